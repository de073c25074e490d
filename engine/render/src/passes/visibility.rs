//! Which triangle of which instance is seen through each pixel.

use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Extent, Format, Graph, Image};
use mica_shaders::visibility::Bind;

/// Instance plus 1 and triangle of each pixel; 0 where nothing is.
pub(crate) fn visibility(g: &mut Graph, scene: &SceneBuffers, frame: &Buffer, extent: Extent) -> Image {
    let mut ids = g.image("ids", Format::Rg32Uint, extent);
    let mut depth = g.image("depth", Format::Depth32, extent);
    let bind = Bind {
        frame,
        instances: &scene.instances.buffer,
        indices: &scene.indices.buffer,
        positions: &scene.positions.buffer,
        materials: &scene.materials,
        uvs: &scene.uvs.buffer,
        textures: &scene.textures.buffer,
        atlas_srgb: &scene.atlas_srgb.image,
        atlas_linear: &scene.atlas_linear.image,
        colors: &scene.colors.buffer,
        ids: &mut ids,
        depth: &mut depth,
    };
    g.raster(bind, (), scene.draws.clone(), extent);
    ids
}
