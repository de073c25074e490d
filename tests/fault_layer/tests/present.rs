//! A presenter on a surface without a window: every size, and every call that fails in any of its ways.

use crate::calls::{Turn, check_kind};
use crate::faults::Faults;
use crate::{not_shown, run_under_layer};
use ash::{Device, Entry, Instance, ext, khr, vk};
use mica_gpu::{Device as MicaDevice, Error, Feature, HostDevice, HostSurface, Presenter, Version};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

/// Window after window, one picture each: two of a size, a line, a pixel, none while it is minimised, and a wide one.
const SIZES: [[u32; 2]; 7] = [[64, 48], [64, 48], [33, 1], [0, 0], [1, 1], [16384, 1], [64, 48]];
const SHOWN: usize = SIZES.len() - 1;

/// A program with a picture to show, and validation.
struct Host {
    entry: Entry,
    instance: Instance,
    physical: vk::PhysicalDevice,
    device: Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    picture: vk::Image,
    memory: vk::DeviceMemory,
    messenger: (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT),
    messages: Box<Mutex<Vec<String>>>,
}

const PICTURE: [u32; 2] = [16, 9];

impl Host {
    fn new() -> Self {
        // SAFETY: loading a library runs its initialisers; the Vulkan loader's are harmless.
        let entry = unsafe { Entry::load() }.expect("a loader");
        let messages: Box<Mutex<Vec<String>>> = Box::default();
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let extensions =
            [ext::debug_utils::NAME, khr::surface::NAME, ext::headless_surface::NAME].map(|name| name.as_ptr());
        let create = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        let listen = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(hear))
            .user_data(std::ptr::from_ref(&*messages).cast_mut().cast());
        let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
        let extensions = [khr::swapchain::NAME.as_ptr()];
        let core = vk::PhysicalDeviceFeatures::default().shader_storage_image_extended_formats(true);
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default()
            .synchronization2(true)
            .dynamic_rendering(true)
            .maintenance4(true);
        let of_device = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .enabled_features(&core)
            .push_next(&mut vulkan13);
        // SAFETY: lavapipe has all that is asked for; the descriptions live until the calls return.
        unsafe {
            let instance = entry.create_instance(&create, None).expect("validation and surfaces without windows");
            let functions = ext::debug_utils::Instance::new(&entry, &instance);
            let messenger = functions.create_debug_utils_messenger(&listen, None).expect("a messenger");
            let physical = instance.enumerate_physical_devices().expect("devices")[0];
            let device = instance.create_device(physical, &of_device, None).expect("a device");
            let queue = device.get_device_queue(0, 0);
            let pool = device.create_command_pool(&vk::CommandPoolCreateInfo::default(), None).expect("a pool");
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(vk::Format::R8G8B8A8_UNORM)
                .extent(vk::Extent3D { width: PICTURE[0], height: PICTURE[1], depth: 1 })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST);
            let picture = device.create_image(&info, None).expect("an image");
            let needs = device.get_image_memory_requirements(picture);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(needs.memory_type_bits.trailing_zeros());
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_image_memory(picture, memory, 0).expect("it is bound");
            let messenger = (functions, messenger);
            Self { entry, instance, physical, device, queue, pool, picture, memory, messenger, messages }
        }
    }

    fn lend(&self) -> Arc<MicaDevice> {
        let enabled: Vec<Feature> = MicaDevice::requirements().features.iter().map(|needed| needed.feature).collect();
        let lent = HostDevice {
            instance: &self.instance,
            physical_device: self.physical,
            device: &self.device,
            api_version: Version { major: 1, minor: 3, patch: 0 },
            queue_family: 0,
            enabled: &enabled,
            debug_utils: true,
        };
        // SAFETY: the handles belong together, the features are enabled, and the host is dropped last.
        unsafe { MicaDevice::borrow(lent) }.expect("the device serves")
    }

    /// Does something with a presenter on a surface of its own.
    fn present<T>(&self, act: impl FnOnce(&mut Presenter) -> Result<T, Error>) -> Result<T, Error> {
        let surfaces = ext::headless_surface::Instance::new(&self.entry, &self.instance);
        let info = vk::HeadlessSurfaceCreateInfoEXT::default();
        // SAFETY: the instance has the extension; the surface is destroyed below, after the presenter.
        let surface = unsafe { surfaces.create_headless_surface(&info, None) }.expect("a surface");
        let there = HostSurface { entry: &self.entry, surface, queue: self.queue };
        // SAFETY: all handles are of one instance and outlive the presenter, and this is the only thread.
        let presenter = unsafe { Presenter::new(self.lend(), there) };
        let done = presenter.and_then(|mut presenter| act(&mut presenter));
        // SAFETY: the presenter is gone, and nothing is under way.
        unsafe {
            self.device.queue_wait_idle(self.queue).expect("it ends");
            khr::surface::Instance::new(&self.entry, &self.instance).destroy_surface(surface, None);
        }
        done
    }

    /// Shows a picture in a window of each size. Returns how many were shown.
    fn show(&self, sizes: &[[u32; 2]]) -> Result<usize, Error> {
        self.present(|presenter| self.show_by(presenter, sizes))
    }

    fn show_by(&self, presenter: &mut Presenter, sizes: &[[u32; 2]]) -> Result<usize, Error> {
        let mut shown = 0;
        for size in sizes {
            let Some(target) = presenter.acquire(*size)? else { continue };
            assert_eq!(target.size(), [size[0].max(1), size[1].max(1)], "lavapipe gives what is asked for");
            self.draw(presenter, &target);
            // SAFETY: the drawing was submitted, and signals what the target has for it.
            shown += usize::from(unsafe { presenter.present(target) }?);
        }
        Ok(shown)
    }

    fn draw(&self, presenter: &Presenter, target: &mica_gpu::Target) {
        let whole = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            level_count: 1,
            layer_count: 1,
            ..Default::default()
        };
        let general = vk::ImageLayout::GENERAL;
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ)
            .new_layout(general)
            .image(self.picture)
            .subresource_range(whole)];
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the command buffer is this frame's own, and the picture is in the layout that is said.
        unsafe {
            let commands = self.device.allocate_command_buffers(&info).expect("a command buffer");
            self.device.begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default()).expect("it begins");
            let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            self.device.cmd_pipeline_barrier2(commands[0], &dependency);
            presenter.draw(commands[0], target, (self.picture, general), PICTURE);
            self.device.end_command_buffer(commands[0]).expect("it ends");
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands[0])];
            let signals = [vk::SemaphoreSubmitInfo::default()
                .semaphore(target.drawn())
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
            let submit = vk::SubmitInfo2::default().command_buffer_infos(&buffers).signal_semaphore_infos(&signals);
            self.device.queue_submit2(self.queue, &[submit], vk::Fence::null()).expect("it is submitted");
        }
    }

    fn assert_silence(&self, after: &dyn std::fmt::Debug) {
        let said = std::mem::take(&mut *self.messages.lock().expect("nobody panics while holding the lock"));
        assert!(said.is_empty(), "after {after:?} validation said:\n{}", said.join("\n"));
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: everything that was submitted was waited for, and presenters are gone.
        unsafe {
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_image(self.picture, None);
            self.device.free_memory(self.memory, None);
            self.device.destroy_device(None);
            if !std::thread::panicking() {
                self.assert_silence(&"the device is destroyed");
            }
            self.messenger.0.destroy_debug_utils_messenger(self.messenger.1, None);
            self.instance.destroy_instance(None);
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

/// Whether the driver has surfaces without windows, as Mesa 22.3 has not; said where it has none. A driver with ray queries,
/// where the environment says that there is one, is a newer one and has to have them.
fn has_surfaces(test: &str) -> bool {
    // SAFETY: loading a library runs its initialisers; the Vulkan loader's are harmless.
    let entry = unsafe { Entry::load() }.expect("a loader");
    // SAFETY: no layer is named.
    let offered = unsafe { entry.enumerate_instance_extension_properties(None) }.expect("extensions");
    let has = offered.iter().any(|it| it.extension_name_as_c_str() == Ok(ext::headless_surface::NAME));
    if !has {
        let expected = std::env::var("MICA_EXPECT").is_ok_and(|expected| expected == "ray-query");
        assert!(!expected, "VK_EXT_headless_surface is expected here");
        not_shown(test, "the driver has no VK_EXT_headless_surface");
    }
    has
}

#[test]
fn f30_f31_windows_of_every_size_are_shown_and_one_without_a_size_is_waited_for() {
    if !has_surfaces("f30_f31_windows_of_every_size_are_shown_and_one_without_a_size_is_waited_for") {
        return;
    }
    let host = Host::new();
    assert_eq!(host.show(&SIZES).expect("it presents"), SHOWN);
    assert_eq!(host.show(&[[0, 0]; 50]).expect("nothing happens"), 0);
    host.assert_silence(&"all sizes");
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn fail_every_call_of_presenting() {
    let (faults, host) = (Faults::open(), Host::new());
    let of_presenter = [
        c"vkGetPhysicalDeviceSurfaceSupportKHR",
        c"vkGetPhysicalDeviceSurfaceFormatsKHR",
        c"vkGetPhysicalDeviceSurfaceCapabilitiesKHR",
        c"vkCreateFence",
        c"vkCreateSwapchainKHR",
        c"vkGetSwapchainImagesKHR",
        c"vkCreateSemaphore",
        c"vkResetFences",
        c"vkAcquireNextImageKHR",
        c"vkWaitForFences",
        c"vkQueuePresentKHR",
    ];
    let mut count = 0;
    for name in of_presenter {
        let mut turn = Some(Turn::default());
        while let Some(Turn { call, choice }) = turn {
            let (shown, happened) = faults.during(Some(name), call, choice, || host.show(&SIZES));
            match (shown, happened.result) {
                (Ok(shown), vk::Result::SUCCESS) => assert_eq!(shown, SHOWN, "{happened:?}"),
                // At most the one picture that was under way when the window changed.
                (Ok(shown), _) => assert!(shown + 1 >= SHOWN, "{happened:?}: {shown} shown"),
                (Err(error), vk::Result::ERROR_SURFACE_LOST_KHR) => {
                    assert!(matches!(error, Error::SurfaceLost) && error.exit_code() == 3, "{happened:?}: {error:?}");
                }
                (Err(error), vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::SUBOPTIMAL_KHR) => {
                    panic!("{happened:?} ended the presentation: {error}")
                }
                (Err(error), _) => check_kind(&error, &happened),
            }
            host.assert_silence(&happened);
            count += u32::from(happened.call.is_some());
            turn = turn.and_then(|turn| turn.next(&happened));
        }
    }
    assert!(count > 80, "only {count} faults");
    assert_eq!(host.show(&SIZES).expect("nothing fails any more"), SHOWN);
}

#[test]
fn f29_a_surface_that_changes_is_followed_and_one_that_is_lost_is_said_whatever_call_says_it() {
    if has_surfaces("f29_a_surface_that_changes_is_followed_and_one_that_is_lost_is_said_whatever_call_says_it") {
        run_under_layer("present::fail_every_call_of_presenting", "");
    }
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn fail_the_waits_for_an_image() {
    let (faults, host) = (Faults::open(), Host::new());
    const WAIT: Option<&CStr> = Some(c"vkWaitForFences");
    // An acquisition waits twice before it gives up, and the next one begins with waiting for it: that may fail as well.
    for (times, errors) in [(1, 0), (2, 1), (3, 2), (4, 3)] {
        for then in [[64, 48], [0, 0], [32, 16]] {
            for choice in 0..4 {
                let shown = host.present(|presenter| {
                    let tries = || (0..errors).map(|_| presenter.acquire([64, 48])).collect::<Vec<_>>();
                    let (failed, happened) = faults.during_some(WAIT, (0, times), choice, tries);
                    for tried in failed {
                        check_kind(&tried.expect_err("every wait failed"), &happened);
                    }
                    host.show_by(presenter, &[then, [64, 48]])
                });
                let expected = 1 + usize::from(then[0] > 0);
                assert_eq!(shown.expect("it presents again"), expected, "after {times} waits of result {choice}");
                host.assert_silence(&(times, then, choice));
            }
        }
    }
}

#[test]
fn f29_an_image_that_was_not_waited_for_is_waited_for_before_anything_else() {
    if has_surfaces("f29_an_image_that_was_not_waited_for_is_waited_for_before_anything_else") {
        run_under_layer("present::fail_the_waits_for_an_image", "");
    }
}
