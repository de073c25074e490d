//! The device that everything runs on: created here, or borrowed from a host.

use crate::error::{Call, Error};
use crate::features::{Chain, DeviceRequirements, Feature, REQUIREMENTS, enables_ray_query, offered};
use crate::info::{self, DeviceInfo};
use crate::instance::Instance;
use crate::messages::{Message, Messages, Validation};
use crate::structures::Support;
use ash::{ext, vk};
use std::ffi::{CString, c_char};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Which device to create, and how.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// A device by its index in [`crate::devices`], or by a part of its name or of its driver's name and version, without
    /// regard to case. `None` takes the best: discrete before integrated before virtual before CPU.
    pub select: Option<String>,
    /// What the validation layer checks. Its messages are collected for [`Device::take_messages`].
    pub validation: Validation,
}

/// A Vulkan device, ours or a host's.
pub struct Device {
    pub(crate) raw: ash::Device,
    pub(crate) instance: ash::Instance,
    pub(crate) physical: vk::PhysicalDevice,
    pub(crate) queue_family: u32,
    pub(crate) info: DeviceInfo,
    /// Those that are enabled.
    pub(crate) features: Vec<Feature>,
    /// There where ray queries are.
    pub(crate) structures: Option<Support>,
    pub(crate) debug_utils: Option<ext::debug_utils::Device>,
    /// What we made and must destroy; `None` for a borrowed device.
    pub(crate) own: Option<Own>,
    /// Set once a call said so; nothing is submitted from then on.
    pub(crate) lost: AtomicBool,
    /// Set after a wait that timed out: the device may still be at work, so nothing may be destroyed.
    pub(crate) hung: AtomicBool,
}

/// What only a device of our own has.
pub(crate) struct Own {
    instance: Instance,
    /// The queue, for one submission at a time.
    pub(crate) queue: Mutex<vk::Queue>,
}

