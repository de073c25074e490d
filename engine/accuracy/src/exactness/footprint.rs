//! The footprint filter: which flakes a pixel sums over.
//!
//! A pixel sees a parallelogram of texture. Filters that are easier to walk through see a box, a square or an ellipse instead;
//! all are scaled to the same mean. What differs is which flakes they see (the pixel's own, or a neighbour's) and how
//! many (a filter over twice the area halves the variance). So there are two errors: the distance of the counts from their
//! law, Poisson's, and what is lost of the correlation with the very counts.

use super::resample::{Words, resampled};
use super::{Chart, Clock, EXACTNESS_SCHEMA, Effort, ExactnessError, ExactnessLine, in_turn, spread};
use crate::{Estimate, Machine};
use mica_gpu::{Executor, Run, Timing};
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_oracle::statistics::{upper_gamma, wasserstein_1};
use mica_render::Progress;
use mica_shaders::types::AskedFootprint;
use mica_shaders::{constants as c, flake_counts, footprint_box, footprint_ellipse, footprint_parallelogram};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Flakes in a square of texture: four in each node of the level that tables have, which are the leaves.
pub const FLAKES: u64 = (c::FLAKES_A_LEAF as u64) << (2 * c::FLAKE_TABLE_LEVEL);
/// Flakes expected in a footprint.
const EXPECTED: f64 = 16.0;
/// Footprints over those of the least effort.
const FOOTPRINTS: u32 = 1024;
/// Longer side over shorter.
const ANISOTROPIES: [u32; 4] = [1, 4, 16, 64];
/// Of the flakes.
pub const SEED: u32 = 5;

/// A filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// A box along the axes of texture space: the least around the parallelogram, or a square of its area.
    Box {
        /// The latter.
        square: bool,
    },
    /// An elliptical Gaussian; footprints that are longer for their width are widened.
    Ellipse {
        /// Longer side over shorter, at most.
        max_anisotropy: f32,
    },
    /// The pixel's own parallelogram.
    Parallelogram,
}

/// One way to see a footprint.
struct Rung {
    name: &'static str,
    what: &'static str,
    filter: Filter,
}

const RUNGS: [Rung; 5] = [
    Rung {
        name: "square",
        what: "A square of the same area along the axes of texture space, as a level of a pyramid has it.",
        filter: Filter::Box { square: true },
    },
    Rung {
        name: "box",
        what: "The least box along the axes of texture space around the parallelogram.",
        filter: Filter::Box { square: false },
    },
    Rung {
        name: "ellipse, 8:1",
        what: "An elliptical Gaussian, widened to 8:1 (Chermain et al. 2020).",
        filter: Filter::Ellipse { max_anisotropy: 8.0 },
    },
    Rung {
        name: "ellipse",
        what: "An elliptical Gaussian of the footprint's own shape (Heckbert 1989).",
        filter: Filter::Ellipse { max_anisotropy: 1e6 },
    },
    Rung {
        name: "parallelogram",
        what: "The pixel's parallelogram, its edges decided as if without rounding (`flakes`).",
        filter: Filter::Parallelogram,
    },
];

/// Footprints of one shape, anywhere in texture space and turned anyhow, and the flakes in them as filters count them.
pub struct Footprints {
    /// Each of them.
    pub asked: Vec<AskedFootprint>,
    asked_buffer: Buffer,
    /// How many flakes there are in each leaf.
    flakes: Buffer,
}

