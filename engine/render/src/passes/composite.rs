//! Glints added to everything else.

use super::GBuffer;
use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::composite::{Bind, Params};

/// The frame's radiance; `visibility`, where there is one, dims the glints.
pub(crate) fn composite(
    g: &mut Graph,
    frame: &Buffer,
    gbuffer: &GBuffer,
    base: &Image,
    glints: &Image,
    visibility: Option<&Image>,
) -> Image {
    let mut radiance = g.image("radiance", Format::Rgba32Float, base.extent());
    let params = Params { occluded: u32::from(visibility.is_some()) };
    let bind = Bind {
        frame,
        ids: &gbuffer.ids,
        position: &gbuffer.position,
        normal: &gbuffer.normal,
        base,
        glints,
        // Not read where there is none.
        visibility: visibility.unwrap_or(glints),
        uv: &gbuffer.uv,
        radiance: &mut radiance,
    };
    g.pass(bind, params, base.extent());
    radiance
}
