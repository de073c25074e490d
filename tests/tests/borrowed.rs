//! A whole frame in a host's command buffer: a bare ash program gets the pixels that a device of our own gives.

use ash::{Device, Entry, Instance, ext, vk};
use mica_gpu::{Device as MicaDevice, DeviceOptions, Executor, Feature, HostDevice, Timing, Version};
use mica_graph::Graph;
use mica_render::{Environment, OcclusionBackend, Renderer, View, embedded_scene, scene::procedural};
use mica_tests::{Gpu, Picture};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

const SIZE: [u32; 2] = [96, 54];

/// A program that owns its instance, device, queue and command buffers, and lends the device.
struct Host {
    instance: Instance,
    physical: vk::PhysicalDevice,
    device: Device,
    queue_family: u32,
    queue: vk::Queue,
    pool: vk::CommandPool,
    messenger: (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT),
    /// What validation said; the driver holds its address.
    messages: Box<Mutex<Vec<String>>>,
    _entry: Entry,
}

impl Host {
    fn new() -> Self {
        let messages: Box<Mutex<Vec<String>>> = Box::default();
        let requirements = MicaDevice::requirements();
        let application = vk::ApplicationInfo::default().api_version(requirements.api_version.packed());
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let extensions = [ext::debug_utils::NAME.as_ptr(), ext::validation_features::NAME.as_ptr()];
        let enables = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut validation = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
        let create = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions)
            .push_next(&mut validation);
        let severities = vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING;
        let listen = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severities)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(hear))
            .user_data(std::ptr::from_ref(&*messages).cast_mut().cast());
        // SAFETY: the descriptions live until the calls return, and the log longer than the messenger.
        let (entry, instance, messenger) = unsafe {
            let entry = Entry::load().expect("a loader");
            let instance = entry.create_instance(&create, None).expect("an instance with validation");
            let functions = ext::debug_utils::Instance::new(&entry, &instance);
            let raw = functions.create_debug_utils_messenger(&listen, None).expect("a messenger");
            (entry, instance, (functions, raw))
        };
        // The one that Mica itself would take: pixels of different devices are not compared.
        let index = MicaDevice::new(&DeviceOptions::default()).expect("a device").info().index;
        // SAFETY: the instance is alive.
        let (physical, families) = unsafe {
            let physical = instance.enumerate_physical_devices().expect("devices")[index];
            (physical, instance.get_physical_device_queue_family_properties(physical))
        };
        let fits = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(requirements.queue_flags);
        let queue_family = families.iter().position(fits).expect("a family with graphics and compute") as u32;
        let (device, queue, pool) = Self::device(&instance, physical, queue_family);
        Self { instance, physical, device, queue_family, queue, pool, messenger, messages, _entry: entry }
    }

    /// A device with exactly what Mica says it needs.
    fn device(
        instance: &Instance,
        physical: vk::PhysicalDevice,
        queue_family: u32,
    ) -> (Device, vk::Queue, vk::CommandPool) {
        let mut core = vk::PhysicalDeviceFeatures::default();
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
        for needed in MicaDevice::requirements().features {
            match needed.feature {
                Feature::Synchronization2 => vulkan13.synchronization2 = vk::TRUE,
                Feature::DynamicRendering => vulkan13.dynamic_rendering = vk::TRUE,
                Feature::Maintenance4 => vulkan13.maintenance4 = vk::TRUE,
                Feature::StorageImageExtendedFormats => core.shader_storage_image_extended_formats = vk::TRUE,
                Feature::Int64 => core.shader_int64 = vk::TRUE,
                Feature::Float64 => core.shader_float64 = vk::TRUE,
                optional => unreachable!("{optional:?} is never needed"),
            }
        }
        assert!(MicaDevice::requirements().device_extensions.is_empty(), "this host enables none");
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&core)
            .push_next(&mut vulkan13);
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(queue_family);
        // SAFETY: the family is the device's, and Mica found the device usable: it has every feature asked for.
        unsafe {
            let device = instance.create_device(physical, &create, None).expect("a device");
            let queue = device.get_device_queue(queue_family, 0);
            let pool = device.create_command_pool(&pool, None).expect("a pool");
            (device, queue, pool)
        }
    }

    fn lend(&self) -> Arc<MicaDevice> {
        let enabled: Vec<Feature> = MicaDevice::requirements().features.iter().map(|needed| needed.feature).collect();
        let lent = HostDevice {
            instance: &self.instance,
            physical_device: self.physical,
            device: &self.device,
            api_version: Version { major: 1, minor: 3, patch: 0 },
            queue_family: self.queue_family,
            enabled: &enabled,
            debug_utils: true,
        };
        // SAFETY: the handles belong together, the features are enabled, and the test drops the host last.
        unsafe { MicaDevice::borrow(lent) }.expect("the host's device serves")
    }

    /// A command buffer, begun.
    fn begin(&self) -> vk::CommandBuffer {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the pool is alive and used by this thread only.
        unsafe {
            let buffer = self.device.allocate_command_buffers(&info).expect("a command buffer")[0];
            self.device.begin_command_buffer(buffer, &once).expect("it begins");
            buffer
        }
    }

    /// Ends a command buffer, submits it and waits for it.
    fn submit(&self, buffer: vk::CommandBuffer) {
        let infos = [vk::CommandBufferSubmitInfo::default().command_buffer(buffer)];
        let submit = vk::SubmitInfo2::default().command_buffer_infos(&infos);
        // SAFETY: the command buffer was begun here, and nothing else uses the queue.
        unsafe {
            self.device.end_command_buffer(buffer).expect("it ends");
            self.device.queue_submit2(self.queue, &[submit], vk::Fence::null()).expect("it is submitted");
            self.device.queue_wait_idle(self.queue).expect("it is finished");
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: the guest is dropped, and everything that was submitted was waited for.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
        let said = std::mem::take(&mut *self.messages.lock().expect("nobody panics while holding the lock"));
        // SAFETY: the device, the only child beside the messenger, is gone.
        unsafe {
            self.messenger.0.destroy_debug_utils_messenger(self.messenger.1, None);
            self.instance.destroy_instance(None);
        }
        if !std::thread::panicking() {
            assert!(said.is_empty(), "validation said to the host:\n{}", said.join("\n"));
        }
    }
}

