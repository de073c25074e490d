//! The scenes that come with the program.

use crate::scene::{Scene, SceneError};

/// A scene inside the program.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedScene {
    /// Its name on command lines.
    pub name: &'static str,
    /// What it shows.
    pub description: &'static str,
    glb: &'static [u8],
}

macro_rules! embedded {
    ($($name:literal: $description:literal),* $(,)?) => {
        &[$(EmbeddedScene {
            name: $name,
            description: $description,
            glb: include_bytes!(concat!("../../../assets/scenes/", $name, ".glb")),
        }),*]
    };
}

/// All of them. `assets/README.md` says how they were made.
pub const EMBEDDED_SCENES: &[EmbeddedScene] = embedded! {
    "shoe": "a pair of glittering pumps: alpha .1, gamma 6 degrees, 1e6 flakes per UV square",
    "snow": "a field of snow in low sun: alpha .5, gamma 2 degrees, 1e5 flakes per UV square",
    "cloth": "sparkling cloth draped over a post: alpha .5, gamma 2 degrees, 1e5 flakes per UV square",
    "dress": "a dress of two glinting materials, sequins above and shimmer below",
    "car": "metallic flakes under a clear coat on a curved body",
    "plane": "a glinting plane to the horizon",
    "sphere": "a glinting sphere",
};

/// An embedded scene by its name.
pub fn embedded_scene(name: &str) -> Option<&'static EmbeddedScene> {
    EMBEDDED_SCENES.iter().find(|scene| scene.name == name)
}

impl EmbeddedScene {
    /// Reads it.
    ///
    /// # Errors
    /// Only if the committed file is broken.
    pub fn load(&self) -> Result<Scene, SceneError> {
        Scene::from_glb_bytes(self.name, self.glb)
    }
}
