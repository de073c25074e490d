//! Everything but the glints: the sky, emission, diffuse and smooth specular reflection, the clear coat.

use super::GBuffer;
use crate::environment_tables::EnvironmentTables;
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Format, Graph, Image};
use mica_shaders::base::Bind;

/// Radiance without glints.
pub(crate) fn base(
    g: &mut Graph,
    scene: &SceneBuffers,
    environment: &EnvironmentTables,
    frame: &Buffer,
    gbuffer: &GBuffer,
    shadow_mask: &Image,
) -> Image {
    let mut radiance = g.image("radiance", Format::Rgba32Float, gbuffer.ids.extent());
    let lobe = environment.ggx();
    let bind = Bind {
        frame,
        lights: &scene.lights.buffer,
        environment: environment.map(),
        ids: &gbuffer.ids,
        position: &gbuffer.position,
        normal: &gbuffer.normal,
        uv: &gbuffer.uv,
        diffuse: &gbuffer.diffuse,
        specular: &gbuffer.specular,
        emission: &gbuffer.emission,
        shadow_mask,
        irradiance: environment.irradiance(),
        prefiltered: &lobe.prefiltered,
        albedo: &lobe.albedo,
        radiance: &mut radiance,
    };
    g.pass(bind, (), gbuffer.ids.extent());
    radiance
}
