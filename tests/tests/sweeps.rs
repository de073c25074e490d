//! Every sweep on the device at hand: the stable form within its tolerance over the whole range, the naive one not.

use mica_stability::{Effort, Laboratory, SWEEPS, Series, Sweep};
use mica_tests::Gpu;

/// Makes a sweep, prints what it found and fails where its claim is not true or a line cannot be drawn. `off` says how far
/// a point of a naive form is from the truth: somewhere that is beyond the tolerance.
fn holds(name: &str, off: impl Fn(&Sweep, (f64, f64)) -> f64) {
    let mut gpu = Gpu::new();
    let (_, make) = SWEEPS.iter().find(|(of, _)| *of == name).expect("a sweep");
    let sweep = make(&mut Laboratory { executor: gpu.executor(), effort: Effort::Quick }).expect("it is made");
    let naive = sweep.series[1].points.iter().map(|point| off(&sweep, *point)).fold(0.0, f64::max);
    println!("{}: stable {:.2e}, naive {naive:.2e}, tolerance {:.2e}", sweep.claim, sweep.worst, sweep.tolerance);
    assert_eq!(sweep.name, name);
    assert!(sweep.holds(), "{}: off by {:e}", sweep.claim, sweep.worst);
    assert!(naive > sweep.tolerance, "the naive form of {name} holds: {naive:e}");
    for Series { name: line, points } in &sweep.series {
        assert!(points.len() > 8 && points.windows(2).all(|pair| pair[0].0 < pair[1].0), "{name}, {line}: {points:?}");
        let drawn = |value: f64, log: bool| value.is_finite() && (!log || value > 0.0);
        let bad = points.iter().find(|(x, y)| !drawn(*x, sweep.x.log) || !drawn(*y, sweep.y.log));
        assert_eq!(bad, None, "{name}, {line}");
    }
}

/// The line is that of an error.
fn error(_: &Sweep, (_, error): (f64, f64)) -> f64 {
    error
}

/// The line is that of a ratio which should be 1.
fn from_one(_: &Sweep, (_, ratio): (f64, f64)) -> f64 {
    (ratio - 1.0).abs()
}

/// The third line is the truth.
fn from_truth(sweep: &Sweep, (x, value): (f64, f64)) -> f64 {
    let truth = &sweep.series[2].points;
    let at = truth.partition_point(|(of, _)| *of < x).min(truth.len() - 1);
    (value / truth[at].1 - 1.0).abs()
}

#[test]
fn radiance_is_flat_over_ten_decades_of_distance() {
    holds("distance", from_one);
}

#[test]
fn the_mean_of_lit_flakes_is_that_of_the_law_over_eleven_decades() {
    holds("flakes_mean", from_one);
}

#[test]
fn the_fluctuation_of_lit_flakes_has_no_step_over_eleven_decades() {
    holds("flakes_deviation", from_truth);
}

#[test]
fn masking_keeps_its_digits_to_the_horizon() {
    holds("grazing", error);
}

#[test]
fn the_distribution_keeps_its_digits_from_mirrors_to_chalk() {
    holds("alpha", error);
}

#[test]
fn narrow_and_wide_cones_keep_the_digits_of_p() {
    holds("gamma", error);
}

#[test]
fn texture_repeats_a_million_squares_from_its_origin() {
    holds("offset", error);
}

#[test]
fn footprints_keep_their_shorter_axis_at_a_million_to_one() {
    holds("anisotropy", error);
}
