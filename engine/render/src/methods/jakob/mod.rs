//! Jakob, Hasan, Yan, Lawrence, Ramamoorthi, Marschner 2014: "Discrete Stochastic Microfacet Models".
//!
//! A hierarchy over place and normal at once, walked on the GPU; its flakes are of its own tree
//! (engine/design/0008-tree-of-jakob.md), the same on every device and in the oracle.
//!
//! Faults of the paper, of its authors' plugin and of a later student's report, and what is done here:
//! - the plugin draws flakes by D cos and gives all the same weight, so that the mean is D cos: too dark by the cosine of
//!   the half vector. Here flakes are drawn by D / S_D and weigh S_D; `weighted=false` leaves the weight out;
//! - the test of arcs against the conic misses a cone that lies within one triangle, and the report's accepts roots beyond
//!   the arc. Here triangles have cones about them, and chords are compared; undecided triangles are divided;
//! - criterion (10) takes the share p of a node for exact, but the density is not constant in a triangle: with many flakes
//!   it accepts large nodes and the mean is off. Here an accepted node counts what is expected of it: its triangle is
//!   divided on, by the expected shares, down to leaves in which the density is linear. The mean is exact at any epsilon;
//! - criterion (10) bounds the error of each node, not of their sum: with epsilon .1, the nodes met after the first ten
//!   counts or so lose their randomness: of 30 lit flakes' variance .29 to .58 is left. Only `epsilon=0` is exact;
//! - the multinomials of the plugin are rounded normals, their sum repaired at random. Here three binomials follow each
//!   other, exact up to 64 flakes and beyond 64 but for the rounding of a halving;
//! - the density of the sampled directions is averaged over 64 samples of the cone. Here it is the integral itself
//!   (`lit_probability.glsl`);
//! - `product=true` is the report's variant: the share of places times the share of normals, each from a tree of its own.
//!   Its mean is right, its variance that of the places alone: flakes do not twinkle, footprints do.
//!
//! Decided where the paper is silent: the footprint is the pixel's parallelogram, without the plugin's limits to its shape
//! (axes within 4 : 1, sine at least 1/4); one over more than 64 squares of texture, or over a square or more with a
//! million flakes, shows the share of a whole square. A walk has a number of steps: when few are left, what is not walked
//! counts as expected, and a footprint of more than 2000 flakes, or one that hardly any steps are left for (many lights, many
//! `samples`), shows nothing but its expectation. Needs shaderInt64 and shaderFloat64. A cut triangle that is
//! no leaf is accepted only with more than 1000 flakes: its expectation is dearer than a walk through fewer.
//!
//! Needs shaderInt64 and shaderFloat64.

mod triangles;

