//! The directional probability tables of Wang, Wang and Holzschuch 2018 and of Wang, Deng and Holzschuch 2020 (section
//! 4.1): made and kept, at the roughnesses that a method asks for.

mod accumulated;

pub(super) use accumulated::{AccumulatedKey, accumulated};

use super::GlintMaterial;
use crate::kept::Inputs;
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::{Executor, Timing};
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_shaders::{constants as c, dpf, dpf_accumulate, dpf_count, dpf_divide};
use std::time::Instant;

/// Half-angle of the tabulated cones, in degrees.
const TABLE_GAMMA_DEG: f64 = 1.0;
/// Flakes counted in one dispatch: 90 invocations each, within the least limit of groups along an axis.
const FLAKES_PER_DISPATCH: u32 = 32_768;

/// How the tables are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum DpfSource {
    /// By quadrature.
    Quadrature,
    /// By counting so many random flakes at each roughness.
    Counted {
        /// How many.
        flakes: u64,
    },
}

impl DpfSource {
    /// What a material's settings ask for.
    pub fn of(material: &GlintMaterial) -> Self {
        match material.values.word("dpf") {
            "counted" => Self::Counted { flakes: material.values.number("dpf_flakes") as u64 },
            _ => Self::Quadrature,
        }
    }

    /// Name of the tables in the cache: what made them, and by which code on which device and driver, as two devices
    /// may differ in the last digits.
    fn key(self, alphas: &[f32], executor: &Executor) -> String {
        let info = executor.device().info();
        let mut made_by = blake3::Hasher::new();
        made_by.update(bytemuck::cast_slice(alphas));
        made_by.update(format!("{} {} {}", info.name, info.driver, info.driver_version).as_bytes());
        for shader in [&dpf::SHADER, &dpf_count::SHADER, &dpf_divide::SHADER] {
            for stage in shader.stages {
                made_by.update(bytemuck::cast_slice(stage.spirv));
            }
        }
        let made_by = &made_by.finalize().to_hex()[..16];
        match self {
            Self::Quadrature => format!("dpf-quadrature-{made_by}"),
            Self::Counted { flakes } => format!("dpf-counted-{flakes}-{made_by}"),
        }
    }
}

/// What P(i, o, gamma) is made by, from tables at these roughnesses.
pub(super) fn made_by(inputs: Inputs, alphas: &[f32]) -> Inputs {
    let shaders = [&dpf::SHADER, &dpf_count::SHADER, &dpf_divide::SHADER, &dpf_accumulate::SHADER];
    shaders.into_iter().fold(inputs.and(format_args!("{alphas:?}")), Inputs::by)
}

/// Bytes of the tables of so many roughnesses.
fn bytes(alphas: &[f32]) -> u64 {
    u64::from(c::DPF_ENTRIES) * alphas.len() as u64 * 4
}

fn tables(alphas: &[f32]) -> Buffer {
    Buffer::new("dpf", bytes(alphas), Lifetime::Scene)
}

/// Declares the passes that make the tables at these roughnesses by quadrature, in spare ones of as many if there are any.
pub(super) fn quadrature(g: &mut Graph, alphas: &[f32], spare: Option<Buffer>) -> Buffer {
    let mut tables = spare.unwrap_or_else(|| tables(alphas));
    let sin2_half_gamma = (0.5 * TABLE_GAMMA_DEG.to_radians()).sin().powi(2) as f32;
    for (table, &alpha) in alphas.iter().enumerate() {
        let params = dpf::Params { alpha, sin2_half_gamma, first: table as u32 * c::DPF_ENTRIES };
        g.pass(dpf::Bind { dpf: &mut tables }, params, Extent::line(c::DPF_ENTRIES));
    }
    tables
}

/// Declares the passes that make P(i, o, gamma) at one roughness as `wang2020` looks it up (`shared/accumulated_dpf.glsl`),
/// from 1-degree tables at `alphas` by quadrature.
pub fn lit_probability_table(g: &mut Graph, alphas: &[f32], alpha: f64, gamma_deg: f64) -> Buffer {
    let dpf = quadrature(g, alphas, None);
    let mut table = accumulated::table("lit_probability_table");
    accumulated::accumulate(g, (alphas, &dpf), alpha, gamma_deg, &mut table);
    table
}

