//! Wang and Bowles 2016: "A Robust and Flexible Real-Time Sparkle Effect", EGSR Experimental Ideas & Implementations.
//!
//! A grid in space, coarser with distance, each cell with a jittered sparkle; the surface cuts through the grid, and the
//! view moves it, which is the twinkle. A sparkle's brightness falls linearly with the squared distance. There is no
//! direction of light in it: a smooth lobe is multiplied. As printed (`repaired=false`) its code has faults:
//! - the level, 0.1 * 2^k - 0.2 with k = floor(log2(0.3 z + 3)), is 0 nearer than z = 3.33, and the grid infinitely fine.
//!   Here nothing sparkles there. Repaired: at least 0.2, and k at least 2;
//! - it writes 2^k as 1.3^(k / log2 1.3), which in floats is not even 0 there but a tiny number of either sign. Here 2^k;
//! - the view's shift, normalize(fract(level v)), is 0/0 where all components are whole: here no sparkle. Repaired: v;
//! - the stretch by (|c| - 1) / |v - c n|^2 with c = v.n is 0/0 at normal incidence: here no sparkle. Repaired:
//!   -1 / (1 + |c|);
//! - the step from one level to the next is sudden. Repaired: two levels are blended. The fract of the view's shift stays:
//!   where a component of level v passes a whole number, the grid jumps;
//! - a sparkle wider than a quarter of a cell is cut at the cell's border. Repaired: the eight nearest cells are asked,
//!   and a sparkle is not stretched so far that it would reach past them;
//! - `sparkle_size` is inverted: larger is smaller. Kept; its range ends before 1, where the radius would be 0, and begins
//!   where the eight nearest cells hold every sparkle that reaches the surface;
//! - sparkles lie in the middle half of their cells: a plane along the grid passes between them or through many. Kept;
//!   `layers` even it out;
//! - very far away the shift differs by more than a cell from pixel to pixel, and sparkles are noise; more than 2^20 cells
//!   from the origin a float does not resolve them, and in the end nothing sparkles. Kept.
//!
//! A look, with this bound: the mean of a plane along one grid is 0 to 2 times the smooth lobe. Over all phases of the grid,
//! as eight layers show them, it is the smooth lobe's: measured on lavapipe within .6 %, printed and repaired; as printed,
//! sparkles that are cut take up to 35 % away.
//!
//! The same material as for other methods: P = sin^2(gamma / 2) / alpha^2, at most 1, of the flakes are lit where the lobe
//! is brightest; where so many in a cell's face are fewer than its sparkles, so many cells stay empty. The paper leaves a
//! sparkle's brightness to the artist: here sparkles carry the lobe's light, so that their mean is the smooth lobe.
//! What is not known of the paper's code is decided so: z is the distance to the eye; its unit is a setting, as scenes have
//! metres, and a centimetre makes sparkles of about a pixel at any distance; a whole shift moves the grid by one cell;
//! random numbers come from the project's integer hash; the position is that in scene space, as no method is told of an
//! object's. The paper has no environment: it is the smooth lobe's, without sparkles.

use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Graph, Image};
use mica_shaders::glints::wang_bowles::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "wang_bowles",
    citation: "B. Wang and H. Bowles, A Robust and Flexible Real-Time Sparkle Effect, EGSR Experimental Ideas & \
               Implementations 2016",
    summary: "Sparkles of a jittered grid in space, shifted by the view and multiplied by a smooth lobe.",
    claim: Claim::Look,
    mean_between: [0.0, 2.0],
    repeats: false,
    settings: &[
        Setting {
            key: "repaired",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Removes the divisions by 0, blends levels and asks neighbouring cells.",
        },
        Setting {
            key: "unit",
            unit: "metres",
            kind: Kind::Real { min: 1e-6, max: 1e3 },
            default: Value::Number(0.01),
            meaning: "Unit of length of the paper's formulas: as printed, nothing nearer than 3.33 of it sparkles.",
        },
        Setting {
            key: "scale",
            unit: "cells per unit of length",
            kind: Kind::Real { min: 1e-3, max: 1e6 },
            default: Value::Number(40.0),
            meaning: "Fineness of the grid: far away a cell covers 0.12 to 0.25 radians over this.",
        },
        Setting {
            key: "sparkle_size",
            unit: "",
            kind: Kind::Real { min: 0.4375, max: 0.999 },
            default: Value::Number(0.9375),
            meaning: "As printed: the larger, the smaller is a sparkle, whose squared radius in cells is 1 less this.",
        },
        Setting {
            key: "twinkle",
            unit: "cells",
            kind: Kind::Real { min: 0.0, max: 10.0 },
            default: Value::Number(1.0),
            meaning: "How far the view shifts the grid.",
        },
        Setting {
            key: "layers",
            unit: "grids",
            kind: Kind::Integer { min: 1, max: 8 },
            default: Value::Number(1.0),
            meaning: "Grids on top of each other, which share the light.",
        },
        Setting {
            key: "round",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(true),
            meaning: "Stretches sparkles along the view, so that they look round.",
        },
    ],
    ladder: &[
        Rung { name: "printed", set: &[] },
        Rung { name: "repaired", set: &[("repaired", "true")] },
        Rung { name: "repaired, 4 layers", set: &[("repaired", "true"), ("layers", "4")] },
    ],
};

/// The method at work. It needs no tables of its own, only the environment's.
#[derive(Default)]
pub(crate) struct WangBowles;

impl Method for WangBowles {
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let lobe = shading.environment.beckmann();
        let values = &material.values;
        let params = Params {
            material: material.index as u32,
            seed: values.number("seed") as u32,
            alpha: values.number("alpha") as f32,
            lit_flakes: material.lit_at_most() as f32,
            unit: values.number("unit") as f32,
            scale: values.number("scale") as f32,
            squared_radius: (1.0 - values.number("sparkle_size")) as f32,
            twinkle: values.number("twinkle") as f32,
            layers: values.number("layers") as u32,
            round_on_screen: u32::from(values.flag("round")),
            repaired: u32::from(values.flag("repaired")),
        };
        let bind = bind_glints!(Bind, shading, glints, prefiltered: &lobe.prefiltered, albedo: &lobe.albedo);
        shading.pass(g, bind, params, material);
    }
}
