//! What can go wrong on a device, said in one line each: what, where, and what to do about it.

use ash::vk;
use mica_graph::PlanError;

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The Vulkan loader cannot be opened.
    #[error("no Vulkan loader (libvulkan.so.1): install libvulkan1 ({0})")]
    NoLoader(String),
    /// The loader found no driver that works.
    #[error(
        "no Vulkan driver: install mesa-vulkan-drivers (software rendering) or the driver of your GPU, \
         and check VK_DRIVER_FILES if it is set ({0})"
    )]
    NoDriver(String),
    /// Validation was asked for and cannot be had.
    #[error("no Vulkan validation ({0}): install vulkan-validationlayers, or ask for no validation")]
    NoValidation(String),
    /// No device fits the selection.
    #[error("no Vulkan device matches '{select}'; there are: {found}")]
    NoSuchDevice {
        /// What was asked for.
        select: String,
        /// The devices there are.
        found: String,
    },
    /// The device, or all there are, cannot do what is needed.
    #[error("device {device} cannot be used: {why}")]
    Unusable {
        /// Its name, or the names of all.
        device: String,
        /// What it lacks.
        why: String,
    },
    /// The driver has no memory left.
    #[error("out of memory: {what} needs {bytes} bytes ({detail}); use a smaller size or fewer glints")]
    OutOfMemory {
        /// The resource, or what else was made.
        what: String,
        /// How many bytes it needs; 0 where that is unknown.
        bytes: u64,
        /// What the driver or the allocator said.
        detail: String,
    },
    /// The number of bytes that the host granted does not suffice.
    #[error("out of memory: {what} needs {bytes} bytes, and {used} of the {limit} granted are taken; raise the limit")]
    MemoryLimit {
        /// The resource.
        what: String,
        /// How many bytes it needs.
        bytes: u64,
        /// Bytes taken so far.
        used: u64,
        /// [`crate::ExecutorOptions::memory_limit_bytes`].
        limit: u64,
    },
    /// The device is gone.
    #[error("the device was lost{}; start again, and look into the system's log for the driver's reason", in_pass(.pass))]
    DeviceLost {
        /// The pass that did not finish, where known.
        pass: Option<String>,
    },
    /// The window that was presented to is gone.
    #[error("the window's surface was lost: make another surface and another presenter")]
    SurfaceLost,
    /// The device did not answer in time.
    #[error("the device did not finish within {seconds} s{}; use a smaller size or fewer glints", in_pass(.pass))]
    Timeout {
        /// How long it was waited for.
        seconds: f64,
        /// The pass that did not finish, where known (only isolated timing knows).
        pass: Option<String>,
    },
    /// The graph makes no sense.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A binding of a shader got no resource.
    #[error("pass {pass}: nothing is bound to {binding} (binding {slot}); declare its use")]
    MissingBinding {
        /// The pass.
        pass: String,
        /// The binding's name in the GLSL.
        binding: String,
        /// Its number.
        slot: u32,
    },
    /// A use does not fit what it is attached to.
    #[error("pass {pass}: {resource} cannot be used so: {why}")]
    BadUse {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
        /// What does not fit.
        why: String,
    },
    /// A pass does not fit its shader or the device.
    #[error("pass {pass}: {why}")]
    BadPass {
        /// The pass.
        pass: String,
        /// What does not fit.
        why: String,
    },
    /// A buffer is larger than a shader of this device can see.
    #[error(
        "pass {pass}: buffer {resource} has {bytes} bytes and {limit_name} of this device is {limit}; \
         use a smaller scene or fewer glints"
    )]
    BufferRange {
        /// The pass.
        pass: String,
        /// The buffer.
        resource: String,
        /// Its size.
        bytes: u64,
        /// The Vulkan limit.
        limit_name: &'static str,
        /// The limit's value.
        limit: u64,
    },
    /// A resource that this device cannot hold, however much memory there is.
    #[error("{resource}: {why}")]
    BadResource {
        /// The resource.
        resource: String,
        /// Why it cannot be.
        why: String,
    },
    /// The host has not brought one of its own resources.
    #[error("{resource} belongs to the host, which has not bound it: call bind_host_image or bind_host_buffer first")]
    Unbound {
        /// The resource.
        resource: String,
    },
    /// A pipeline cannot be made.
    #[error("pass {pass}: the driver rejects shader {shader}: {result}")]
    Pipeline {
        /// The pass.
        pass: String,
        /// The shader, with its variant.
        shader: String,
        /// What the driver said.
        result: vk::Result,
    },
    /// Something that no body of this crate does yet.
    #[error("pass {pass}: {what}")]
    Unsupported {
        /// The pass.
        pass: String,
        /// What is missing.
        what: String,
    },
    /// A borrowed device was asked to submit.
    #[error("a borrowed device never submits: record the frame into a command buffer of the host instead")]
    Borrowed,
    /// The host keeps more recorded frames open than it said it would.
    #[error("{0} frames are recorded and none is finished: wait for one and give it to Executor::finish")]
    FramesInFlight(usize),
    /// Any other call of Vulkan that failed.
    #[error("{call} failed: {result}")]
    Vulkan {
        /// The function.
        call: &'static str,
        /// What it returned.
        result: vk::Result,
    },
}

fn in_pass(pass: &Option<String>) -> String {
    pass.as_ref().map(|pass| format!(" in pass {pass}")).unwrap_or_default()
}

impl Error {
    /// The exit code a program should end with: 4 if memory ran out or the device was lost, 3 if the device or driver
    /// cannot do what is asked.
    pub fn exit_code(&self) -> i32 {
        match self {
            Self::OutOfMemory { .. }
            | Self::MemoryLimit { .. }
            | Self::BufferRange { .. }
            | Self::DeviceLost { .. }
            | Self::Timeout { .. } => 4,
            _ => 3,
        }
    }
}

/// Whether a call failed for want of memory of any kind.
pub(crate) fn is_out_of_memory(result: vk::Result) -> bool {
    matches!(
        result,
        vk::Result::ERROR_OUT_OF_HOST_MEMORY
            | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
            | vk::Result::ERROR_OUT_OF_POOL_MEMORY
            | vk::Result::ERROR_FRAGMENTED_POOL
            | vk::Result::ERROR_FRAGMENTATION
    )
}

/// Turns a failed call into an error that says which.
pub(crate) trait Call<T> {
    /// Names the function that was called.
    fn call(self, call: &'static str) -> Result<T, Error>;
    /// Names the function that was called and the thing that it was to make.
    fn making(self, call: &'static str, what: &str, bytes: u64) -> Result<T, Error>;
}

impl<T> Call<T> for Result<T, vk::Result> {
    fn call(self, call: &'static str) -> Result<T, Error> {
        self.making(call, call, 0)
    }

    fn making(self, call: &'static str, what: &str, bytes: u64) -> Result<T, Error> {
        self.map_err(|result| match result {
            result if is_out_of_memory(result) => {
                Error::OutOfMemory { what: what.to_owned(), bytes, detail: result.to_string() }
            }
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { pass: None },
            vk::Result::ERROR_SURFACE_LOST_KHR => Error::SurfaceLost,
            _ => Error::Vulkan { call, result },
        })
    }
}
