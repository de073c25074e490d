// What the examples of the crate's documentation stand on: a shader of the fixtures, a graph and its resources.

mod shaders {
    include!(concat!(env!("OUT_DIR"), "/fixtures/mod.rs"));
}

use mica_graph::{Buffer, Extent, Format, Graph, Image};
pub use shaders::tonemap::{Bind, Params};

pub struct Setting {
    pub g: Graph,
    pub extent: Extent,
    pub radiance: Image,
    pub display: Image,
    pub histogram: Buffer,
}

pub fn setting() -> Setting {
    let mut g = Graph::new();
    let extent = Extent::new(64, 32);
    let radiance = g.image("radiance", Format::Rgba32Float, extent);
    let display = g.image("display", Format::Rgba8, extent);
    let histogram = g.buffer("histogram", 256 * 4);
    Setting { g, extent, radiance, display, histogram }
}
