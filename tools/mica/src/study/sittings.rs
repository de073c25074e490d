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
    /// How far sittings of one point lie apart for nine tenths of the points: a hitch is no drift.
    fn seen(points: &[Point]) -> Self {
        let apart = |of: fn(&[f64; 2]) -> f64| {
            let of_point = |point: &Point| {
                let medians: Vec<f64> =
                    point.cost.sittings.iter().map(|rounds| median(rounds.iter().map(of))).collect();
                let least = medians.iter().copied().fold(f64::INFINITY, f64::min);
                let greatest = medians.iter().copied().fold(0.0, f64::max);
                (greatest - least) / median(medians.into_iter())
            };
            let mut ranges: Vec<f64> = points.iter().map(of_point).collect();
            ranges.sort_by(f64::total_cmp);
            let tenth = ranges.len() / 10;
            ranges.iter().rev().nth(tenth).map_or(LEAST_DRIFT, |range| range.max(LEAST_DRIFT))
        };
        Self { frame: apart(with_glints), ratio: apart(with_over_without) }
    }
}

/// Times all points of a place again, in turns, until each has as many sittings as it should, and hands over those whose
/// figures change. An interrupt or a failure of a frame ends it and is returned; what was timed until then counts.
///
/// # Errors
/// Those of `keep`: nothing more can be kept.
pub fn sit_again(
    open: &mut OpenPlace,
    points: &mut [Point],
    effort: &Effort,
    (interrupt, progress): (&Interrupt, &mut Progress),
    mut keep: impl FnMut(&Point) -> Result<(), Failure>,
) -> Result<Option<Failure>, Failure> {
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
    Ok(end.err())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(sittings: &[f64]) -> Cost {
        let rounds = sittings.iter().map(|ratio| vec![[ratio * 1e6, 1e6]]).collect();
        Cost { sittings: rounds, ..super::super::timing::nothing_yet() }
    }

    #[test]
    fn a_spread_holds_every_round_and_what_sittings_differ_by() {
        let mut alike = cost(&[2.0, 2.0, 2.2]);
        settle(&mut alike, &Drift { frame: 0.3, ratio: 0.1 });
        assert_eq!((alike.ratio.value, alike.frame.value, alike.glints.value), (2.0, 2e6, 1e6));
        let ends = |of: mica_accuracy::Estimate| [of.low, of.high].map(|end| (end * 1e6).round() / 1e6);
        assert_eq!(ends(alike.ratio), [1.8, 2.2]);
        assert_eq!(ends(alike.frame), [1.4e6, 2.6e6]);
        // A tenth of the frame by the ratio, and three tenths of itself by the frame.
        assert_eq!(ends(alike.glints), [0.5e6, 1.5e6]);
        let mut apart = cost(&[1.0, 2.0, 5.0]);
        settle(&mut apart, &Drift::default());
        assert_eq!(ends(apart.ratio), [1.0, 5.0]);
    }
}
