//! What Mica needs of a device, as data that a host can read before it creates its own.

use ash::{khr, vk};
use std::ffi::{CStr, CString};

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
    /// `VkPhysicalDeviceVulkan12Features::bufferDeviceAddress`.
    BufferDeviceAddress,
    /// `VkPhysicalDeviceAccelerationStructureFeaturesKHR::accelerationStructure`, of an extension.
    AccelerationStructure,
    /// `VkPhysicalDeviceRayQueryFeaturesKHR::rayQuery`, of an extension.
    RayQuery,
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
            Self::BufferDeviceAddress => "bufferDeviceAddress",
            Self::AccelerationStructure => "accelerationStructure",
            Self::RayQuery => "rayQuery",
        }
    }

    /// The device extensions that it comes with.
    pub const fn extensions(self) -> &'static [&'static CStr] {
        match self {
            Self::AccelerationStructure => &[khr::acceleration_structure::NAME, khr::deferred_host_operations::NAME],
            Self::RayQuery => &[khr::ray_query::NAME],
            _ => &[],
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
    /// Features to enable where there are any, with their [`Feature::extensions`]: passes that use one of them are
    /// refused without it, and no others. Those of ray queries are of use together only.
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
        FeatureRequirement { feature: Feature::BufferDeviceAddress, why: "builds of acceleration structures" },
        FeatureRequirement { feature: Feature::AccelerationStructure, why: "occlusion by ray queries" },
        FeatureRequirement { feature: Feature::RayQuery, why: "occlusion by ray queries" },
    ],
    device_extensions: &[],
    optional_instance_extensions: &["VK_EXT_debug_utils"],
    queue_flags: vk::QueueFlags::from_raw(vk::QueueFlags::GRAPHICS.as_raw() | vk::QueueFlags::COMPUTE.as_raw()),
};

/// What occlusion by ray queries takes.
pub(crate) const OF_RAY_QUERY: [Feature; 3] =
    [Feature::BufferDeviceAddress, Feature::AccelerationStructure, Feature::RayQuery];

/// The features among those needed or of use that a physical device offers. Those of ray queries are there all or none.
pub(crate) fn offered(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<Feature> {
    let mut found = features_of(instance, physical_device);
    if !enables_ray_query(&found) {
        found.retain(|feature| !OF_RAY_QUERY.contains(feature));
    }
    found
}

/// Whether ray queries can be made with these features.
pub(crate) fn enables_ray_query(features: &[Feature]) -> bool {
    OF_RAY_QUERY.iter().all(|feature| features.contains(feature))
}

/// The names of the extensions and features that a physical device lacks for ray queries.
pub(crate) fn ray_query_lacks(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<String> {
    let found = features_of(instance, physical_device);
    let extensions = extensions_of(instance, physical_device);
    let lacking = OF_RAY_QUERY.iter().filter(|feature| !found.contains(feature));
    // A feature whose extension is missing needs no mention of its own.
    let names = lacking.flat_map(|feature| {
        let missing: Vec<String> = feature
            .extensions()
            .iter()
            .filter(|extension| !extensions.iter().any(|name| name.as_c_str() == **extension))
            .map(|extension| extension.to_string_lossy().into_owned())
            .collect();
        if missing.is_empty() { vec![feature.name().to_owned()] } else { missing }
    });
    names.collect()
}

fn features_of(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<Feature> {
    let extensions = extensions_of(instance, physical_device);
    let comes_with = |feature: Feature| {
        feature.extensions().iter().all(|extension| extensions.iter().any(|name| name.as_c_str() == *extension))
    };
    let mut chain = Chain::default();
    let core = {
        let mut features = chain.features(comes_with);
        // SAFETY: the physical device is of this instance, has Vulkan 1.3 (the caller checked) and the extensions whose
        // structures are in the chain.
        unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
        features.features
    };
    let has = |feature: Feature| {
        vk::TRUE
            == match feature {
                Feature::Synchronization2 => chain.vulkan13.synchronization2,
                Feature::DynamicRendering => chain.vulkan13.dynamic_rendering,
                Feature::Maintenance4 => chain.vulkan13.maintenance4,
                Feature::StorageImageExtendedFormats => core.shader_storage_image_extended_formats,
                Feature::Int64 => core.shader_int64,
                Feature::Float64 => core.shader_float64,
                Feature::BufferDeviceAddress => chain.addresses.buffer_device_address,
                Feature::AccelerationStructure => chain.structures.acceleration_structure,
                Feature::RayQuery => chain.queries.ray_query,
            }
    };
    let of_use = REQUIREMENTS.features.iter().chain(REQUIREMENTS.optional_features).map(|wanted| wanted.feature);
    of_use.filter(|feature| comes_with(*feature) && has(*feature)).collect()
}

fn extensions_of(instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<CString> {
    // SAFETY: the physical device is of this instance.
    let found = unsafe { instance.enumerate_device_extension_properties(physical_device) }.unwrap_or_default();
    found.iter().filter_map(|extension| Some(extension.extension_name_as_c_str().ok()?.to_owned())).collect()
}

/// The names of the needed features that are not in `features`.
pub(crate) fn lacking(features: &[Feature]) -> Vec<&'static str> {
    let needed = REQUIREMENTS.features.iter().map(|needed| needed.feature);
    needed.filter(|feature| !features.contains(feature)).map(Feature::name).collect()
}

/// Vulkan's structures for all features, to ask for them and to enable them.
#[derive(Default)]
pub(crate) struct Chain {
    core: vk::PhysicalDeviceFeatures,
    vulkan13: vk::PhysicalDeviceVulkan13Features<'static>,
    addresses: vk::PhysicalDeviceBufferDeviceAddressFeatures<'static>,
    structures: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    queries: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
}

impl Chain {
    /// With these features switched on.
    pub(crate) fn enabling(features: &[Feature]) -> Self {
        let mut chain = Self::default();
        for feature in features {
            *match feature {
                Feature::Synchronization2 => &mut chain.vulkan13.synchronization2,
                Feature::DynamicRendering => &mut chain.vulkan13.dynamic_rendering,
                Feature::Maintenance4 => &mut chain.vulkan13.maintenance4,
                Feature::StorageImageExtendedFormats => &mut chain.core.shader_storage_image_extended_formats,
                Feature::Int64 => &mut chain.core.shader_int64,
                Feature::Float64 => &mut chain.core.shader_float64,
                Feature::BufferDeviceAddress => &mut chain.addresses.buffer_device_address,
                Feature::AccelerationStructure => &mut chain.structures.acceleration_structure,
                Feature::RayQuery => &mut chain.queries.ray_query,
            } = vk::TRUE;
        }
        chain
    }

    /// The structures linked, those of extensions only where `includes` says so.
    pub(crate) fn features(&mut self, includes: impl Fn(Feature) -> bool) -> vk::PhysicalDeviceFeatures2<'_> {
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .features(self.core)
            .push_next(&mut self.vulkan13)
            .push_next(&mut self.addresses);
        if includes(Feature::AccelerationStructure) {
            features = features.push_next(&mut self.structures);
        }
        if includes(Feature::RayQuery) {
            features = features.push_next(&mut self.queries);
        }
        features
    }
}
