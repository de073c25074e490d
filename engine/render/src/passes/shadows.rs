//! Which lights each pixel's surface cannot see.

use super::GBuffer;
use crate::occluders::{Occluders, RaysOfPass, pass_with_rays};
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Format, Graph, Image, Over};

/// One bit for each light that is occluded.
pub(crate) fn shadows(
    g: &mut Graph,
    scene: &SceneBuffers,
    occluders: &Occluders,
    frame: &Buffer,
    gbuffer: &GBuffer,
) -> (Image, RaysOfPass) {
    let extent = gbuffer.ids.extent();
    let mut shadow_mask = g.image("shadow_mask", Format::R32Uint, extent);
    let mut rays = RaysOfPass::none_yet(g, "shadows");
    pass_with_rays!(
        g,
        shadows,
        occluders,
        scene,
        Over::Texels(extent),
        (),
        Bind {
            frame,
            positions: &scene.positions.buffer,
            lights: &scene.lights.buffer,
            ids: &gbuffer.ids,
            position: &gbuffer.position,
            normal: &gbuffer.normal,
            ray_counts: &mut rays.counts,
            shadow_mask: &mut shadow_mask,
        },
        Unmasked { instances: &scene.instances.buffer, indices: &scene.indices.buffer }
    );
    (shadow_mask, rays)
}
