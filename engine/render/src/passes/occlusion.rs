//! Whether the mirror direction of each glinting pixel is free.

use super::GBuffer;
use crate::occluders::{Occluders, RaysOfPass, pass_with_rays};
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Format, Graph, Image};

/// 1 where it is free, 0 where something lies in it.
pub(crate) fn occlusion(
    g: &mut Graph,
    scene: &SceneBuffers,
    occluders: &Occluders,
    frame: &Buffer,
    gbuffer: &GBuffer,
) -> (Image, RaysOfPass) {
    let extent = gbuffer.ids.extent();
    let mut visibility = g.image("visibility", Format::R32Float, extent);
    let mut rays = RaysOfPass::none_yet(g, "occlusion");
    pass_with_rays!(
        g,
        occlusion,
        occluders,
        scene,
        extent,
        (),
        Bind {
            frame,
            positions: &scene.positions.buffer,
            ids: &gbuffer.ids,
            position: &gbuffer.position,
            normal: &gbuffer.normal,
            ray_counts: &mut rays.counts,
            visibility: &mut visibility,
        },
        Unmasked { instances: &scene.instances.buffer, indices: &scene.indices.buffer, materials: &scene.materials }
    );
    (visibility, rays)
}
