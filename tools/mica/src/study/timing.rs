//! What glints cost: frames with them against frames without, in turns in one run, and what stays on the device for them.
//!
//! `engine/design/0010-error-and-time.md` says why times are taken like this.

use super::effort::Effort;
use super::place::OpenPlace;
use super::sittings::{Drift, settle};
use crate::error::{Failure, INTERRUPTED, NO_DEVICE};
use crate::interrupt::Interrupt;
use crate::measure::{self, PassSum};
use crate::session::{Shot, Wanted};
use mica_accuracy::{Bytes, Cost, Estimate};
use mica_gpu::{DeviceInfo, DeviceKind, Run, Timing};
use mica_graph::{Lifetime, Plan};
use mica_render::View;
use std::collections::BTreeSet;
use std::time::Instant;

/// Where times of frames come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Timestamps of the device.
    Gpu,
    /// Processor time of the process, where the device is the processor: other processes hardly move it.
    Cpu,
}

impl Clock {
    /// The clock for a device.
    ///
    /// # Errors
    /// If it is no processor and measures no time.
    pub fn of(device: &DeviceInfo) -> Result<Self, Failure> {
        let clock = Self::choose(device.kind, device.limits.timestamp_valid_bits, mica_gpu::process_cpu_ns().is_some());
        clock.ok_or_else(|| {
            let name = &device.name;
            Failure::with_code(
                NO_DEVICE,
                format!("{name} measures no time (its queue's timestampValidBits is 0); choose another with --device"),
            )
        })
    }

    fn choose(kind: DeviceKind, valid_bits: u32, system_tells: bool) -> Option<Self> {
        if kind == DeviceKind::Cpu && system_tells { Some(Self::Cpu) } else { (valid_bits > 0).then_some(Self::Gpu) }
    }

    /// The word in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }

    /// Nanoseconds of a frame.
    ///
    /// # Errors
    /// If the device gave none.
    pub fn ns(self, run: &Run) -> Result<f64, Failure> {
        let ns = match self {
            Self::Gpu => run.frame_ns,
            Self::Cpu => run.cpu_ns,
        };
        let missing = || Failure::with_code(NO_DEVICE, "the device gave no time for a frame; run again");
        ns.map(|ns| ns as f64).ok_or_else(missing)
    }
}

/// Builds the tables of the method in use and times its frames: the first sitting. The method and its settings are those of
/// the place as it stands ([`OpenPlace::set`]).
///
/// # Errors
/// Those of frames; one with the code of an interrupt when Ctrl-C was pressed before the fewest rounds were done.
pub fn paired(open: &mut OpenPlace, effort: &Effort, interrupt: &Interrupt) -> Result<Cost, Failure> {
    let clock = Clock::of(open.session.device())?;
    let (precomputation, tables) = build(open, interrupt)?;
    let view = open.session.view.clone();
    // The first frames of a shader compile it, and those after a change place their images: both are over after two.
    let mut passes: Vec<Vec<PassSum>> = Vec::new();
    for _ in 0..effort.isolated.max(1) {
        passes.push(measure::sums(&frame(open, &view, Timing::Isolated, interrupt)?, false));
    }
    let Sitting { rounds, needs: [with, without] } = sit(open, effort, interrupt)?;
    let memory: Vec<Bytes> = open.session.executor.memory().into_iter().map(bytes).collect();
    let kept = |row: &&Bytes| {
        let of_glints = row.lifetime == Lifetime::Settings.name() || with.kept.contains(&row.name);
        row.lifetime != Lifetime::Frame.name() && of_glints && !open.without_glints.contains(&row.name)
    };
    let shared = with.shared_bytes.saturating_sub(without.shared_bytes);
    let glint_bytes = shared + memory.iter().filter(kept).map(|row| row.bytes).sum::<u64>();
    let mut cost = Cost {
        clock: clock.name().to_owned(),
        sittings: vec![rounds],
        passes: of_passes(&passes),
        tables,
        precomputation,
        glint_bytes,
        memory,
        ..nothing_yet()
    };
    settle(&mut cost, &Drift::default());
    Ok(cost)
}

/// Rounds that were taken one after another, and what their frames need.
pub(super) struct Sitting {
    /// Nanoseconds of a frame with glints, and of one without.
    pub(super) rounds: Vec<[f64; 2]>,
    needs: [Needs; 2],
}

/// Takes the rounds of a sitting, after a frame with glints and one without that bring back what other frames drove out.
pub(super) fn sit(open: &mut OpenPlace, effort: &Effort, interrupt: &Interrupt) -> Result<Sitting, Failure> {
    let clock = Clock::of(open.session.device())?;
    let with = open.session.view.clone();
    let without = View { glints: false, ..with.clone() };
    let mut needs_of = |view| Ok::<_, Failure>(Needs::of(&frame(open, view, Timing::Overlapped, interrupt)?.run.plan));
    let needs = [needs_of(&with)?, needs_of(&without)?];
    let [fewest, most] = effort.rounds.map(|rounds| rounds.max(1) as usize);
    let begun = Instant::now();
    let mut rounds: Vec<[f64; 2]> = Vec::new();
    while rounds.len() < fewest || (rounds.len() < most && begun.elapsed().as_secs_f64() < effort.seconds) {
        // In turns, so that what drifts does so for both.
        let first_without = rounds.len() % 2 == 1;
        let mut ns = [0.0; 2];
        for is_without in [first_without, !first_without] {
            let view = if is_without { &without } else { &with };
            ns[usize::from(is_without)] = clock.ns(&frame(open, view, Timing::Overlapped, interrupt)?.run)?;
        }
        rounds.push(ns);
    }
    Ok(Sitting { rounds, needs })
}

