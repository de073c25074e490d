//! The layer's place between the loader and what is below it.
//!
//! Khronos, Vulkan-Loader, docs/LoaderLayerInterface.md: a layer finds in a chained structure the functions of what is
//! below it, moves the structure on, and creates. Instances, devices and their queues and command buffers begin with a
//! pointer that is the same for all that belong together: the key to what was found.

use crate::{calls, faults, moods, poorer};
use ash::vk::{self, Handle};
use std::collections::HashMap;
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// What is below the layer, for one instance or device.
struct Below {
    from: From,
    /// What was found. An instance has to be asked once: the loader fills the table that it answers from with the functions
    /// of the topmost layer, which may be those of this one, as soon as it has asked for them itself.
    found: HashMap<CString, unsafe extern "system" fn()>,
}

#[derive(Clone, Copy)]
enum From {
    Instance(vk::PFN_vkGetInstanceProcAddr, vk::Instance),
    Device(vk::PFN_vkGetDeviceProcAddr, vk::Device),
}

static BELOW: LazyLock<Mutex<HashMap<usize, Below>>> = LazyLock::new(Mutex::default);

/// The structures that the loader chains, with the links of layers.
#[repr(C)]
struct CreateInfo<Link> {
    s_type: vk::StructureType,
    next: *mut Self,
    /// 0 where `link` is one; the loader chains other things under the same type.
    function: i32,
    link: *mut Link,
}

#[repr(C)]
struct InstanceLink {
    next: *mut Self,
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
}

#[repr(C)]
struct DeviceLink {
    next: *mut Self,
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

const OF_INSTANCE: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;
const OF_DEVICE: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;

/// The loader's structure in a chain.
///
/// # Safety
/// The chain is one that the loader passed.
unsafe fn links<Link>(mut next: *mut CreateInfo<Link>, of: vk::StructureType) -> Option<*mut CreateInfo<Link>> {
    while !next.is_null() {
        // SAFETY: every structure of a chain begins with its type and its successor, and those of this type go on so.
        unsafe {
            if (*next).s_type == of && (*next).function == 0 {
                return Some(next);
            }
            next = (*next).next;
        }
    }
    None
}

fn key(object: impl Handle) -> usize {
    // SAFETY: dispatchable objects are pointers to what begins with the loader's pointer.
    unsafe { *(object.as_raw() as usize as *const usize) }
}

fn all() -> MutexGuard<'static, HashMap<usize, Below>> {
    BELOW.lock().unwrap_or_else(PoisonError::into_inner)
}

fn note(object: impl Handle, from: From) {
    all().insert(key(object), Below { from, found: HashMap::new() });
}

fn below(object: impl Handle) -> Option<From> {
    all().get(&key(object)).map(|below| below.from)
}

/// A function of what is below an object's instance or device.
pub(crate) fn function(object: impl Handle, name: &CStr) -> vk::PFN_vkVoidFunction {
    let key = key(object);
    let from = {
        let all = all();
        let below = all.get(&key)?;
        if let Some(found) = below.found.get(name) {
            return Some(*found);
        }
        below.from
    };
    // SAFETY: the handle was noted when it was created, and is forgotten when it is destroyed.
    let found = unsafe {
        match from {
            From::Instance(get, instance) => get(instance, name.as_ptr()),
            From::Device(get, device) => get(device, name.as_ptr()),
        }
    }?;
    all().get_mut(&key)?.found.insert(name.to_owned(), found);
    Some(found)
}

unsafe extern "system" fn destroy_instance(instance: vk::Instance, callbacks: *const c_void) {
    type Destroy = unsafe extern "system" fn(vk::Instance, *const c_void);
    if instance == vk::Instance::null() {
        return;
    }
    let destroy = function(instance, c"vkDestroyInstance");
    all().remove(&key(instance));
    if let Some(destroy) = destroy {
        // SAFETY: the arguments are those of the caller, for a function of this name.
        unsafe { std::mem::transmute::<unsafe extern "system" fn(), Destroy>(destroy)(instance, callbacks) };
    }
}

unsafe extern "system" fn destroy_device(device: vk::Device, callbacks: *const c_void) {
    type Destroy = unsafe extern "system" fn(vk::Device, *const c_void);
    if device == vk::Device::null() {
        return;
    }
    let destroy = function(device, c"vkDestroyDevice");
    all().remove(&key(device));
    if let Some(destroy) = destroy {
        // SAFETY: as for instances.
        unsafe { std::mem::transmute::<unsafe extern "system" fn(), Destroy>(destroy)(device, callbacks) };
    }
}

