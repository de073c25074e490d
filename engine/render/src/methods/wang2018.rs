//! Wang, Wang, Holzschuch 2018: "Fast Global Illumination with Discrete Stochastic Microfacets Using a Filterable Model".
//!
//! The four-dimensional search of Jakob et al. 2014 in two steps of two dimensions: a quadtree over texture space says how
//! many flakes lie where, and a table of the directional probability function (DPF) how likely one of them is lit.
//!
//! Kept as it is in the authors' program, faults included:
//! - the random numbers that decide which flakes are lit are drawn anew for each pair of directions in whole degrees:
//!   glints neither persist nor fade while light or viewer move, they are replaced at each degree;
//! - flakes have no weight 1 / (h.n): the mean is too dark by that cosine (`weighted=true` repairs it);
//! - the table is looked up at the nearest entry, and the difference of azimuths is not folded: within half a degree below
//!   a full turn the entry of the next polar angle is read (`interpolated=true` repairs both);
//! - entries of whole degrees are added up for gamma: the mean is wrong by up to tens of percent where the cone is not
//!   small beside the lobe, and entries within gamma / 2 of the pole and the horizon are lost (`dpf=closed` repairs both);
//! - a leaf that lies partly inside counts by its share of area, and one with more than 16 lit flakes by its expectation:
//!   the count's variance is too small where leaves are not small beside the footprint (magnified leaves are squares),
//!   and where flakes are many.
//!
//! Decided here: counts are split as in the flake set (engine/design/0007), without loss, so that they are those of the
//! other methods down to its leaves; the traversal ends on level 11 (the program's "0.55 of the maximal depth" leaves open
//! of what), or sooner where the footprint covers so many leaves that they do not fit a bounded traversal; the integer hash
//! stands for TEA; a leaf with more than 16 flakes draws their number at once, which has the same law; the table is made at
//! the material's own roughness, accumulated as in `wang2020` (round(gamma) entries an axis). The paper filters the DPF
//! and the environment into directional levels for indirect light: here `samples` directions are drawn in each pixel and
//! frame instead, others in each, so that `--samples` converges to what the levels approximate. They are drawn as random
//! flakes would reflect, by density P / sigma, so that the table's error cancels in what they add. Lights and directions
//! share the loop iterations that draws may take: once they are spent, further leaves count by their expectation.
//!
//! Needs shaderInt64.

use super::dpf::{self, AccumulatedKey, DpfSource};
use super::shared::Shared;
use super::{Claim, GlintMaterial, Method, MethodInfo, Reads, Rung, Shading, bind_glints};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::Executor;
use mica_graph::{Buffer, Graph, Image, Lifetime};
use mica_shaders::glints::wang2018::{Bind, Params};

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "wang2018",
    citation: "B. Wang, L. Wang, N. Holzschuch, Fast Global Illumination with Discrete Stochastic Microfacets Using a \
               Filterable Model, Computer Graphics Forum 37(7), 2018",
    summary: "A quadtree says how many flakes there are, a table how likely each of them is lit.",
    claim: Claim::Look,
    mean_between: [0.9, 1.1],
    repeats: true,
    settings: &[
        Setting {
            key: "dpf",
            unit: "",
            kind: Kind::Choice(&["quadrature", "counted", "closed"]),
            default: Value::Word("quadrature"),
            meaning: "Where P comes from: a table made by quadrature, a table made by counting random flakes as the \
                      paper does, or no table.",
        },
        Setting {
            key: "dpf_flakes",
            unit: "flakes",
            kind: Kind::Integer { min: 1, max: 4_000_000_000 },
            default: Value::Number(1e9),
            meaning: "Flakes counted when dpf=counted; the paper counts 1e9.",
        },
        Setting {
            key: "interpolated",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Looks the table up linearly and with folded azimuths, and not at the nearest entry.",
        },
        Setting {
            key: "weighted",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Gives flakes the weight 1 / (h.n) that is left out.",
        },
        Setting {
            key: "depth",
            unit: "levels",
            kind: Kind::Integer { min: 0, max: 18 },
            default: Value::Number(11.0),
            meaning: "Level of the quadtree's leaves.",
        },
        Setting {
            key: "expectation",
            unit: "lit flakes in a leaf",
            kind: Kind::Real { min: 0.0, max: 1e12 },
            default: Value::Number(16.0),
            meaning: "Above this a leaf's lit flakes are not drawn, but expected.",
        },
        Setting {
            key: "samples",
            unit: "directions",
            kind: Kind::Integer { min: 1, max: 16 },
            default: Value::Number(4.0),
            meaning: "Directions drawn from the environment in each pixel and frame.",
        },
    ],
    ladder: &[
        Rung { name: "expected", set: &[("expectation", "0"), ("depth", "0")] },
        Rung { name: "depth 8", set: &[("depth", "8")] },
        Rung { name: "printed", set: &[] },
        Rung { name: "repaired", set: &[("dpf", "closed"), ("weighted", "true"), ("expectation", "1e12")] },
    ],
};

