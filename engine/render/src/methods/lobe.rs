//! The environment by a smooth Beckmann lobe, for methods whose papers have lights only (`shared/lobe_light.glsl`).

use super::GlintMaterial;
use crate::environment_tables::{EnvironmentTables, Lobe};
use mica_graph::Graph;

/// The lobe's tables once an update declared them.
#[derive(Default)]
pub(super) struct SmoothEnvironment(Option<Lobe>);

impl SmoothEnvironment {
    /// Declares the passes that fill the tables, the first time.
    pub fn update(&mut self, g: &mut Graph, material: &GlintMaterial, environment: &EnvironmentTables) {
        if self.0.is_none() {
            g.because(format!("material {}: smooth lobe under the environment; first frame", material.name));
            self.0 = Some(environment.beckmann(g));
        }
    }

    /// The tables.
    pub fn lobe(&self) -> Option<&Lobe> {
        self.0.as_ref()
    }
}
