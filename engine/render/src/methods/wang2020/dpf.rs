//! The directional probability tables of Wang, Deng and Holzschuch 2020 (section 4.1): made, kept, extracted from.

use super::GlintMaterial;
use crate::{Cache, Progress, RenderError, Update};
use mica_gpu::{Executor, Timing};
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_shaders::{constants as c, dpf, dpf_count, dpf_divide};
use std::time::Instant;

/// The roughnesses at which the paper tabulates.
const ALPHAS: [f32; c::DPF_ROUGHNESSES as usize] = [0.02, 0.04, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
/// The least of them.
pub(super) const LEAST_ALPHA: f64 = 0.02;
/// Half-angle of the tabulated cones, in degrees.
const TABLE_GAMMA_DEG: f64 = 1.0;
/// Bytes of all tables.
const BYTES: u64 = c::DPF_ENTRIES as u64 * c::DPF_ROUGHNESSES as u64 * 4;
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
    fn key(self, executor: &Executor) -> String {
        let info = executor.device().info();
        let mut made_by = blake3::Hasher::new();
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

fn tables() -> Buffer {
    Buffer::new("dpf", BYTES, Lifetime::Scene)
}

/// Declares the passes that make all tables by quadrature.
pub(super) fn quadrature(g: &mut Graph) -> Buffer {
    let mut tables = tables();
    let sin2_half_gamma = (0.5 * TABLE_GAMMA_DEG.to_radians()).sin().powi(2) as f32;
    for (table, alpha) in ALPHAS.into_iter().enumerate() {
        let params = dpf::Params { alpha, sin2_half_gamma, first: table as u32 * c::DPF_ENTRIES };
        g.pass(dpf::Bind { dpf: &mut tables }, params, Extent::line(c::DPF_ENTRIES));
    }
    tables
}

/// Makes the tables on a device of our own, or takes them from the cache, and keeps them there.
pub(super) fn precompute(
    source: DpfSource,
    executor: &mut Executor,
    cache: Option<&Cache>,
    progress: Progress,
) -> Result<(Buffer, Update), RenderError> {
    let start = Instant::now();
    let key = source.key(executor);
    let update = |why: String, ns: u64| Update { pass: "dpf".to_owned(), why, ns };
    let kept = cache.and_then(|cache| {
        cache.load(&key).unwrap_or_else(|error| {
            log::warn!("{error}");
            None
        })
    });
    if let Some(bytes) = kept.filter(|bytes| bytes.len() as u64 == BYTES) {
        let mut tables = tables();
        let mut g = Graph::new();
        g.upload(&mut tables, bytes);
        executor.run(g, Timing::Overlapped)?;
        return Ok((tables, update("read from the cache".to_owned(), start.elapsed().as_nanos() as u64)));
    }
    let (made, ns, why) = match source {
        DpfSource::Quadrature => {
            progress("directional probability tables by quadrature", 0, 1);
            let mut g = Graph::new();
            let made = quadrature(&mut g);
            let run = executor.run(g, Timing::Isolated)?;
            progress("directional probability tables by quadrature", 1, 1);
            (made, run.passes.iter().filter_map(|pass| pass.ns).sum(), "by quadrature".to_owned())
        }
        DpfSource::Counted { flakes } => {
            let (made, ns) = counted(flakes, executor, progress)?;
            (made, ns, format!("by counting {flakes} flakes at each roughness"))
        }
    };
    if let Some(cache) = cache {
        let mut g = Graph::new();
        let download = g.download(&made);
        let mut run = executor.run(g, Timing::Overlapped)?;
        if let Err(error) = cache.store(&key, &run.take(download)) {
            log::warn!("{error}");
        }
    }
    Ok((made, update(why, ns)))
}

/// Counts flakes, a dispatch at a time, so that no single one keeps the device for long.
fn counted(flakes: u64, executor: &mut Executor, progress: Progress) -> Result<(Buffer, u64), RenderError> {
    let mut hits = Buffer::new("dpf_hits", BYTES, Lifetime::Settings);
    let mut ns = 0;
    let mut g = Graph::new();
    g.fill(&mut hits, 0);
    let rounds = flakes.div_ceil(u64::from(FLAKES_PER_DISPATCH));
    for round in 0..rounds {
        let first = round * u64::from(FLAKES_PER_DISPATCH);
        let count = (flakes - first).min(u64::from(FLAKES_PER_DISPATCH)) as u32;
        for (table, alpha) in ALPHAS.into_iter().enumerate() {
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
    let mut tables = tables();
    let params = dpf_divide::Params { entries: c::DPF_ENTRIES * c::DPF_ROUGHNESSES, flakes: flakes as f32 };
    // A row of groups for each table.
    let extent = Extent::new(c::DPF_ENTRIES.next_multiple_of(64), c::DPF_ROUGHNESSES);
    g.pass(dpf_divide::Bind { hits: &hits, dpf: &mut tables }, params, extent);
    executor.run(g, Timing::Overlapped)?;
    Ok((tables, ns))
}

/// The table below a roughness, and the weight of the one above; beyond the ends, the end.
pub(super) fn bracket(alpha: f32) -> (usize, f32) {
    let low = ALPHAS.iter().rposition(|&tabulated| tabulated <= alpha).unwrap_or(0).min(ALPHAS.len() - 2);
    (low, ((alpha - ALPHAS[low]) / (ALPHAS[low + 1] - ALPHAS[low])).clamp(0.0, 1.0))
}

/// First and last offset, in whole degrees, of the entries that are added up for a cone of this half-angle: as many as it
/// has degrees, at least one, about the middle.
pub(super) fn accumulation_offsets(gamma_deg: f64) -> [i32; 2] {
    let count = (gamma_deg / TABLE_GAMMA_DEG).round().max(1.0) as i32;
    [-(count / 2), count - 1 - count / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roughness_lies_between_the_tables_around_it() {
        assert_eq!(bracket(0.02), (0, 0.0));
        assert_eq!(bracket(0.1), (2, 0.0));
        let (low, part) = bracket(0.5);
        assert_eq!(low, 4);
        assert!((part - 0.5).abs() < 1e-6);
        assert_eq!(bracket(1.0), (6, 1.0));
        assert_eq!(bracket(0.001), (0, 0.0));
    }

    #[test]
    fn accumulated_entries_fill_the_cone() {
        for gamma in 1..=30 {
            let [first, last] = accumulation_offsets(f64::from(gamma));
            assert_eq!(last - first + 1, gamma);
            assert!(first <= 0 && last >= 0);
        }
        assert_eq!(accumulation_offsets(0.01), [0, 0]);
    }
}
