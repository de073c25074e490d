//! A prepared plan, written into a command buffer. Nothing here can fail.

use crate::device::{Device, c_string};
use crate::memory::{ImageObject, Object};
use crate::prepare::{Command, Program, Targets};
use crate::resources::Brought;
use crate::structures::{self, Build};
use crate::timing::Timing;
use crate::vulkan_types as to_vk;
use ash::vk;
use mica_graph::{Barrier, Draw, Extent, ImageDesc, Plan, ResourceId, Step};
use std::collections::HashMap;

/// Everything that a frame records from.
pub(crate) struct Recording<'a> {
    pub(crate) device: &'a Device,
    pub(crate) to: vk::CommandBuffer,
    pub(crate) plan: &'a Plan,
    pub(crate) commands: &'a [Command<'a>],
    pub(crate) objects: &'a HashMap<ResourceId, Object>,
    pub(crate) staging: vk::Buffer,
    /// Timestamp queries and their number; `None` where no time is measured.
    pub(crate) timestamps: Option<(vk::QueryPool, u32)>,
    /// Queries for sizes of compacted structures and their number.
    pub(crate) sizes: Option<(vk::QueryPool, u32)>,
    pub(crate) timing: Timing,
    /// Persistent images that no frame has used yet.
    pub(crate) undefined: &'a [ImageObject],
    pub(crate) hosts: &'a [Brought],
}

/// How many timestamps a frame writes.
pub(crate) fn timestamp_count(timing: Timing, passes: usize) -> u32 {
    match timing {
        Timing::Isolated => 2 * passes as u32,
        Timing::Overlapped => 2,
    }
}

const EVERYTHING: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_COMMANDS;

