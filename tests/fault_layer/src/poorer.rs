//! Devices with lower limits and fewer features and extensions than they have.

use crate::{chain, faults};
use ash::vk;
use std::ffi::{CStr, c_char};
use std::sync::LazyLock;

/// What `MICA_FAULTS` takes away.
struct Taken {
    limits: Vec<(String, u32)>,
    without: Vec<String>,
}

static TAKEN: LazyLock<Taken> = LazyLock::new(|| {
    let mut taken = Taken { limits: Vec::new(), without: Vec::new() };
    for item in faults::items() {
        match item.split_once('=') {
            Some(("without", name)) => taken.without.push(name.to_owned()),
            Some((name, value)) => taken.limits.extend(value.parse().ok().map(|value| (name.to_owned(), value))),
            None => {}
        }
    }
    taken
});

impl Taken {
    /// Lowers a limit if it has this name; none is ever raised.
    fn lower(&self, name: &str, limit: &mut u32) {
        for (_, value) in self.limits.iter().filter(|(of, _)| of == name) {
            *limit = (*limit).min(*value);
        }
    }

    fn lower_all(&self, limits: &mut vk::PhysicalDeviceLimits) {
        self.lower("maxImageDimension2D", &mut limits.max_image_dimension2_d);
        self.lower("maxStorageBufferRange", &mut limits.max_storage_buffer_range);
        self.lower("maxUniformBufferRange", &mut limits.max_uniform_buffer_range);
        self.lower("maxPushConstantsSize", &mut limits.max_push_constants_size);
        self.lower("maxPerStageDescriptorStorageBuffers", &mut limits.max_per_stage_descriptor_storage_buffers);
        self.lower("maxPerStageDescriptorStorageImages", &mut limits.max_per_stage_descriptor_storage_images);
        self.lower("maxPerStageDescriptorSampledImages", &mut limits.max_per_stage_descriptor_sampled_images);
        self.lower("maxComputeWorkGroupInvocations", &mut limits.max_compute_work_group_invocations);
        limits.max_compute_work_group_count.iter_mut().for_each(|count| self.lower("maxComputeWorkGroupCount", count));
    }

    fn take(&self, feature: &str, has: &mut vk::Bool32) {
        if self.without.iter().any(|name| name == feature) {
            *has = vk::FALSE;
        }
    }
}

/// The layer's function for a question about devices.
pub(crate) fn function(name: &CStr) -> vk::PFN_vkVoidFunction {
    type Void = unsafe extern "system" fn();
    let own = match name.to_bytes() {
        b"vkGetPhysicalDeviceProperties" => properties as *const (),
        b"vkGetPhysicalDeviceProperties2" => properties2 as *const (),
        b"vkGetPhysicalDeviceFeatures2" => features2 as *const (),
        b"vkGetPhysicalDeviceQueueFamilyProperties" => queue_families as *const (),
        b"vkEnumerateDeviceExtensionProperties" => extensions as *const (),
        _ => return None,
    };
    // SAFETY: whoever asks for a function by its name calls it with the arguments of that name.
    Some(unsafe { std::mem::transmute::<*const (), Void>(own) })
}

/// The function below, of its type.
macro_rules! below {
    ($device:expr, $name:literal, $type:ty) => {
        chain::function($device, $name).map(|found| {
            // SAFETY: the type is that of the name.
            unsafe { std::mem::transmute::<unsafe extern "system" fn(), $type>(found) }
        })
    };
}

unsafe extern "system" fn properties(device: vk::PhysicalDevice, found: *mut vk::PhysicalDeviceProperties) {
    let Some(ask) = below!(device, c"vkGetPhysicalDeviceProperties", vk::PFN_vkGetPhysicalDeviceProperties) else {
        return;
    };
    // SAFETY: the arguments are those of the caller.
    unsafe {
        ask(device, found);
        TAKEN.lower_all(&mut (*found).limits);
    }
}

