//! Every call that makes something fails once: an error comes back, nothing leaks, and the next try succeeds.

use crate::common::host::Host;
use crate::common::{bind, bytes_of, color, compute, depth, raster, words};
use ash::vk;
use mica_gpu::{Error, Executor, Timing};
use mica_graph::{
    Access, BindingKind, Buffer, Download, Draw, Extent, Format, Graph, Image, ImageDesc, Lifetime, Work,
};
use std::cell::Cell;
use std::sync::OnceLock;

thread_local! {
    /// How many calls still succeed before one fails; `None` where all do.
    static LEFT: Cell<Option<u32>> = const { Cell::new(None) };
    /// How many calls failed.
    static FAILED: Cell<u32> = const { Cell::new(0) };
}

/// Whether this call is the one to fail.
fn fails() -> bool {
    let left = LEFT.get();
    LEFT.set(left.and_then(|left| left.checked_sub(1)));
    FAILED.set(FAILED.get() + u32::from(left == Some(0)));
    left == Some(0)
}

/// Puts a function that may fail in the place of one in a table.
macro_rules! make_faulty {
    ($table:ident.$name:ident: $type:ty, ($($argument:ident: $of:ty),*)) => {{
        static REAL: OnceLock<$type> = OnceLock::new();
        unsafe extern "system" fn faulty($($argument: $of),*) -> vk::Result {
            if fails() {
                return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
            }
            // SAFETY: the arguments are those of the caller, and the function was set before this one could be called.
            unsafe { REAL.get().expect("the real function")($($argument),*) }
        }
        REAL.get_or_init(|| $table.$name);
        $table.$name = faulty;
    }};
}

type Callbacks<'a> = *const vk::AllocationCallbacks<'a>;

