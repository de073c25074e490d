//! Atanasov and Koylazov 2016: "A Practical Stochastic Algorithm for Rendering Mirror-Like Flakes".
//!
//! A talk of two pages, the algorithm behind V-Ray's stochastic flakes. Known of it, from its abstract, from later authors'
//! words about it and from the manual of V-Ray:
//! - the model is that of Jakob et al. 2014, but only its spatial hierarchy is kept and nothing is precomputed: counts are
//!   split at random, nodes that the footprint touches are descended into, and at the end stand the footprint's flakes as
//!   a list of explicit normals drawn from the distribution;
//! - the viewer's direction is mirrored at each of them once (the talk's reflection cache); a flake is lit where the light
//!   is within gamma of its mirror direction;
//! - light is sampled by choosing flakes and then a direction inside their cone ("optimal importance sampling");
//! - `blend_min` and `blend_max` flakes in a pixel, between which V-Ray goes over to the smooth distribution.
//!
//! Decided here, as the text does not tell or another choice serves better:
//! - the flakes are those of the flake set (engine/design/0007): where they are enumerated they are the reference's flakes,
//!   up to f32 at the edges of footprint and cone. They carry the weight 1 / (m.n), without which the mean would be too
//!   dark by that cosine; the factor i.h is taken at the half vector as in Jakob et al.;
//! - all lights are tested in one traversal;
//! - under an environment every flake of the list is asked rather than some that are chosen: each reflects what it meets
//!   in one direction of its cone, another in each frame, so that a constant environment does not sparkle and `--samples`
//!   converges;
//! - with more flakes in the footprint than `enumerated`, or where the footprint is so long that a traversal to the leaves
//!   takes too many steps, it ends after a few hundred, mostly above the leaves: a node's lit flakes are then a draw from
//!   the law of their number given the node's, Binomial(n, share P), by a random word of the node. The word stays while the
//!   light moves, so that counts change by ones; the neighbouring pixel's part of the same node uses it too, so that
//!   neighbours are a little alike. Counts keep their law, but the flakes are no longer those of the reference: hence the
//!   claim;
//! - with more than 4 lights that traversal is shorter by as much, and when its draws have taken the invocation's steps, what
//!   is left of it counts as expected: hundreds of lit flakes under dozens of lights lose part of their variance;
//! - a footprint over hundreds of squares of texture draws the lit flakes of one square and repeats them;
//! - blending to the smooth lobe is off unless asked for: it takes away the variance that is left there.
//!
//! Left out: GGX and triplanar mapping (flakes are Beckmann's and lie in texture space here), flakes of several colours.
//!
//! Needs shaderInt64.

use super::{Claim, GlintMaterial, Method, MethodInfo, Reads, Rung, Shading, bind_glints, leaf_level};
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Graph, Image};
use mica_shaders::glints::atanasov::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "atanasov",
    citation: "A. Atanasov and V. Koylazov, A Practical Stochastic Algorithm for Rendering Mirror-Like Flakes, ACM \
               SIGGRAPH 2016 Talks",
    summary: "Descends a hierarchy over texture space and tests the normals of the flakes at its end one by one.",
    claim: Claim::Distribution,
    mean_between: [0.99, 1.01],
    repeats: true,
    settings: &[
        Setting {
            key: "enumerated",
            unit: "flakes in the footprint",
            kind: Kind::Real { min: 0.0, max: 2000.0 },
            default: Value::Number(1000.0),
            meaning: "Up to so many, each flake is tested; beyond, a traversal of a few hundred steps ends sooner and the \
                      lit flakes of a node are drawn from their law.",
        },
        Setting {
            key: "blend_min",
            unit: "flakes in the footprint",
            kind: Kind::Real { min: 0.0, max: 1e12 },
            default: Value::Number(1e12),
            meaning: "From so many on, the smooth lobe is mixed in.",
        },
        Setting {
            key: "blend_max",
            unit: "flakes in the footprint",
            kind: Kind::Real { min: 0.0, max: 1e12 },
            default: Value::Number(1e12),
            meaning: "From so many on, there is nothing but the smooth lobe.",
        },
        Setting {
            key: "samples",
            unit: "directions",
            kind: Kind::Integer { min: 1, max: 1024 },
            default: Value::Number(16.0),
            meaning: "Normals drawn in each pixel and frame for the environment's part of flakes that are not tested one \
                      by one.",
        },
    ],
    ladder: &[
        Rung { name: "blended", set: &[("enumerated", "50"), ("blend_min", "50"), ("blend_max", "100")] },
        Rung { name: "counted", set: &[("enumerated", "0")] },
        Rung { name: "100 enumerated", set: &[("enumerated", "100")] },
        Rung { name: "1000 enumerated", set: &[] },
    ],
};

/// The method at work. It needs no tables.
#[derive(Default)]
pub(crate) struct Atanasov;

impl Method for Atanasov {
    fn reads(&self) -> Reads {
        Reads::Map
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let values = &material.values;
        let alpha = values.number("alpha");
        let flakes = material.flakes();
        let params = Params {
            material: material.index as u32,
            alpha: alpha as f32,
            slope_deviation: (alpha * std::f64::consts::FRAC_1_SQRT_2) as f32,
            sin2_half_gamma: material.sin2_half_gamma() as f32,
            flakes: flakes as f32,
            flakes_low: flakes as u32,
            flakes_high: (flakes >> 32) as u32,
            leaf_level: leaf_level(flakes),
            seed: values.number("seed") as u32,
            enumerated_below: values.number("enumerated") as f32,
            blend_from: values.number("blend_min") as f32,
            blend_to: values.number("blend_max") as f32,
            samples: values.number("samples") as u32,
        };
        let bind = bind_glints!(Bind, shading, glints, environment: shading.environment.map());
        shading.pass(g, bind, params, material);
    }
}
