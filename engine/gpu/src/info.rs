//! What devices there are, what they can do, and which of them would serve.

use crate::error::{Call, Error};
use crate::features::{self, REQUIREMENTS, Version};
use crate::instance::Instance;
use crate::messages::Validation;
use ash::vk;
use std::ffi::CStr;

/// What kind of device it is, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DeviceKind {
    /// A GPU of its own.
    Discrete,
    /// A GPU beside the processor.
    Integrated,
    /// A GPU lent to a virtual machine.
    Virtual,
    /// The processor: lavapipe and its like.
    Cpu,
    /// Something else.
    Other,
}

impl DeviceKind {
    /// The word used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Virtual => "virtual GPU",
            Self::Cpu => "CPU",
            Self::Other => "other",
        }
    }

    fn from_vulkan(kind: vk::PhysicalDeviceType) -> Self {
        match kind {
            vk::PhysicalDeviceType::DISCRETE_GPU => Self::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => Self::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => Self::Virtual,
            vk::PhysicalDeviceType::CPU => Self::Cpu,
            _ => Self::Other,
        }
    }
}

/// The limits that decide what can be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most bytes of a storage buffer that a shader sees.
    pub max_storage_buffer_range_bytes: u64,
    /// Most bytes of a uniform buffer that a shader sees.
    pub max_uniform_buffer_range_bytes: u64,
    /// Most bytes of any buffer.
    pub max_buffer_bytes: u64,
    /// Most bytes of push constants.
    pub max_push_constants_bytes: u32,
    /// Most storage buffers that one stage of a shader sees.
    pub max_stage_storage_buffers: u32,
    /// Most storage images that one stage of a shader sees.
    pub max_stage_storage_images: u32,
    /// Most sampled images that one stage of a shader sees.
    pub max_stage_sampled_images: u32,
    /// Most invocations of a group.
    pub max_group_invocations: u32,
    /// Most texels along a side of a flat image.
    pub max_image_side_2d: u32,
    /// Most texels along a side of a volume.
    pub max_image_side_3d: u32,
    /// Most layers of an image.
    pub max_image_layers: u32,
    /// Most groups of a dispatch along x, y and z.
    pub max_groups: [u32; 3],
    /// Bits of a timestamp that count; 0 if the device measures no time.
    pub timestamp_valid_bits: u32,
    /// Nanoseconds of one tick.
    pub timestamp_period_ns: f32,
    /// Bytes of all memory that is local to the device.
    pub device_memory_bytes: u64,
}

/// One device.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// What `DeviceOptions::select` may name it by, besides a part of its name.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// Discrete GPU, CPU and so on.
    pub kind: DeviceKind,
    /// The driver's name.
    pub driver: String,
    /// The driver's version, in its own words.
    pub driver_version: String,
    /// The version of Vulkan that it offers.
    pub api_version: Version,
    /// Its limits.
    pub limits: Limits,
    /// The extensions and features that the device lacks for ray queries; empty if it offers them.
    pub ray_query_lacks: Vec<String>,
    /// Why it cannot serve; `None` if it can.
    pub unusable: Option<String>,
    /// What a pipeline cache must agree with: the device's and the driver's identity.
    pub(crate) cache_identity: CacheIdentity,
}

impl DeviceInfo {
    /// Whether the device offers ray queries.
    pub fn offers_ray_query(&self) -> bool {
        self.ray_query_lacks.is_empty()
    }
}

/// What a pipeline cache depends on. Mesa 22.3's lavapipe has a cache UUID that does not change with the driver, hence
/// the driver's version beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CacheIdentity {
    pub(crate) cache_uuid: [u8; 16],
    pub(crate) device_uuid: [u8; 16],
    pub(crate) driver_uuid: [u8; 16],
    pub(crate) driver_version: u32,
}

/// All devices, with what speaks against each. Needs a loader and a driver, and creates no device.
///
/// # Errors
/// [`Error::NoLoader`] or [`Error::NoDriver`] where there is nothing to ask.
pub fn devices() -> Result<Vec<DeviceInfo>, Error> {
    let instance = Instance::new(Validation::Off)?;
    Ok(enumerate(&instance.raw)?.into_iter().map(|(_, info)| info).collect())
}

