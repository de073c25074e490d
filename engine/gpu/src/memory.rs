//! Device memory and the objects in it, within the number of bytes that the host granted.

use crate::device::Device;
use crate::error::{Call, Error};
use crate::structures::{self, StructureObject};
use crate::vulkan_types as to_vk;
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings, MemoryLocation};
use mica_graph::{BufferDesc, Description, ImageDesc, StructureDesc};
use std::mem::ManuallyDrop;
use std::sync::Arc;

const MIB: u64 = 1 << 20;

/// An image or a buffer with what is needed to use it. A plain set of handles: whoever made it destroys it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Object {
    Image(ImageObject),
    Buffer(BufferObject),
    Structure(StructureObject),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct ImageObject {
    pub(crate) image: vk::Image,
    pub(crate) desc: ImageDesc,
    /// What it was created for.
    pub(crate) usage: vk::ImageUsageFlags,
    /// All levels and layers; null where no use needs a view.
    pub(crate) all: vk::ImageView,
    /// The first level of all layers; the same as `all` where there is one level.
    pub(crate) base: vk::ImageView,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct BufferObject {
    pub(crate) buffer: vk::Buffer,
    pub(crate) bytes: u64,
}

/// The allocator, and the count of what it gave out.
pub(crate) struct Memory {
    device: Arc<Device>,
    /// Dropped by hand, as it must not be where the device hangs.
    allocator: ManuallyDrop<Allocator>,
    limit: Option<u64>,
    used: u64,
}

impl Memory {
    pub(crate) fn new(device: Arc<Device>, limit: Option<u64>) -> Result<Self, Error> {
        // Blocks small enough that a few of them, the last one part empty, stay below the limit.
        let block = limit.map_or(64 * MIB, |limit| (limit / 8).clamp(4 * MIB, 64 * MIB) / (4 * MIB) * (4 * MIB));
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: device.instance.clone(),
            device: device.raw.clone(),
            physical_device: device.physical,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: device.structures.is_some(),
            allocation_sizes: AllocationSizes::new(block, block.min(16 * MIB)),
        })
        .map_err(|error| out_of_memory("the allocator", 0, &error))?;
        Ok(Self { device, allocator: ManuallyDrop::new(allocator), limit, used: 0 })
    }

    /// Takes memory, but never more than the limit in whole blocks.
    pub(crate) fn allocate(
        &mut self,
        what: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, Error> {
        let bytes = requirements.size;
        let over_limit = |used: u64, limit| Error::MemoryLimit { what: what.to_owned(), bytes, used, limit };
        if let Some(limit) = self.limit.filter(|limit| bytes > limit.saturating_sub(self.used)) {
            return Err(over_limit(self.used, limit));
        }
        let mut within = |allocation_scheme| {
            let desc = AllocationCreateDesc { name: what, requirements, location, linear, allocation_scheme };
            let allocation = self.allocator.allocate(&desc).map_err(|error| out_of_memory(what, bytes, &error))?;
            let used = self.allocator.capacity();
            match self.limit.filter(|limit| used > *limit) {
                Some(limit) => {
                    let _ = self.allocator.free(allocation);
                    Err(over_limit(used, limit))
                }
                None => Ok(allocation),
            }
        };
        // Where a block for several is too much, one of just this size may not be. It is dedicated to nothing in particular.
        let alone = AllocationScheme::DedicatedBuffer(vk::Buffer::null());
        let allocation = within(AllocationScheme::GpuAllocatorManaged).or_else(|_| within(alone))?;
        self.used += allocation.size();
        Ok(allocation)
    }

    pub(crate) fn free(&mut self, allocation: Allocation) {
        self.used -= allocation.size();
        if let Err(error) = self.allocator.free(allocation) {
            log::warn!("memory was not given back: {error}");
        }
    }

    /// A buffer with memory of its own.
    pub(crate) fn buffer(
        &mut self,
        what: &str,
        desc: BufferDesc,
        location: MemoryLocation,
    ) -> Result<(BufferObject, Allocation), Error> {
        self.buffer_for(what, desc, buffer_usage(&self.device), location)
    }

    fn buffer_for(
        &mut self,
        what: &str,
        desc: BufferDesc,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<(BufferObject, Allocation), Error> {
        let device = self.device.clone();
        let object = create_buffer_for(&device, what, desc, usage)?;
        // SAFETY: the buffer is alive.
        let mut requirements = unsafe { device.raw.get_buffer_memory_requirements(object.buffer) };
        requirements.alignment = requirements.alignment.max(structures::INSTANCE_ALIGNMENT);
        let allocation = self.allocate(what, requirements, location, true);
        let bound = allocation.and_then(|allocation| {
            let bound = bind_buffer(&device, what, object.buffer, &allocation, 0);
            self.keep_if(bound, allocation)
        });
        match bound {
            Ok(allocation) => Ok((object, allocation)),
            Err(error) => {
                // SAFETY: nothing has used the buffer.
                unsafe { device.raw.destroy_buffer(object.buffer, None) };
                Err(error)
            }
        }
    }

    /// An acceleration structure of so many bytes with memory of its own.
    pub(crate) fn structure(
        &mut self,
        what: &str,
        desc: &StructureDesc,
        bytes: u64,
    ) -> Result<(StructureObject, Allocation), Error> {
        let device = self.device.clone();
        let usage =
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let (buffer, allocation) = self.buffer_for(what, BufferDesc { bytes }, usage, MemoryLocation::GpuOnly)?;
        match structures::create(&device, what, desc, buffer) {
            Ok(object) => Ok((object, allocation)),
            Err(error) => {
                // SAFETY: nothing has used the buffer.
                unsafe { device.raw.destroy_buffer(buffer.buffer, None) };
                self.free(allocation);
                Err(error)
            }
        }
    }

    /// An image with memory of its own, and its views.
    pub(crate) fn image(
        &mut self,
        what: &str,
        desc: &ImageDesc,
        usage: vk::ImageUsageFlags,
    ) -> Result<(ImageObject, Allocation), Error> {
        let device = self.device.clone();
        let image = create_image(&device, what, desc, usage)?;
        // SAFETY: the image is alive.
        let requirements = unsafe { device.raw.get_image_memory_requirements(image) };
        let allocation = self.allocate(what, requirements, MemoryLocation::GpuOnly, false);
        let made = allocation.and_then(|allocation| {
            let made = bind_image(&device, what, image, &allocation, 0)
                .and_then(|()| create_views(&device, what, image, desc, usage));
            match made {
                Ok(object) => Ok((object, allocation)),
                Err(error) => {
                    self.free(allocation);
                    Err(error)
                }
            }
        });
        if made.is_err() {
            // SAFETY: nothing has used the image.
            unsafe { device.raw.destroy_image(image, None) };
        }
        made
    }

    fn keep_if(&mut self, result: Result<(), Error>, allocation: Allocation) -> Result<Allocation, Error> {
        match result {
            Ok(()) => Ok(allocation),
            Err(error) => {
                self.free(allocation);
                Err(error)
            }
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // A device that hangs may still write to the blocks: they are left to it.
        if self.device.may_destroy() {
            // SAFETY: the allocator is not used again, and whatever was bound to its blocks is destroyed.
            unsafe { ManuallyDrop::drop(&mut self.allocator) };
        }
    }
}

fn out_of_memory(what: &str, bytes: u64, error: &gpu_allocator::AllocationError) -> Error {
    Error::OutOfMemory { what: what.to_owned(), bytes, detail: error.to_string() }
}

/// How a buffer is created.
pub(crate) fn buffer_info(device: &Device, desc: BufferDesc) -> vk::BufferCreateInfo<'static> {
    vk::BufferCreateInfo::default().size(desc.bytes).usage(buffer_usage(device))
}

fn buffer_usage(device: &Device) -> vk::BufferUsageFlags {
    match &device.structures {
        Some(_) => to_vk::BUFFER_USAGE | to_vk::BUILD_USAGE,
        None => to_vk::BUFFER_USAGE,
    }
}

/// How an image is created.
pub(crate) fn image_info(desc: &ImageDesc, usage: vk::ImageUsageFlags) -> vk::ImageCreateInfo<'static> {
    vk::ImageCreateInfo::default()
        .image_type(to_vk::image_type(desc))
        .format(to_vk::format(desc.format))
        .extent(to_vk::extent(desc.extent))
        .mip_levels(desc.mips)
        .array_layers(desc.layers.max(1))
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(usage)
}

