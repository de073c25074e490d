//! Shopf: "Gettin' Procedural", AMD, cited as of 2012: the sparkle of its snow.
//!
//! The talk's own text was not at hand. Known from several public shaders that quote its formula, word for word the same,
//! and from ATI's sample "Glitter", which has it too:
//!
//! ```text
//! specular = saturate(dot(reflect(-normalize(v), n), l))
//! f        = frac(0.7 x + 9 noise(0.04 x) + 0.1 v);   f *= 1 - f
//! glitter  = saturate(1 - 7 (f.x + f.y + f.z))
//! sparkle  = glitter * pow(specular, 1.5)
//! ```
//!
//! x is the position in object space, v the vector from it to the eye, not normalised, and noise a texture of random values.
//! The sample adds it to a highlight of exponent 24, and takes a lower exponent for the glitter so that it spreads more. Its
//! faults:
//! - no footprint: a grid finer than the pixels is noise, brighter the rarer;
//! - the lattice shows, as cells all have their sparkle in the same place; it is bent by the noise, not broken;
//! - the eye drags the lattice with it: 0.1 v is -0.1 x too, and sparkles change by where the eye is, not by the half
//!   vector;
//! - frac of large numbers: beyond 2^23 cells every f is 0 and the whole surface shines at a sparkle's full strength;
//!   beyond 2^18 what is left of f is coarse (`repaired=true` fades the grid to its mean there).
//!
//! Decided: the lattice has as many corners in a square metre as there are flakes lit at the lobe's brightest,
//! P = sin^2(gamma / 2) / alpha^2, at most 1, of them, to the nearest power of 4 (a seam shows where a stretched texture
//! passes from one to the next); 0.04, 9 and 0.1 are kept in cells: 0.0571 periods a cell, 9 cells, 1/7 cell for a cell's
//! way of the eye. The broad lobe is Beckmann's with alpha times sqrt(24 / 1.5), the ratio of the exponents; it takes
//! `share` of the lobe's light, and glitter is divided by its mean. Noise comes from the project's integer hash. Position is
//! that in scene space. The environment is the smooth lobe's.
//!
//! A look, with this bound: near the origin the mean over many sparkles is the mixture of both smooth lobes (measured on
//! lavapipe within 8 %, of noise), and no pixel of the broad one is above 848 times it.

use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Graph, Image};
use mica_shaders::glints::shopf::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "shopf",
    citation: "J. Shopf, Gettin' Procedural, AMD technical talk (GDC 2010, published 2012)",
    summary: "A lattice of sparkles in space, bent by noise and moved by the eye, where a broad lobe is lit.",
    claim: Claim::Look,
    mean_between: [0.3, 1.5],
    repeats: false,
    settings: &[
        Setting {
            key: "share",
            unit: "",
            kind: Kind::Real { min: 0.0, max: 1.0 },
            default: Value::Number(0.5),
            meaning: "How much of the lobe's light glitters.",
        },
        Setting {
            key: "spread",
            unit: "times",
            kind: Kind::Real { min: 1.0, max: 1000.0 },
            default: Value::Number(4.0),
            meaning: "How much rougher the glittering lobe is than the smooth one.",
        },
        Setting {
            key: "noise",
            unit: "cells",
            kind: Kind::Real { min: 0.0, max: 100.0 },
            default: Value::Number(9.0),
            meaning: "How far the noise moves the lattice.",
        },
        Setting {
            key: "twinkle",
            unit: "cells per cell",
            kind: Kind::Real { min: 0.0, max: 1.0 },
            default: Value::Number(1.0 / 7.0),
            meaning: "How far the lattice moves when the eye does.",
        },
        Setting {
            key: "repaired",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Fades the lattice to its mean so far from the origin that a float does not resolve it.",
        },
    ],
    ladder: &[Rung { name: "smooth", set: &[("share", "0")] }, Rung { name: "printed", set: &[] }],
};

/// The method at work. It needs no tables of its own, only the environment's.
#[derive(Default)]
pub(crate) struct Shopf;

impl Method for Shopf {
    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let lobe = shading.environment.beckmann();
        let values = &material.values;
        let alpha = values.number("alpha");
        let params = Params {
            material: material.index as u32,
            seed: values.number("seed") as u32,
            alpha: alpha as f32,
            broad_alpha: (alpha * values.number("spread")).min(1.0) as f32,
            lit_flakes: material.lit_at_most() as f32,
            glitter_share: values.number("share") as f32,
            noise_cells: values.number("noise") as f32,
            twinkle: values.number("twinkle") as f32,
            repaired: u32::from(values.flag("repaired")),
        };
        let bind = bind_glints!(Bind, shading, glints, prefiltered: &lobe.prefiltered, albedo: &lobe.albedo);
        shading.pass(g, bind, params, material);
    }
}
