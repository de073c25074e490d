//! Times of the points of a place, taken again with all others in between, and what that says of how sure they are.
//!
//! Rounds of one sitting are more alike than runs of the program are: processors slow down, neighbours come and go. How far
//! sittings of the same point lie apart is what runs differ by, and all points of a place tell it together.

use super::effort::Effort;
use super::place::OpenPlace;
use super::timing::{median, sit, spread};
use crate::error::Failure;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use mica_accuracy::{Cost, Point};

/// By how much a figure may move from one run of the program to the next, relative to itself, whatever the sittings say:
/// where a process lies in memory, say, is the same for all of them.
const LEAST_DRIFT: f64 = 0.05;

/// By how much figures of the same point move from sitting to sitting, relative to themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// A frame with glints.
    frame: f64,
    /// It over one without.
    ratio: f64,
}

impl Default for Drift {
    fn default() -> Self {
        Self { frame: LEAST_DRIFT, ratio: LEAST_DRIFT }
    }
}

impl Drift {
    /// The farthest that two sittings of any of the points lie apart.
    fn seen(points: &[Point]) -> Self {
        let farthest = |of: fn(&[f64; 2]) -> f64| {
            let of_point = |point: &Point| {
                let medians: Vec<f64> =
                    point.cost.sittings.iter().map(|rounds| median(rounds.iter().map(of))).collect();
                let least = medians.iter().copied().fold(f64::INFINITY, f64::min);
                let greatest = medians.iter().copied().fold(0.0, f64::max);
                (greatest - least) / median(medians.into_iter())
            };
            points.iter().map(of_point).fold(LEAST_DRIFT, f64::max)
        };
        Self { frame: farthest(with_glints), ratio: farthest(with_over_without) }
    }
}

/// Times all points of a place again, in turns, until each has as many sittings as it should, and hands over those whose
/// figures change. An interrupt or a failure ends it; what was timed until then counts.
///
/// # Errors
/// Those of frames, with the point they are of; one with the code of an interrupt; and those of `keep`.
pub fn sit_again(
    open: &mut OpenPlace,
    points: &mut [Point],
    effort: &Effort,
    (interrupt, progress): (&Interrupt, &mut Progress),
    mut keep: impl FnMut(&Point) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let before: Vec<Cost> = points.iter().map(|point| point.cost.clone()).collect();
    let mut end = Ok(());
    for sitting in 1..effort.sittings {
        let title = format!("{}: times, sitting {} of {}", open.place.scene, sitting + 1, effort.sittings);
        let missing = points.iter_mut().filter(|point| point.cost.sittings.len() == sitting);
        end = end.and_then(|()| progress.during(&title, || sitting_of(open, missing, effort, interrupt)));
    }
    let drift = Drift::seen(points);
    for (point, before) in points.iter_mut().zip(&before) {
        settle(&mut point.cost, &drift);
        if point.cost != *before {
            keep(point)?;
        }
    }
    end
}

fn sitting_of<'a>(
    open: &mut OpenPlace,
    points: impl Iterator<Item = &'a mut Point>,
    effort: &Effort,
    interrupt: &Interrupt,
) -> Result<(), Failure> {
    for point in points {
        let method = mica_render::method(&point.method)?;
        let set: Vec<(&str, &str)> = point.set.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        open.set(method, &set)?;
        point.cost.sittings.push(sit(open, effort, interrupt)?.rounds);
    }
    Ok(())
}

/// The figures of a cost from its sittings: medians of all rounds, within what rounds and sittings differ by.
pub(super) fn settle(cost: &mut Cost, drift: &Drift) {
    let rounds = || cost.sittings.iter().flatten();
    let typical = median(rounds().map(with_glints));
    let ratio = median(rounds().map(with_over_without));
    let glints = median(rounds().map(|[with, without]| with - without));
    cost.glints =
        spread(rounds().map(|[with, without]| with - without), typical * drift.ratio + glints.abs() * drift.frame);
    cost.frame = spread(rounds().map(with_glints), typical * drift.frame);
    cost.ratio = spread(rounds().map(with_over_without), ratio * drift.ratio);
}

fn with_glints([with, _]: &[f64; 2]) -> f64 {
    *with
}

fn with_over_without([with, without]: &[f64; 2]) -> f64 {
    with / without
}
