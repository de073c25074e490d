//! Compute passes: exact numbers, memory shared by resources, and what is refused.

use crate::common::{Checked, bind, bytes_of, compute, words};
use mica_gpu::{Error, Executor, Timing};
use mica_graph::{
    Access, BindingKind, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Shader, Slot, Stages, Use, Work,
};
use std::sync::LazyLock;

/// `b1[i] = scale * b0[i] + i`.
static SCALE: LazyLock<&Shader> = LazyLock::new(|| {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(push_constant) uniform Params { uint count; uint scale; };
        layout(binding = 0) readonly buffer B0 { uint b0[]; };
        layout(binding = 1) writeonly buffer B1 { uint b1[]; };
        void main() {
          uint i = gl_GlobalInvocationID.x;
          if (i < count) b1[i] = scale * b0[i] + i;
        }";
    let bindings =
        [(0, BindingKind::StorageBuffer, Access::StorageRead), (1, BindingKind::StorageBuffer, Access::StorageWrite)];
    compute("scale", glsl, [64, 1, 1], 8, &bindings)
});

fn scale_work(count: u32, factor: u32) -> Work {
    Work::Compute { shader: *SCALE, params: bytes_of(&[count, factor]), groups: [count.div_ceil(64), 1, 1] }
}

fn scale(graph: &mut Graph, from: &Buffer, to: &mut Buffer, count: u32, factor: u32) {
    let uses = vec![bind(0, from.resource(), Access::StorageRead), bind(1, to.resource(), Access::StorageWrite)];
    graph.push(format!("scale {}", to.resource().name), scale_work(count, factor), uses);
}

#[test]
fn a_chain_of_passes_that_share_memory_gives_exact_numbers_with_both_timings() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    for timing in [Timing::Isolated, Timing::Overlapped, Timing::Isolated] {
        let count = 1000;
        let mut graph = Graph::new();
        let mut first = graph.buffer("first", 4 * u64::from(count));
        let input: Vec<u32> = (0..count).map(|i| i ^ 0x5a5a).collect();
        graph.upload(&mut first, bytes_of(&input));
        let mut previous = first;
        for step in 0..8 {
            let mut next = graph.buffer(format!("step {step}"), 4 * u64::from(count));
            scale(&mut graph, &previous, &mut next, count, 3 + step);
            previous = next;
        }
        let download = graph.download(&previous);
        let mut run = executor.run(graph, timing).expect("the frame runs");
        let expected = (0..8).fold(input, |values, step| {
            values.iter().zip(0..).map(|(value, i): (&u32, u32)| value.wrapping_mul(3 + step).wrapping_add(i)).collect()
        });
        assert_eq!(words(&run.take(download)), expected);
        let (shared, unshared) = (run.plan.shared_bytes, run.plan.unshared_bytes);
        assert!(3 * shared < unshared, "of nine buffers two live at a time: {shared} of {unshared} bytes");
    }
}

#[test]
fn groups_counted_by_one_pass_are_run_by_the_next() {
    let count_groups = compute(
        "count_groups",
        "layout(local_size_x = 1) in;
         layout(binding = 0) writeonly buffer B0 { uint b0[]; };
         void main() { b0[4] = 3; b0[5] = 2; b0[6] = 1; }",
        [1; 3],
        0,
        &[(0, BindingKind::StorageBuffer, Access::StorageWrite)],
    );
    let count_invocations = compute(
        "count_invocations",
        "layout(local_size_x = 4) in;
         layout(binding = 0) buffer B0 { uint b0; };
         void main() { atomicAdd(b0, 1); }",
        [4, 1, 1],
        0,
        &[(0, BindingKind::StorageBuffer, Access::StorageReadWrite)],
    );
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut graph = Graph::new();
    let arguments = graph.buffer("arguments", 28);
    let mut total = graph.buffer("total", 4);
    graph.fill(&mut total, 100);
    let work = Work::Compute { shader: count_groups, params: Vec::new(), groups: [1; 3] };
    graph.push("count_groups", work, vec![bind(0, arguments.resource(), Access::StorageWrite)]);
    let indirect = |offset| Work::ComputeIndirect { shader: count_invocations, params: Vec::new(), offset };
    let uses = vec![
        bind(0, total.resource(), Access::StorageReadWrite),
        Use {
            resource: arguments.resource().clone(),
            slot: Slot::None,
            access: Access::IndirectRead,
            stages: Stages::INDIRECT,
        },
    ];
    graph.push("count_invocations", indirect(16), uses.clone());
    let download = graph.download(&total);
    let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
    assert_eq!(words(&run.take(download)), [100 + 4 * 6]);

    let mut graph = Graph::new();
    let mut short = graph.buffer("short", 28);
    graph.fill(&mut short, 0);
    graph.fill(&mut total, 0);
    let mut uses = uses;
    uses[1].resource = short.resource().clone();
    graph.push("count_invocations", indirect(20), uses);
    graph.download(&total);
    let error = executor.run(graph, Timing::Overlapped).expect_err("the third count ends after the buffer");
    assert!(
        matches!(&error, Error::BadUse { pass, resource, .. } if pass == "count_invocations" && resource == "short")
    );
}

