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

use super::dpf::{self, Accumulated, DpfSource};
use super::{Claim, GlintMaterial, Method, MethodInfo, Rung, Shading, bind_glints};
use crate::environment_tables::EnvironmentTables;
use crate::settings::{Kind, Setting, Value};
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::Executor;
use mica_graph::{Buffer, Graph, Image, Lifetime};
use mica_shaders::glints::wang2018::{Bind, Params};
use std::collections::BTreeMap;

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

/// The tables of one material.
struct Tables {
    /// The 1-degree table by quadrature, and the roughness it was made for.
    quadrature: Option<(f64, Buffer)>,
    accumulated: Accumulated,
}

/// The method at work.
pub(crate) struct Wang2018 {
    /// Tables that were counted, by how and by the roughness's bits.
    counted: BTreeMap<(DpfSource, u64), Buffer>,
    /// By the material's index.
    tables: BTreeMap<usize, Tables>,
    /// Stands for the table where P has its closed form: shaders bind it but do not read it.
    no_table: Buffer,
}

impl Default for Wang2018 {
    fn default() -> Self {
        let no_table = Buffer::new("dpf_absent", 16, Lifetime::Scene);
        Self { counted: BTreeMap::new(), tables: BTreeMap::new(), no_table }
    }
}

/// Where the material's P comes from; nothing where it has its closed form.
fn source(material: &GlintMaterial) -> Option<DpfSource> {
    (material.values.word("dpf") != "closed").then(|| DpfSource::of(material))
}

/// Names a table at the material's roughness.
fn counted_key(source: DpfSource, material: &GlintMaterial) -> (DpfSource, u64) {
    (source, material.values.number("alpha").to_bits())
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
        let Some(source @ DpfSource::Counted { .. }) = source(material) else { return Ok(Vec::new()) };
        let key = counted_key(source, material);
        if self.counted.contains_key(&key) {
            return Ok(Vec::new());
        }
        let alphas = [material.values.number("alpha") as f32];
        let (table, update) = dpf::precompute(source, &alphas, executor, cache, progress)?;
        self.counted.insert(key, table);
        Ok(vec![update])
    }

    fn keep(&mut self, materials: &[GlintMaterial]) {
        self.tables.retain(|index, _| materials.iter().any(|material| material.index == *index));
        let wanted = |key| {
            materials.iter().any(|material| source(material).is_some_and(|source| counted_key(source, material) == key))
        };
        self.counted.retain(|key, _| wanted(*key));
    }

    fn update(&mut self, g: &mut Graph, material: &GlintMaterial, _environment: &mut EnvironmentTables) {
        let Some(wanted) = source(material) else { return };
        let alpha = material.values.number("alpha");
        let alphas = [alpha as f32];
        let tables = self
            .tables
            .entry(material.index)
            .or_insert_with(|| Tables { quadrature: None, accumulated: Accumulated::new(&material.name) });
        if let Some(dpf) = self.counted.get(&counted_key(wanted, material)) {
            tables.accumulated.update(g, material, alpha, (wanted, &alphas, dpf));
            return;
        }
        // Counting takes too long for a frame: it happens in `precompute`, and this table stands in without it.
        if tables.quadrature.as_ref().is_none_or(|(made_for, _)| *made_for != alpha) {
            g.because(format!("material {}: directional probabilities at alpha {alpha}", material.name));
            tables.quadrature = Some((alpha, dpf::quadrature(g, &alphas)));
        }
        if let Some((_, dpf)) = &tables.quadrature {
            tables.accumulated.update(g, material, alpha, (DpfSource::Quadrature, &alphas, dpf));
        }
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let values = &material.values;
        let flakes = material.flakes();
        let tables = self.tables.get(&material.index).filter(|_| source(material).is_some());
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
            closed_form: u32::from(tables.is_none()),
            interpolated: u32::from(values.flag("interpolated")),
            weighted: u32::from(values.flag("weighted")),
        };
        let accumulated = tables.map_or(&self.no_table, |tables| &tables.accumulated.table);
        let bind = bind_glints!(Bind, shading, glints, accumulated: accumulated, environment: shading.environment);
        g.pass(bind, params, shading.gbuffer.ids.extent());
    }
}
