//! What is made by formula when it is asked for: environments, and the scene that is too large for a file.

mod boulder;
mod drift;
mod environment;
mod noise;

pub use drift::drift;
pub use environment::{NAMES, SUN_ANGULAR_RADIUS, SUN_DIRECTION, SUN_IRRADIANCE, environment};

/// How finely a scene is made. Its shapes, materials, lights and camera are the same either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// As it is meant to be.
    Full,
    /// With an eighth of the vertices along each line: where only the rest of the scene matters.
    Coarse,
}

impl Detail {
    /// How many cells stand for so many.
    fn cells(self, full: usize) -> usize {
        match self {
            Self::Full => full,
            Self::Coarse => full / 8,
        }
    }
}