unsafe extern "system" fn properties2(device: vk::PhysicalDevice, found: *mut vk::PhysicalDeviceProperties2<'_>) {
    let Some(ask) = below!(device, c"vkGetPhysicalDeviceProperties2", vk::PFN_vkGetPhysicalDeviceProperties2) else {
        return;
    };
    // SAFETY: the arguments are those of the caller.
    unsafe {
        ask(device, found);
        TAKEN.lower_all(&mut (*found).properties.limits);
    }
}

unsafe extern "system" fn features2(device: vk::PhysicalDevice, found: *mut vk::PhysicalDeviceFeatures2<'_>) {
    let Some(ask) = below!(device, c"vkGetPhysicalDeviceFeatures2", vk::PFN_vkGetPhysicalDeviceFeatures2) else {
        return;
    };
    // SAFETY: the arguments are those of the caller; each structure of the chain is of the type that it says.
    unsafe {
        ask(device, found);
        let core = &mut (*found).features;
        TAKEN.take("shaderStorageImageExtendedFormats", &mut core.shader_storage_image_extended_formats);
        TAKEN.take("shaderInt64", &mut core.shader_int64);
        TAKEN.take("shaderFloat64", &mut core.shader_float64);
        let mut next = (*found).p_next.cast::<vk::BaseOutStructure<'_>>();
        while !next.is_null() {
            if (*next).s_type == vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES {
                let vulkan13 = &mut *next.cast::<vk::PhysicalDeviceVulkan13Features<'_>>();
                TAKEN.take("synchronization2", &mut vulkan13.synchronization2);
                TAKEN.take("dynamicRendering", &mut vulkan13.dynamic_rendering);
                TAKEN.take("maintenance4", &mut vulkan13.maintenance4);
            }
            next = (*next).p_next;
        }
    }
}

unsafe extern "system" fn queue_families(
    device: vk::PhysicalDevice,
    count: *mut u32,
    found: *mut vk::QueueFamilyProperties,
) {
    type Ask = vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties;
    let Some(ask) = below!(device, c"vkGetPhysicalDeviceQueueFamilyProperties", Ask) else { return };
    // SAFETY: the arguments are those of the caller.
    unsafe {
        ask(device, count, found);
        if !found.is_null() {
            let families = std::slice::from_raw_parts_mut(found, *count as usize);
            families.iter_mut().for_each(|family| TAKEN.lower("timestampValidBits", &mut family.timestamp_valid_bits));
        }
    }
}

unsafe extern "system" fn extensions(
    device: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    found: *mut vk::ExtensionProperties,
) -> vk::Result {
    use vk::Result as R;
    type Ask = vk::PFN_vkEnumerateDeviceExtensionProperties;
    let may_return = [R::INCOMPLETE, R::ERROR_OUT_OF_HOST_MEMORY, R::ERROR_OUT_OF_DEVICE_MEMORY];
    if let Some(result) = faults::result_of("vkEnumerateDeviceExtensionProperties\0", &may_return) {
        return result;
    }
    let Some(ask) = below!(device, c"vkEnumerateDeviceExtensionProperties", Ask) else { return R::ERROR_UNKNOWN };
    // SAFETY: the arguments are those of the caller, or room for as many as there are.
    unsafe {
        let mut there = 0;
        let result = ask(device, layer, &mut there, std::ptr::null_mut());
        if result != R::SUCCESS {
            return result;
        }
        let mut all = vec![vk::ExtensionProperties::default(); there as usize];
        let result = ask(device, layer, &mut there, all.as_mut_ptr());
        if result != R::SUCCESS {
            return result;
        }
        all.truncate(there as usize);
        let is_taken = |extension: &vk::ExtensionProperties| {
            let name = extension.extension_name_as_c_str().unwrap_or_default().to_bytes();
            TAKEN.without.iter().any(|taken| taken.as_bytes() == name)
        };
        all.retain(|extension| !is_taken(extension));
        if found.is_null() {
            *count = all.len() as u32;
            return R::SUCCESS;
        }
        let room = (*count as usize).min(all.len());
        std::ptr::copy_nonoverlapping(all.as_ptr(), found, room);
        *count = room as u32;
        if room < all.len() { R::INCOMPLETE } else { R::SUCCESS }
    }
}
