//! Whether the mirror direction of each glinting pixel is free.

use super::GBuffer;
use crate::scene_buffers::{Bvh, SceneBuffers};
use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::occlusion::bvh::Bind;
use mica_shaders::types::RayCounts;

/// 1 where it is free, 0 where something lies in it.
pub(crate) fn occlusion(g: &mut Graph, scene: &SceneBuffers, bvh: &Bvh, frame: &Buffer, gbuffer: &GBuffer) -> Image {
    let extent = gbuffer.ids.extent();
    let mut visibility = g.image("visibility", Format::R32Float, extent);
    let mut ray_counts = g.buffer("ray_counts", size_of::<RayCounts>() as u64);
    g.fill(&mut ray_counts, 0);
    let bind = Bind {
        frame,
        instances: &scene.instances.buffer,
        materials: &scene.materials,
        ids: &gbuffer.ids,
        position: &gbuffer.position,
        normal: &gbuffer.normal,
        bvh_nodes: &bvh.nodes.buffer,
        bvh_triangles: &bvh.triangles.buffer,
        bvh_instances: &bvh.instances.buffer,
        ray_counts: &mut ray_counts,
        visibility: &mut visibility,
    };
    g.pass(bind, (), extent);
    visibility
}