impl Footprints {
    /// So many footprints of 16 flakes, of 4 x 4^9 in a square of texture; with what they need on the device.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(executor: &mut Executor, anisotropy: f64, count: u32) -> Result<Self, ExactnessError> {
        let area = EXPECTED / FLAKES as f64;
        let (longer, shorter) = ((area * anisotropy).sqrt(), (area / anisotropy).sqrt());
        let mut words = Words(u64::from(count));
        let asked: Vec<AskedFootprint> = (0..count)
            .map(|_| {
                let uv = [words.unit() as f32, words.unit() as f32];
                let (sin, cos) = (TAU * words.unit()).sin_cos();
                let side_x = [(longer * cos) as f32, (longer * sin) as f32];
                let side_y = [(-shorter * sin) as f32, (shorter * cos) as f32];
                AskedFootprint { uv, side_x, side_y }
            })
            .collect();
        let mut g = Graph::new();
        let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(&asked));
        let mut asked_buffer = Buffer::new("footprints", bytes.len() as u64, Lifetime::Scene);
        g.upload(&mut asked_buffer, bytes);
        let flakes = part_flakes(&mut g);
        executor.run(g, Timing::Overlapped)?;
        Ok(Self { asked, asked_buffer, flakes })
    }

    /// Declares the pass that counts by a filter; the counts, 32-bit floats.
    fn count(&self, g: &mut Graph, filter: Filter) -> Buffer {
        let count = self.asked.len() as u32;
        let mut counts = Buffer::new("counts", u64::from(count) * 4, Lifetime::Scene);
        let (leaf_level, table_level, seed) = (c::FLAKE_TABLE_LEVEL, c::FLAKE_TABLE_LEVEL, SEED);
        let (footprints, flake_counts) = (&self.asked_buffer, &self.flakes);
        let extent = Extent::line(count);
        match filter {
            Filter::Box { square } => {
                let square = u32::from(square);
                let params = footprint_box::Params { count, leaf_level, table_level, seed, square };
                g.pass(footprint_box::Bind { footprints, flake_counts, counts: &mut counts }, params, extent);
            }
            Filter::Ellipse { max_anisotropy } => {
                let params = footprint_ellipse::Params { count, leaf_level, table_level, seed, max_anisotropy };
                g.pass(footprint_ellipse::Bind { footprints, flake_counts, counts: &mut counts }, params, extent);
            }
            Filter::Parallelogram => {
                let params = footprint_parallelogram::Params { count, leaf_level, table_level, seed };
                g.pass(footprint_parallelogram::Bind { footprints, flake_counts, counts: &mut counts }, params, extent);
            }
        }
        counts
    }

    /// The flakes of each footprint as a filter counts them.
    ///
    /// # Errors
    /// Those of the device.
    pub fn counted(&self, executor: &mut Executor, filter: Filter) -> Result<Vec<f64>, ExactnessError> {
        let mut g = Graph::new();
        let counts = self.count(&mut g, filter);
        let download = g.download(&counts);
        let bytes = executor.run(g, Timing::Overlapped)?.take(download);
        Ok(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes).into_iter().map(f64::from).collect())
    }

    /// Nanoseconds that the device takes for a footprint, round by round.
    fn time(&self, executor: &mut Executor, rounds: usize) -> Result<Vec<Estimate>, ExactnessError> {
        let clock = Clock::of(executor);
        let times = in_turn(rounds, RUNGS.len(), |rung| {
            let mut g = Graph::new();
            // What it gives is kept, or nothing would be done.
            let _counts = self.count(&mut g, RUNGS[rung].filter);
            let run = executor.run(g, clock.timing())?;
            Ok::<_, ExactnessError>(taken(executor, &run)? / self.asked.len() as f64)
        })?;
        Ok(times.iter().map(|times| spread(times)).collect())
    }
}

/// Nanoseconds that the passes of a run took.
pub(super) fn taken(executor: &Executor, run: &Run) -> Result<f64, ExactnessError> {
    let device = || executor.device().info().name.clone();
    Clock::of(executor).ns(run).ok_or_else(|| ExactnessError::NoClock { device: device() })
}

