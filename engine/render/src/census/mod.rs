//! What there is to simulate: counted once when a scene is loaded, and kept current on edits.
//!
//! A frame follows from it: the nodes that are declared, the tables that are made, and by [`Census::effects`] what shaders are
//! specialised for. Nothing that nobody sees is counted: materials that no triangle shows call for nothing.

mod effects;
mod environment;
mod lights;
mod materials;

pub use effects::Effect;
pub use environment::EnvironmentCensus;
pub use lights::LightCensus;
pub use materials::{GlintCensus, MaterialCensus};

use crate::GlintMaterial;
use crate::moved::Moved;
use crate::scene::Scene;
use glam::DAffine3;
use materials::Surfaces;
use serde::Serialize;

/// What a scene, its lights and its settings hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Census {
    /// How many instances there are.
    pub instances: usize,
    /// How many of them are not where they were when the scene was loaded.
    pub moved_instances: usize,
    /// Triangles that the instances show together.
    pub triangles: u64,
    /// The materials, in the order of the scene.
    pub materials: Vec<MaterialCensus>,
    /// The lights.
    pub lights: LightCensus,
    /// Light from everywhere, if there is any.
    pub environment: Option<EnvironmentCensus>,
}

/// The census of a renderer's scene, and what it is brought up to date from.
pub(crate) struct Counted {
    census: Census,
    surfaces: Surfaces,
    moved: Moved,
}

impl Counted {
    /// Counts everything.
    pub fn new(
        scene: &Scene,
        glinting: &[GlintMaterial],
        lights: LightCensus,
        environment: Option<EnvironmentCensus>,
    ) -> Self {
        let surfaces = Surfaces::of(scene);
        let census = Census {
            instances: scene.instances.len(),
            moved_instances: 0,
            triangles: surfaces.triangles(),
            materials: surfaces.materials(scene, glinting),
            lights,
            environment,
        };
        Self { census, surfaces, moved: Moved::default() }
    }

    /// What was counted.
    pub fn census(&self) -> &Census {
        &self.census
    }

    /// After an edit of a material, of its glints' settings, or of their methods.
    pub fn note_materials(&mut self, scene: &Scene, glinting: &[GlintMaterial]) {
        self.census.materials = self.surfaces.materials(scene, glinting);
    }

    /// After an instance was moved.
    pub fn note_moved(&mut self, instance: usize, from: DAffine3, to: DAffine3) {
        self.moved.note(instance, from, to);
        self.census.moved_instances = self.moved.count();
    }

    /// After the lights were exchanged.
    pub fn note_lights(&mut self, lights: LightCensus) {
        self.census.lights = lights;
    }

    /// After the environment was exchanged.
    pub fn note_environment(&mut self, environment: Option<EnvironmentCensus>) {
        self.census.environment = environment;
    }
}