/// Makes the tables on a device of our own, or takes them from the cache, and keeps them there.
pub(super) fn precompute(
    source: DpfSource,
    alphas: &[f32],
    executor: &mut Executor,
    cache: Option<&Cache>,
    progress: Progress,
) -> Result<(Buffer, Update), RenderError> {
    let start = Instant::now();
    let key = source.key(alphas, executor);
    let update = |why: String, ns: u64| Update { pass: "dpf".to_owned(), why, ns };
    let kept = cache.and_then(|cache| {
        cache.load(&key).unwrap_or_else(|error| {
            error.warn();
            None
        })
    });
    if let Some(kept) = kept.filter(|kept| kept.len() as u64 == bytes(alphas)) {
        let mut tables = tables(alphas);
        let mut g = Graph::new();
        g.upload(&mut tables, kept);
        executor.run(g, Timing::Overlapped)?;
        return Ok((tables, update("read from the cache".to_owned(), start.elapsed().as_nanos() as u64)));
    }
    let (made, ns, why) = match source {
        DpfSource::Quadrature => {
            progress("directional probability tables by quadrature", 0, 1);
            let mut g = Graph::new();
            let made = quadrature(&mut g, alphas, None);
            let run = executor.run(g, Timing::Isolated)?;
            progress("directional probability tables by quadrature", 1, 1);
            (made, run.passes.iter().filter_map(|pass| pass.ns).sum(), "by quadrature".to_owned())
        }
        DpfSource::Counted { flakes } => {
            let (made, ns) = counted(flakes, alphas, executor, progress)?;
            (made, ns, format!("by counting {flakes} flakes at each roughness"))
        }
    };
    if let Some(cache) = cache {
        let mut g = Graph::new();
        let download = g.download(&made);
        let mut run = executor.run(g, Timing::Overlapped)?;
        if let Err(error) = cache.store(&key, &run.take(download)) {
            error.warn();
        }
    }
    Ok((made, update(why, ns)))
}

/// Counts flakes, a dispatch at a time, so that no single one keeps the device for long.
fn counted(
    flakes: u64,
    alphas: &[f32],
    executor: &mut Executor,
    progress: Progress,
) -> Result<(Buffer, u64), RenderError> {
    let mut hits = Buffer::new("dpf_hits", bytes(alphas), Lifetime::Settings);
    let mut ns = 0;
    let mut g = Graph::new();
    g.fill(&mut hits, 0);
    let rounds = flakes.div_ceil(u64::from(FLAKES_PER_DISPATCH));
    for round in 0..rounds {
        let first = round * u64::from(FLAKES_PER_DISPATCH);
        let count = (flakes - first).min(u64::from(FLAKES_PER_DISPATCH)) as u32;
        for (table, &alpha) in alphas.iter().enumerate() {
            let params = dpf_count::Params {
                alpha,
                cos_gamma: TABLE_GAMMA_DEG.to_radians().cos() as f32,
                gamma_degrees: TABLE_GAMMA_DEG as f32,
                first: table as u32 * c::DPF_ENTRIES,
                first_flake: first as u32,
                flakes: count,
                seed: table as u32,
            };
            g.pass(dpf_count::Bind { hits: &mut hits }, params, Extent::line(count * c::DPF_THETA));
        }
        let run = executor.run(std::mem::take(&mut g), Timing::Isolated)?;
        ns += run.passes.iter().filter_map(|pass| pass.ns).sum::<u64>();
        progress("directional probability tables by counting flakes", round + 1, rounds);
    }
    let mut tables = tables(alphas);
    let params = dpf_divide::Params { entries: c::DPF_ENTRIES * alphas.len() as u32, flakes: flakes as f32 };
    // A row of groups for each table.
    let extent = Extent::new(c::DPF_ENTRIES.next_multiple_of(64), alphas.len() as u32);
    g.pass(dpf_divide::Bind { hits: &hits, dpf: &mut tables }, params, extent);
    executor.run(g, Timing::Overlapped)?;
    Ok((tables, ns))
}
