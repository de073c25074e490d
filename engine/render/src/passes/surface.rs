//! The surface seen through each pixel, with its analytic footprint in texture space.

use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Extent, Format, Graph, Image};
use mica_shaders::surface::Bind;

/// What is known of each pixel's surface; `surface.comp` says what lies in which channel.
pub(crate) struct GBuffer {
    pub ids: Image,
    pub position: Image,
    pub normal: Image,
    pub uv: Image,
    /// Derivatives of the flakes' texture coordinates; none where nothing glints.
    pub footprint: Option<Image>,
    pub diffuse: Image,
    pub specular: Image,
    pub emission: Image,
}

/// Fills the G-buffer from what is visible.
pub(crate) fn surface(
    g: &mut Graph,
    scene: &SceneBuffers,
    frame: &Buffer,
    ids: Image,
    mut footprint: Option<Image>,
) -> GBuffer {
    let extent = ids.extent();
    let mut position = g.image("position", Format::Rgba32Float, extent);
    let mut normal = g.image("normal", Format::Rgba32Float, extent);
    let mut uv = g.image("uv", Format::Rgba32Float, extent);
    let mut absent = g.image("footprint_absent", Format::Rgba32Float, Extent::new(1, 1));
    let mut diffuse = g.image("diffuse", Format::Rgba32Float, extent);
    let mut specular = g.image("specular", Format::Rgba32Float, extent);
    let mut emission = g.image("emission", Format::Rgba32Float, extent);
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
        ids: &ids,
        colors: &scene.colors.buffer,
        normals: &scene.normals.buffer,
        tangents: &scene.tangents.buffer,
        position: &mut position,
        normal: &mut normal,
        uv: &mut uv,
        // Not written where nothing glints.
        footprint: footprint.as_mut().unwrap_or(&mut absent),
        diffuse: &mut diffuse,
        specular: &mut specular,
        emission: &mut emission,
    };
    g.pass(bind, (), extent);
    GBuffer { ids, position, normal, uv, footprint, diffuse, specular, emission }
}