/// The host's device with functions that fail on demand.
fn faulty_device(host: &Host) -> ash::Device {
    let mut table = host.device.fp_v1_0().clone();
    make_faulty!(table.allocate_memory: vk::PFN_vkAllocateMemory,
        (device: vk::Device, info: *const vk::MemoryAllocateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::DeviceMemory));
    make_faulty!(table.create_buffer: vk::PFN_vkCreateBuffer,
        (device: vk::Device, info: *const vk::BufferCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::Buffer));
    make_faulty!(table.create_image: vk::PFN_vkCreateImage,
        (device: vk::Device, info: *const vk::ImageCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::Image));
    make_faulty!(table.create_image_view: vk::PFN_vkCreateImageView,
        (device: vk::Device, info: *const vk::ImageViewCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::ImageView));
    make_faulty!(table.bind_buffer_memory: vk::PFN_vkBindBufferMemory,
        (device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, offset: vk::DeviceSize));
    make_faulty!(table.bind_image_memory: vk::PFN_vkBindImageMemory,
        (device: vk::Device, image: vk::Image, memory: vk::DeviceMemory, offset: vk::DeviceSize));
    make_faulty!(table.create_sampler: vk::PFN_vkCreateSampler,
        (device: vk::Device, info: *const vk::SamplerCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::Sampler));
    make_faulty!(table.create_pipeline_cache: vk::PFN_vkCreatePipelineCache,
        (device: vk::Device, info: *const vk::PipelineCacheCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::PipelineCache));
    make_faulty!(table.create_shader_module: vk::PFN_vkCreateShaderModule,
        (device: vk::Device, info: *const vk::ShaderModuleCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::ShaderModule));
    make_faulty!(table.create_pipeline_layout: vk::PFN_vkCreatePipelineLayout,
        (device: vk::Device, info: *const vk::PipelineLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::PipelineLayout));
    make_faulty!(table.create_descriptor_set_layout: vk::PFN_vkCreateDescriptorSetLayout,
        (device: vk::Device, info: *const vk::DescriptorSetLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::DescriptorSetLayout));
    make_faulty!(table.create_compute_pipelines: vk::PFN_vkCreateComputePipelines,
        (device: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::ComputePipelineCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::Pipeline));
    make_faulty!(table.create_graphics_pipelines: vk::PFN_vkCreateGraphicsPipelines,
        (device: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::GraphicsPipelineCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::Pipeline));
    make_faulty!(table.create_descriptor_pool: vk::PFN_vkCreateDescriptorPool,
        (device: vk::Device, info: *const vk::DescriptorPoolCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::DescriptorPool));
    make_faulty!(table.allocate_descriptor_sets: vk::PFN_vkAllocateDescriptorSets,
        (device: vk::Device, info: *const vk::DescriptorSetAllocateInfo<'_>, made: *mut vk::DescriptorSet));
    make_faulty!(table.create_query_pool: vk::PFN_vkCreateQueryPool,
        (device: vk::Device, info: *const vk::QueryPoolCreateInfo<'_>, callbacks: Callbacks<'_>, made: *mut vk::QueryPool));
    let device = &host.device;
    ash::Device::from_parts_1_3(
        device.handle(),
        table,
        device.fp_v1_1().clone(),
        device.fp_v1_2().clone(),
        device.fp_v1_3().clone(),
    )
}

/// A frame that makes one of everything, and leaves its result in a download.
struct Frame {
    history: Image,
    table: Buffer,
    shaders: [&'static mica_graph::Shader; 2],
}

impl Frame {
    fn new() -> Self {
        let vertex =
            "void main() { gl_Position = vec4(gl_VertexIndex == 1 ? 3 : -1, gl_VertexIndex == 2 ? 3 : -1, 0.5, 1); }";
        let fragment = "layout(location = 0) out vec4 color; void main() { color = vec4(0.5); }";
        let glsl = "
            layout(local_size_x = 8, local_size_y = 8) in;
            layout(binding = 0) uniform texture2D b0;
            layout(binding = 1) uniform sampler b1;
            layout(binding = 2, r32f) uniform image2D b2;
            layout(binding = 3) readonly buffer B3 { float b3[]; };
            void main() {
              ivec2 at = ivec2(gl_GlobalInvocationID.xy);
              float drawn = textureLod(sampler2D(b0, b1), (vec2(at) + 0.5) / 8.0, 0).x;
              imageStore(b2, at, vec4(drawn + b3[at.x]));
            }";
        let bindings = [
            (0, BindingKind::SampledImage, Access::Sampled),
            (1, BindingKind::Sampler(mica_graph::Sampler::Nearest), Access::Sampled),
            (2, BindingKind::StorageImage, Access::StorageReadWrite),
            (3, BindingKind::StorageBuffer, Access::StorageRead),
        ];
        let desc = ImageDesc { mips: 2, ..ImageDesc::new(Format::R32Float, Extent::new(8, 8)) };
        Self {
            history: Image::new("history", desc, Lifetime::Scene),
            table: Buffer::new("table", 32, Lifetime::Settings),
            shaders: [
                raster("draw", (vertex, fragment), 0, &["color"], &[]),
                compute("add", glsl, [8, 8, 1], 0, &bindings),
            ],
        }
    }

    fn declare(&mut self) -> (Graph, Download) {
        let extent = Extent::new(8, 8);
        let mut graph = Graph::new();
        graph.upload(&mut self.table, bytes_of(&[1.0_f32.to_bits(); 8]));
        let drawn = graph.image("drawn", Format::Rgba16Float, extent);
        let depths = graph.image("depth", Format::Depth32, extent);
        let draws = [Draw { vertices: 3, instance: 0 }].into();
        let uses = vec![color(0, drawn.resource()), depth(depths.resource())];
        graph.push("draw", Work::Raster { shader: self.shaders[0], params: Vec::new(), draws, extent }, uses);
        graph.clear(&mut self.history, 0.0);
        let uses = vec![
            bind(0, drawn.resource(), Access::Sampled),
            bind(2, self.history.resource(), Access::StorageReadWrite),
            bind(3, self.table.resource(), Access::StorageRead),
        ];
        graph.push("add", Work::Compute { shader: self.shaders[1], params: Vec::new(), groups: [1; 3] }, uses);
        let download = graph.download_image(&self.history);
        (graph, download)
    }
}

/// Records, submits and finishes a frame.
fn run(host: &Host, executor: &mut Executor, frame: &mut Frame) -> Result<Vec<u32>, Error> {
    let (graph, download) = frame.declare();
    let commands = host.begin();
    // SAFETY: the command buffer was just begun, and is submitted and waited for below.
    let recorded = unsafe { executor.record(graph, commands, Timing::Isolated) }?;
    host.end_and_submit(commands);
    // SAFETY: the host waited for the frame.
    let mut run = unsafe { executor.finish(recorded) }?;
    Ok(words(&run.take(download)))
}

#[test]
fn f24_any_one_call_may_fail_and_the_next_try_succeeds() {
    let host = Host::new();
    let faulty = faulty_device(&host);
    let device = host.lend_table(&faulty);
    let mut frame = Frame::new();
    // Until a try meets no failure any more: then each of its calls has failed once.
    for calls in 0.. {
        LEFT.set(Some(calls));
        let made = Executor::new(device.clone());
        let result = made.and_then(|mut executor| {
            let first = run(&host, &mut executor, &mut frame);
            LEFT.set(None);
            let second = run(&host, &mut executor, &mut frame).expect("nothing fails any more");
            assert_eq!(second[..64], [1.5_f32.to_bits(); 64], "the frame after failure {calls}");
            first
        });
        LEFT.set(None);
        match result {
            // A pipeline cache that cannot be filled from a file is tried again empty: that failure is no error.
            Ok(first) => assert_eq!(first[..64], [1.5_f32.to_bits(); 64]),
            Err(error) => {
                assert_eq!(error.exit_code(), 4, "call {calls}: {error:?}");
                assert!(error.to_string().starts_with("out of memory: "), "{error}");
            }
        }
        if FAILED.get() == calls {
            assert!(calls > 30, "only {calls} calls could fail");
            return;
        }
    }
}
