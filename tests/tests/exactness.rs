//! The cost of each exactness: every rung is as wrong as it is known to be, neither more nor less, and every line says what
//! it is of. No figure of time is judged.

use mica_accuracy::exactness::{Chart, EXACTNESS_SCHEMA, Effort, ExactnessLine, measure};
use mica_accuracy::{Estimate, Machine};
use mica_tests::Gpu;

/// What a device may add to errors that are not of rounding: its own exponentials. A gate softer by a tenth shows, and a
/// deviation wrong by 2 %.
const SLACK: f64 = 1.03;

fn lines(chart: Chart) -> Vec<ExactnessLine> {
    let machine = Machine {
        device: "any".to_owned(),
        driver: "any".to_owned(),
        occlusion: "none".to_owned(),
        build: "any".to_owned(),
    };
    let lines = measure(chart, Gpu::new().executor(), &Effort::LEAST, &machine, &mut |_, _, _| {});
    let lines = lines.expect("the rungs are measured");
    for (index, line) in lines.iter().enumerate() {
        assert_eq!((line.schema.as_str(), line.chart.as_str()), (EXACTNESS_SCHEMA, chart.name()));
        assert!(![&line.case, &line.rung, &line.what, &line.error_of, &line.per].iter().any(|text| text.is_empty()));
        assert!(!lines[..index].iter().any(|other| other.is_same_as(line)), "{} {} twice", line.case, line.rung);
        for Estimate { value, low, high } in [line.error, line.ns] {
            assert!(value.is_finite() && low <= value && value <= high && high.is_finite(), "{line:?}");
        }
        assert!(line.error.low >= 0.0, "{line:?}");
        println!(
            "{:36} {:26} {:9.2e} {:9.2e} {:9.3} ns",
            line.case, line.rung, line.error.value, line.error.high, line.ns.value
        );
    }
    lines
}

fn error(lines: &[ExactnessLine], case: &str, rung: &str) -> Estimate {
    let line = lines.iter().find(|line| line.case == case && line.rung == rung);
    line.unwrap_or_else(|| panic!("{rung} is not measured for {case}")).error
}

/// Asserts that an error is what it was measured to be; below the third figure, that it is only of rounding.
fn is_about(what: &str, error: f64, expected: f64, rounding: f64) {
    if expected < rounding {
        assert!(error < rounding, "{what}: {error:e}, where only rounding is expected, below {rounding:e}");
    } else {
        let range = expected / SLACK..=expected * SLACK;
        assert!(range.contains(&error), "{what}: {error:e}, where {expected:e} is expected");
    }
}

/// Median and 95th percentile of |P'/P - 1|. Those of the first case are what the closed forms were derived to have; those
/// of the wide cone depend on where in the cone is asked: here, where light is seen.
#[test]
fn each_rung_of_the_lit_probability_is_as_wrong_as_it_is_known_to_be() {
    let lines = lines(Chart::LitProbability);
    let cases = ["alpha 0.5, gamma 2 deg", "alpha 0.1, gamma 6 deg", "alpha 0.02, gamma 6 deg"];
    let rungs = [
        ("small cone", [[4.70e-4, 2.51e-3], [1.59e-1, 7.66e-1], [9.98e-1, 5.23]]),
        ("widened Gaussian", [[4.32e-4, 4.48e-3], [6.47e-3, 7.95e-2], [2.43e-1, 5.67e-1]]),
        ("equal-area box", [[4.62e-4, 4.77e-3], [1.09e-2, 7.98e-2], [3.87e-2, 4.61e-1]]),
        ("cap cubature", [[6.7e-8, 2e-7], [4.54e-4, 3.29e-2], [4.29e-1, 1.31]]),
        ("6 strips", [[4.31e-4, 4.49e-3], [3.21e-3, 3.67e-2], [3.96e-3, 4.43e-2]]),
        ("8 nodes", [[8.4e-7, 2.7e-6], [4.75e-5, 5.67e-3], [1.39e-2, 1.05e-1]]),
        ("16 nodes", [[7.0e-7, 2.1e-6], [1.9e-7, 1.3e-6], [4.3e-6, 2.34e-4]]),
        ("32 nodes", [[6.4e-7, 1.8e-6], [1.8e-7, 7.3e-7], [1.8e-7, 1.6e-6]]),
        ("table", [[9.58e-3, 3.00e-2], [1.15e-1, 5.60e-1], [8.01e-1, 1.61]]),
    ];
    for (rung, of_cases) in rungs {
        for (case, [median, most]) in cases.into_iter().zip(of_cases) {
            let error = error(&lines, case, rung);
            is_about(&format!("{case}, {rung}, median"), error.value, median, 1e-5);
            is_about(&format!("{case}, {rung}, 95th percentile"), error.high, most, 2e-5);
        }
    }
    let between = error(&lines, cases[0], "table between roughnesses");
    is_about("interpolated in roughness", between.value, 7.18e-2, 0.0);
    assert_eq!(lines.len(), 9 * 3 + 1);
}

