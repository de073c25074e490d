//! The environment of a census.

use crate::scene::EquirectMap;
use serde::Serialize;

/// Light from everywhere.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnvironmentCensus {
    /// Texels along the horizon and from pole to pole.
    pub size: [u32; 2],
    /// Small bright lights in it, as a sun is one.
    pub small_lights: usize,
    /// What these are of all its light, 0 to 1.
    pub share_of_small_lights: f64,
    /// Texels that were no finite radiance and were repaired.
    pub bad_texels: u64,
}

impl EnvironmentCensus {
    /// Counts a map of some size, by a level of it that is fine enough to find its lights in.
    pub(crate) fn of(size: [u32; 2], level: &EquirectMap, bad_texels: u64) -> Self {
        let (lights, _) = level.part_small_lights();
        let luminance = |[r, g, b]: [f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let of_lights = lights.iter().fold(0.0, |sum, light| sum + luminance(light.irradiance));
        let all = luminance(level.integral());
        Self {
            size,
            small_lights: lights.len(),
            share_of_small_lights: if all > 0.0 { of_lights / all } else { 0.0 },
            bad_texels,
        }
    }
}
