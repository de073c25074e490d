//! Pictures on a window: a swapchain that is made, used, and made again when the window asks for it.
//!
//! For hosts, which have the window, the queue and the command buffer. A swapchain is all that this holds.

use crate::device::Device;
use crate::error::{Call, Error};
use ash::{khr, vk};
use std::sync::Arc;

/// Where to present. There is one thread for it: nobody else uses the queue during a call.
pub struct HostSurface<'a> {
    /// The loader that the instance of the device came from.
    pub entry: &'a ash::Entry,
    /// The surface. The host destroys it, after the presenter.
    pub surface: vk::SurfaceKHR,
    /// A queue of the device's family. The device has `VK_KHR_swapchain` enabled.
    pub queue: vk::Queue,
}

/// Shows one picture after another on a surface.
pub struct Presenter {
    device: Arc<Device>,
    surfaces: khr::surface::Instance,
    swapchains: khr::swapchain::Device,
    surface: vk::SurfaceKHR,
    queue: vk::Queue,
    format: vk::SurfaceFormatKHR,
    /// Signalled once an image can be drawn to.
    acquired: vk::Fence,
    /// Whether an acquisition was begun and not waited for.
    is_acquiring: bool,
    /// None while the window has no size, and at first.
    chain: Option<Chain>,
}

struct Chain {
    raw: vk::SwapchainKHR,
    /// The images, each with what signals that its picture is drawn.
    images: Vec<(vk::Image, vk::Semaphore)>,
    /// What the host asked for, which is not always what it got.
    asked: vk::Extent2D,
    extent: vk::Extent2D,
    /// Whether the surface said that another one is needed, or would suit better.
    is_stale: bool,
}

/// An image of the surface, to be drawn to and presented once.
#[derive(Debug)]
#[must_use = "an image that was acquired has to be presented"]
pub struct Target {
    index: u32,
    image: vk::Image,
    extent: vk::Extent2D,
    drawn: vk::Semaphore,
}

impl Target {
    /// How large it is, in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.extent.width, self.extent.height]
    }

    /// What the submission that draws to it has to signal.
    pub fn drawn(&self) -> vk::Semaphore {
        self.drawn
    }
}

/// How long to wait for an image before the next try: a window that is hidden may give none.
const PATIENCE_NS: u64 = 1_000_000_000;

impl Presenter {
    /// Looks at a surface. No swapchain is made yet.
    ///
    /// # Errors
    /// [`Error::Unusable`] if the device cannot present there or has no extension for it, [`Error::SurfaceLost`].
    ///
    /// # Safety
    /// The handles belong together and to the device's instance and device, and outlive the presenter.
    pub unsafe fn new(device: Arc<Device>, host: HostSurface<'_>) -> Result<Self, Error> {
        let unusable = |why: &str| Error::Unusable { device: device.info.name.clone(), why: why.to_owned() };
        // SAFETY: the device is alive, and the name is a string.
        let known =
            unsafe { device.instance.get_device_proc_addr(device.raw.handle(), c"vkCreateSwapchainKHR".as_ptr()) };
        if known.is_none() {
            return Err(unusable("VK_KHR_swapchain is not enabled"));
        }
        let surfaces = khr::surface::Instance::new(host.entry, &device.instance);
        let (physical, surface) = (device.physical, host.surface);
        // SAFETY: the surface is of this instance.
        let can = unsafe { surfaces.get_physical_device_surface_support(physical, device.queue_family, surface) }
            .call("vkGetPhysicalDeviceSurfaceSupportKHR")?;
        if !can {
            return Err(unusable("its queue cannot present to this window"));
        }
        // SAFETY: as above.
        let formats = unsafe { surfaces.get_physical_device_surface_formats(physical, surface) }
            .call("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
        // Pictures come encoded for the display: a format that encodes would do it twice.
        let plain = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
        let fits = |format: &&vk::SurfaceFormatKHR| {
            plain.contains(&format.format) && format.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
        };
        let format = *formats.iter().find(fits).ok_or_else(|| unusable("the window takes no plain 8-bit colours"))?;
        let swapchains = khr::swapchain::Device::new(&device.instance, &device.raw);
        // SAFETY: the description is empty.
        let acquired =
            unsafe { device.raw.create_fence(&vk::FenceCreateInfo::default(), None) }.call("vkCreateFence")?;
        let queue = host.queue;
        Ok(Self { device, surfaces, swapchains, surface, queue, format, acquired, is_acquiring: false, chain: None })
    }

    /// An image of the surface, for a window of so many pixels. `None` if there is nothing to draw to now: the window has
    /// no size, or it changed just now. No swapchain is kept for a window without a size; ask again when it has one.
    ///
    /// # Errors
    /// [`Error::SurfaceLost`], after which another presenter is needed, or a lack of memory or the device.
    pub fn acquire(&mut self, [width, height]: [u32; 2]) -> Result<Option<Target>, Error> {
        let asked = vk::Extent2D { width, height };
        // The image of an acquisition that was given up goes with its swapchain, which must not go before it came.
        self.wait_for_image(1)?;
        if width == 0 || height == 0 {
            self.discard();
            return Ok(None);
        }
        if self.chain.as_ref().is_none_or(|chain| chain.is_stale || chain.asked != asked) && !self.renew(asked)? {
            return Ok(None);
        }
        let Some(chain) = &mut self.chain else { return Ok(None) };
        // SAFETY: no acquisition is under way, and the fence is unsignalled once it is reset.
        let acquired = unsafe {
            self.device.raw.reset_fences(&[self.acquired]).call("vkResetFences")?;
            self.swapchains.acquire_next_image(chain.raw, PATIENCE_NS, vk::Semaphore::null(), self.acquired)
        };
        let (index, suboptimal) = match acquired {
            Ok(found) => found,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                chain.is_stale = true;
                return Ok(None);
            }
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
            Err(result) => return Err(result).call("vkAcquireNextImageKHR"),
        };
        chain.is_stale |= suboptimal;
        self.is_acquiring = true;
        let (image, drawn) = chain.images[index as usize];
        let target = Target { index, image, extent: chain.extent, drawn };
        // Until the image is there another swapchain is needed for the next one.
        let is_stale = std::mem::replace(&mut chain.is_stale, true);
        // Without memory or patience the image is acquired all the same: one more try.
        self.wait_for_image(2)?;
        if let Some(chain) = &mut self.chain {
            chain.is_stale = is_stale;
        }
        Ok(Some(target))
    }