/// Median and greatest over the laws.
#[test]
fn each_rung_of_the_count_law_is_as_wrong_as_it_is_known_to_be() {
    let lines = lines(Chart::CountLaw);
    let cases = ["mean", "variance", "dark pixels", "distribution"];
    let rungs = [
        ("mean alone", [[0.0, 1e-7], [1.0, 1.0], [2.26e-1, 9.05e-1], [5.87e-1, 1.81]]),
        ("gated Gaussian", [[4.32e-2, 1.43e-1], [6.36e-2, 4.52e-1], [9.62e-2, 1.15e-1], [9.82e-2, 5.38e-1]]),
        ("gated Gaussian, repaired", [[4.63e-2, 1.23e-1], [6.03e-2, 4.53e-1], [9.59e-2, 1.00e-1], [9.76e-2, 5.23e-1]]),
        ("blended inversion", [[5e-4, 1.7e-3], [2.11e-2, 5.04e-1], [5.20e-3, 2.80e-2], [3.99e-2, 7.04e-2]]),
        ("blended, sqrt 2 restored", [[6e-4, 1.7e-3], [1.47e-2, 4.67e-2], [5.20e-3, 2.80e-2], [2.67e-2, 5.22e-2]]),
        ("three thresholds", [[2.69e-4, 3.68e-3], [2.73e-3, 2.20e-2], [4e-6, 8e-6], [6.23e-4, 3.70e-3]]),
        ("exact inversion", [[5e-6, 9e-5], [3e-5, 4.3e-4], [4e-6, 8e-6], [3e-5, 1.8e-4]]),
    ];
    for (rung, of_cases) in rungs {
        // What draws of its own vary by, or what as many even draws can show.
        let rounding = if rung.starts_with("blended") { [2e-3, 2e-3, 2e-3, 2e-3] } else { [2e-4, 1e-3, 2e-5, 4e-4] };
        for ((case, [median, most]), rounding) in cases.into_iter().zip(of_cases).zip(rounding) {
            let error = error(&lines, case, rung);
            is_about(&format!("{case}, {rung}, median"), error.value, median, rounding);
            is_about(&format!("{case}, {rung}, greatest"), error.high, most, rounding);
        }
    }
    assert_eq!(lines.len(), rungs.len() * cases.len());
}

/// The common form loses digits where it is said to; the stable form keeps them, as far as Vulkan lets a device's own sines
/// and arc sines keep them.
#[test]
fn stable_arithmetic_keeps_the_digits_that_common_forms_lose() {
    let lines = lines(Chart::Arithmetic);
    let high = |case: &str, rung: &str| error(&lines, case, rung).high;
    for (case, rung, least) in [
        ("cone membership, gamma 1 deg", "matrix", 1e-4),
        ("cone membership, gamma 1 deg", "cosine", 1e-4),
        ("cone membership, gamma 0.01 deg", "matrix", 0.1),
        ("cone membership, gamma 0.01 deg", "cosine", 0.1),
        ("G1 / cos, cos 1e-7 to .1", "tangent", 0.02),
        ("Beckmann D, alpha 0.1", "cosine", 3e-6),
        ("Beckmann D, alpha 0.001", "cosine", 0.03),
        ("2 x 2 determinant, 10,000 to 1", "plain", 1e-5),
        ("1 - (1 - p)^n, p 1e-8 to 1e-3", "power", 0.3),
        ("i.h, half-angle pi/2 - .001", "normalized", 4e-3),
        ("angle of .001", "acos", 0.02),
        ("solid angle, gamma .01 to 1 deg", "cosine", 0.3),
        ("shorter axis, 100 to 10,000 to 1", "roots", 0.1),
    ] {
        assert!(high(case, rung) > least, "{case}, {rung}: {:e} is better than it can be", high(case, rung));
    }
    for (case, rung, most) in [
        ("cone membership, gamma 1 deg", "chord", 0.0),
        ("cone membership, gamma 0.01 deg", "chord", 2e-3),
        ("G1 / cos, cos 1e-7 to .1", "cancelled", 2e-6),
        ("Beckmann D, alpha 0.1", "cross product", 5e-6),
        ("Beckmann D, alpha 0.1", "chord", 5e-6),
        ("Beckmann D, alpha 0.001", "cross product", 2e-4),
        ("Beckmann D, alpha 0.001", "chord", 5e-6),
        ("2 x 2 determinant, 10,000 to 1", "exact products", 2e-7),
        ("1 - (1 - p)^n, p 1e-8 to 1e-3", "series", 2e-6),
        ("i.h, half-angle pi/2 - .001", "length", 1e-6),
        ("angle of .001", "chord", 5e-4),
        ("solid angle, gamma .01 to 1 deg", "sine", 0.05),
        ("shorter axis, 100 to 10,000 to 1", "quotient", 5e-4),
    ] {
        assert!(high(case, rung) <= most, "{case}, {rung}: {:e} is above {most:e}", high(case, rung));
    }
    assert_eq!(lines.len(), 26);
}
