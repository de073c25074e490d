//! Wang, Deng, Holzschuch 2020: "Real-Time Glints Rendering with Prefiltered Discrete Stochastic Microfacets".
//!
//! As printed, faults included; `wang2020.glsl` and the passes in `passes/wang2020` and `passes/dpf` name them where they happen:
//! - Eqs. 16 and 21 have no cosine of the incident light: energy grows at grazing light (`cosine=true` repairs it);
//! - 64 directions drawn from the BRDF stand for the whole environment: a sun in the map is missed by most of them, and
//!   hardly lights (give it to the scene as a light);
//! - Eq. 17 makes P-hat a solid angle that does not know the light: a white furnace sparkles;
//! - the 36 x 9 directions of Eq. 17 miss narrow lobes (alpha .02 seen head-on): no flake tested one by one is lit there
//!   (`p_hat=closed` repairs it);
//! - one lambda a flake: lit sets are nested, flakes with a small lambda never go out;
//! - the scales switch at 4 and 64 flakes in the footprint: the variance jumps there;
//! - the table is linear in alpha between eight roughnesses from .02, below which it stays at .02, and sums whole
//!   degrees: mean errors of tens of percent.
//!
//! What the paper leaves open is decided so: the footprint is the pixel's parallelogram, a leaf partly inside counts by its
//! share; tables are looked up linearly; the reflectance F is applied when shading, at the view's angle for the
//! environment, so that an edit of the colour rebuilds nothing; offsets of the accumulation fill gamma degrees an axis,
//! so that their entries' solid angles add up to the cone's.

mod tables;

use super::dpf::{self, DpfSource};
use super::shared::Shared;
use super::{Claim, Finish, GlintMaterial, Method, MethodInfo, Reads, Rung, Shading, bind_glints};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::Executor;
use mica_graph::{Buffer, Graph, Image};
use mica_shaders::constants::DPF_ROUGHNESSES;
use mica_shaders::glints::wang2020::{Bind, Params};
use tables::Tables;

/// The roughnesses at which the paper tabulates.
const ALPHAS: [f32; DPF_ROUGHNESSES as usize] = [0.02, 0.04, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
/// The least of them.
const LEAST_ALPHA: f64 = 0.02;

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "wang2020",
    citation: "B. Wang, H. Deng, N. Holzschuch, Real-Time Glints Rendering with Prefiltered Discrete Stochastic \
               Microfacets, Computer Graphics Forum 39(6), 2020",
    summary: "A prefiltered 4D table of the environment and a quadtree of flake counts, looked up at three scales.",
    claim: Claim::Look,
    mean_between: [0.6, 1.7],
    repeats: true,
    settings: &[
        Setting {
            key: "dpf",
            unit: "",
            kind: Kind::Choice(&["quadrature", "counted"]),
            default: Value::Word("quadrature"),
            meaning: "How the directional probability table is made: by quadrature, or by counting random flakes as \
                      the paper does.",
        },
        Setting {
            key: "dpf_flakes",
            unit: "flakes",
            kind: Kind::Integer { min: 1, max: 4_000_000_000 },
            default: Value::Number(1e9),
            meaning: "Flakes counted for each roughness when dpf=counted; the paper counts 1e9.",
        },
        Setting {
            key: "depth",
            unit: "levels",
            kind: Kind::Integer { min: 1, max: 11 },
            default: Value::Number(11.0),
            meaning: "Level of the quadtree's leaves.",
        },
        Setting {
            key: "cut_depth",
            unit: "levels",
            kind: Kind::Integer { min: 0, max: 11 },
            default: Value::Number(6.0),
            meaning: "Level at which the traversal of the quadtree starts.",
        },
        Setting {
            key: "micro",
            unit: "flakes in the footprint",
            kind: Kind::Real { min: 0.0, max: 1e6 },
            default: Value::Number(4.0),
            meaning: "Below this, each flake is tested on its own.",
        },
        Setting {
            key: "macro",
            unit: "flakes in the footprint",
            kind: Kind::Real { min: 0.0, max: 1e6 },
            default: Value::Number(64.0),
            meaning: "Above this, the quadtree is not asked.",
        },
        Setting {
            key: "samples",
            unit: "directions",
            kind: Kind::Integer { min: 1, max: 16384 },
            default: Value::Number(64.0),
            meaning: "Directions drawn for each entry of the prefiltered table (K of Eq. 16).",
        },
        Setting {
            key: "cosine",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(false),
            meaning: "Multiplies point and directional light by the cosine that Eq. 21 leaves out.",
        },
        Setting {
            key: "p_hat",
            unit: "",
            kind: Kind::Choice(&["printed", "closed"]),
            default: Value::Word("printed"),
            meaning: "Eq. 17 by the paper's 36 x 9 directions, which miss narrow lobes, or in closed form.",
        },
        Setting {
            key: "blur",
            unit: "",
            kind: Kind::Flag,
            default: Value::Flag(true),
            meaning: "Blurs the glints over 3 pixels and the occlusion over 9, as the paper does.",
        },
    ],
    ladder: &[
        Rung { name: "macro", set: &[("micro", "0"), ("macro", "0")] },
        Rung { name: "meso", set: &[("micro", "0")] },
        Rung { name: "printed", set: &[] },
        Rung { name: "samples 1024", set: &[("samples", "1024")] },
    ],
};

