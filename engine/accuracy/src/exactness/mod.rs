//! What each exactness costs on its own: the ways to compute one quantity, error against nanoseconds.
//!
//! A chart is a quantity, a rung one way to compute it, a case the conditions under which it is asked for. Errors are
//! against f64 on the same inputs; `error_of` of a line says of what. Times are of the device that runs the rungs, taken in
//! turn: engine/design/0011-cost-of-exactness.md.

mod arithmetic;
mod count_law;
pub mod environment;
pub mod footprint;
mod kernel;
mod lit_probability;
pub mod moments;
pub mod occlusion;
mod resample;

use crate::{Estimate, Machine, StageError};
use kernel::Rung;
use mica_gpu::{DeviceKind, Error, Executor, Run, Timing};
use mica_oracle::OracleError;
use mica_render::scene::SceneError;
use mica_render::{Progress, RenderError, SettingError};
use serde::{Deserialize, Serialize};

/// What lines of exactness say of themselves.
pub const EXACTNESS_SCHEMA: &str = "mica-exactness-1";

/// A quantity that can be computed more or less exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Chart {
    /// The probability that a flake is lit.
    LitProbability,
    /// How many of the flakes in a footprint are lit.
    CountLaw,
    /// Which flakes a pixel sums over.
    Footprint,
    /// What flakes reflect of light from everywhere.
    Environment,
    /// What hides light from flakes.
    Occlusion,
    /// One formula, written naively and stably.
    Arithmetic,
}

impl Chart {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::LitProbability, Self::CountLaw, Self::Footprint, Self::Environment, Self::Occlusion, Self::Arithmetic];

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LitProbability => "lit_probability",
            Self::CountLaw => "count_law",
            Self::Footprint => "footprint",
            Self::Environment => "environment",
            Self::Occlusion => "occlusion",
            Self::Arithmetic => "arithmetic",
        }
    }
}

/// A line of `exactness.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExactnessLine {
    /// [`EXACTNESS_SCHEMA`].
    pub schema: String,
    /// The quantity: [`Chart::name`].
    pub chart: String,
    /// The conditions, in words.
    pub case: String,
    /// One way to compute it, in words.
    pub rung: String,
    /// What that is, and whose.
    pub what: String,
    /// What the error is of, and what its three figures are.
    pub error_of: String,
    /// The error.
    pub error: Estimate,
    /// Nanoseconds: median, least and greatest of the rounds.
    pub ns: Estimate,
    /// Of what, and by which clock.
    pub per: String,
    /// Who measured.
    pub machine: Machine,
}

impl ExactnessLine {
    /// Whether another line measures the same on the same machine: the later of the two then counts.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let key = |line: &Self| (line.chart.clone(), line.case.clone(), line.rung.clone(), line.machine.clone());
        key(self) == key(other)
    }
}

/// How much time is spent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Rounds that are measured, after one that is not.
    pub rounds: usize,
    /// Nanoseconds for which each rung is kept at work in a round.
    pub round_ns: f64,
}

impl Effort {
    /// For tests: errors, and hardly anything about times.
    pub const LEAST: Self = Self { rounds: 1, round_ns: 0.0 };
    /// Seconds.
    pub const QUICK: Self = Self { rounds: 7, round_ns: 3e6 };
    /// Under a minute.
    pub const FULL: Self = Self { rounds: 25, round_ns: 1e7 };

    /// What whole frames are asked, over what they are asked at the least effort.
    fn frames(&self) -> u32 {
        if self.rounds > 1 { 2 } else { 1 }
    }

    /// Rounds of whole frames, which take longer than a pass.
    fn frame_rounds(&self) -> usize {
        self.rounds.min(7)
    }
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum ExactnessError {
    /// The device does not run a rung.
    #[error(transparent)]
    Gpu(#[from] Error),
    /// The truth cannot be computed.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// A frame cannot be declared.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The stage does not show what it should.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// An embedded scene is broken.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The device says nothing of time.
    #[error("{device} tells no times, neither of its own nor of the processor; nothing can be said of costs")]
    NoClock {
        /// The device.
        device: String,
    },
}

/// Measures every rung of a chart in every case.
///
/// # Errors
/// As [`ExactnessError`] says.
pub fn measure(
    chart: Chart,
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    match chart {
        Chart::LitProbability => lit_probability::measure(executor, effort, machine, progress),
        Chart::CountLaw => count_law::measure(executor, effort, machine, progress),
        Chart::Footprint => footprint::measure(executor, effort, machine, progress),
        Chart::Environment => environment::measure(executor, effort, machine, progress),
        Chart::Occlusion => occlusion::measure(executor, effort, machine, progress),
        Chart::Arithmetic => arithmetic::measure(executor, effort, machine, progress),
    }
}

/// A line about a rung, its figures and case still to come.
fn about(chart: Chart, rung: &Rung, clock: Clock, machine: &Machine) -> ExactnessLine {
    ExactnessLine {
        schema: EXACTNESS_SCHEMA.to_owned(),
        chart: chart.name().to_owned(),
        case: String::new(),
        rung: rung.word.to_owned(),
        what: rung.what.to_owned(),
        error_of: String::new(),
        error: Estimate::exact(0.0),
        ns: Estimate::exact(0.0),
        per: clock.per("an evaluation"),
        machine: machine.clone(),
    }
}

/// |answer / truth - 1|: median, the same, 95th percentile. What is no number counts as infinitely wrong.
fn error_of_ratios(answers: &[f64], truth: &[f64]) -> Estimate {
    let error = |(answer, truth): (&f64, &f64)| (answer / truth - 1.0).abs();
    let errors: Vec<f64> = answers.iter().zip(truth).map(error).collect();
    let errors = sorted(&errors.iter().map(|e| if e.is_nan() { f64::INFINITY } else { *e }).collect::<Vec<_>>());
    let median = quantile(&errors, 0.5);
    Estimate { value: median, low: median, high: quantile(&errors, 0.95) }
}

/// Whose time is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The device's: timestamps about each pass.
    Device,
    /// The processor's, where the device is the processor: time of all threads of this process, which other programs
    /// hardly disturb.
    Processor,
}

impl Clock {
    /// The one that fits a device.
    pub fn of(executor: &Executor) -> Self {
        if executor.device().info().kind == DeviceKind::Cpu { Self::Processor } else { Self::Device }
    }

