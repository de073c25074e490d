//! Flakes under an environment by two moments (shaders_glsl/shared/two_moments.glsl): the tables, and the pass that shades.

use crate::Condition;
use mica_graph::{Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime};
use mica_render::Frame;
use mica_render::scene::{EquirectMap, SmallLight};
use mica_shaders::types::TexelMoments;
use mica_shaders::{constants as c, environment_moments, moments_finest, moments_halve, moments_lobes};
use std::sync::Arc;

/// Normals drawn for each texel of the tables.
const LOBE_SAMPLES: u32 = 64;

/// How the moments of what one flake shows are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TwoMoments {
    /// Rings and sectors of normals that the moments are summed over; 0 and 0 is one normal.
    pub normals: [u32; 2],
    /// So many flakes, and fewer, are looked at one by one.
    pub each_below: u32,
    /// Whether small bright lights are taken out of the environment.
    pub lights: bool,
}

/// What two moments need of an environment, for one half-angle of the cone: no table depends on roughness.
pub struct MomentTables {
    cone: Image,
    first: Image,
    second: Image,
    lights: Buffer,
    light_count: u32,
}

impl MomentTables {
    /// Declares the passes that make the tables of a map.
    pub fn new(g: &mut Graph, map: &EquirectMap, lights: &[SmallLight], gamma_deg: f64) -> Self {
        let means = map.cone_means(gamma_deg.to_radians(), c::MOMENTS_WIDTH);
        let finest = Extent::new(means.width, means.height);
        let mut cone = Image::new("moments_cone", ImageDesc::new(Format::Rgba32Float, finest), Lifetime::Settings);
        let texels: Vec<[f32; 4]> = means.texels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        g.upload_image(&mut cone, Arc::<[u8]>::from(bytemuck::cast_slice::<_, u8>(&texels)));

        let texels: u64 = (0..c::MOMENTS_LEVELS).map(|level| finest.texels() >> (2 * level)).sum();
        let mut levels = g.buffer("moment_levels", texels * size_of::<TexelMoments>() as u64);
        g.pass(moments_finest::Bind { environment_cone: &cone, moment_levels: &mut levels }, (), finest);
        for level in 1..c::MOMENTS_LEVELS {
            let extent = Extent::new(finest.width >> level, finest.height >> level);
            g.pass(moments_halve::Bind { moment_levels: &mut levels }, moments_halve::Params { level }, extent);
        }
        let lobes = Extent::new(256, 128);
        let desc = ImageDesc { layers: c::SPECULAR_LAYERS, ..ImageDesc::new(Format::Rgba32Float, lobes) };
        let [mut first, mut second] =
            ["first_moment", "second_moment"].map(|name| Image::new(name, desc, Lifetime::Settings));
        let bind = moments_lobes::Bind { moment_levels: &levels, first_moment: &mut first, second_moment: &mut second };
        let extent = Extent { depth: c::SPECULAR_LAYERS, ..lobes };
        g.pass(bind, moments_lobes::Params { samples: LOBE_SAMPLES }, extent);

        let xyz0 = |v: [f64; 3]| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0];
        let mut words: Vec<[f32; 4]> =
            lights.iter().flat_map(|light| [xyz0(light.direction.to_array()), xyz0(light.irradiance)]).collect();
        // A buffer holds something.
        words.resize(words.len().max(1), [0.0; 4]);
        let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&words));
        let mut buffer = Buffer::new("extracted_lights", bytes.len() as u64, Lifetime::Settings);
        g.upload(&mut buffer, bytes);
        Self { cone, first, second, lights: buffer, light_count: lights.len() as u32 }
    }
}

/// Declares the pass that shades a frame's pixels by two moments.
pub fn shade(
    g: &mut Graph,
    tables: &MomentTables,
    how: TwoMoments,
    condition: &Condition,
    seed: u32,
    frame: &Frame,
    glints: &mut Image,
) {
    // Where nothing glints there is nothing to shade.
    let Some(footprint) = &frame.footprint else { return };
    let extent = glints.extent();
    let params = environment_moments::Params {
        alpha: condition.alpha as f32,
        sin2_half_gamma: (0.5 * condition.gamma_deg.to_radians()).sin().powi(2) as f32,
        flakes: condition.count().round() as f32,
        seed,
        rings: how.normals[0],
        sectors: how.normals[1],
        each_below: how.each_below,
        light_count: tables.light_count,
    };
    let bind = environment_moments::Bind {
        frame: &frame.constants,
        ids: &frame.ids,
        position: &frame.position,
        normal: &frame.normal,
        uv: &frame.uv,
        footprint,
        specular: &frame.specular,
        // Nothing is read from it without lights.
        shadow_mask: frame.shadow_mask.as_ref().unwrap_or(&frame.ids),
        first_moment: &tables.first,
        second_moment: &tables.second,
        environment_cone: &tables.cone,
        extracted_lights: &tables.lights,
        glints,
    };
    g.pass(bind, params, extent);
}