    /// Waits so many times for the acquisition under way, if there is one.
    fn wait_for_image(&mut self, tries: u32) -> Result<(), Error> {
        if !self.is_acquiring {
            return Ok(());
        }
        // SAFETY: the fence was given to the acquisition.
        let wait = || unsafe { self.device.raw.wait_for_fences(&[self.acquired], true, PATIENCE_NS) };
        let waited = (1..tries).fold(wait(), |waited, _| waited.or_else(|_| wait()));
        if waited == Err(vk::Result::TIMEOUT) {
            return Err(Error::Timeout { seconds: f64::from(tries) * PATIENCE_NS as f64 * 1e-9, pass: None });
        }
        waited.call("vkWaitForFences")?;
        self.is_acquiring = false;
        Ok(())
    }

    /// Records a copy of a picture to the whole of a target, stretched where the sizes differ.
    ///
    /// # Safety
    /// The command buffer is in the recording state and outside of any rendering, and is submitted with a signal of
    /// [`Target::drawn`]. The picture is a colour image of this size with usage as the source of a copy, in the layout
    /// given, and all that writes to it is recorded or submitted before.
    pub unsafe fn draw(
        &self,
        to: vk::CommandBuffer,
        target: &Target,
        (picture, layout): (vk::Image, vk::ImageLayout),
        [width, height]: [u32; 2],
    ) {
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            level_count: 1,
            layer_count: 1,
            ..Default::default()
        };
        let barrier = |from: vk::ImageLayout, to: vk::ImageLayout| {
            vk::ImageMemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
                .old_layout(from)
                .new_layout(to)
                .image(target.image)
                .subresource_range(range)
        };
        let written = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        let before = [barrier(vk::ImageLayout::UNDEFINED, written)];
        let after = [barrier(written, vk::ImageLayout::PRESENT_SRC_KHR)];
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            layer_count: 1,
            ..Default::default()
        };
        let corner = |extent: vk::Extent2D| vk::Offset3D { x: extent.width as i32, y: extent.height as i32, z: 1 };
        let region = vk::ImageBlit {
            src_subresource: layers,
            src_offsets: [vk::Offset3D::default(), corner(vk::Extent2D { width, height })],
            dst_subresource: layers,
            dst_offsets: [vk::Offset3D::default(), corner(target.extent)],
        };
        let raw = &self.device.raw;
        // SAFETY: as the caller promises; the target was acquired, and its content is given up.
        unsafe {
            raw.cmd_pipeline_barrier2(to, &vk::DependencyInfo::default().image_memory_barriers(&before));
            raw.cmd_blit_image(to, picture, layout, target.image, written, &[region], vk::Filter::LINEAR);
            raw.cmd_pipeline_barrier2(to, &vk::DependencyInfo::default().image_memory_barriers(&after));
        }
    }

    /// Shows a target. Returns whether the picture was shown: not if the window changed meanwhile, and the next one will be.
    ///
    /// # Errors
    /// As for [`Presenter::acquire`].
    ///
    /// # Safety
    /// What draws to the target was submitted to the queue, with a signal of [`Target::drawn`].
    pub unsafe fn present(&mut self, target: Target) -> Result<bool, Error> {
        let Some(chain) = &mut self.chain else { return Ok(false) };
        let (chains, indices, waits) = ([chain.raw], [target.index], [target.drawn]);
        let info = vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        // SAFETY: as the caller promises.
        match unsafe { self.swapchains.queue_present(self.queue, &info) } {
            Ok(suboptimal) => {
                chain.is_stale |= suboptimal;
                Ok(true)
            }
            Err(result) => {
                // Whatever it was, the image may not have been given back.
                chain.is_stale = true;
                if result == vk::Result::ERROR_OUT_OF_DATE_KHR {
                    return Ok(false);
                }
                Err(result).call("vkQueuePresentKHR")
            }
        }
    }

    /// Makes the swapchain anew. Returns whether there is one: a window may have no size without the host's knowledge.
    fn renew(&mut self, asked: vk::Extent2D) -> Result<bool, Error> {
        self.discard();
        // SAFETY: the surface is of this instance.
        let can = unsafe { self.surfaces.get_physical_device_surface_capabilities(self.device.physical, self.surface) }
            .call("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let extent = extent_of(&can, asked);
        if extent.width == 0 || extent.height == 0 {
            return Ok(false);
        }
        let most = if can.max_image_count == 0 { u32::MAX } else { can.max_image_count };
        let alphas = can.supported_composite_alpha;
        let opaque = vk::CompositeAlphaFlagsKHR::OPAQUE;
        let first = vk::CompositeAlphaFlagsKHR::from_raw(alphas.as_raw() & alphas.as_raw().wrapping_neg());
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface)
            .min_image_count((can.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .pre_transform(can.current_transform)
            .composite_alpha(if alphas.contains(opaque) { opaque } else { first })
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true);
        // SAFETY: the surface offers all of it, and has no other swapchain.
        let raw = unsafe { self.swapchains.create_swapchain(&info, None) }.call("vkCreateSwapchainKHR")?;
        // What is made from here on is destroyed with it.
        let chain = self.chain.insert(Chain { raw, images: Vec::new(), asked, extent, is_stale: false });
        // SAFETY: the swapchain is alive.
        let images = unsafe { self.swapchains.get_swapchain_images(raw) }.call("vkGetSwapchainImagesKHR");
        let made = images.and_then(|images| {
            for image in images {
                // SAFETY: the description is empty.
                let drawn = unsafe { self.device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
                    .call("vkCreateSemaphore")?;
                chain.images.push((image, drawn));
            }
            Ok(true)
        });
        if made.is_err() {
            self.discard();
        }
        made
    }

    /// Destroys the swapchain, once the queue has done with it.
    fn discard(&mut self) {
        let Some(chain) = self.chain.take() else { return };
        // SAFETY: one thread uses the queue, as the host promised. A queue that cannot be waited for is of a lost device,
        // which does nothing any more.
        unsafe {
            let _ = self.device.raw.queue_wait_idle(self.queue);
            for (_, drawn) in chain.images {
                self.device.raw.destroy_semaphore(drawn, None);
            }
            self.swapchains.destroy_swapchain(chain.raw, None);
        }
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        // SAFETY: the fence belongs to the acquisition under way, which is waited for before its swapchain goes; one that cannot be
        // waited for is of a lost device, which does nothing any more.
        unsafe {
            if self.is_acquiring {
                let _ = self.device.raw.wait_for_fences(&[self.acquired], true, u64::MAX);
            }
            self.discard();
            self.device.raw.destroy_fence(self.acquired, None);
        }
    }
}

/// The size of a swapchain's images: the window's own where it says one, else what was asked for within its limits.
fn extent_of(can: &vk::SurfaceCapabilitiesKHR, asked: vk::Extent2D) -> vk::Extent2D {
    if can.current_extent.width != u32::MAX {
        return can.current_extent;
    }
    let (min, max) = (can.min_image_extent, can.max_image_extent);
    let within = |asked: u32, min: u32, max: u32| asked.min(max).max(min);
    vk::Extent2D {
        width: within(asked.width, min.width, max.width),
        height: within(asked.height, min.height, max.height),
    }
}

#[cfg(test)]
mod tests {
    use super::extent_of;
    use ash::vk::{Extent2D, SurfaceCapabilitiesKHR};

    #[test]
    fn f30_f31_a_window_s_own_size_goes_first_and_what_is_asked_stays_within_its_limits() {
        let extent = |width, height| Extent2D { width, height };
        let can = |current| SurfaceCapabilitiesKHR {
            current_extent: current,
            min_image_extent: extent(2, 2),
            max_image_extent: extent(4096, 4096),
            ..Default::default()
        };
        let free = can(extent(u32::MAX, u32::MAX));
        assert_eq!(extent_of(&free, extent(16384, 1)), extent(4096, 2));
        assert_eq!(extent_of(&free, extent(640, 360)), extent(640, 360));
        assert_eq!(extent_of(&can(extent(0, 0)), extent(640, 360)), extent(0, 0), "it was minimised just now");
        assert_eq!(extent_of(&can(extent(800, 600)), extent(640, 360)), extent(800, 600));
    }
}
