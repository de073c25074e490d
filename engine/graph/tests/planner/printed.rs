//! A plan as people read it.

use crate::shaders::{COMPUTE, Compute, Raster};
use mica_graph::{
    Access, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Plan, Requirements, Slot, Stages, Use, Work,
};
use std::sync::Arc;

/// A frame with something of everything: uploads, drawing, compute, history, culling, reuse of memory, a download.
fn frame() -> Graph {
    let size = Extent::new(16, 8);
    let mut g = Graph::new();
    let mut mesh = Buffer::new("mesh", 96, Lifetime::Scene);
    let mut history = Image::new("history", ImageDesc::new(Format::Rgba16Float, size), Lifetime::Settings);

    g.because("the scene is new");
    g.upload(&mut mesh, vec![0; 96]);
    g.because("");
    let mut visibility = g.image("visibility", Format::Rg32Uint, size);
    let mut depth = g.image("depth", Format::Depth32, size);
    g.raster(Raster { mesh: &mesh, color: &mut visibility, depth: &mut depth }, (), Arc::from([]), size);

    let mut heat = g.image("heat", Format::Rgba8, size);
    g.pass_named("heat map", Compute { reads: vec![&depth], writes: vec![&mut heat] }, (), size);

    let mut radiance = g.image("radiance", Format::Rgba16Float, size);
    g.pass_named("shade", Compute { reads: vec![&visibility, &history], writes: vec![&mut radiance] }, (), size);
    g.because("the surface glints");
    let glints = vec![
        Use {
            resource: depth.resource().clone(),
            slot: Slot::Binding(0),
            access: Access::Sampled,
            stages: Stages::COMPUTE,
        },
        Use {
            resource: radiance.resource().clone(),
            slot: Slot::Binding(1),
            access: Access::StorageReadWrite,
            stages: Stages::COMPUTE,
        },
    ];
    g.push("glints", Work::Compute { shader: &COMPUTE, params: Vec::new(), groups: [2, 1, 1] }, glints);
    g.because("");
    g.copy_image(&radiance, &mut history);

    let mut display = g.image("display", Format::Rgba8, size);
    g.pass_named("tonemap", Compute { reads: vec![&radiance], writes: vec![&mut display] }, (), size);
    g.export(&display);
    g.download_image(&display);
    g
}

#[test]
fn a_plan_reads_as_a_table() {
    let plan = Plan::new(frame(), &|resource, _| Requirements { bytes: resource.bytes(), alignment: 256 });
    let text = plan.expect("the frame is well formed").to_string();
    assert_eq!(text, include_str!("printed.txt"), "\n{text}");
}
