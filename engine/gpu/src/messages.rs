//! What the validation layer checks, and what it says, collected so that a test can fail on it.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// What Vulkan's validation layer checks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// Nothing: the layer is not asked for.
    #[default]
    Off,
    /// Each call against the rules of the specification.
    Core,
    /// The same, and whether accesses that conflict are ordered. Hazards between two submissions are seen only if the
    /// process was started with `VK_LAYER_ENABLES=VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT`
    /// (layer 1.3.239).
    Synchronization,
    /// The rules of the specification, and where shaders read and write: their code is changed for it, which takes time.
    /// The layer keeps one set of descriptors for itself.
    GpuAssisted,
}

impl Validation {
    /// What is switched on beside the core checks, which are on by default.
    pub(crate) fn beside_core(self) -> &'static [vk::ValidationFeatureEnableEXT] {
        match self {
            Self::Off | Self::Core => &[],
            Self::Synchronization => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
            Self::GpuAssisted => &[
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
            ],
        }
    }
}

/// One message of the validation layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Whether it is an error; otherwise it is a warning.
    pub error: bool,
    /// Its name, as `VUID-...` or `SYNC-HAZARD-...`.
    pub id: String,
    /// The text.
    pub text: String,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}: {}", if self.error { "error" } else { "warning" }, self.id, self.text)
    }
}

/// Where the messages of one device go. It may be kept longer than the device.
#[derive(Clone, Debug, Default)]
pub struct Messages(Arc<Log>);

type Log = Mutex<Vec<Message>>;

impl Messages {
    /// All messages since the last call.
    pub fn take(&self) -> Vec<Message> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Asks for errors and warnings of validation and performance. The general type is the loader's own talk about
    /// drivers it could not open, which says nothing about our calls.
    ///
    /// The driver is given the address of the log: the instance keeps a clone of this as long as it lives.
    pub(crate) fn messenger_info(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'_> {
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(receive))
            .user_data(Arc::as_ptr(&self.0).cast_mut().cast())
    }
}

/// The one message that is expected: images stay in the general layout by design, and the layer's performance check
/// advises the transfer layouts for every copy from or to them.
fn is_layout_advice(message: &Message, types: vk::DebugUtilsMessageTypeFlagsEXT) -> bool {
    types == vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE
        && message.text.contains("VK_IMAGE_LAYOUT_TRANSFER_")
        && message.text.contains("instead of GENERAL")
}

unsafe extern "system" fn receive(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the loader passes valid callback data, and the log given in `messenger_info`, which the instance keeps
    // until it is destroyed. Threads share the log behind its lock.
    let (data, log) = unsafe { (&*data, &*user_data.cast::<Log>()) };
    let text = |pointer: *const std::ffi::c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: strings of callback data are NUL-terminated and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    let message = Message {
        error: severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR),
        id: text(data.p_message_id_name),
        text: text(data.p_message),
    };
    if !is_layout_advice(&message, types) {
        log::warn!("{message}");
        log.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
    vk::FALSE
}