    /// How frames are run to be timed.
    pub const fn timing(self) -> Timing {
        match self {
            Self::Device => Timing::Isolated,
            Self::Processor => Timing::Overlapped,
        }
    }

    /// Nanoseconds that the passes of a frame took; none where the device does not say.
    pub fn ns(self, run: &Run) -> Option<f64> {
        let ns = match self {
            Self::Device => run.passes.iter().map(|pass| pass.ns).sum(),
            Self::Processor => run.cpu_ns,
        };
        ns.map(|ns: u64| ns as f64)
    }

    /// Words for [`ExactnessLine::per`].
    pub fn per(self, of: &str) -> String {
        match self {
            Self::Device => format!("{of}, by the device's timestamps"),
            Self::Processor => format!("{of}, processor time of all threads"),
        }
    }
}

/// Does each of so many things once a round, in turn, so that a slow moment of the machine hits all of them, and begins each
/// round with another; a first round, in which drivers compile, is not kept. The values of each thing, round by round.
///
/// # Errors
/// The first that `once` returns.
pub fn in_turn<E>(
    rounds: usize,
    things: usize,
    mut once: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Vec<Vec<f64>>, E> {
    let mut values = vec![Vec::new(); things];
    for round in 0..=rounds {
        for step in 0..things {
            let thing = (round + step) % things;
            let value = once(thing)?;
            if round > 0 {
                values[thing].push(value);
            }
        }
    }
    Ok(values)
}

/// Nanoseconds that the passes of a name took in a frame that was run with isolated timing.
///
/// # Errors
/// If there are none, or the device says nothing of time.
pub fn pass_ns(executor: &Executor, run: &Run, name: &str) -> Result<f64, ExactnessError> {
    let mut of_name = run.passes.iter().filter(|pass| pass.name == name).map(|pass| pass.ns).peekable();
    let ns: Option<u64> = of_name.peek().is_some().then(|| of_name.sum()).flatten();
    ns.map(|ns| ns as f64).ok_or_else(|| ExactnessError::NoClock { device: executor.device().info().name.clone() })
}

/// Median, least and greatest.
///
/// # Panics
/// If there are no values: a mistake of the caller, not of any input.
pub fn spread(values: &[f64]) -> Estimate {
    let sorted = sorted(values);
    Estimate { value: quantile(&sorted, 0.5), low: sorted[0], high: sorted[sorted.len() - 1] }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// The value that a share of the sorted values is below, between neighbours linearly.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    // Infinity less itself is no number.
    if part == 0.0 { sorted[low] } else { sorted[low] * (1.0 - part) + sorted[low + 1] * part }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_done_in_turn_and_the_first_round_is_not_kept() {
        let mut order = Vec::new();
        let values = in_turn(2, 3, |thing| {
            order.push(thing);
            Ok::<_, ()>((10 * order.len() + thing) as f64)
        });
        assert_eq!(order, [0, 1, 2, 1, 2, 0, 2, 0, 1]);
        assert_eq!(values, Ok(vec![vec![60.0, 80.0], vec![41.0, 91.0], vec![52.0, 72.0]]));
        assert_eq!(in_turn(2, 3, |thing| if thing == 1 { Err("stop") } else { Ok(0.0) }), Err("stop"));
    }

    #[test]
    fn errors_are_summed_up_by_their_median_and_95th_percentile() {
        let answers: Vec<f64> = (0..=100).map(|k| 2.0 + 0.02 * f64::from(k)).collect();
        let error = error_of_ratios(&answers, &[2.0; 101]);
        assert!((error.value - 0.5).abs() < 1e-12 && error.low == error.value && (error.high - 0.95).abs() < 1e-12);
        assert_eq!(error_of_ratios(&[f64::NAN, 1.0, 1.0], &[1.0; 3]).high, f64::INFINITY);
        assert_eq!(spread(&[3.0, 1.0, 9.0]), Estimate { value: 3.0, low: 1.0, high: 9.0 });
        assert_eq!(spread(&[4.0, 2.0]), Estimate { value: 3.0, low: 2.0, high: 4.0 });
    }
}
