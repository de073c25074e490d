//! The memory that the resources of frames share, and the objects that a plan places in it.

use super::{Garbage, Resources};
use crate::device::Device;
use crate::error::Error;
use crate::memory::{self, Object};
use crate::structures;
use crate::vulkan_types as to_vk;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use mica_graph::{Access, BufferDesc, Description, Placement, Usage};
use std::collections::BTreeSet;

/// Shared memory of so many bytes is kept however little of it a frame needs.
const KEPT_BYTES: u64 = 32 << 20;

/// The memory of the frames' own resources, and the objects that the last plan placed in it.
pub(super) struct Shared {
    pub(super) allocation: Allocation,
    alignment: u64,
    memory_type_bits: u32,
    shape: Vec<Placed>,
    pub(super) objects: Vec<Object>,
    last_frame: u64,
}

/// One object in the shared memory. Plans that agree in all of these use the same objects, frame after frame.
#[derive(Clone, PartialEq, Eq)]
struct Placed {
    name: String,
    description: Description,
    accesses: BTreeSet<Access>,
    placement: Placement,
}

impl Resources {
    /// Makes the shared memory hold the objects of a plan.
    pub(super) fn place(
        &mut self,
        bytes: u64,
        placed: &[(&Usage, Placement)],
        frame: u64,
        oldest_unfinished: u64,
    ) -> Result<(), Error> {
        if placed.is_empty() {
            return Ok(());
        }
        let shape: Vec<Placed> = placed
            .iter()
            .map(|(usage, placement)| Placed {
                name: usage.resource.name.clone(),
                description: usage.resource.description,
                accesses: usage.accesses.clone(),
                placement: *placement,
            })
            .collect();
        if let Some(shared) = self.shared.as_mut().filter(|shared| shared.shape == shape) {
            shared.last_frame = frame;
            return Ok(());
        }
        let (mut alignment, mut memory_type_bits) = (self.granularity, u32::MAX);
        for (usage, _) in placed {
            let needed = self.requirements(&usage.resource, &usage.accesses)?;
            alignment = alignment.max(needed.alignment);
            memory_type_bits &= needed.memory_type_bits;
        }
        self.fit_shared(bytes, alignment, memory_type_bits, placed, oldest_unfinished)?;
        let Some(shared) = &mut self.shared else { return Ok(()) };
        let old = std::mem::take(&mut shared.objects);
        shared.shape.clear();
        self.garbage.push(Garbage { objects: old, allocation: None, last_frame: shared.last_frame });
        for (usage, placement) in placed {
            match create_placed(&self.device, usage, &shared.allocation, placement.offset) {
                Ok(object) => shared.objects.push(object),
                Err(error) => {
                    let objects = std::mem::take(&mut shared.objects);
                    self.garbage.push(Garbage { objects, allocation: None, last_frame: 0 });
                    return Err(error);
                }
            }
        }
        shared.shape = shape;
        shared.last_frame = frame;
        Ok(())
    }

    /// Keeps the shared memory if it is large enough and of a fitting kind, and takes another if it is not.
    fn fit_shared(
        &mut self,
        bytes: u64,
        alignment: u64,
        memory_type_bits: u32,
        placed: &[(&Usage, Placement)],
        oldest_unfinished: u64,
    ) -> Result<(), Error> {
        // What a build once needed is given back, as a frame without it needs far less.
        let is_wasteful = |size: u64| size > KEPT_BYTES && size / 4 > bytes;
        let fits = |shared: &Shared| {
            shared.allocation.size() >= bytes
                && !is_wasteful(shared.allocation.size())
                && shared.alignment >= alignment
                && shared.memory_type_bits & memory_type_bits == shared.memory_type_bits
        };
        if self.shared.as_ref().is_some_and(fits) {
            return Ok(());
        }
        if let Some(Shared { allocation, objects, last_frame, .. }) = self.shared.take() {
            self.garbage.push(Garbage { objects, allocation: Some(allocation), last_frame });
            self.collect(oldest_unfinished);
        }
        let largest = placed.iter().max_by_key(|(_, placement)| placement.bytes);
        let what = match largest {
            Some((usage, _)) => format!("frame (shared; its largest resource is {})", usage.resource.name),
            None => "frame (shared)".to_owned(),
        };
        if memory_type_bits == 0 {
            let why = "its images and buffers have no type of memory in common on this device".to_owned();
            return Err(Error::BadResource { resource: what, why });
        }
        let requirements = vk::MemoryRequirements { size: bytes, alignment, memory_type_bits };
        let allocation = self.memory.allocate(&what, requirements, MemoryLocation::GpuOnly, false)?;
        self.shared = Some(Shared {
            allocation,
            alignment,
            memory_type_bits,
            shape: Vec::new(),
            objects: Vec::new(),
            last_frame: 0,
        });
        Ok(())
    }
}

fn create_placed(device: &Device, usage: &Usage, allocation: &Allocation, offset: u64) -> Result<Object, Error> {
    let what = &usage.resource.name;
    let buffer = |desc: BufferDesc| {
        let object = memory::create_buffer(device, what, desc)?;
        let bound = memory::bind_buffer(device, what, object.buffer, allocation, offset);
        bound.inspect_err(|_| {
            // SAFETY: nothing has used the buffer.
            unsafe { device.raw.destroy_buffer(object.buffer, None) }
        })?;
        Ok(Object::Buffer(object))
    };
    match &usage.resource.description {
        Description::Buffer(desc) => buffer(*desc),
        Description::Scratch(desc) => buffer(BufferDesc { bytes: structures::sizes(device, what, desc)?.scratch }),
        // Refused when its requirements were asked for.
        Description::Structure(_) => Err(Error::Unbound { resource: what.clone() }),
        Description::Image(desc) => {
            let flags = to_vk::image_usage(&usage.accesses);
            let image = memory::create_image(device, what, desc, flags)?;
            let made = memory::bind_image(device, what, image, allocation, offset)
                .and_then(|()| memory::create_views(device, what, image, desc, flags));
            let object = made.inspect_err(|_| {
                // SAFETY: nothing has used the image.
                unsafe { device.raw.destroy_image(image, None) }
            })?;
            Ok(Object::Image(object))
        }
    }
}