unsafe extern "system" fn hear(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the loader passes valid data, and the log that the host keeps longer than the messenger.
    let (text, log) = unsafe { (CStr::from_ptr((*data).p_message), &*user_data.cast::<Mutex<Vec<String>>>()) };
    log.lock().expect("nobody panics while holding the lock").push(text.to_string_lossy().into_owned());
    vk::FALSE
}

/// The embedded sphere under the studio's light, glinting by `wang2020`, with few samples in its table.
fn renderer() -> (Renderer, View) {
    let scene = embedded_scene("sphere").expect("it is embedded").load().expect("it is sound");
    let view = View::new(scene.default_camera(), SIZE);
    let map = procedural::environment("studio").expect("it is listed");
    let environment = Environment { map, rotation_radians: 0.3 };
    let mut renderer =
        Renderer::new(scene, &[], Some(&environment), OcclusionBackend::Bvh).expect("the scene is sound");
    renderer.set_method(None, "wang2020").expect("the method exists");
    renderer.set(None, "samples", "4").expect("a setting");
    (renderer, view)
}

/// Nothing is precomputed, as a host that only records frames does not either: the first frame makes every table. The
/// second one finds them made, and rebuilds the quadtree for another count.
#[test]
fn a_host_gets_the_pixels_of_a_device_of_our_own_from_whole_frames() {
    let counts = ["2e5", "4e4"];
    let mut expected = Vec::new();
    {
        let mut gpu = Gpu::new();
        let (mut renderer, view) = renderer();
        for count in counts {
            renderer.set(None, "count", count).expect("a setting");
            expected.push(gpu.render(&mut renderer, &view).picture);
        }
    }
    assert!(
        expected[0].variance() > 0.0 && !expected[0].differing(&expected[1]).is_empty(),
        "there is something to see"
    );

    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let (mut renderer, view) = renderer();
    for (count, expected) in counts.into_iter().zip(&expected) {
        renderer.set(None, "count", count).expect("a setting");
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, &view, None).expect("the frame is declared");
        let download = graph.download_image(&frame.radiance);
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        let recorded = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect("the frame is recorded");
        host.submit(commands);
        // SAFETY: the host waited for the frame.
        let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
        let picture = Picture::from_bytes(SIZE, &run.take(download));
        let differing = picture.differing(expected).len();
        assert_eq!(differing, 0, "{differing} pixels differ with {count} flakes");
    }
}
