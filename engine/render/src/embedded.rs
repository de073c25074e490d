//! The scenes that come with the program.

use crate::scene::procedural::{self, Detail};
use crate::scene::{Scene, SceneError};

/// A scene inside the program.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedScene {
    /// Its name on command lines.
    pub name: &'static str,
    /// What it shows.
    pub description: &'static str,
    source: Source,
}

/// Where a scene comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// A small file inside the program.
    Glb(&'static [u8]),
    /// Made when it is asked for, as its file would be large.
    Formula(fn(Detail) -> Scene),
}

macro_rules! glb {
    ($name:literal, $description:literal) => {
        EmbeddedScene {
            name: $name,
            description: $description,
            source: Source::Glb(include_bytes!(concat!("../../../assets/scenes/", $name, ".glb"))),
        }
    };
}

/// All of them. `assets/README.md` says how they were made.
pub const EMBEDDED_SCENES: &[EmbeddedScene] = &[
    glb!("shoe", "a pair of glittering pumps: alpha .1, gamma 6 degrees, 1e6 flakes per UV square"),
    glb!("snow", "a field of snow in low sun: alpha .5, gamma 2 degrees, 1e5 flakes per UV square"),
    glb!("cloth", "sparkling cloth draped over a post: alpha .5, gamma 2 degrees, 1e5 flakes per UV square"),
    glb!("dress", "a dress of two glinting materials, sequins above and shimmer below"),
    glb!("car", "metallic flakes under a clear coat on a curved body"),
    glb!("plane", "a glinting plane to the horizon"),
    glb!("sphere", "a glinting sphere"),
    EmbeddedScene {
        name: "drift",
        description: "snow carved by the wind, with boulders: over a million triangles, made when it is loaded",
        source: Source::Formula(procedural::drift),
    },
];

/// An embedded scene by its name.
pub fn embedded_scene(name: &str) -> Option<&'static EmbeddedScene> {
    EMBEDDED_SCENES.iter().find(|scene| scene.name == name)
}

impl EmbeddedScene {
    /// Reads or makes it.
    ///
    /// # Errors
    /// Only if the committed file is broken.
    pub fn load(&self) -> Result<Scene, SceneError> {
        self.load_with(Detail::Full)
    }

    /// The same with [`Detail::Coarse`] shapes if it is [`EmbeddedScene::is_large`]: for what has to look at every scene
    /// and not at its triangles.
    ///
    /// # Errors
    /// As [`EmbeddedScene::load`].
    pub fn load_coarse(&self) -> Result<Scene, SceneError> {
        self.load_with(Detail::Coarse)
    }

    /// Whether it has so many triangles that work on it takes seconds.
    pub fn is_large(&self) -> bool {
        matches!(self.source, Source::Formula(_))
    }

    fn load_with(&self, detail: Detail) -> Result<Scene, SceneError> {
        match self.source {
            Source::Glb(bytes) => Scene::from_glb_bytes(self.name, bytes),
            Source::Formula(make) => Ok(make(detail)),
        }
    }
}
