//! A host as small as it can be: it makes its own instance, device and command buffers with ash, and submits them.

use ash::{Device, Entry, Instance, ext, vk};
use mica_gpu::{Device as MicaDevice, DeviceOptions, Feature, HostDevice, Version};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

/// The host's device with all that Mica requires, under validation.
pub struct Host {
    pub instance: Instance,
    pub physical: vk::PhysicalDevice,
    pub device: Device,
    pub queue_family: u32,
    pub queue: vk::Queue,
    pool: vk::CommandPool,
    messages: Box<Mutex<Vec<String>>>,
    messenger: (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT),
    enabled: Vec<Feature>,
    _entry: Entry,
}

impl Host {
    /// With all that Mica needs, and nothing else.
    pub fn new() -> Self {
        Self::enabling(&[])
    }

    /// With some features beside, which the device has.
    pub fn enabling(optional: &[Feature]) -> Self {
        let messages: Box<Mutex<Vec<String>>> = Box::default();
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(receive))
            .user_data(std::ptr::from_ref(&*messages).cast_mut().cast());
        let requirements = MicaDevice::requirements();
        let application = vk::ApplicationInfo::default().api_version(requirements.api_version.packed());
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let extensions = [ext::debug_utils::NAME.as_ptr(), ext::validation_features::NAME.as_ptr()];
        let enables = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
        let mut instance_messages = info;
        let create = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions)
            .push_next(&mut features)
            .push_next(&mut instance_messages);
        // SAFETY: everything in the description lives until the calls return, and the log as long as the instance.
        let (entry, instance, messenger) = unsafe {
            let entry = Entry::load().expect("a loader");
            let instance = entry.create_instance(&create, None).expect("an instance with validation");
            let functions = ext::debug_utils::Instance::new(&entry, &instance);
            let raw = functions.create_debug_utils_messenger(&info, None).expect("a messenger");
            (entry, instance, (functions, raw))
        };
        // The device that Mica would take, so that the two can be compared.
        let index = MicaDevice::new(&DeviceOptions::default()).expect("a device").info().index;
        // SAFETY: the instance is alive.
        let (physical, families) = unsafe {
            let physical = instance.enumerate_physical_devices().expect("devices")[index];
            (physical, instance.get_physical_device_queue_family_properties(physical))
        };
        let fits = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(requirements.queue_flags);
        let queue_family = families.iter().position(fits).expect("a family with graphics and compute") as u32;
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        let mut core = vk::PhysicalDeviceFeatures::default();
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default();
        let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        let needed = requirements.features.iter().map(|needed| needed.feature);
        let enabled: Vec<Feature> = needed.chain(optional.iter().copied()).collect();
        for feature in &enabled {
            match feature {
                Feature::Synchronization2 => vulkan13.synchronization2 = vk::TRUE,
                Feature::DynamicRendering => vulkan13.dynamic_rendering = vk::TRUE,
                Feature::Maintenance4 => vulkan13.maintenance4 = vk::TRUE,
                Feature::StorageImageExtendedFormats => core.shader_storage_image_extended_formats = vk::TRUE,
                Feature::Int64 => core.shader_int64 = vk::TRUE,
                Feature::Float64 => core.shader_float64 = vk::TRUE,
                Feature::BufferDeviceAddress => addresses.buffer_device_address = vk::TRUE,
                Feature::AccelerationStructure => structures.acceleration_structure = vk::TRUE,
                Feature::RayQuery => queries.ray_query = vk::TRUE,
            }
        }
        let extensions: Vec<_> = enabled.iter().flat_map(|it| it.extensions()).map(|name| name.as_ptr()).collect();
        let mut create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&core)
            .push_next(&mut vulkan13);
        if enabled.contains(&Feature::RayQuery) {
            create = create.push_next(&mut addresses).push_next(&mut structures).push_next(&mut queries);
        }
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(queue_family);
        // SAFETY: the device was found usable, so it has every feature that is asked for.
        let (device, queue, pool) = unsafe {
            let device = instance.create_device(physical, &create, None).expect("a device");
            let queue = device.get_device_queue(queue_family, 0);
            let pool = device.create_command_pool(&pool, None).expect("a pool");
            (device, queue, pool)
        };
        Self { instance, physical, device, queue_family, queue, pool, messages, messenger, enabled, _entry: entry }
    }

    /// Lends the device with everything enabled.
    pub fn lend(&self) -> Arc<MicaDevice> {
        self.lend_table(&self.device)
    }

    /// Lends the device behind other functions.
    pub fn lend_table(&self, device: &Device) -> Arc<MicaDevice> {
        // SAFETY: the handles belong together, the features are enabled, and tests drop the host last.
        unsafe { MicaDevice::borrow(self.description(device, &self.enabled)) }.expect("the host's device serves")
    }

    /// What is lent, for tests that lend less.
    pub fn description<'a>(&'a self, device: &'a Device, enabled: &'a [Feature]) -> HostDevice<'a> {
        HostDevice {
            instance: &self.instance,
            physical_device: self.physical,
            device,
            api_version: Version { major: 1, minor: 3, patch: 0 },
            queue_family: self.queue_family,
            enabled,
            debug_utils: true,
        }
    }

    /// A command buffer, begun.
    pub fn begin(&self) -> vk::CommandBuffer {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is alive and used by this thread only.
        unsafe {
            let buffer = self.device.allocate_command_buffers(&info).expect("a command buffer")[0];
            self.device.begin_command_buffer(buffer, &vk::CommandBufferBeginInfo::default()).expect("it begins");
            buffer
        }
    }

    /// Ends a command buffer.
    pub fn end(&self, buffer: vk::CommandBuffer) {
        // SAFETY: the command buffer was begun here.
        unsafe { self.device.end_command_buffer(buffer) }.expect("it ends");
    }

    /// Ends a command buffer, submits it and waits for it.
    pub fn end_and_submit(&self, buffer: vk::CommandBuffer) {
        self.end(buffer);
        self.submit(&[buffer]);
    }

    /// Submits command buffers, each on its own, and waits for all.
    pub fn submit(&self, buffers: &[vk::CommandBuffer]) {
        // SAFETY: the command buffers were ended; nothing else uses the queue.
        unsafe {
            for buffer in buffers {
                let infos = [vk::CommandBufferSubmitInfo::default().command_buffer(*buffer)];
                let submit = vk::SubmitInfo2::default().command_buffer_infos(&infos);
                self.device.queue_submit2(self.queue, &[submit], vk::Fence::null()).expect("it is submitted");
            }
            self.device.queue_wait_idle(self.queue).expect("it ends");
        }
    }

    /// A buffer or image's memory, all of it, visible to the host where that can be.
    pub fn allocate(&self, requirements: vk::MemoryRequirements) -> vk::DeviceMemory {
        // SAFETY: the physical device is of this instance.
        let properties = unsafe { self.instance.get_physical_device_memory_properties(self.physical) };
        let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let types = properties.memory_types_as_slice();
        let index = (0..types.len() as u32)
            .filter(|index| requirements.memory_type_bits & (1 << index) != 0)
            .max_by_key(|index| types[*index as usize].property_flags.contains(visible))
            .expect("a type of memory");
        let info = vk::MemoryAllocateInfo::default().allocation_size(requirements.size).memory_type_index(index);
        // SAFETY: the type is one of those allowed.
        unsafe { self.device.allocate_memory(&info, None) }.expect("memory")
    }

    /// What validation said since the last call.
    pub fn take_messages(&self) -> Vec<String> {
        std::mem::take(&mut *self.messages.lock().expect("no test panics while it holds the lock"))
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nothing of the device is in use: tests drop guests and their own objects first.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
        let said = self.take_messages();
        // SAFETY: as above.
        unsafe {
            self.messenger.0.destroy_debug_utils_messenger(self.messenger.1, None);
            self.instance.destroy_instance(None);
        }
        if !std::thread::panicking() {
            assert!(said.is_empty(), "validation said:\n{}", said.join("\n"));
        }
    }
}

unsafe extern "system" fn receive(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the loader passes valid data, and the log that the host keeps longer than the instance.
    let (text, log) = unsafe { (CStr::from_ptr((*data).p_message), &*user_data.cast::<Mutex<Vec<String>>>()) };
    log.lock().expect("no test panics while it holds the lock").push(text.to_string_lossy().into_owned());
    vk::FALSE
}
