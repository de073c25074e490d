//! Linear radiance to display values.

use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::tonemap::{Bind, Params};

/// sRGB-encoded, 8 bits a channel.
pub(crate) fn tonemap(g: &mut Graph, frame: &Buffer, radiance: &Image, exposure: f32) -> Image {
    let mut display = g.image("display", Format::Rgba8, radiance.extent());
    g.pass(Bind { frame, radiance, display: &mut display }, Params { exposure }, radiance.extent());
    display
}