/// What a 1-degree table depends on: how it is made, and the roughness.
type DpfKey = (DpfSource, f64);

/// The method at work.
pub(crate) struct Wang2018 {
    /// 1-degree tables.
    dpf: Shared<DpfKey, Buffer>,
    /// P(i, o, gamma).
    accumulated: Shared<AccumulatedKey, Buffer>,
    /// Stands for the table where P has its closed form: shaders bind it but do not read it.
    no_table: Buffer,
}

impl Default for Wang2018 {
    fn default() -> Self {
        let no_table = Buffer::new("dpf_absent", 16, Lifetime::Scene);
        Self { dpf: Shared::default(), accumulated: Shared::default(), no_table }
    }
}

/// Where the material's P comes from; nothing where it has its closed form.
fn source(material: &GlintMaterial) -> Option<DpfSource> {
    (material.values.word("dpf") != "closed").then(|| DpfSource::of(material))
}

/// The 1-degree table that a material's settings ask for; none where P has its closed form.
fn dpf_key(material: &GlintMaterial) -> Option<DpfKey> {
    source(material).map(|source| (source, material.values.number("alpha")))
}

impl Method for Wang2018 {
    fn precompute(
        &mut self,
        material: &GlintMaterial,
        executor: &mut Executor,
        cache: Option<&Cache>,
        progress: Progress,
    ) -> Result<Vec<Update>, RenderError> {
        // Quadrature at one roughness is no longer than a frame.
        let Some(key @ (source @ DpfSource::Counted { .. }, alpha)) = dpf_key(material) else { return Ok(Vec::new()) };
        if self.dpf.get(key).is_some() {
            return Ok(Vec::new());
        }
        let (table, update) = dpf::precompute(source, &[alpha as f32], executor, cache, progress)?;
        self.dpf.insert(key, table);
        Ok(vec![update])
    }

    fn update(
        &mut self,
        g: &mut Graph,
        _kept: &mut Kept,
        materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
        let there = self.dpf.keys();
        // Counting takes too long for a frame: it happens in `precompute`, and a table by quadrature stands in without it.
        let found = |material: &GlintMaterial| {
            let key = dpf_key(material)?;
            Some(if there.contains(&key) { key } else { (DpfSource::Quadrature, key.1) })
        };
        self.dpf.update(materials, found, |wanted| {
            let (_, alpha) = wanted.key;
            wanted.because(g, format_args!("directional probabilities at alpha {alpha}"));
            Some(dpf::quadrature(g, &[alpha as f32], wanted.spare))
        });
        let key = |material: &GlintMaterial| {
            found(material).map(|(source, alpha)| (alpha, material.values.number("gamma_deg"), source))
        };
        self.accumulated.update(materials, key, |wanted| {
            let (alpha, _, source) = wanted.key;
            let table = self.dpf.get((source, alpha))?;
            Some(dpf::accumulated(g, wanted, (&[alpha as f32], table)))
        });
    }

    fn reads(&self) -> Reads {
        Reads::Map
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let values = &material.values;
        let flakes = material.flakes();
        let accumulated = self.accumulated.of(material);
        let params = Params {
            material: material.index as u32,
            alpha: values.number("alpha") as f32,
            sin2_half_gamma: material.sin2_half_gamma() as f32,
            flakes: flakes as f32,
            flakes_low: flakes as u32,
            flakes_high: (flakes >> 32) as u32,
            leaf_level: values.number("depth") as u32,
            seed: values.number("seed") as u32,
            expectation_above: values.number("expectation") as f32,
            samples: values.number("samples") as u32,
            closed_form: u32::from(accumulated.is_none()),
            interpolated: u32::from(values.flag("interpolated")),
            weighted: u32::from(values.flag("weighted")),
        };
        let accumulated = accumulated.unwrap_or(&self.no_table);
        let bind =
            bind_glints!(Bind, shading, glints, accumulated: accumulated, environment: shading.environment.map());
        shading.pass(g, bind, params, material);
    }
}