/// A buffer without memory.
pub(crate) fn create_buffer(device: &Device, what: &str, desc: BufferDesc) -> Result<BufferObject, Error> {
    create_buffer_for(device, what, desc, buffer_usage(device))
}

fn create_buffer_for(
    device: &Device,
    what: &str,
    desc: BufferDesc,
    usage: vk::BufferUsageFlags,
) -> Result<BufferObject, Error> {
    let info = buffer_info(device, desc).usage(usage);
    // SAFETY: size and usage are valid: a plan has no empty buffers, and `check_resource` knows the largest.
    let buffer = unsafe { device.raw.create_buffer(&info, None) }.making("vkCreateBuffer", what, desc.bytes)?;
    device.set_name(buffer, what);
    Ok(BufferObject { buffer, bytes: desc.bytes })
}

/// An image without memory.
pub(crate) fn create_image(
    device: &Device,
    what: &str,
    desc: &ImageDesc,
    usage: vk::ImageUsageFlags,
) -> Result<vk::Image, Error> {
    // SAFETY: `check_resource` asked the driver whether it supports this very description.
    let image = unsafe { device.raw.create_image(&image_info(desc, usage), None) }.making(
        "vkCreateImage",
        what,
        desc.bytes(),
    )?;
    device.set_name(image, what);
    Ok(image)
}

/// Gives a buffer its place, `offset` bytes into the allocation.
pub(crate) fn bind_buffer(
    device: &Device,
    what: &str,
    buffer: vk::Buffer,
    allocation: &Allocation,
    offset: u64,
) -> Result<(), Error> {
    // SAFETY: the allocation was made for the requirements of this buffer, or of a plan with it at this offset.
    unsafe { device.raw.bind_buffer_memory(buffer, allocation.memory(), allocation.offset() + offset) }.making(
        "vkBindBufferMemory",
        what,
        0,
    )
}

