//! Which lights each pixel's surface cannot see.

use super::GBuffer;
use crate::scene_buffers::{Bvh, SceneBuffers};
use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::shadows::bvh::Bind;
use mica_shaders::types::RayCounts;

/// One bit for each light that is occluded.
pub(crate) fn shadows(g: &mut Graph, scene: &SceneBuffers, bvh: &Bvh, frame: &Buffer, gbuffer: &GBuffer) -> Image {
    let extent = gbuffer.ids.extent();
    let mut shadow_mask = g.image("shadow_mask", Format::R32Uint, extent);
    let mut ray_counts = g.buffer("ray_counts", size_of::<RayCounts>() as u64);
    g.fill(&mut ray_counts, 0);
    let bind = Bind {
        frame,
        lights: &scene.lights.buffer,
        ids: &gbuffer.ids,
        position: &gbuffer.position,
        normal: &gbuffer.normal,
        bvh_nodes: &bvh.nodes.buffer,
        bvh_triangles: &bvh.triangles.buffer,
        bvh_instances: &bvh.instances.buffer,
        ray_counts: &mut ray_counts,
        shadow_mask: &mut shadow_mask,
    };
    g.pass(bind, (), extent);
    shadow_mask
}
