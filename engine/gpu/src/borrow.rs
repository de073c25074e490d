//! A device lent by a host. The guest never creates a device, submits, waits or presents; it believes what it is told.

use crate::device::Device;
use crate::error::Error;
use crate::features::{Feature, OF_RAY_QUERY, REQUIREMENTS, Version, enables_ray_query, lacking};
use crate::info;
use crate::structures::Support;
use ash::{ext, vk};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a host lends. There is no queue in it: a guest does not submit.
pub struct HostDevice<'a> {
    /// The host's instance.
    pub instance: &'a ash::Instance,
    /// The physical device behind `device`.
    pub physical_device: vk::PhysicalDevice,
    /// The host's device.
    pub device: &'a ash::Device,
    /// The least of what the application asked for (`VkApplicationInfo::apiVersion`) and the device offers.
    pub api_version: Version,
    /// The family of the queue that the recorded command buffers are submitted to; graphics and compute.
    pub queue_family: u32,
    /// Those of the features in [`Device::requirements`], needed and optional, that the host enabled, each with its
    /// [`Feature::extensions`].
    pub enabled: &'a [Feature],
    /// Whether the host enabled `VK_EXT_debug_utils`, for names and labels.
    pub debug_utils: bool,
}

impl Device {
    /// Borrows a host's device.
    ///
    /// # Errors
    /// [`Error::Unusable`] names what the host has not enabled.
    ///
    /// # Safety
    /// The handles are valid and belong together, what is said to be enabled is enabled, and all of it outlives the
    /// returned device and every executor made with it. Calls that Vulkan wants externally synchronised are the host's
    /// to keep apart: an executor makes none on the device itself, only on objects of its own and on the command buffer
    /// that it is given.
    pub unsafe fn borrow(host: HostDevice<'_>) -> Result<Arc<Self>, Error> {
        if host.api_version < REQUIREMENTS.api_version {
            let (has, needs) = (host.api_version, REQUIREMENTS.api_version);
            let why = format!("the host set it up for Vulkan {has}, needed is {needs}");
            return Err(Error::Unusable { device: "of the host".to_owned(), why });
        }
        let mut info = info::describe(host.instance, host.physical_device, 0);
        let unusable = |why: String| Error::Unusable { device: info.name.clone(), why };
        let lacking = lacking(host.enabled);
        if !lacking.is_empty() {
            return Err(unusable(format!("the host has not enabled {}", lacking.join(", "))));
        }
        // SAFETY: the physical device is of this instance, as the caller promises.
        let families = unsafe { host.instance.get_physical_device_queue_family_properties(host.physical_device) };
        let Some(family) = families.get(host.queue_family as usize) else {
            return Err(unusable(format!("it has no queue family {}", host.queue_family)));
        };
        if !family.queue_flags.contains(REQUIREMENTS.queue_flags) {
            return Err(unusable(format!("queue family {} lacks graphics or compute", host.queue_family)));
        }
        info.limits.timestamp_valid_bits = family.timestamp_valid_bits;
        if !enables_ray_query(host.enabled) {
            // What the device offers is no use where the host has not enabled it.
            let missing = OF_RAY_QUERY.iter().filter(|feature| !host.enabled.contains(feature));
            info.ray_query_lacks = missing.map(|feature| feature.name().to_owned()).collect();
        }
        Ok(Arc::new(Self {
            raw: host.device.clone(),
            instance: host.instance.clone(),
            physical: host.physical_device,
            queue_family: host.queue_family,
            info,
            features: host.enabled.to_vec(),
            structures: enables_ray_query(host.enabled)
                .then(|| Support::new(host.instance, host.device, host.physical_device)),
            debug_utils: host.debug_utils.then(|| ext::debug_utils::Device::new(host.instance, host.device)),
            own: None,
            lost: AtomicBool::new(false),
            hung: AtomicBool::new(false),
        }))
    }
}

/// The state that the host leaves an image in, or wants it in.
#[derive(Clone, Copy, Debug)]
pub struct HostState {
    /// The layout. An image may arrive `UNDEFINED`: its content is then given up.
    pub layout: vk::ImageLayout,
    /// The stages that used it, or will.
    pub stages: vk::PipelineStageFlags2,
    /// The accesses that were made, or will be.
    pub access: vk::AccessFlags2,
}

/// A host's image for one of the graph's.
#[derive(Clone, Copy, Debug)]
pub struct HostImage {
    /// The image, with the size, format, levels and layers that the graph's handle says, and with usages for all that
    /// the graph does with it.
    pub image: vk::Image,
    /// A view of all its levels and layers, of the type that the handle's description implies. It serves storage and
    /// attachment uses too, so an image with several levels is sampled only.
    pub view: vk::ImageView,
    /// How the frame finds it.
    pub arrives: HostState,
    /// How the frame leaves it.
    pub leaves: HostState,
}

/// A host's buffer for one of the graph's. How it arrives need not be said: a frame waits for all commands before it.
///
/// What acceleration structures are built from needs the usages SHADER_DEVICE_ADDRESS and
/// ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR, and memory allocated with DEVICE_ADDRESS.
#[derive(Clone, Copy, Debug)]
pub struct HostBuffer {
    /// The buffer, at least as large as the graph's handle says, with usages for all that the graph does with it.
    pub buffer: vk::Buffer,
    /// The stages that will use it next.
    pub leaves_stages: vk::PipelineStageFlags2,
    /// The accesses that will be made next.
    pub leaves_access: vk::AccessFlags2,
}