use super::shared::Shared;
use super::{Claim, GlintMaterial, Method, MethodInfo, Reads, Rung, Shading, bind_glints, leaf_level};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Buffer, Graph, Image, Lifetime};
use mica_shaders::constants as c;
use mica_shaders::glints::jakob::{Bind, Params};
use std::f64::consts::PI;
pub use triangles::JakobTable;

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "jakob",
    citation: "W. Jakob, M. Hasan, L.-Q. Yan, J. Lawrence, R. Ramamoorthi, S. Marschner, Discrete Stochastic \
               Microfacet Models, ACM Transactions on Graphics 33(4), 2014",
    summary: "Flakes counted in the footprint and the cone by a tree over place and normal, made as it is walked. The \
              distribution is that claimed with epsilon=0; the paper's .1 keeps the mean and loses variance.",
    claim: Claim::Distribution,
    mean_between: [0.99, 1.01],
    repeats: true,
    settings: &[
        Setting {
            key: "epsilon",
            unit: "",
            kind: Kind::Real { min: 0.0, max: 1.0 },
            default: Value::Number(0.1),
            meaning: "A node whose standard error is at most this times the flakes found so far counts as expected \
                      (criterion 10); 0 counts every flake \
                      that the steps of an invocation suffice for.",
        },
        Setting {
            key: "mean_area",
            unit: "UV squares",
            kind: Kind::Real { min: 1e-12, max: 1.0 },
            default: Value::Number(1e-5),
            meaning: "Area of the footprints to expect, which the tree's shape, and so its flakes, depend on.",
        },
        Setting {
            key: "steps",
            unit: "steps",
            kind: Kind::Integer { min: 200, max: c::JAKOB_STEPS as u64 },
            default: Value::Number(c::JAKOB_STEPS as f64),
            meaning: "What a pixel may take for all its walks; a walk that they do not suffice for shows its expectation, \
                      without glints. Fewer are faster.",
        },
        Setting {
            key: "weighted",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(true),
            meaning: "Gives flakes the weight that makes the mean D(h).",
        },
        Setting {
            key: "product",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Multiplies the share of flakes in the footprint by the share of flakes that are lit, instead of \
                      counting flakes that are both.",
        },
        Setting {
            key: "samples",
            unit: "directions",
            kind: Kind::Integer { min: 1, max: 64 },
            default: Value::Number(1.0),
            meaning: "Directions drawn for the environment in each pixel and frame.",
        },
    ],
    ladder: &[
        Rung { name: "2500 steps", set: &[("steps", "2500")] },
        Rung { name: "epsilon .5", set: &[("epsilon", "0.5")] },
        Rung { name: "epsilon .1", set: &[] },
        Rung { name: "epsilon .02", set: &[("epsilon", "0.02")] },
        Rung { name: "epsilon 0", set: &[("epsilon", "0")] },
    ],
};

/// The method at work.
#[derive(Default)]
pub(crate) struct Jakob {
    /// By alpha.
    tables: Shared<f64, Table>,
}

/// The triangles of one roughness on the GPU.
struct Table {
    triangles: Buffer,
    density_integral: f64,
}

impl Method for Jakob {
    fn update(
        &mut self,
        g: &mut Graph,
        _kept: &mut Kept,
        materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
        let alpha = |material: &GlintMaterial| Some(material.values.number("alpha"));
        self.tables.update(materials, alpha, |wanted| {
            let change = if wanted.before.is_some() { "alpha is now" } else { "first frame with alpha" };
            wanted.because(g, format_args!("{change} {}", wanted.key));
            let JakobTable { triangles, density_integral } = JakobTable::new(wanted.key);
            let bytes: &[u8] = bytemuck::cast_slice(&triangles);
            let mut triangles = Buffer::new("jakob_triangles", bytes.len() as u64, Lifetime::Settings);
            g.upload(&mut triangles, bytes);
            Some(Table { triangles, density_integral })
        });
    }

    fn reads(&self) -> Reads {
        Reads::Map
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let Some(table) = self.tables.of(material) else { return };
        let values = &material.values;
        let flakes = material.flakes();
        let sin2 = material.sin2_half_gamma();
        // q_omega = pi (1 - cos gamma) / 2.
        let mean_solid_angle = PI * sin2;
        let params = Params {
            material: material.index as u32,
            alpha: values.number("alpha") as f32,
            sin_half_gamma: sin2.sqrt() as f32,
            cos_half_gamma: (1.0 - sin2).sqrt() as f32,
            solid_angle: material.solid_angle() as f32,
            flakes_low: flakes as u32,
            flakes_high: (flakes >> 32) as u32,
            seed: values.number("seed") as u32,
            last_level: leaf_level(flakes),
            split_ratio: (mean_solid_angle / values.number("mean_area")) as f32,
            epsilon: values.number("epsilon") as f32,
            weight: if values.flag("weighted") { table.density_integral as f32 } else { 1.0 },
            density_integral: table.density_integral as f32,
            product: u32::from(values.flag("product")),
            samples: values.number("samples") as u32,
            steps: values.number("steps") as u32,
        };
        let bind = bind_glints!(
            Bind, shading, glints,
            triangles: &table.triangles,
            environment: shading.environment.map(),
        );
        shading.pass(g, bind, params, material);
    }
}