/// The cost of nothing: what stands in a line until its cost is known.
pub(super) fn nothing_yet() -> Cost {
    let none = Estimate::exact(0.0);
    Cost {
        clock: String::new(),
        sittings: Vec::new(),
        glints: none,
        frame: none,
        ratio: none,
        passes: Vec::new(),
        tables: 0.0,
        precomputation: 0.0,
        glint_bytes: 0,
        memory: Vec::new(),
    }
}

/// Makes what the method needs anew. Returns nanoseconds of what precedes the first frame, and of what the first frame
/// makes, not a number where the device has no timestamps; neither holds the compilation of shaders, nor what blocks rays, which is the scene's.
fn build(open: &mut OpenPlace, interrupt: &Interrupt) -> Result<(f64, f64), Failure> {
    loop {
        open.drop_tables()?;
        let before = open.session.precompute_anew()?;
        let view = open.session.view.clone();
        let first = measure::sums(&frame(open, &view, Timing::Isolated, interrupt)?, true);
        let names: BTreeSet<String> =
            before.iter().map(|update| &update.pass).chain(first.iter().map(|sum| &sum.name)).cloned().collect();
        // Whatever ran for the first time compiled its shader, or built for the scene: once more.
        if names.is_subset(&open.built) {
            // Folded, as the sum of no f64 is -0.
            let precomputation = before.iter().fold(0.0, |sum, update| sum + update.ns as f64);
            let tables = first.iter().fold(0.0, |all, sum| all + sum.ns.map_or(f64::NAN, |ns| ns as f64));
            return Ok((precomputation, tables));
        }
        open.built.extend(names);
    }
}

fn frame(open: &mut OpenPlace, view: &View, timing: Timing, interrupt: &Interrupt) -> Result<Shot, Failure> {
    if interrupt.requested() {
        return Err(Failure::with_code(INTERRUPTED, "interrupted"));
    }
    open.session.look(view, timing, Wanted::default())
}

/// What a frame needs of the device's memory.
struct Needs {
    /// Names of what stays between frames.
    kept: BTreeSet<String>,
    /// Of what frames share.
    shared_bytes: u64,
}

impl Needs {
    fn of(plan: &Plan) -> Self {
        let kept = plan.resources.iter().filter(|usage| usage.resource.lifetime != Lifetime::Frame);
        Self { kept: kept.map(|usage| usage.resource.name.clone()).collect(), shared_bytes: plan.shared_bytes }
    }
}

fn bytes(row: mica_gpu::MemoryRow) -> Bytes {
    Bytes { name: row.name, bytes: row.bytes, lifetime: row.lifetime.name().to_owned() }
}

/// Each pass over the frames that were timed in isolation; passes without a time are left out.
fn of_passes(frames: &[Vec<PassSum>]) -> Vec<(String, Estimate)> {
    let names = frames.first().into_iter().flatten().map(|sum| &sum.name);
    names
        .filter_map(|name| {
            let of_frame = |sums: &Vec<PassSum>| sums.iter().find(|sum| sum.name == *name).and_then(|sum| sum.ns);
            let times: Vec<f64> = frames.iter().filter_map(of_frame).map(|ns| ns as f64).collect();
            (!times.is_empty()).then(|| (name.clone(), spread(times.into_iter(), 0.0)))
        })
        .collect()
}

/// Median, least and greatest of some values, the ends at least so far from the median.
pub fn spread(values: impl Iterator<Item = f64> + Clone, least_half_width: f64) -> Estimate {
    let value = median(values.clone());
    Estimate {
        value,
        low: values.clone().fold(value - least_half_width, f64::min),
        high: values.fold(value + least_half_width, f64::max),
    }
}

/// The middle; of an even number, the mean of the middle two. 0 of none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => sorted[odd / 2],
        even => f64::midpoint(sorted[even / 2 - 1], sorted[even / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_one_that_runs() {
        for (kind, bits, system_tells, clock) in [
            (DeviceKind::Discrete, 64, true, Some(Clock::Gpu)),
            (DeviceKind::Integrated, 36, false, Some(Clock::Gpu)),
            (DeviceKind::Discrete, 0, true, None),
            (DeviceKind::Cpu, 64, true, Some(Clock::Cpu)),
            (DeviceKind::Cpu, 0, true, Some(Clock::Cpu)),
            (DeviceKind::Cpu, 64, false, Some(Clock::Gpu)),
            (DeviceKind::Cpu, 0, false, None),
        ] {
            assert_eq!(Clock::choose(kind, bits, system_tells), clock, "{kind:?}, {bits} bits");
        }
    }

    #[test]
    fn a_spread_holds_every_round_and_what_runs_differ_by() {
        let wide = spread([5.0, 1.0, 3.0].into_iter(), 0.5);
        assert_eq!((wide.low, wide.value, wide.high), (1.0, 3.0, 5.0));
        let narrow = spread([3.0, 3.0, 3.1].into_iter(), 0.5);
        assert_eq!((narrow.low, narrow.value, narrow.high), (2.5, 3.0, 3.5));
        assert_eq!(median([4.0, 1.0, 2.0, 9.0].into_iter()), 3.0);
    }
}
