//! The environment's tables: what a diffuse surface and a smooth lobe see of it.

use crate::environment_tables::Ndf;
use mica_graph::{Extent, Graph, Image};
use mica_shaders::{constants as c, environment_irradiance, environment_specular, specular_albedo};

/// Normals drawn for each texel of the prefiltered environment.
const SPECULAR_SAMPLES: u32 = 64;
/// Normals drawn for each entry of the albedo table: the tests find the means of a plane and a sphere under a constant
/// sky within 0.07 % of the f64 evaluation.
const ALBEDO_SAMPLES: u32 = 1024;
/// Directions summed for each texel of the irradiance, along the horizon and from pole to pole.
const IRRADIANCE_DIRECTIONS: [u32; 2] = [64, 32];

/// Fills `irradiance` from the first level of the map that is at most 64 texels on a side.
pub(crate) fn irradiance(g: &mut Graph, map: &Image, irradiance: &mut Image) {
    let desc = map.desc();
    let fits = |level: &u32| desc.extent.width >> level <= 64 && desc.extent.height >> level <= 64;
    let level = (0..desc.mips).find(fits).unwrap_or(desc.mips - 1);
    // As many as there are texels, but not fewer when the map itself is small: a single texel lies behind half of all
    // surfaces.
    let [columns, rows] = IRRADIANCE_DIRECTIONS;
    let params = environment_irradiance::Params {
        columns: columns.max(desc.extent.width >> level),
        rows: rows.max(desc.extent.height >> level),
        source_level: level as f32,
    };
    let extent = irradiance.extent();
    g.pass(environment_irradiance::Bind { environment: map, irradiance }, params, extent);
}

/// Fills what a lobe sees of the map, one roughness a layer.
pub(crate) fn specular(g: &mut Graph, map: &Image, ndf: Ndf, prefiltered: &mut Image) {
    let desc = map.desc();
    let params = environment_specular::Params {
        samples: SPECULAR_SAMPLES,
        beckmann: u32::from(ndf == Ndf::Beckmann),
        texel_solid_angle: 4.0 * std::f32::consts::PI / desc.extent.texels() as f32,
        max_level: (desc.mips - 1) as f32,
    };
    let extent = Extent { depth: c::SPECULAR_LAYERS, ..prefiltered.extent() };
    g.pass(environment_specular::Bind { environment: map, prefiltered }, params, extent);
}

/// Fills a lobe's directional albedo by cosine and roughness.
pub(crate) fn albedo(g: &mut Graph, ndf: Ndf, albedo: &mut Image) {
    let params = specular_albedo::Params { samples: ALBEDO_SAMPLES, beckmann: u32::from(ndf == Ndf::Beckmann) };
    let extent = albedo.extent();
    g.pass(specular_albedo::Bind { albedo }, params, extent);
}
