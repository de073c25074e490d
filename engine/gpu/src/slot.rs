//! What one frame needs until the device has finished it: descriptor sets, staging memory, timestamps.

use crate::device::Device;
use crate::error::{Call, Error};
use crate::memory::{self, BufferObject, Memory, Object};
use crate::structures::SizeQueries;
use crate::timing::Timestamps;
use crate::vulkan_types as to_vk;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use mica_graph::{BufferDesc, Plan};
use std::collections::BTreeMap;

/// One frame's own objects, used again by a later frame.
#[derive(Default)]
pub(crate) struct Slot {
    /// The frame that uses it; `None` once that is finished.
    pub(crate) frame: Option<u64>,
    descriptors: Option<Descriptors>,
    pub(crate) staging: Option<Staging>,
    pub(crate) timestamps: Option<Timestamps>,
    pub(crate) sizes: Option<SizeQueries>,
}

struct Descriptors {
    pool: vk::DescriptorPool,
    sets: u32,
    counts: BTreeMap<i32, u32>,
}

/// Memory that both the host and the device see, for uploads and downloads.
pub(crate) struct Staging {
    pub(crate) buffer: BufferObject,
    pub(crate) allocation: Allocation,
}

impl Staging {
    /// What an isolated frame noted last, whether or not it has ended.
    pub(crate) fn marker(&self) -> u32 {
        // SAFETY: the memory is mapped while the allocation lives, and its start is aligned. The device may write to it
        // meanwhile: a volatile read of one word gets the old or the new value.
        self.allocation.mapped_ptr().map_or(0, |start| unsafe { start.cast::<u32>().as_ptr().read_volatile() })
    }
}

impl Slot {
    /// An empty pool with room for the sets of a plan.
    pub(crate) fn ready_descriptors(&mut self, device: &Device, plan: &Plan) -> Result<vk::DescriptorPool, Error> {
        let mut counts: BTreeMap<i32, u32> = BTreeMap::new();
        let mut sets = 0;
        for shader in plan.passes.iter().filter_map(|pass| pass.work.shader()) {
            sets += 1;
            for binding in shader.bindings {
                *counts.entry(to_vk::descriptor_type(binding.kind).as_raw()).or_default() += 1;
            }
        }
        if let Some(ready) = self.descriptors.as_ref().filter(|ready| ready.holds(sets, &counts)) {
            // SAFETY: the frame that used the sets of this pool is finished.
            unsafe { device.raw.reset_descriptor_pool(ready.pool, vk::DescriptorPoolResetFlags::empty()) }
                .call("vkResetDescriptorPool")?;
            return Ok(ready.pool);
        }
        if let Some(old) = self.descriptors.take() {
            // SAFETY: the frame that used the sets of this pool is finished.
            unsafe { device.raw.destroy_descriptor_pool(old.pool, None) };
        }
        let mut sizes: Vec<vk::DescriptorPoolSize> = counts
            .iter()
            .map(|(kind, count)| vk::DescriptorPoolSize {
                ty: vk::DescriptorType::from_raw(*kind),
                descriptor_count: *count,
            })
            .collect();
        if sizes.is_empty() {
            sizes.push(vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: 1 });
        }
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets.max(1)).pool_sizes(&sizes);
        // SAFETY: there is at least one set and one descriptor.
        let pool = unsafe { device.raw.create_descriptor_pool(&info, None) }.call("vkCreateDescriptorPool")?;
        self.descriptors = Some(Descriptors { pool, sets, counts });
        Ok(pool)
    }

    /// Staging memory of at least so many bytes. What is there is kept, unless it is much too large.
    pub(crate) fn ready_staging(&mut self, memory: &mut Memory, device: &Device, bytes: u64) -> Result<(), Error> {
        let fits = |staging: &Staging| staging.buffer.bytes >= bytes && staging.buffer.bytes <= bytes.saturating_mul(4);
        if self.staging.as_ref().is_some_and(fits) {
            return Ok(());
        }
        self.drop_staging(memory, device);
        if bytes > 0 {
            let (buffer, allocation) = memory.buffer("staging", BufferDesc { bytes }, MemoryLocation::GpuToCpu)?;
            self.staging = Some(Staging { buffer, allocation });
        }
        Ok(())
    }

    /// Queries for so many timestamps.
    pub(crate) fn ready_timestamps(&mut self, device: &Device, count: u32) -> Result<(), Error> {
        if self.timestamps.as_ref().is_some_and(|ready| ready.holds(count)) {
            return Ok(());
        }
        if let Some(old) = self.timestamps.take() {
            // SAFETY: the frame that used the queries is finished.
            unsafe { device.raw.destroy_query_pool(old.pool, None) };
        }
        self.timestamps = Some(Timestamps::new(device, count)?);
        Ok(())
    }

    /// Queries for so many sizes of compacted structures.
    pub(crate) fn ready_sizes(&mut self, device: &Device, count: u32) -> Result<(), Error> {
        if count == 0 || self.sizes.as_ref().is_some_and(|ready| ready.holds(count)) {
            return Ok(());
        }
        if let Some(old) = self.sizes.take() {
            // SAFETY: the frame that used the queries is finished.
            unsafe { device.raw.destroy_query_pool(old.pool, None) };
        }
        self.sizes = Some(SizeQueries::new(device, count)?);
        Ok(())
    }

    fn drop_staging(&mut self, memory: &mut Memory, device: &Device) {
        if let Some(Staging { buffer, allocation }) = self.staging.take() {
            // SAFETY: the frame that used it is finished.
            unsafe { memory::destroy(device, &Object::Buffer(buffer)) };
            memory.free(allocation);
        }
    }

    /// Destroys everything. The executor has waited for the device.
    pub(crate) fn destroy(&mut self, memory: &mut Memory, device: &Device) {
        self.drop_staging(memory, device);
        // SAFETY: the device has finished all work.
        unsafe {
            if let Some(descriptors) = self.descriptors.take() {
                device.raw.destroy_descriptor_pool(descriptors.pool, None);
            }
            if let Some(timestamps) = self.timestamps.take() {
                device.raw.destroy_query_pool(timestamps.pool, None);
            }
            if let Some(sizes) = self.sizes.take() {
                device.raw.destroy_query_pool(sizes.pool, None);
            }
        }
    }
}

impl Descriptors {
    fn holds(&self, sets: u32, counts: &BTreeMap<i32, u32>) -> bool {
        let enough = |(kind, count): (&i32, &u32)| self.counts.get(kind).is_some_and(|have| have >= count);
        self.sets >= sets && counts.iter().all(enough)
    }
}
