//! Glints added to everything else.

use super::{GBuffer, GlintTiles};
use mica_graph::{Buffer, Graph, Image};
use mica_shaders::composite::{Bind, Params};

/// Adds a layer of glints to the frame's radiance; `visibility`, where there is one, dims it.
pub(crate) fn composite(
    g: &mut Graph,
    frame: &Buffer,
    gbuffer: &GBuffer,
    (tiles, list): (&GlintTiles, u32),
    glints: &Image,
    visibility: Option<&Image>,
    radiance: &mut Image,
) {
    let params = Params { list, occluded: u32::from(visibility.is_some()) };
    let bind = Bind {
        frame,
        ids: &gbuffer.ids,
        position: &gbuffer.position,
        normal: &gbuffer.normal,
        glints,
        // Not read where there is none.
        visibility: visibility.unwrap_or(glints),
        uv: &gbuffer.uv,
        listed_tiles: &tiles.listed,
        tile_lists: &tiles.lists,
        radiance,
    };
    g.pass_indirect(bind, params, &tiles.lists, GlintTiles::arguments(list));
}