#[test]
fn f23_a_storage_buffer_beyond_the_device_s_range_is_refused_by_name_before_it_is_bound() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let limit = checked.device().info().limits.max_storage_buffer_range_bytes;
    let mut graph = Graph::new();
    let mut flakes = graph.buffer("flakes", limit + 4);
    let mut small = graph.buffer("small", 4);
    graph.fill(&mut small, 0);
    scale(&mut graph, &small, &mut flakes, 1, 1);
    graph.download(&flakes);
    let error = executor.run(graph, Timing::Overlapped).expect_err("the buffer is too large to bind");
    let text = error.to_string();
    assert!(matches!(error, Error::BufferRange { .. }) && error.exit_code() == 4, "{error:?}");
    for part in ["scale flakes", "buffer flakes", "maxStorageBufferRange", &limit.to_string(), &(limit + 4).to_string()]
    {
        assert!(text.contains(part), "'{text}' does not say {part}");
    }
}

#[test]
fn passes_that_do_not_fit_their_shader_are_refused_and_leave_the_executor_usable() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let whole = |graph: &mut Graph, work: Work, slots: [u32; 2], accesses: [Access; 2]| {
        let mut from = graph.buffer("from", 256);
        graph.fill(&mut from, 7);
        let to = Buffer::new("to", 256, Lifetime::Scene);
        let uses = vec![bind(slots[0], from.resource(), accesses[0]), bind(slots[1], to.resource(), accesses[1])];
        graph.push("scale", work, uses);
        to
    };
    let good = [Access::StorageRead, Access::StorageWrite];
    let error_of = |executor: &mut Executor, work: Work, slots, accesses| {
        let mut graph = Graph::new();
        whole(&mut graph, work, slots, accesses);
        executor.run(graph, Timing::Overlapped).expect_err("the pass is wrong")
    };

    let missing = error_of(&mut executor, scale_work(64, 2), [0, 5], good);
    assert!(matches!(&missing, Error::MissingBinding { pass, binding, slot: 1 } if pass == "scale" && binding == "b1"));
    let unsuited = error_of(&mut executor, scale_work(64, 2), [0, 1], [Access::Uniform, Access::StorageWrite]);
    assert!(matches!(&unsuited, Error::BadUse { resource, .. } if resource == "from"), "{unsuited:?}");
    let short = Work::Compute { shader: *SCALE, params: bytes_of(&[64]), groups: [1; 3] };
    assert!(matches!(error_of(&mut executor, short, [0, 1], good), Error::BadPass { .. }));
    let many = Work::Compute { shader: *SCALE, params: bytes_of(&[64, 2]), groups: [1, u32::MAX, 1] };
    assert!(matches!(error_of(&mut executor, many, [0, 1], good), Error::BadPass { .. }));
    let compact = error_of(&mut executor, Work::Compact, [0, 1], [Access::BuildRead, Access::BuildWrite]);
    assert!(matches!(&compact, Error::BadUse { resource, .. } if resource == "from"), "{compact:?}");

    let mut graph = Graph::new();
    let to = whole(&mut graph, scale_work(64, 2), [0, 1], good);
    let download = graph.download(&to);
    let mut run = executor.run(graph, Timing::Overlapped).expect("the pass is right");
    assert_eq!(words(&run.take(download)), (14..78).collect::<Vec<u32>>());
}

#[test]
fn images_of_any_shape_are_read_and_written_by_texel() {
    let increment = |dimension: &str, coordinate: &str| {
        let glsl = format!(
            "layout(local_size_x = 4, local_size_y = 4, local_size_z = 2) in;
             layout(binding = 0) uniform utexture{dimension} b0;
             layout(binding = 1, r32ui) uniform writeonly uimage{dimension} b1;
             void main() {{
               {coordinate};
               imageStore(b1, at, texelFetch(b0, at, 0) + 1);
             }}"
        );
        let bindings =
            [(0, BindingKind::SampledImage, Access::Sampled), (1, BindingKind::StorageImage, Access::StorageWrite)];
        let source = format!("#extension GL_EXT_samplerless_texture_functions : require\n{glsl}");
        compute("increment", &source, [4, 4, 2], 0, &bindings)
    };
    let checked = Checked::new();
    let mut executor = checked.executor();
    let flat = increment("2D", "ivec2 at = ivec2(gl_GlobalInvocationID.xy)");
    let layered = increment("2DArray", "ivec3 at = ivec3(gl_GlobalInvocationID)");
    let volume = increment("3D", "ivec3 at = ivec3(gl_GlobalInvocationID)");
    for (shader, extent, layers) in [
        (flat, Extent::new(8, 4), 0),
        (layered, Extent::new(8, 4), 6),
        (layered, Extent::new(4, 4), 1),
        (volume, Extent::volume(8, 4, 6), 0),
    ] {
        let desc = ImageDesc { layers, ..ImageDesc::new(Format::R32Uint, extent) };
        let image = |name| Image::new(name, desc, Lifetime::Frame);
        let (mut from, to) = (image("from"), image("to"));
        let texels: Vec<u32> = (0..desc.bytes() as u32 / 4).collect();
        let mut graph = Graph::new();
        graph.upload_image(&mut from, bytes_of(&texels));
        let groups = [extent.width.div_ceil(4), extent.height.div_ceil(4), extent.depth.max(layers).div_ceil(2)];
        let uses = vec![bind(0, from.resource(), Access::Sampled), bind(1, to.resource(), Access::StorageWrite)];
        graph.push("increment", Work::Compute { shader, params: Vec::new(), groups }, uses);
        let download = graph.download_image(&to);
        let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
        assert_eq!(words(&run.take(download)), texels.iter().map(|texel| texel + 1).collect::<Vec<u32>>(), "{desc:?}");
    }
}
