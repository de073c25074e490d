//! The calls that may fail, each with what it may return beside success: the lists of the Vulkan specification 1.3.
//!
//! Not in them: errors of extensions that nobody here enables, and `VK_ERROR_UNKNOWN`, which any call may return.

use crate::{chain, faults};
use ash::vk;
use std::ffi::{CStr, c_void};

/// Any pointer: it is passed on and not looked at.
type P = *const c_void;
/// Any handle that is no pointer to something of the loader's.
type H = u64;

macro_rules! may_fail {
    ($($name:ident($object:ident $(, $type:ty)*): $($result:ident)*;)*) => {
        /// The layer's function for a call that may fail.
        pub(crate) fn function(name: &CStr) -> vk::PFN_vkVoidFunction {
            type Void = unsafe extern "system" fn();
            $({
                const NAME: &str = concat!(stringify!($name), "\0");
                if name.to_bytes_with_nul() == NAME.as_bytes() {
                    may_fail!(@function NAME, $object, ($($type),*), [$(vk::Result::$result),*]);
                    // SAFETY: whoever asks for a function by its name calls it with the arguments of that name.
                    return Some(unsafe { std::mem::transmute::<*const (), Void>(faulty as *const ()) });
                }
            })*
            None
        }
    };
    (@function $name:ident, $object:ident, ($a:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a);
    };
    (@function $name:ident, $object:ident, (), $results:expr) => {
        may_fail!(@define $name, $object, $results,);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty, $c:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b, c: $c);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty, $c:ty, $d:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b, c: $c, d: $d);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty, $c:ty, $d:ty, $e:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b, c: $c, d: $d, e: $e);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty, $c:ty, $d:ty, $e:ty, $f:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b, c: $c, d: $d, e: $e, f: $f);
    };
    (@function $name:ident, $object:ident, ($a:ty, $b:ty, $c:ty, $d:ty, $e:ty, $f:ty, $g:ty), $results:expr) => {
        may_fail!(@define $name, $object, $results, a: $a, b: $b, c: $c, d: $d, e: $e, f: $f, g: $g);
    };
    (@define $name:ident, $object:ident, $results:expr, $($argument:ident: $type:ty),*) => {
        unsafe extern "system" fn faulty(object: vk::$object $(, $argument: $type)*) -> vk::Result {
            type Function = unsafe extern "system" fn(vk::$object $(, $type)*) -> vk::Result;
            let injected = faults::result_of($name, &$results);
            if let Some(result) = injected.filter(|result| *result != vk::Result::SUBOPTIMAL_KHR) {
                return result;
            }
            let name = CStr::from_bytes_with_nul($name.as_bytes()).unwrap_or_default();
            let Some(below) = chain::function(object, name) else { return vk::Result::ERROR_UNKNOWN };
            // SAFETY: the arguments are those of the caller, for a function of this name.
            let result = unsafe { std::mem::transmute::<unsafe extern "system" fn(), Function>(below)(object $(, $argument)*) };
            // What is not optimal succeeded all the same.
            if result == vk::Result::SUCCESS { injected.unwrap_or(result) } else { result }
        }
    };
}

may_fail! {
    vkEnumeratePhysicalDevices(Instance, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INITIALIZATION_FAILED;
    vkCreateDebugUtilsMessengerEXT(Instance, P, P, P): ERROR_OUT_OF_HOST_MEMORY;
    vkCreateHeadlessSurfaceEXT(Instance, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkGetPhysicalDeviceImageFormatProperties(PhysicalDevice, i32, i32, i32, u32, u32, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_FORMAT_NOT_SUPPORTED;
    vkGetPhysicalDeviceSurfaceSupportKHR(PhysicalDevice, u32, H, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_SURFACE_LOST_KHR;
    vkGetPhysicalDeviceSurfaceCapabilitiesKHR(PhysicalDevice, H, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_SURFACE_LOST_KHR;
    vkGetPhysicalDeviceSurfaceFormatsKHR(PhysicalDevice, H, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_SURFACE_LOST_KHR;

    vkAllocateMemory(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_EXTERNAL_HANDLE ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;
    vkMapMemory(Device, H, u64, u64, u32, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_MEMORY_MAP_FAILED;
    vkBindBufferMemory(Device, H, H, u64): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;
    vkBindImageMemory(Device, H, H, u64): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreateBuffer(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;
    vkCreateImage(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS ERROR_COMPRESSION_EXHAUSTED_EXT;
    vkCreateImageView(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;
    vkCreateSampler(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;
    vkCreateAccelerationStructureKHR(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS;

    vkCreatePipelineCache(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkGetPipelineCacheData(Device, H, P, P): INCOMPLETE ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreateShaderModule(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_SHADER_NV;
    vkCreateDescriptorSetLayout(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreatePipelineLayout(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreateComputePipelines(Device, H, u32, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_SHADER_NV PIPELINE_COMPILE_REQUIRED;
    vkCreateGraphicsPipelines(Device, H, u32, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_INVALID_SHADER_NV PIPELINE_COMPILE_REQUIRED;
    vkCreateDescriptorPool(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_FRAGMENTATION;
    vkAllocateDescriptorSets(Device, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_FRAGMENTED_POOL ERROR_OUT_OF_POOL_MEMORY;
    vkCreateQueryPool(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkGetQueryPoolResults(Device, H, u32, u32, usize, P, u64, u32): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST NOT_READY;

    vkCreateCommandPool(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkResetCommandPool(Device, H, u32): ERROR_OUT_OF_DEVICE_MEMORY;
    vkAllocateCommandBuffers(Device, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkBeginCommandBuffer(CommandBuffer, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkEndCommandBuffer(CommandBuffer): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreateFence(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkCreateSemaphore(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkResetFences(Device, u32, P): ERROR_OUT_OF_DEVICE_MEMORY;
    vkWaitForFences(Device, u32, P, u32, u64): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST TIMEOUT;
    vkQueueSubmit2(Queue, u32, P, H): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST;
    vkDeviceWaitIdle(Device): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST;
    vkSetDebugUtilsObjectNameEXT(Device, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;

    vkCreateSwapchainKHR(Device, P, P, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST ERROR_SURFACE_LOST_KHR ERROR_NATIVE_WINDOW_IN_USE_KHR ERROR_INITIALIZATION_FAILED;
    vkGetSwapchainImagesKHR(Device, H, P, P): INCOMPLETE ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY;
    vkAcquireNextImageKHR(Device, H, u64, H, H, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST ERROR_OUT_OF_DATE_KHR ERROR_SURFACE_LOST_KHR TIMEOUT NOT_READY SUBOPTIMAL_KHR;
    vkQueuePresentKHR(Queue, P): ERROR_OUT_OF_HOST_MEMORY ERROR_OUT_OF_DEVICE_MEMORY ERROR_DEVICE_LOST ERROR_OUT_OF_DATE_KHR ERROR_SURFACE_LOST_KHR SUBOPTIMAL_KHR;
}
