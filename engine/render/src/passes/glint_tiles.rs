//! The tiles of a frame on which something glints, in lists that the passes over glints are dispatched over.

use super::GBuffer;
use crate::GlintMaterial;
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Extent, Format, Graph};
use mica_shaders::{constants as c, glint_tiles, layer_tiles, types};
use std::sync::Arc;

/// Lists of tiles: one for each glinting material, and one for each layer.
pub(crate) struct GlintTiles {
    /// The tiles, list after list.
    pub listed: Buffer,
    /// How many are in each, and the groups of a dispatch over them.
    pub lists: Buffer,
    /// The materials, by index, in the order of their lists.
    materials: Vec<usize>,
    /// Whether layers have lists of their own.
    layered: bool,
}

impl GlintTiles {
    /// The list of a material's tiles.
    pub fn of_material(&self, material: &GlintMaterial) -> u32 {
        self.materials.iter().position(|index| *index == material.index).unwrap_or_default() as u32
    }

    /// The list of the tiles that a layer reaches.
    pub fn of_layer(&self, layer: usize) -> u32 {
        if self.layered { (self.materials.len() + layer) as u32 } else { 0 }
    }

    /// Where the arguments of a dispatch over a list lie in `lists`.
    pub fn arguments(list: u32) -> u64 {
        u64::from(list) * size_of::<types::TileList>() as u64
    }
}

/// Lists the tiles of these materials, and of layers, each of which may be blurred.
pub(crate) fn glint_tiles(
    g: &mut Graph,
    scene: &SceneBuffers,
    frame: &Buffer,
    gbuffer: &GBuffer,
    materials: &[GlintMaterial],
    blurred: &[bool],
) -> GlintTiles {
    let Extent { width, height, .. } = gbuffer.ids.extent();
    let tiles = Extent::new(width.div_ceil(c::TILE_SIDE), height.div_ceil(c::TILE_SIDE));
    // A single material without a blur reaches its own tiles only.
    let layered = materials.len() > 1 || blurred.contains(&true);
    let count = materials.len() + if layered { blurred.len() } else { 0 };
    let mut listed = g.buffer("listed_tiles", count as u64 * tiles.texels() * 4);
    let empty = vec![types::TileList { groups: [0, 0, 1], tiles: 0 }; count];
    let mut lists = g.buffer("tile_lists", size_of_val(&empty[..]) as u64);
    g.upload(&mut lists, Arc::<[u8]>::from(bytemuck::cast_slice::<_, u8>(&empty)));
    let mut tile_layers = g.image("tile_layers", Format::R32Uint, tiles);
    let bind = glint_tiles::Bind {
        frame,
        instances: &scene.instances.buffer,
        materials: &scene.materials,
        ids: &gbuffer.ids,
        listed_tiles: &mut listed,
        tile_lists: &mut lists,
        tile_layers: &mut tile_layers,
    };
    g.pass(bind, glint_tiles::Params { material_lists: materials.len() as u32 }, gbuffer.ids.extent());
    if layered {
        let bits = (0..).zip(blurred).filter(|(_, blurred)| **blurred).map(|(layer, _)| 1u32 << layer);
        let params = layer_tiles::Params {
            first_list: materials.len() as u32,
            layer_count: blurred.len() as u32,
            blurred_layers: bits.fold(0, |all, bit| all | bit),
        };
        let bind =
            layer_tiles::Bind { frame, tile_layers: &tile_layers, listed_tiles: &mut listed, tile_lists: &mut lists };
        g.pass(bind, params, tiles);
    }
    GlintTiles { listed, lists, materials: materials.iter().map(|material| material.index).collect(), layered }
}