/// Parts the flakes of a square level by level, down to the leaves.
fn part_flakes(g: &mut Graph) -> Buffer {
    let level_of = |level: u32| Buffer::new("flake_counts", 8 << (2 * level), Lifetime::Settings);
    let mut parents = level_of(0);
    g.upload(&mut parents, Arc::<[u8]>::from(FLAKES.to_le_bytes().as_slice()));
    for level in 0..c::FLAKE_TABLE_LEVEL {
        let mut children = level_of(level + 1);
        let bind = flake_counts::Bind { parents: &parents, children: &mut children };
        g.pass(bind, flake_counts::Params { level, seed: SEED }, Extent::line(1 << (2 * level)));
        parents = children;
    }
    parents
}

/// Numbers of flakes as the law has them, evenly spread: Poisson's, as a footprint is a millionth of the texture.
fn law(samples: usize) -> Vec<f64> {
    let (mut number, mut at_most) = (0.0, upper_gamma(1.0, EXPECTED));
    let quantile = |u: f64| {
        while at_most < u {
            number += 1.0;
            at_most = upper_gamma(number + 1.0, EXPECTED);
        }
        number
    };
    (0..samples).map(|index| (index as f64 + 0.5) / samples as f64).map(quantile).collect()
}

/// Distance of counts from their law, over the mean.
fn from_law(counts: &[f64]) -> Estimate {
    let law = law(counts.len());
    resampled(counts.len(), |picks| {
        let picked: Vec<f64> = picks.iter().map(|pick| counts[*pick]).collect();
        wasserstein_1(&picked, &law).unwrap_or(f64::NAN) / EXPECTED
    })
}

/// 1 less the correlation of counts with those of the very footprints.
fn uncorrelated(counts: &[f64], exact: &[f64]) -> Estimate {
    resampled(counts.len(), |picks| {
        let mean = |of: &[f64]| picks.iter().map(|pick| of[*pick]).sum::<f64>() / picks.len() as f64;
        let (mean_a, mean_b) = (mean(counts), mean(exact));
        let (mut both, mut a_squared, mut b_squared) = (0.0, 0.0, 0.0);
        for pick in picks {
            let (a, b) = (counts[*pick] - mean_a, exact[*pick] - mean_b);
            both += a * b;
            a_squared += a * a;
            b_squared += b * b;
        }
        (1.0 - both / (a_squared * b_squared).sqrt()).max(0.0)
    })
}

/// The lines of the chart.
///
/// # Errors
/// Those of the device.
pub fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let mut lines = Vec::new();
    for (done, anisotropy) in (0..).zip(ANISOTROPIES) {
        progress("footprint filters", done, ANISOTROPIES.len() as u64);
        let footprints = Footprints::new(executor, f64::from(anisotropy), FOOTPRINTS * effort.frames())?;
        let times = footprints.time(executor, effort.frame_rounds())?;
        let counts: Vec<Vec<f64>> =
            RUNGS.iter().map(|rung| footprints.counted(executor, rung.filter)).collect::<Result<_, _>>()?;
        let exact = &counts[RUNGS.len() - 1];
        for ((rung, counts), ns) in RUNGS.iter().zip(&counts).zip(&times) {
            let mut line = |case: String, error_of: &str, error: Estimate| {
                lines.push(ExactnessLine {
                    schema: EXACTNESS_SCHEMA.to_owned(),
                    chart: Chart::Footprint.name().to_owned(),
                    case,
                    rung: rung.name.to_owned(),
                    what: rung.what.to_owned(),
                    error_of: error_of.to_owned(),
                    error,
                    ns: *ns,
                    per: Clock::of(executor).per("footprint of 16 flakes"),
                    machine: machine.clone(),
                });
            };
            let of_law =
                "Wasserstein-1 distance of the count of flakes from its law over the mean, with its 95 % interval";
            line(format!("{anisotropy}:1, distribution"), of_law, from_law(counts));
            let of_pixels = "1 - correlation with the count of the very footprint, with its 95 % interval";
            line(format!("{anisotropy}:1, pixels"), of_pixels, uncorrelated(counts, exact));
        }
    }
    Ok(lines)
}