impl Recording<'_> {
    /// Writes the frame.
    ///
    /// # Safety
    /// The command buffer is in the recording state outside of any rendering, and every handle is alive and stays so
    /// until the device has finished the commands.
    pub(crate) unsafe fn record(&self) {
        // SAFETY: as the caller promises, for this and everything below it.
        unsafe {
            for (pool, count) in [self.timestamps, self.sizes].into_iter().flatten().filter(|(_, count)| *count > 0) {
                self.device.raw.cmd_reset_query_pool(self.to, pool, 0, count);
            }
            self.open();
            let overlapped = self.timing == Timing::Overlapped;
            if overlapped {
                self.timestamp(0);
                self.full_barrier(&[]);
            }
            for step in &self.plan.steps {
                match step {
                    Step::Synchronize { barrier, discard } => self.synchronize(barrier, discard),
                    Step::Run(pass) if overlapped => self.pass(*pass),
                    Step::Run(pass) => {
                        self.full_barrier(&[]);
                        self.device.raw.cmd_fill_buffer(self.to, self.staging, 0, 4, *pass as u32 + 1);
                        self.timestamp(2 * *pass as u32);
                        // Once more: lavapipe writes a timestamp only when something makes it flush, and without this
                        // a dispatch that binds little is over by then, and seems to have taken no time.
                        self.full_barrier(&[]);
                        self.pass(*pass);
                        self.timestamp(2 * *pass as u32 + 1);
                    }
                }
            }
            if overlapped {
                self.timestamp(1);
            }
            self.close();
        }
    }

    /// Puts the frame after everything before it, and takes images that come from outside to the general layout.
    unsafe fn open(&self) {
        let mut images = Vec::new();
        for image in self.undefined {
            images.push(into_general(image.image, &image.desc).src_stage_mask(EVERYTHING));
        }
        for brought in self.hosts {
            if let Brought::Image(host, desc) = brought {
                let arrives = host.arrives;
                let barrier = into_general(host.image, desc)
                    .old_layout(arrives.layout)
                    .src_stage_mask(arrives.stages)
                    .src_access_mask(arrives.access);
                images.push(barrier);
            }
        }
        // SAFETY: as the caller promises.
        unsafe { self.full_barrier(&images) };
    }

    /// Hands downloads to the processor, and the host's resources back in the state it wants.
    unsafe fn close(&self) {
        let everything_written =
            vk::MemoryBarrier2::default().src_stage_mask(EVERYTHING).src_access_mask(vk::AccessFlags2::MEMORY_WRITE);
        let mut memory = Vec::new();
        if self.commands.iter().any(|command| matches!(command, Command::Download { .. })) {
            let to_host = everything_written
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ);
            memory.push(to_host);
        }
        let mut images = Vec::new();
        for brought in self.hosts {
            match brought {
                Brought::Image(host, desc) => images.push(
                    vk::ImageMemoryBarrier2::default()
                        .image(host.image)
                        .subresource_range(to_vk::whole_image(desc))
                        .old_layout(vk::ImageLayout::GENERAL)
                        .new_layout(host.leaves.layout)
                        .src_stage_mask(EVERYTHING)
                        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                        .dst_stage_mask(host.leaves.stages)
                        .dst_access_mask(host.leaves.access)
                        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED),
                ),
                Brought::Buffer(host, _) => memory
                    .push(everything_written.dst_stage_mask(host.leaves_stages).dst_access_mask(host.leaves_access)),
            }
        }
        if memory.is_empty() && images.is_empty() {
            return;
        }
        let info = vk::DependencyInfo::default().memory_barriers(&memory).image_memory_barriers(&images);
        // SAFETY: as the caller promises.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.to, &info) };
    }

    /// Everything before is finished and visible to everything after.
    unsafe fn full_barrier(&self, images: &[vk::ImageMemoryBarrier2<'_>]) {
        let memory = [vk::MemoryBarrier2::default()
            .src_stage_mask(EVERYTHING)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(EVERYTHING)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
        let info = vk::DependencyInfo::default().memory_barriers(&memory).image_memory_barriers(images);
        // SAFETY: as the caller promises.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.to, &info) };
    }

    /// One barrier of the plan: memory, and the images whose old content is given up.
    unsafe fn synchronize(&self, barrier: &Barrier, discard: &[ResourceId]) {
        let from_stages = to_vk::stages(barrier.from_stages);
        let to_stages = to_vk::stages(barrier.to_stages);
        let from_access = to_vk::accesses(barrier.from_access.iter());
        let to_access = to_vk::accesses(&barrier.to_access);
        let memory = [vk::MemoryBarrier2::default()
            .src_stage_mask(from_stages)
            .src_access_mask(from_access)
            .dst_stage_mask(to_stages)
            .dst_access_mask(to_access)];
        let images: Vec<vk::ImageMemoryBarrier2<'_>> = discard
            .iter()
            .filter_map(|id| self.objects.get(id))
            .filter_map(|object| match object {
                Object::Image(image) => Some(image),
                _ => None,
            })
            .map(|image| {
                // The stages that wait are waited for too: where nothing in this frame comes first, that chains the
                // change of layout to the barrier that the frame opens with, and so to the frame before.
                into_general(image.image, &image.desc)
                    .src_stage_mask(from_stages | to_stages)
                    .src_access_mask(from_access)
                    .dst_stage_mask(to_stages)
                    .dst_access_mask(to_access)
            })
            .collect();
        let mut info = vk::DependencyInfo::default().image_memory_barriers(&images);
        if !barrier.from_stages.is_empty() {
            info = info.memory_barriers(&memory);
        }
        // SAFETY: as the caller promises.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.to, &info) };
    }

    unsafe fn timestamp(&self, query: u32) {
        if let Some((pool, _)) = self.timestamps {
            // SAFETY: as the caller promises; the query was reset and is written once.
            unsafe { self.device.raw.cmd_write_timestamp2(self.to, EVERYTHING, pool, query) };
        }
    }

    unsafe fn pass(&self, index: usize) {
        let device = &self.device.raw;
        if let Some(debug_utils) = &self.device.debug_utils {
            let name = c_string(&self.plan.passes[index].name);
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: as the caller promises; the label is ended below.
            unsafe { debug_utils.cmd_begin_debug_utils_label(self.to, &label) };
        }
        // SAFETY: as the caller promises; sizes, usages and limits were checked when the commands were prepared.
        unsafe {
            match &self.commands[index] {
                Command::Compute { program, groups: [x, y, z] } => {
                    self.bind(program);
                    device.cmd_dispatch(self.to, *x, *y, *z);
                }
                Command::ComputeIndirect { program, arguments, offset } => {
                    self.bind(program);
                    device.cmd_dispatch_indirect(self.to, *arguments, *offset);
                }
                Command::Raster { program, draws, extent, targets } => self.raster(program, draws, *extent, targets),
                Command::Upload { to, bytes, .. } => self.upload(to, bytes.start as u64),
                Command::Update { to, offset, bytes, .. } => {
                    let (src_offset, size) = (bytes.start as u64, bytes.len() as u64);
                    let region = vk::BufferCopy { src_offset, dst_offset: *offset, size };
                    device.cmd_copy_buffer(self.to, self.staging, *to, &[region]);
                }
                Command::Download { from, bytes, .. } => self.download(from, bytes.start as u64),
                Command::Copy { from, to } => self.copy(from, to),
                Command::Fill { to, word } => self.fill(to, *word),
                Command::BuildMeshes { builds, first_query } => self.build_meshes(builds, *first_query),
                Command::BuildInstances { build, bytes, .. } => self.build_instances(build, bytes.start as u64),
                Command::Compact { from, to } => self.compact(*from, *to),
            }
            if let Some(debug_utils) = &self.device.debug_utils {
                debug_utils.cmd_end_debug_utils_label(self.to);
            }
        }
    }

    unsafe fn bind(&self, program: &Program<'_>) {
        let Program { pipeline, set, params } = program;
        let device = &self.device.raw;
        // SAFETY: as the caller promises; the set was made from the pipeline's own layout.
        unsafe {
            device.cmd_bind_pipeline(self.to, pipeline.bind_point, pipeline.raw);
            device.cmd_bind_descriptor_sets(self.to, pipeline.bind_point, pipeline.layout, 0, &[*set], &[]);
            if !params.is_empty() {
                device.cmd_push_constants(self.to, pipeline.layout, pipeline.params_stages, 0, params);
            }
        }
    }

    unsafe fn raster(&self, program: &Program<'_>, draws: &[Draw], extent: Extent, targets: &Targets) {
        let device = &self.device.raw;
        // All zero, which is black, integer 0 and, depth being reversed, the far plane.
        let clear = vk::ClearValue::default();
        let attachment = |view: vk::ImageView| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(clear)
        };
        let colors: Vec<vk::RenderingAttachmentInfo<'_>> = targets.colors.iter().copied().map(attachment).collect();
        let depth = targets.depth.map(attachment);
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width: extent.width, height: extent.height },
        };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let height = extent.height as f32;
        // The height is negative, which turns clip space's y up.
        let viewport = vk::Viewport {
            x: 0.0,
            y: height,
            width: extent.width as f32,
            height: -height,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        // SAFETY: as the caller promises; the attachments have the extent, as the planner checked.
        unsafe {
            device.cmd_begin_rendering(self.to, &info);
            self.bind(program);
            device.cmd_set_viewport(self.to, 0, &[viewport]);
            device.cmd_set_scissor(self.to, 0, &[area]);
            for draw in draws {
                device.cmd_draw(self.to, draw.vertices, 1, 0, draw.instance);
            }
            device.cmd_end_rendering(self.to);
        }
    }

    /// Builds, and then asks for the sizes that compaction would leave.
    unsafe fn build_meshes(&self, builds: &[Build], first_query: u32) {
        let Some(support) = &self.device.structures else { return };
        // SAFETY: as the caller promises.
        unsafe {
            structures::record(support, self.to, &builds.iter().collect::<Vec<_>>());
            if let Some((pool, _)) = self.sizes {
                let memory = [vk::MemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR)
                    .src_access_mask(vk::AccessFlags2::ACCELERATION_STRUCTURE_WRITE_KHR)
                    .dst_stage_mask(vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR)
                    .dst_access_mask(vk::AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR)];
                let built = vk::DependencyInfo::default().memory_barriers(&memory);
                self.device.raw.cmd_pipeline_barrier2(self.to, &built);
                let all: Vec<vk::AccelerationStructureKHR> = builds.iter().map(Build::to).collect();
                let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
                support.functions.cmd_write_acceleration_structures_properties(self.to, &all, kind, pool, first_query);
            }
        }
    }

    unsafe fn build_instances(&self, build: &Build, offset: u64) {
        let Some(support) = &self.device.structures else { return };
        let build = build.read_instances_at(structures::address(self.device, self.staging) + offset);
        // SAFETY: as the caller promises; staging memory holds the records from the offset on.
        unsafe { structures::record(support, self.to, &[&build]) };
    }

    unsafe fn compact(&self, from: vk::AccelerationStructureKHR, to: vk::AccelerationStructureKHR) {
        let Some(support) = &self.device.structures else { return };
        let mode = vk::CopyAccelerationStructureModeKHR::COMPACT;
        let info = vk::CopyAccelerationStructureInfoKHR::default().src(from).dst(to).mode(mode);
        // SAFETY: as the caller promises; the copy is as large as the device said, or as the original.
        unsafe { support.functions.cmd_copy_acceleration_structure(self.to, &info) };
    }

    unsafe fn upload(&self, to: &Object, offset: u64) {
        let device = &self.device.raw;
        // SAFETY: as the caller promises; staging memory holds the whole resource from the offset on.
        unsafe {
            match to {
                Object::Buffer(buffer) => {
                    let region = vk::BufferCopy { src_offset: offset, dst_offset: 0, size: buffer.bytes };
                    device.cmd_copy_buffer(self.to, self.staging, buffer.buffer, &[region]);
                }
                Object::Image(image) => {
                    let regions = packed_regions(&image.desc, offset);
                    let layout = vk::ImageLayout::GENERAL;
                    device.cmd_copy_buffer_to_image(self.to, self.staging, image.image, layout, &regions);
                }
                // Refused when the pass was prepared, here and below.
                Object::Structure(_) => {}
            }
        }
    }

    unsafe fn download(&self, from: &Object, offset: u64) {
        let device = &self.device.raw;
        // SAFETY: as the caller promises; staging memory has room for the whole resource from the offset on.
        unsafe {
            match from {
                Object::Buffer(buffer) => {
                    let region = vk::BufferCopy { src_offset: 0, dst_offset: offset, size: buffer.bytes };
                    device.cmd_copy_buffer(self.to, buffer.buffer, self.staging, &[region]);
                }
                Object::Image(image) => {
                    let regions = packed_regions(&image.desc, offset);
                    let layout = vk::ImageLayout::GENERAL;
                    device.cmd_copy_image_to_buffer(self.to, image.image, layout, self.staging, &regions);
                }
                Object::Structure(_) => {}
            }
        }
    }

    unsafe fn copy(&self, from: &Object, to: &Object) {
        let device = &self.device.raw;
        // SAFETY: as the caller promises; both have the same description.
        unsafe {
            match (from, to) {
                (Object::Buffer(from), Object::Buffer(to)) => {
                    let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: from.bytes };
                    device.cmd_copy_buffer(self.to, from.buffer, to.buffer, &[region]);
                }
                (Object::Image(from), Object::Image(to)) => {
                    let regions: Vec<vk::ImageCopy> = (0..from.desc.mips)
                        .map(|mip| {
                            let layers = to_vk::mip_layers(&from.desc, mip);
                            vk::ImageCopy::default()
                                .src_subresource(layers)
                                .dst_subresource(layers)
                                .extent(to_vk::mip_extent(&from.desc, mip))
                        })
                        .collect();
                    let layout = vk::ImageLayout::GENERAL;
                    device.cmd_copy_image(self.to, from.image, layout, to.image, layout, &regions);
                }
                // Descriptions that are equal are of the same kind.
                _ => {}
            }
        }
    }

    unsafe fn fill(&self, to: &Object, word: u32) {
        let device = &self.device.raw;
        // SAFETY: as the caller promises.
        unsafe {
            match to {
                Object::Buffer(buffer) => device.cmd_fill_buffer(self.to, buffer.buffer, 0, vk::WHOLE_SIZE, word),
                Object::Structure(_) => {}
                Object::Image(image) => {
                    let (layout, range) = (vk::ImageLayout::GENERAL, [to_vk::whole_image(&image.desc)]);
                    if range[0].aspect_mask == vk::ImageAspectFlags::DEPTH {
                        let value = vk::ClearDepthStencilValue { depth: f32::from_bits(word), stencil: 0 };
                        device.cmd_clear_depth_stencil_image(self.to, image.image, layout, &value, &range);
                    } else {
                        // Formats of floats read these bits as floats, formats of integers as integers.
                        let value = vk::ClearColorValue { uint32: [word; 4] };
                        device.cmd_clear_color_image(self.to, image.image, layout, &value, &range);
                    }
                }
            }
        }
    }
}

/// An image on its way into the general layout, its content given up, for anything after.
fn into_general(image: vk::Image, desc: &ImageDesc) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .image(image)
        .subresource_range(to_vk::whole_image(desc))
        .old_layout(vk::ImageLayout::UNDEFINED)
        .new_layout(vk::ImageLayout::GENERAL)
        .dst_stage_mask(EVERYTHING)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
}

/// The levels of an image one after another in a buffer, each with its layers, tightly packed.
fn packed_regions(desc: &ImageDesc, offset: u64) -> Vec<vk::BufferImageCopy> {
    let mut at = offset;
    (0..desc.mips)
        .map(|mip| {
            let extent = to_vk::mip_extent(desc, mip);
            let region = vk::BufferImageCopy::default()
                .buffer_offset(at)
                .image_subresource(to_vk::mip_layers(desc, mip))
                .image_extent(extent);
            let texels = u64::from(extent.width) * u64::from(extent.height) * u64::from(extent.depth);
            at += texels * u64::from(desc.layers.max(1)) * desc.format.bytes();
            region
        })
        .collect()
}