/// The method at work.
#[derive(Default)]
pub(crate) struct Wang2020 {
    /// The directional probability tables, by how they were made.
    dpf: Shared<DpfSource, Buffer>,
    tables: Tables,
}

/// The roughness that a material is rendered with: the paper's tables begin at .02, and below that P would be that of .02
/// while the rest of Eq. 16 would not.
fn alpha(material: &GlintMaterial) -> f64 {
    material.values.number("alpha").max(LEAST_ALPHA)
}

impl Method for Wang2020 {
    fn precompute(
        &mut self,
        material: &GlintMaterial,
        executor: &mut Executor,
        cache: Option<&Cache>,
        progress: Progress,
    ) -> Result<Vec<Update>, RenderError> {
        let source = DpfSource::of(material);
        if self.dpf.get(source).is_some() {
            return Ok(Vec::new());
        }
        let (buffer, update) = dpf::precompute(source, &ALPHAS, executor, cache, progress)?;
        self.dpf.insert(source, buffer);
        Ok(vec![update])
    }

    fn update(&mut self, g: &mut Graph, kept: &mut Kept, materials: &[GlintMaterial], environment: &EnvironmentTables) {
        let there = self.dpf.keys();
        // Counting takes too long for a frame: it happens in `precompute`, and a table by quadrature stands in without it.
        let found = |material: &GlintMaterial| {
            let source = DpfSource::of(material);
            if there.contains(&source) { source } else { DpfSource::Quadrature }
        };
        self.dpf.update(
            materials,
            |material| Some(found(material)),
            |wanted| {
                wanted.because(g, "no directional probability table was precomputed");
                Some(dpf::quadrature(g, &ALPHAS, wanted.spare))
            },
        );
        let accumulated =
            |material: &GlintMaterial| (alpha(material), material.values.number("gamma_deg"), found(material));
        self.tables.update((g, kept), materials, accumulated, &self.dpf, environment);
    }

    fn reads(&self) -> Reads {
        Reads::Map
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let Some(tables) = self.tables.of(material) else { return };
        let values = &material.values;
        let depth = values.number("depth") as u32;
        let params = Params {
            material: material.index as u32,
            alpha: alpha(material) as f32,
            solid_angle: material.solid_angle() as f32,
            flakes: material.flakes() as f32,
            depth,
            cut_depth: (values.number("cut_depth") as u32).min(depth),
            seed: values.number("seed") as u32,
            micro_below: values.number("micro") as f32,
            macro_above: values.number("macro") as f32,
            cosine: u32::from(values.flag("cosine")),
        };
        let bind = bind_glints!(
            Bind, shading, glints,
            accumulated: tables.accumulated,
            prefiltered: tables.prefiltered,
            nodes: &tables.quadtree.nodes,
            bounds: &tables.quadtree.bounds,
        );
        shading.pass(g, bind, params, material);
    }

    fn finish(&self, material: &GlintMaterial) -> Finish {
        let blur = material.values.flag("blur");
        Finish { mirror_occlusion: true, visibility_blur: if blur { 4 } else { 0 }, glint_blur: i32::from(blur) }
    }
}
