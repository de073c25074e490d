//! The lights of a census.

use crate::scene::Light;
use serde::Serialize;

/// Lights by their kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LightCensus {
    /// At points.
    pub point: usize,
    /// At infinity.
    pub directional: usize,
    /// With a cone.
    pub spot: usize,
}

impl LightCensus {
    /// Counts lights.
    pub fn of<'a>(lights: impl IntoIterator<Item = &'a Light>) -> Self {
        let mut census = Self::default();
        for light in lights {
            *match light {
                Light::Point { .. } => &mut census.point,
                Light::Directional { .. } => &mut census.directional,
                Light::Spot { .. } => &mut census.spot,
            } += 1;
        }
        census
    }

    /// All of them.
    pub fn count(&self) -> usize {
        self.point + self.directional + self.spot
    }
}
