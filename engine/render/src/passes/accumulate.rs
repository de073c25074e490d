//! The mean over frames whose rays pass through different points of each pixel.

use mica_graph::{Buffer, Graph, Image};
use mica_shaders::accumulate::{Bind, Params};

/// Adds a frame to the mean of `earlier` frames.
pub(crate) fn accumulate(g: &mut Graph, frame: &Buffer, radiance: &Image, mean: &mut Image, earlier: u32) {
    let extent = radiance.extent();
    g.pass(Bind { frame, radiance, mean }, Params { earlier }, extent);
}
