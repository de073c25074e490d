//! The limit of infinitely many flakes: a smooth Beckmann lobe (Beckmann and Spizzichino 1963; Walter et al. 2007).
//!
//! The environment's part is a split sum (Karis 2013): exact in the lobe's albedo, approximate in the lobe's shape.

use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use mica_graph::{Graph, Image};
use mica_shaders::glints::smooth::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "smooth",
    citation: "P. Beckmann and A. Spizzichino, The Scattering of Electromagnetic Waves from Rough Surfaces, 1963; \
               B. Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007",
    summary: "The same surface without glints: what infinitely many flakes of narrow cones look like. The environment is \
              a split sum, darker than the truth at grazing views (by 38 % at 83 degrees under `overcast`, alpha .3).",
    claim: Claim::Mean,
    mean_between: [0.99, 1.01],
    repeats: false,
    settings: &[],
    ladder: &[Rung { name: "smooth", set: &[] }],
};

/// The smooth limit at work. It needs no tables of its own, only the environment's.
#[derive(Default)]
pub(crate) struct Smooth;

impl Method for Smooth {
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let lobe = shading.environment.beckmann();
        let params = Params { material: material.index as u32, alpha: material.values.number("alpha") as f32 };
        let bind = bind_glints!(Bind, shading, glints, prefiltered: &lobe.prefiltered, albedo: &lobe.albedo);
        // Its own name: it shares the frame of the glints' shader, but there are no glints.
        shading.pass_named(g, INFO.name, bind, params, material);
    }
}