/// `vkCreateInstance` of the layer.
pub(crate) unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    callbacks: *const c_void,
    made: *mut vk::Instance,
) -> vk::Result {
    use vk::Result as R;
    let may_return = [
        R::ERROR_OUT_OF_HOST_MEMORY,
        R::ERROR_OUT_OF_DEVICE_MEMORY,
        R::ERROR_INITIALIZATION_FAILED,
        R::ERROR_LAYER_NOT_PRESENT,
        R::ERROR_EXTENSION_NOT_PRESENT,
        R::ERROR_INCOMPATIBLE_DRIVER,
    ];
    type Create =
        unsafe extern "system" fn(*const vk::InstanceCreateInfo<'_>, *const c_void, *mut vk::Instance) -> vk::Result;
    if let Some(result) = faults::result_of("vkCreateInstance\0", &may_return) {
        return result;
    }
    // SAFETY: the loader passes its links, each with the functions of the next layer or the driver.
    unsafe {
        let Some(links) = links::<InstanceLink>((*info).p_next.cast_mut().cast(), OF_INSTANCE) else {
            return R::ERROR_INITIALIZATION_FAILED;
        };
        let get = (*(*links).link).get_instance_proc_addr;
        (*links).link = (*(*links).link).next;
        let Some(create) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return R::ERROR_INITIALIZATION_FAILED;
        };
        let result = std::mem::transmute::<unsafe extern "system" fn(), Create>(create)(info, callbacks, made);
        if result == R::SUCCESS {
            note(*made, From::Instance(get, *made));
        }
        result
    }
}

/// `vkCreateDevice` of the layer.
pub(crate) unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    callbacks: *const c_void,
    made: *mut vk::Device,
) -> vk::Result {
    use vk::Result as R;
    let may_return = [
        R::ERROR_OUT_OF_HOST_MEMORY,
        R::ERROR_OUT_OF_DEVICE_MEMORY,
        R::ERROR_INITIALIZATION_FAILED,
        R::ERROR_EXTENSION_NOT_PRESENT,
        R::ERROR_FEATURE_NOT_PRESENT,
        R::ERROR_TOO_MANY_OBJECTS,
        R::ERROR_DEVICE_LOST,
    ];
    type Create = unsafe extern "system" fn(
        vk::PhysicalDevice,
        *const vk::DeviceCreateInfo<'_>,
        *const c_void,
        *mut vk::Device,
    ) -> vk::Result;
    if let Some(result) = faults::result_of("vkCreateDevice\0", &may_return) {
        return result;
    }
    // SAFETY: as for instances; a physical device has the key of its instance.
    unsafe {
        let Some(links) = links::<DeviceLink>((*info).p_next.cast_mut().cast(), OF_DEVICE) else {
            return R::ERROR_INITIALIZATION_FAILED;
        };
        let (get_of_instance, get) = ((*(*links).link).get_instance_proc_addr, (*(*links).link).get_device_proc_addr);
        (*links).link = (*(*links).link).next;
        let Some(From::Instance(_, instance)) = below(physical) else { return R::ERROR_INITIALIZATION_FAILED };
        let Some(create) = get_of_instance(instance, c"vkCreateDevice".as_ptr()) else {
            return R::ERROR_INITIALIZATION_FAILED;
        };
        let create = std::mem::transmute::<unsafe extern "system" fn(), Create>(create);
        let result = create(physical, info, callbacks, made);
        if result == R::SUCCESS {
            note(*made, From::Device(get, *made));
        }
        result
    }
}

/// `vkGetInstanceProcAddr` of the layer.
///
/// # Safety
/// As Vulkan asks.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn mica_faults_get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: names are strings.
    let name = unsafe { CStr::from_ptr(name) };
    let own = own(name);
    // The loader also asks while the instance is being created.
    if instance == vk::Instance::null() || below(instance).is_none() {
        return own;
    }
    // What is not there below is not there at all.
    let next = function(instance, name)?;
    own.or(Some(next))
}

/// `vkGetDeviceProcAddr` of the layer.
///
/// # Safety
/// As Vulkan asks.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn mica_faults_get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: names are strings.
    let name = unsafe { CStr::from_ptr(name) };
    let next = function(device, name)?;
    match name.to_bytes() {
        b"vkGetDeviceProcAddr" | b"vkDestroyDevice" => own(name),
        _ => moods::function(name).or_else(|| calls::function(name)).or(Some(next)),
    }
}

/// The layer's own function of a name.
fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
    type Void = unsafe extern "system" fn();
    // SAFETY: whoever asks for a function by its name calls it with the arguments of that name.
    unsafe {
        Some(match name.to_bytes() {
            b"vkCreateInstance" => std::mem::transmute::<*const (), Void>(create_instance as *const ()),
            b"vkCreateDevice" => std::mem::transmute::<*const (), Void>(create_device as *const ()),
            b"vkDestroyInstance" => std::mem::transmute::<*const (), Void>(destroy_instance as *const ()),
            b"vkDestroyDevice" => std::mem::transmute::<*const (), Void>(destroy_device as *const ()),
            b"vkGetInstanceProcAddr" => {
                std::mem::transmute::<*const (), Void>(mica_faults_get_instance_proc_addr as *const ())
            }
            b"vkGetDeviceProcAddr" => {
                std::mem::transmute::<*const (), Void>(mica_faults_get_device_proc_addr as *const ())
            }
            _ => return poorer::function(name).or_else(|| calls::function(name)),
        })
    }
}
