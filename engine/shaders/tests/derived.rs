//! The Rust derived from the fixtures' GLSL, held against numbers and names written here by hand.

#[allow(dead_code, reason = "no test makes every resource of every fixture")]
mod shaders {
    include!(concat!(env!("OUT_DIR"), "/fixtures/mod.rs"));
}

use mica_graph::Access::{
    ColorWrite, DepthWrite, Sampled, StorageRead, StorageReadWrite, StorageWrite, Traverse, Uniform as UniformRead,
};
use mica_graph::{
    Access, Bind, BindingKind, Buffer, Extent, Format, Image, ImageDesc, Lifetime, Sampler, Shader, Slot, Stages,
    Structure,
};
use shaders::types::{Camera, Particle, Range, Spin, Table};
use shaders::{access, constants, counts, glints, glints_naive, layouts, mesh, tonemap};
use std::mem::{offset_of, size_of};

fn image(name: &str) -> Image {
    Image::new(name, ImageDesc::new(Format::R32Float, Extent::new(4, 4)), Lifetime::Frame)
}

fn buffer(name: &str) -> Buffer {
    Buffer::new(name, 16, Lifetime::Frame)
}

/// What a `Bind` visits, with the names of the resources.
fn visited(bind: &impl Bind) -> Vec<(String, Slot, Access, Stages)> {
    let mut visited = Vec::new();
    bind.visit(&mut |resource, slot, access, stages| visited.push((resource.name.clone(), slot, access, stages)));
    visited
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn a_bind_visits_its_resources_in_slot_order_with_the_access_the_glsl_declares() {
    let (sources, kinds, layers, read_image) = (buffer("sources"), buffer("type"), image("layers"), image("read"));
    let (mut targets, mut counters, mut halves) = (buffer("targets"), buffer("counters"), buffer("halves"));
    let (mut written, mut counted) = (image("written"), image("counted"));
    let world = Structure::over_instances("world", 1, Lifetime::Scene);
    let bind = access::Bind {
        sources: &sources,
        targets: &mut targets,
        counters: &mut counters,
        halves: &mut halves,
        r#type: &kinds,
        read_image: &read_image,
        written_image: &mut written,
        counted_image: &mut counted,
        layers: &layers,
        world: &world,
    };
    let expected = [
        ("layers", 3, Sampled),
        ("counted", 4, StorageReadWrite),
        ("written", 5, StorageWrite),
        ("read", 6, StorageRead),
        ("counters", 7, StorageReadWrite),
        ("targets", 8, StorageWrite),
        ("sources", 9, StorageRead),
        ("halves", 10, StorageReadWrite),
        ("type", 11, StorageRead),
        ("world", 12, Traverse),
    ];
    let expected = expected.map(|(name, slot, access)| (name.to_owned(), Slot::Binding(slot), access, Stages::COMPUTE));
    assert_eq!(visited(&bind), expected);
}

#[test]
fn samplers_are_bindings_of_the_shader_and_not_fields_of_bind() {
    let kinds: Vec<_> = access::SHADER.bindings.iter().map(|binding| (binding.slot, binding.kind)).collect();
    let expected = [
        (0, BindingKind::Sampler(Sampler::Linear)),
        (1, BindingKind::Sampler(Sampler::Nearest)),
        (2, BindingKind::Sampler(Sampler::LinearWrapU)),
        (3, BindingKind::SampledImage),
        (4, BindingKind::StorageImage),
        (5, BindingKind::StorageImage),
        (6, BindingKind::StorageImage),
        (7, BindingKind::StorageBuffer),
        (8, BindingKind::StorageBuffer),
        (9, BindingKind::StorageBuffer),
        (10, BindingKind::StorageBuffer),
        (11, BindingKind::StorageBuffer),
        (12, BindingKind::AccelerationStructure),
    ];
    assert_eq!(kinds, expected);
}

#[test]
fn a_raster_shader_binds_what_both_stages_use_then_its_outputs_by_location_then_depth() {
    let (vertices, colors) = (buffer("vertices"), buffer("colors"));
    let (mut color, mut identity, mut depth) = (image("color"), image("identity"), image("depth"));
    let bind = mesh::Bind {
        vertices: &vertices,
        colors: &colors,
        color: &mut color,
        identity: &mut identity,
        depth: &mut depth,
    };
    let expected = [
        ("vertices", Slot::Binding(1), StorageRead, Stages::VERTEX | Stages::FRAGMENT),
        ("colors", Slot::Binding(3), StorageRead, Stages::FRAGMENT),
        ("color", Slot::Color(0), ColorWrite, Stages::COLOR_OUTPUT),
        ("identity", Slot::Color(1), ColorWrite, Stages::COLOR_OUTPUT),
        ("depth", Slot::Depth, DepthWrite, Stages::DEPTH_TEST),
    ];
    let expected = expected.map(|(name, slot, access, stages)| (name.to_owned(), slot, access, stages));
    assert_eq!(visited(&bind), expected);
    assert_eq!(mesh::SHADER.outputs, ["color", "identity"]);
    let stages: Vec<_> = mesh::SHADER.stages.iter().map(|code| code.stage).collect();
    assert_eq!(stages, [mica_graph::Stage::Vertex, mica_graph::Stage::Fragment]);
}

#[test]
fn std140_members_lie_where_the_rules_put_them() {
    assert_eq!(offset_of!(Camera, clip_from_world), 0);
    assert_eq!(offset_of!(Camera, world_from_local), 64);
    assert_eq!(offset_of!(Camera, eye), 112);
    assert_eq!(offset_of!(Camera, gamma_radians), 124, "a float fits behind a vec3");
    assert_eq!(offset_of!(Camera, weights), 128);
    assert_eq!(offset_of!(Camera, jitter), 176, "elements of an array are 16 bytes apart");
    assert_eq!(offset_of!(Camera, viewport), 192);
    assert_eq!(size_of::<Camera>(), 208);
    let camera = Camera {
        world_from_local: [[1.0, 2.0, 3.0, 0.0]; 3],
        weights: [[5.0, 0.0, 0.0, 0.0]; 3],
        viewport: [-1; 4],
        ..Camera::default()
    };
    assert_eq!(words(bytemuck::bytes_of(&camera))[20..24], [1f32, 2.0, 3.0, 0.0].map(f32::to_bits));
}

#[test]
fn std430_members_lie_where_the_rules_put_them() {
    assert_eq!((offset_of!(Spin, axis), offset_of!(Spin, turns), size_of::<Spin>()), (0, 12, 32));
    assert_eq!(offset_of!(Particle, radius), 12);
    assert_eq!((offset_of!(Particle, spin), offset_of!(Particle, mass)), (16, 48));
    assert_eq!(size_of::<Particle>(), 64);
    assert_eq!((offset_of!(Table, scale), offset_of!(Table, weights)), (16, 28));
    assert_eq!((offset_of!(Table, rotations), offset_of!(Table, pinned)), (48, 144));
    assert_eq!((offset_of!(Range, step_size), size_of::<Range>()), (8, 16), "a block ends at its alignment");
    assert_eq!(size_of::<Table>(), 208, "the array without end begins here");
    let table = Table { weights: [7.0; 3], rotations: [[[0.0; 4]; 3]; 2], ..Table::default() };
    assert_eq!(table.weights[2].to_bits(), words(bytemuck::bytes_of(&table))[9]);
}

#[test]
fn push_constants_are_written_at_the_offsets_of_the_block() {
    let params = layouts::Params {
        exposure: 1.5,
        tint: [2.0, 3.0, 4.0],
        size: [5, 6],
        rotation: [[7.0, 8.0], [9.0, 10.0]],
        enabled: 1,
    };
    let bytes = layouts::Bind::params_bytes(&params);
    let mut expected = [0u32; 16];
    expected[0] = 1.5f32.to_bits();
    expected[4..7].copy_from_slice(&[2.0f32, 3.0, 4.0].map(f32::to_bits));
    expected[8..10].copy_from_slice(&[5, 6]);
    expected[10..14].copy_from_slice(&[7.0f32, 8.0, 9.0, 10.0].map(f32::to_bits));
    expected[14] = 1;
    assert_eq!(words(&bytes), expected);
    assert_eq!(layouts::SHADER.params_bytes, 64);
}

#[test]
fn a_shader_without_push_constants_takes_the_unit() {
    let params: access::Params = ();
    assert!(access::Bind::params_bytes(&params).is_empty());
    assert_eq!(access::SHADER.params_bytes, 0);
}

#[test]
fn a_pass_with_a_method_is_made_once_for_each_method() {
    let variants = [&counts::counted::SHADER, &counts::smooth::SHADER].map(|shader| (shader.name, shader.variant));
    assert_eq!(variants, [("counts", "method=counted"), ("counts", "method=smooth")]);
    assert_eq!(counts::counted::Bind::params_bytes(&counts::counted::Params { count: 3 }), 3u32.to_le_bytes());
    let (weight, mut target) = (buffer("weight"), buffer("counts"));
    let visited = visited(&counts::smooth::Bind { counts: &mut target, weight: &weight });
    assert_eq!(visited[1], ("weight".to_owned(), Slot::Binding(5), UniformRead, Stages::COMPUTE));
}

#[test]
fn a_pass_with_a_method_and_occlusion_is_made_for_each_pair() {
    let slots = |shader: &Shader| shader.bindings.iter().map(|binding| binding.slot).collect::<Vec<_>>();
    assert_eq!(slots(&glints::counted_bvh::SHADER), [0, 6]);
    assert_eq!(slots(&glints::counted_none::SHADER), [0]);
    assert_eq!(slots(&glints::smooth_bvh::SHADER), [0, 5, 6]);
    assert_eq!(slots(&glints::smooth_none::SHADER), [0, 5]);
    assert_eq!(glints::smooth_bvh::SHADER.variant, "method=smooth,occlusion=bvh");
}

#[test]
fn a_twin_of_naive_forms_differs_in_its_code_alone() {
    let (stable, naive) = (&glints::smooth_bvh::SHADER, &glints_naive::smooth_bvh::SHADER);
    assert_eq!((stable.bindings, stable.params_bytes, stable.group), (naive.bindings, naive.params_bytes, naive.group));
    assert_ne!(stable.stages[0].spirv, naive.stages[0].spirv);
}

#[test]
fn every_shader_and_variant_is_listed_once() {
    let all: Vec<_> = shaders::ALL.iter().map(|shader| (shader.name, shader.variant)).collect();
    let expected = [
        ("access", ""),
        ("counts", "method=counted"),
        ("counts", "method=smooth"),
        ("glints", "method=counted,occlusion=bvh"),
        ("glints", "method=counted,occlusion=none"),
        ("glints", "method=smooth,occlusion=bvh"),
        ("glints", "method=smooth,occlusion=none"),
        // Passes with naive forms have a twin for each variant.
        ("glints_naive", "method=counted,occlusion=bvh"),
        ("glints_naive", "method=counted,occlusion=none"),
        ("glints_naive", "method=smooth,occlusion=bvh"),
        ("glints_naive", "method=smooth,occlusion=none"),
        ("layouts", ""),
        ("mesh", ""),
        ("tonemap", ""),
    ];
    assert_eq!(all, expected);
}

#[test]
fn code_is_spirv_and_group_sizes_are_read_from_it() {
    for code in shaders::ALL.iter().flat_map(|shader| shader.stages) {
        assert_eq!(code.spirv[0], 0x0723_0203);
    }
    assert_eq!(tonemap::SHADER.group, [8, 4, 1]);
    assert_eq!(access::SHADER.group, [64, 1, 1]);
    assert_eq!(mesh::SHADER.group, [1, 1, 1]);
}

#[test]
fn constants_have_the_values_of_the_shaders() {
    assert_eq!(constants::LARGEST, u32::MAX);
    assert_eq!(constants::LOWEST, -7);
    assert_eq!(constants::TENTH.to_bits(), 0.1f32.to_bits());
    assert_eq!(constants::SMALL.to_bits(), (-1.5e-3f32).to_bits());
    assert_eq!(constants::OCTAL, 15);
}
