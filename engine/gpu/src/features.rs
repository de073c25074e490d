//! What Mica needs of a device, as data that a host can read before it creates its own.

use ash::{khr, vk};

/// A feature of Vulkan that Mica uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Feature {
    /// `VkPhysicalDeviceVulkan13Features::synchronization2`.
    Synchronization2,
    /// `VkPhysicalDeviceVulkan13Features::dynamicRendering`.
    DynamicRendering,
    /// `VkPhysicalDeviceVulkan13Features::maintenance4`.
    Maintenance4,
    /// `VkPhysicalDeviceFeatures::shaderStorageImageExtendedFormats`.
    StorageImageExtendedFormats,
    /// `VkPhysicalDeviceFeatures::shaderInt64`.
    Int64,
    /// `VkPhysicalDeviceFeatures::shaderFloat64`.
    Float64,
}

impl Feature {
    /// Its name in the Vulkan specification.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Synchronization2 => "synchronization2",
            Self::DynamicRendering => "dynamicRendering",
            Self::Maintenance4 => "maintenance4",
            Self::StorageImageExtendedFormats => "shaderStorageImageExtendedFormats",
            Self::Int64 => "shaderInt64",
            Self::Float64 => "shaderFloat64",
        }
    }
}

/// One line of [`DeviceRequirements`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureRequirement {
    /// The feature.
    pub feature: Feature,
    /// What it is for.
    pub why: &'static str,
}

/// What a device must be created with before it can be lent to Mica.
#[derive(Clone, Copy, Debug)]
pub struct DeviceRequirements {
    /// Least version of Vulkan, for `VkApplicationInfo::apiVersion` and the device.
    pub api_version: Version,
    /// Features to enable.
    pub features: &'static [FeatureRequirement],
    /// Features to enable where there are any: passes that use one of them are refused without it, and no others.
    pub optional_features: &'static [FeatureRequirement],
    /// Device extensions to enable.
    pub device_extensions: &'static [&'static str],
    /// Instance extensions that are of use and can be missed.
    pub optional_instance_extensions: &'static [&'static str],
    /// What the queue family must support.
    pub queue_flags: vk::QueueFlags,
}

/// A version of Vulkan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// Before the first dot.
    pub major: u32,
    /// Between the dots.
    pub minor: u32,
    /// After the second dot.
    pub patch: u32,
}

impl Version {
    /// From Vulkan's packed form.
    pub const fn from_packed(packed: u32) -> Self {
        Self {
            major: vk::api_version_major(packed),
            minor: vk::api_version_minor(packed),
            patch: vk::api_version_patch(packed),
        }
    }

    /// In Vulkan's packed form.
    pub const fn packed(self) -> u32 {
        vk::make_api_version(0, self.major, self.minor, self.patch)
    }
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// All that is needed.
pub(crate) const REQUIREMENTS: DeviceRequirements = DeviceRequirements {
    api_version: Version { major: 1, minor: 3, patch: 0 },
    features: &[
        FeatureRequirement { feature: Feature::Synchronization2, why: "barriers and timestamps" },
        FeatureRequirement { feature: Feature::DynamicRendering, why: "raster passes" },
        FeatureRequirement { feature: Feature::Maintenance4, why: "planning memory before anything is created" },
        FeatureRequirement {
            feature: Feature::StorageImageExtendedFormats,
            why: "storage images of one and two channels",
        },
    ],
    optional_features: &[
        FeatureRequirement {
            feature: Feature::Int64,
            why: "whole counts of flakes in flakes, jakob, atanasov and wang2018",
        },
        FeatureRequirement { feature: Feature::Float64, why: "exact tests of flakes in flakes and jakob" },
    ],
    device_extensions: &[],
    optional_instance_extensions: &["VK_EXT_debug_utils"],
    queue_flags: vk::QueueFlags::from_raw(vk::QueueFlags::GRAPHICS.as_raw() | vk::QueueFlags::COMPUTE.as_raw()),
};

/// The features among those needed or of use that a physical device offers.
pub(crate) fn offered(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<Feature> {
    let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan13);
    // SAFETY: the physical device is of this instance, has Vulkan 1.3 (the caller checked), and the chain is valid.
    unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
    let core = features.features;
    let has = |feature: Feature| {
        vk::TRUE
            == match feature {
                Feature::Synchronization2 => vulkan13.synchronization2,
                Feature::DynamicRendering => vulkan13.dynamic_rendering,
                Feature::Maintenance4 => vulkan13.maintenance4,
                Feature::StorageImageExtendedFormats => core.shader_storage_image_extended_formats,
                Feature::Int64 => core.shader_int64,
                Feature::Float64 => core.shader_float64,
            }
    };
    let of_use = REQUIREMENTS.features.iter().chain(REQUIREMENTS.optional_features).map(|wanted| wanted.feature);
    of_use.filter(|feature| has(*feature)).collect()
}

/// The names of the needed features that are not in `features`.
pub(crate) fn lacking(features: &[Feature]) -> Vec<&'static str> {
    let needed = REQUIREMENTS.features.iter().map(|needed| needed.feature);
    needed.filter(|feature| !features.contains(feature)).map(Feature::name).collect()
}

/// Features as `vkCreateDevice` takes them.
pub(crate) fn to_enable(
    features: &[Feature],
) -> (vk::PhysicalDeviceFeatures, vk::PhysicalDeviceVulkan13Features<'static>) {
    let mut core = vk::PhysicalDeviceFeatures::default();
    let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
    for feature in features {
        match feature {
            Feature::Synchronization2 => vulkan13.synchronization2 = vk::TRUE,
            Feature::DynamicRendering => vulkan13.dynamic_rendering = vk::TRUE,
            Feature::Maintenance4 => vulkan13.maintenance4 = vk::TRUE,
            Feature::StorageImageExtendedFormats => core.shader_storage_image_extended_formats = vk::TRUE,
            Feature::Int64 => core.shader_int64 = vk::TRUE,
            Feature::Float64 => core.shader_float64 = vk::TRUE,
        }
    }
    (core, vulkan13)
}

/// Whether the device could trace rays in a compute shader.
pub(crate) fn offers_ray_query(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> bool {
    // SAFETY: the physical device is of this instance.
    let Ok(extensions) = (unsafe { instance.enumerate_device_extension_properties(physical_device) }) else {
        return false;
    };
    let has = |name| extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name));
    has(khr::ray_query::NAME) && has(khr::acceleration_structure::NAME)
}
