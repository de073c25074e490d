//! Zirr and Kaplanyan 2016: "Real-time Rendering of Procedural Multiscale Materials", I3D.
//!
//! Grids of cells over the footprint, each with a number of flakes that shine: random, but the same for the same cell and
//! the same piece of the lobe. A flake has a lobe of its own, alpha_m, within the whole one, alpha.
//!
//! A look, with this bound: without variation and light's cone, the mean of pixels is 1 to -ln(1 - p) / p times the smooth
//! limit, p being the probability that a flake shines. Measured on lavapipe: within 2 % of 1 where a cell expects several
//! flakes; 1.17 at p = .27 and 1.7 at p = .7 where it expects a tenth. As it stands; its faults:
//! - that: the count is drawn for a fractional number of flakes, and divided by it;
//! - `variation` multiplies a cell's flakes by 1 plus a normal number; what comes out below 0 is folded back to tiny
//!   positive numbers, of which the count is divided by the sum: 6.7 times too bright at the published example's 100 with
//!   one flake in a footprint, and `count` is not the number of flakes any more. Hence 0 by default;
//! - the Gaussian branch of the counts lacks a factor sqrt 2: half the variance (`root_two=true` repairs it);
//! - two grids of cells at least as wide as the footprint, blended linearly and weighted by coverage, take variance away:
//!   .46 to .65 of the binomial one is left, and .24 with the fault before;
//! - a cell's index is shorn of its factors of 2, so that some cells of one grid are those of the next: a grid repeats
//!   itself too, cell 3 in cells 6, 12 and so on. Cells of index 0 would be shifted by an undefined number of bits: here
//!   they are cells 0 of all grids;
//! - the lights' cone is mixed into the probability, which leaves a floor of light beyond the lobe. Lights are points and
//!   directions here: 0 by default, .01 in the published example.
//!
//! The same material as for other methods: alpha is the whole lobe's roughness, count the flakes per UV square, and
//! alpha_m = sin(gamma / 2) / sqrt(i.h), at most alpha, so that a flake's lobe, pi alpha_m^2, fills the solid angle
//! sigma / (4 i.h) of half vectors that a mirror flake of cone gamma answers to. Hence p is D(h) sigma / (4 i.h): the mean
//! is the smooth lobe, not its average over the cone.
//!
//! Not as published: random numbers come from the project's integer hash instead of fract(sin(mod(n, 3.14)) 753.5453),
//! which differs from device to device; erfinv of a uniform number is drawn as a normal number over sqrt 2; roughness is
//! isotropic. What is left open is decided so: counts are summed over all cells and both grids before they are divided by
//! the expected number; where the fine grid has more cells along the footprint than are walked, those in the middle count;
//! a footprint without area, too large, or too far from the origin for its cells to be told apart shows the smooth lobe;
//! pieces of the lobe are told apart in the shared frame about the normal, as no tangents of the texture are at hand.
//! The paper has lights only: the environment is the smooth lobe's.

use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Graph, Image};
use mica_shaders::glints::zirr_kaplanyan::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "zirr_kaplanyan",
    citation: "T. Zirr and A. S. Kaplanyan, Real-time Rendering of Procedural Multiscale Materials, I3D 2016",
    summary: "Counts of shining flakes drawn for the cells of two grids over the footprint.",
    claim: Claim::Look,
    mean_between: [0.95, 1.05],
    repeats: false,
    settings: &[
        Setting {
            key: "cells",
            unit: "cells",
            kind: Kind::Integer { min: 3, max: 66 },
            default: Value::Number(18.0),
            meaning: "Cells walked along the footprint's long axis, at most.",
        },
        Setting {
            key: "variation",
            unit: "",
            kind: Kind::Real { min: 0.0, max: 1000.0 },
            default: Value::Number(0.0),
            meaning: "Of the number of flakes from cell to cell; above 0 it is not `count`, and energy is not conserved.",
        },
        Setting {
            key: "cone",
            unit: "radians",
            kind: Kind::Real { min: 0.0, max: 0.5 },
            default: Value::Number(0.0),
            meaning: "Angular radius of the lights, mixed into the probability; the published example has 0.01.",
        },
        Setting {
            key: "dynamic_range",
            unit: "times the smooth lobe",
            kind: Kind::Real { min: 1.0, max: 1e9 },
            default: Value::Number(5e4),
            meaning: "Brighter glints are cut down to this.",
        },
        Setting {
            key: "root_two",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Restores the factor sqrt 2 that the Gaussian branch of the counts lacks.",
        },
    ],
    ladder: &[
        Rung { name: "cells 4", set: &[("cells", "4")] },
        Rung { name: "cells 8", set: &[("cells", "8")] },
        Rung { name: "printed", set: &[] },
        Rung { name: "cells 34", set: &[("cells", "34")] },
    ],
};

/// The method at work. It needs no tables of its own, only the environment's.
#[derive(Default)]
pub(crate) struct ZirrKaplanyan;

impl Method for ZirrKaplanyan {
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let lobe = shading.environment.beckmann();
        let values = &material.values;
        let params = Params {
            material: material.index as u32,
            seed: values.number("seed") as u32,
            alpha: values.number("alpha") as f32,
            sin_half_gamma: material.sin2_half_gamma().sqrt() as f32,
            density: material.flakes() as f32,
            cone: values.number("cone") as f32,
            variation: values.number("variation") as f32,
            dynamic_range: values.number("dynamic_range") as f32,
            long_cells: values.number("cells") as u32,
            root_two: u32::from(values.flag("root_two")),
        };
        let bind = bind_glints!(Bind, shading, glints, prefiltered: &lobe.prefiltered, albedo: &lobe.albedo);
        shading.pass(g, bind, params, material);
    }
}