/// Gives an image its place, `offset` bytes into the allocation.
pub(crate) fn bind_image(
    device: &Device,
    what: &str,
    image: vk::Image,
    allocation: &Allocation,
    offset: u64,
) -> Result<(), Error> {
    // SAFETY: the allocation was made for the requirements of this image, or of a plan with it at this offset.
    unsafe { device.raw.bind_image_memory(image, allocation.memory(), allocation.offset() + offset) }.making(
        "vkBindImageMemory",
        what,
        0,
    )
}

/// The views of an image that has memory.
pub(crate) fn create_views(
    device: &Device,
    what: &str,
    image: vk::Image,
    desc: &ImageDesc,
    usage: vk::ImageUsageFlags,
) -> Result<ImageObject, Error> {
    let null = vk::ImageView::null();
    if !usage.intersects(to_vk::VIEWED) {
        return Ok(ImageObject { image, desc: *desc, usage, all: null, base: null });
    }
    let view = |levels: u32| {
        let range = vk::ImageSubresourceRange { level_count: levels, ..to_vk::whole_image(desc) };
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(to_vk::view_type(desc))
            .format(to_vk::format(desc.format))
            .subresource_range(range);
        // SAFETY: the image has memory, and a usage that views are for.
        unsafe { device.raw.create_image_view(&info, None) }.making("vkCreateImageView", what, 0)
    };
    let all = view(desc.mips)?;
    device.set_name(all, what);
    if desc.mips == 1 {
        return Ok(ImageObject { image, desc: *desc, usage, all, base: all });
    }
    match view(1) {
        Ok(base) => {
            device.set_name(base, what);
            Ok(ImageObject { image, desc: *desc, usage, all, base })
        }
        Err(error) => {
            // SAFETY: nothing has used the view.
            unsafe { device.raw.destroy_image_view(all, None) };
            Err(error)
        }
    }
}

/// Destroys what stands behind an object.
///
/// # Safety
/// The device has finished all work that uses it, and nothing uses it afterwards.
pub(crate) unsafe fn destroy(device: &Device, object: &Object) {
    // SAFETY: as the caller promises; destroying a null view does nothing.
    unsafe {
        match object {
            Object::Buffer(buffer) => device.raw.destroy_buffer(buffer.buffer, None),
            Object::Structure(structure) => structures::destroy(device, structure),
            Object::Image(image) => {
                if image.base != image.all {
                    device.raw.destroy_image_view(image.base, None);
                }
                device.raw.destroy_image_view(image.all, None);
                device.raw.destroy_image(image.image, None);
            }
        }
    }
}

/// Whether the device can hold the resource at all, memory aside.
pub(crate) fn check_resource(
    device: &Device,
    what: &str,
    description: &Description,
    usage: vk::ImageUsageFlags,
) -> Result<(), Error> {
    let bad = |why: String| Err(Error::BadResource { resource: what.to_owned(), why });
    let limits = &device.info.limits;
    let buffer_of = |bytes: u64| {
        let most = limits.max_buffer_bytes;
        if bytes <= most {
            return Ok(());
        }
        bad(format!("{bytes} bytes are more than a buffer of this device holds, {most}"))
    };
    match description {
        Description::Buffer(desc) => buffer_of(desc.bytes),
        Description::Structure(desc) => buffer_of(structures::sizes(device, what, desc)?.structure),
        Description::Scratch(desc) => buffer_of(structures::sizes(device, what, desc)?.scratch),
        Description::Image(desc) => {
            if desc.extent.depth > 1 && desc.layers > 0 {
                return bad("a volume has no layers".to_owned());
            }
            // SAFETY: the physical device is of this instance.
            let properties = unsafe {
                device.instance.get_physical_device_image_format_properties(
                    device.physical,
                    to_vk::format(desc.format),
                    to_vk::image_type(desc),
                    vk::ImageTiling::OPTIMAL,
                    usage,
                    vk::ImageCreateFlags::empty(),
                )
            };
            let most = match properties {
                Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED) => {
                    return bad(format!("this device has no {:?} images for {usage:?}", desc.format));
                }
                asked => asked.call("vkGetPhysicalDeviceImageFormatProperties")?,
            };
            let (size, max) = (desc.extent, most.max_extent);
            if size.width > max.width || size.height > max.height || size.depth > max.depth {
                let (has, can) = ((size.width, size.height, size.depth), (max.width, max.height, max.depth));
                return bad(format!("{has:?} texels are more than an image of this device holds, {can:?}"));
            }
            let full_chain = 32 - size.width.max(size.height).max(size.depth).leading_zeros();
            if desc.mips == 0 || desc.mips > full_chain.min(most.max_mip_levels) {
                return bad(format!("{} levels do not fit its size", desc.mips));
            }
            if desc.layers > most.max_array_layers {
                return bad(format!("{} layers are more than this device has, {}", desc.layers, most.max_array_layers));
            }
            Ok(())
        }
    }
}