impl Device {
    /// Creates a device with an instance of its own, without any window.
    ///
    /// # Errors
    /// If there is no loader, no driver, no device that fits, or no validation layer though it was asked for.
    pub fn new(options: &DeviceOptions) -> Result<Arc<Self>, Error> {
        let instance = Instance::new(options.validation)?;
        let (physical, info) = choose(info::enumerate(&instance.raw)?, options.select.as_deref())?;
        let unusable = |why: &str| Error::Unusable { device: info.name.clone(), why: why.to_owned() };
        let (queue_family, _) =
            info::queue_family(&instance.raw, physical).ok_or_else(|| unusable("it has no queue"))?;
        let priorities = [1.0];
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
        let features = offered(&instance.raw, physical);
        let extensions: Vec<*const c_char> =
            features.iter().flat_map(|feature| feature.extensions()).map(|name| name.as_ptr()).collect();
        let mut chain = Chain::enabling(&features);
        let mut enabled = chain.features(|feature| features.contains(&feature));
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut enabled);
        // SAFETY: the device offers every feature in the chain, as `choose` checked, and has the queue family.
        let made = unsafe { instance.raw.create_device(physical, &create, None) };
        let raw = made.making("vkCreateDevice", "the device", 0).map_err(|error| match error {
            Error::Vulkan { result, .. } => unusable(&format!("vkCreateDevice: {result}")),
            other => other,
        })?;
        // SAFETY: the queue was created with the device.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let structures = enables_ray_query(&features).then(|| Support::new(&instance.raw, &raw, physical));
        let debug_utils = instance.debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        Ok(Arc::new(Self {
            raw,
            instance: instance.raw.clone(),
            physical,
            queue_family,
            info,
            features,
            structures,
            debug_utils,
            own: Some(Own { instance, queue: Mutex::new(queue) }),
            lost: AtomicBool::new(false),
            hung: AtomicBool::new(false),
        }))
    }

    /// What a host must create its device with before [`Device::borrow`] can take it.
    pub fn requirements() -> &'static DeviceRequirements {
        &REQUIREMENTS
    }

    /// What this device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Whether a feature is enabled.
    pub fn has(&self, feature: Feature) -> bool {
        self.features.contains(&feature)
    }

    /// Whether the device belongs to a host.
    pub fn is_borrowed(&self) -> bool {
        self.own.is_none()
    }

    /// What the validation layer said since the last call. A borrowed device says it to its host instead.
    pub fn take_messages(&self) -> Vec<Message> {
        self.messages().take()
    }

    /// Where the validation layer's messages go, also those about what is left over when the device is dropped.
    pub fn messages(&self) -> Messages {
        self.own.as_ref().map(|own| own.instance.messages()).unwrap_or_default()
    }

    /// Gives a Vulkan object a name in messages and captures.
    pub(crate) fn set_name(&self, handle: impl vk::Handle, name: &str) {
        if let Some(debug_utils) = &self.debug_utils {
            let name = c_string(name);
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
            // SAFETY: the handle is a live object of this device. A failure costs a name and nothing else.
            let _ = unsafe { debug_utils.set_debug_utils_object_name(&info) };
        }
    }

    /// Notes of an error whether it says that the device is gone.
    pub(crate) fn note_loss(&self, error: &Error) {
        if matches!(error, Error::DeviceLost { .. }) {
            self.lost.store(true, Ordering::Relaxed);
        }
    }

    /// An error if the device is known to be gone.
    pub(crate) fn check_alive(&self) -> Result<(), Error> {
        if self.lost.load(Ordering::Relaxed) { Err(Error::DeviceLost { pass: None }) } else { Ok(()) }
    }

    /// Whether objects of the device may be destroyed.
    pub(crate) fn may_destroy(&self) -> bool {
        !self.hung.load(Ordering::Relaxed)
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device")
            .field("info", &self.info)
            .field("borrowed", &self.is_borrowed())
            .finish_non_exhaustive()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let Some(own) = self.own.take() else { return };
        if !self.may_destroy() {
            // The device may still be at work on objects that were left to it: its parents have to stay as well.
            std::mem::forget(own);
            return;
        }
        // SAFETY: executors hold the device in an `Arc`, so every object made from it is destroyed, and each of them
        // waited for its work. The instance goes after the device, when `own` is dropped.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// A name as C wants it.
pub(crate) fn c_string(name: &str) -> CString {
    CString::new(name.replace('\0', "")).unwrap_or_default()
}

type Found = (vk::PhysicalDevice, DeviceInfo);

fn choose(found: Vec<Found>, select: Option<&str>) -> Result<Found, Error> {
    let names = |found: &[Found]| {
        let driver = |info: &DeviceInfo| format!("{} {}", info.driver, info.driver_version);
        found
            .iter()
            .map(|(_, info)| format!("{} {} ({})", info.index, info.name, driver(info)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let all = names(&found);
    let Some(select) = select else {
        let reasons: Vec<String> = found
            .iter()
            .filter_map(|(_, info)| info.unusable.as_ref().map(|why| format!("{}: {why}", info.name)))
            .collect();
        let usable = found.into_iter().filter(|(_, info)| info.unusable.is_none());
        return usable
            .min_by_key(|(_, info)| info.kind)
            .ok_or(Error::Unusable { device: all, why: reasons.join("; ") });
    };
    let wanted = select.to_lowercase();
    let index = select.parse::<usize>().ok();
    let text = |info: &DeviceInfo| format!("{} {} {}", info.name, info.driver, info.driver_version).to_lowercase();
    // A number is an index first, and then a whole word (an RTX 4090) or the beginning of a version; not any digits.
    let has_word = |info: &DeviceInfo| {
        let is_it =
            |word: &str| word.strip_prefix(&wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        text(info).split([' ', '(', ')', ',']).any(is_it)
    };
    let fits = |info: &DeviceInfo| match index {
        Some(index) => index == info.index || has_word(info),
        None => !wanted.is_empty() && text(info).contains(&wanted),
    };
    let mut matching: Vec<Found> = found.into_iter().filter(|(_, info)| fits(info)).collect();
    matching.sort_by_key(|(_, info)| (index != Some(info.index), info.unusable.is_some(), info.kind));
    let Some((physical, info)) = matching.into_iter().next() else {
        return Err(Error::NoSuchDevice { select: select.to_owned(), found: all });
    };
    match &info.unusable {
        Some(why) => Err(Error::Unusable { device: info.name.clone(), why: why.clone() }),
        None => Ok((physical, info)),
    }
}