/// The physical devices of an instance with their descriptions.
pub(crate) fn enumerate(instance: &ash::Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>, Error> {
    // SAFETY: the instance is alive.
    let found =
        unsafe { instance.enumerate_physical_devices() }.call("vkEnumeratePhysicalDevices").map_err(no_driver)?;
    if found.is_empty() {
        return Err(Error::NoDriver("the drivers found offer no device".to_owned()));
    }
    Ok(found.into_iter().enumerate().map(|(index, device)| (device, describe(instance, device, index))).collect())
}

/// A call about drivers that failed, other than for want of memory, speaks of a driver that does not work.
pub(crate) fn no_driver(error: Error) -> Error {
    match error {
        Error::Vulkan { result, .. } => Error::NoDriver(result.to_string()),
        other => other,
    }
}

/// A family with graphics and compute.
pub(crate) fn queue_family(instance: &ash::Instance, device: vk::PhysicalDevice) -> Option<(u32, u32)> {
    // SAFETY: the physical device is of this instance.
    let families = unsafe { instance.get_physical_device_queue_family_properties(device) };
    let fits = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(REQUIREMENTS.queue_flags);
    let index = families.iter().position(fits)?;
    Some((index as u32, families[index].timestamp_valid_bits))
}

pub(crate) fn describe(instance: &ash::Instance, device: vk::PhysicalDevice, index: usize) -> DeviceInfo {
    // SAFETY: the physical device is of this instance.
    let core = unsafe { instance.get_physical_device_properties(device) };
    let api_version = Version::from_packed(core.api_version);
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut identity = vk::PhysicalDeviceIDProperties::default();
    let mut maintenance4 = vk::PhysicalDeviceMaintenance4Properties::default();
    let modern = api_version >= REQUIREMENTS.api_version;
    if modern {
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut driver)
            .push_next(&mut identity)
            .push_next(&mut maintenance4);
        // SAFETY: the device has Vulkan 1.3, which knows every structure of the chain.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
    }
    // SAFETY: the physical device is of this instance.
    let memory = unsafe { instance.get_physical_device_memory_properties(device) };
    let local = |heap: &&vk::MemoryHeap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL);
    let family = queue_family(instance, device);
    DeviceInfo {
        index,
        name: text(core.device_name_as_c_str()),
        kind: DeviceKind::from_vulkan(core.device_type),
        driver: text(driver.driver_name_as_c_str()),
        driver_version: text(driver.driver_info_as_c_str()),
        api_version,
        limits: Limits {
            max_storage_buffer_range_bytes: core.limits.max_storage_buffer_range.into(),
            max_uniform_buffer_range_bytes: core.limits.max_uniform_buffer_range.into(),
            max_buffer_bytes: maintenance4.max_buffer_size,
            max_push_constants_bytes: core.limits.max_push_constants_size,
            max_stage_storage_buffers: core.limits.max_per_stage_descriptor_storage_buffers,
            max_stage_storage_images: core.limits.max_per_stage_descriptor_storage_images,
            max_stage_sampled_images: core.limits.max_per_stage_descriptor_sampled_images,
            max_group_invocations: core.limits.max_compute_work_group_invocations,
            max_image_side_2d: core.limits.max_image_dimension2_d,
            max_image_side_3d: core.limits.max_image_dimension3_d,
            max_image_layers: core.limits.max_image_array_layers,
            max_groups: core.limits.max_compute_work_group_count,
            timestamp_valid_bits: family.map_or(0, |(_, bits)| bits),
            timestamp_period_ns: core.limits.timestamp_period,
            device_memory_bytes: memory.memory_heaps_as_slice().iter().filter(local).map(|heap| heap.size).sum(),
        },
        ray_query_lacks: if modern {
            features::ray_query_lacks(instance, device)
        } else {
            vec![format!("Vulkan {}", REQUIREMENTS.api_version)]
        },
        unusable: unusable(instance, device, api_version, family.is_some()),
        cache_identity: CacheIdentity {
            cache_uuid: core.pipeline_cache_uuid,
            device_uuid: identity.device_uuid,
            driver_uuid: identity.driver_uuid,
            driver_version: core.driver_version,
        },
    }
}

fn unusable(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    api_version: Version,
    has_queue: bool,
) -> Option<String> {
    if api_version < REQUIREMENTS.api_version {
        return Some(format!("it has Vulkan {api_version}, needed is {}", REQUIREMENTS.api_version));
    }
    let lacking = features::lacking(&features::offered(instance, device));
    if !lacking.is_empty() {
        return Some(format!("it lacks {}", lacking.join(", ")));
    }
    (!has_queue).then(|| "it has no queue for graphics and compute".to_owned())
}

fn text(name: Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
