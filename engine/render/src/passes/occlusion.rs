//! Whether the mirror direction of each glinting pixel is free.

use super::{GBuffer, GlintTiles};
use crate::occluders::{Occluders, RaysOfPass, pass_with_rays};
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Format, Graph, Image, Over};

/// 1 where it is free and where nothing glints, 0 where something lies in it; on the tiles of a list.
pub(crate) fn occlusion(
    g: &mut Graph,
    scene: &SceneBuffers,
    occluders: &Occluders,
    frame: &Buffer,
    gbuffer: &GBuffer,
    (tiles, list): (&GlintTiles, u32),
) -> (Image, RaysOfPass) {
    let extent = gbuffer.ids.extent();
    let mut visibility = g.image("visibility", Format::R32Float, extent);
    g.clear(&mut visibility, 1.0);
    let mut rays = RaysOfPass::none_yet(g, "occlusion");
    pass_with_rays!(
        g,
        occlusion,
        occluders,
        scene,
        Over::Counted(&tiles.lists, GlintTiles::arguments(list)),
        Params { list },
        Bind {
            frame,
            positions: &scene.positions.buffer,
            ids: &gbuffer.ids,
            position: &gbuffer.position,
            normal: &gbuffer.normal,
            listed_tiles: &tiles.listed,
            tile_lists: &tiles.lists,
            ray_counts: &mut rays.counts,
            visibility: &mut visibility,
        },
        Unmasked { instances: &scene.instances.buffer, indices: &scene.indices.buffer, materials: &scene.materials }
    );
    (visibility, rays)
}
