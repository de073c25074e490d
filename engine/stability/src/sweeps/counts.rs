//! How many flakes are lit, from a thousandth of a flake in the footprint to 1e8, in steps of 1 %.

use super::{Series, Sweep, greatest, linear, log};
use crate::count_law::{
    Law, Moments, binomial_moments, exact_moments, gated_law, gated_moments, in_steps, law_of, scale_moments,
};
use crate::{Laboratory, StabilityError};

const LEAST: f64 = 1e-3;
const MOST: f64 = 1e8;
/// Steps of 1 % between points of naive forms, which are sampled.
const NAIVE_STRIDE: u32 = 20;

/// The mean over that of the law.
///
/// # Errors
/// Those of the device.
pub fn mean(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    let (expected, laws, moments) = stable(laboratory)?;
    let ratios: Vec<f64> = laws.iter().zip(&moments).map(|(law, of)| of.mean / exact_moments(*law).mean).collect();
    let coarse = in_steps(LEAST, MOST, NAIVE_STRIDE);
    let gates: Vec<Law> = coarse.iter().map(|expected| gated_law(*expected)).collect();
    let gated = gated_moments(laboratory, &gates)?;
    let gated = gates.iter().zip(&gated).map(|(law, of)| of.mean / exact_moments(*law).mean);
    // Of rarer events 2,048 draws show the chance, and not the law.
    let shown = coarse.iter().copied().zip(gated).filter(|(expected, _)| *expected > 1.0);
    Ok(Sweep {
        name: "flakes_mean".to_owned(),
        title: "Mean of the lit flakes".to_owned(),
        x: log("flakes expected in the footprint"),
        y: linear("mean of the lit flakes / n p"),
        worst: greatest(ratios.iter().map(|ratio| (ratio - 1.0).abs())),
        series: vec![
            Series { name: "one binomial count".to_owned(), points: expected.into_iter().zip(ratios).collect() },
            Series { name: "a gate and a rounded normal number".to_owned(), points: shown.collect() },
        ],
        claim: "The mean is that of the law within .1 % from a thousandth of a flake to 1e8, in steps of 1 %."
            .to_owned(),
        tolerance: 1e-3,
    })
}

/// The standard deviation over the mean.
///
/// # Errors
/// Those of the device.
pub fn deviation(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    let (expected, laws, moments) = stable(laboratory)?;
    let coarse = in_steps(LEAST, MOST, NAIVE_STRIDE);
    let coarse: Vec<f64> = coarse.into_iter().filter(|expected| *expected > 1.0).collect();
    let switched = scale_moments(laboratory, &coarse)?;
    let relative = |of: &Moments| of.deviation / of.mean;
    let truth: Vec<Moments> = laws.iter().map(|law| exact_moments(*law)).collect();
    let off = truth.iter().zip(&moments).map(|(truth, of)| (of.deviation / truth.deviation - 1.0).abs());
    let line = |name: &str, moments: &[Moments]| Series {
        name: name.to_owned(),
        points: expected.iter().copied().zip(moments.iter().map(relative)).collect(),
    };
    // Beyond the second switch there is no deviation, and nothing to draw.
    let of_scales = coarse.iter().copied().zip(switched.iter().map(relative)).filter(|(_, relative)| *relative > 1e-6);
    Ok(Sweep {
        name: "flakes_deviation".to_owned(),
        title: "Fluctuation of the lit flakes".to_owned(),
        x: log("flakes expected in the footprint"),
        y: log("standard deviation / mean of the lit flakes"),
        worst: greatest(off),
        series: vec![
            line("one binomial count", &moments),
            Series { name: "three scales, switched at 4 and 64".to_owned(), points: of_scales.collect() },
            line("the law", &truth),
        ],
        claim: "The standard deviation is that of the law within .5 % from a thousandth of a flake to 1e8, in steps of 1 %."
            .to_owned(),
        tolerance: 5e-3,
    })
}

/// Flakes that are expected, the laws of the lit ones, and moments as the device draws them.
type Drawn = (Vec<f64>, Vec<Law>, Vec<Moments>);

fn stable(laboratory: &mut Laboratory) -> Result<Drawn, StabilityError> {
    let expected = in_steps(LEAST, MOST, 1);
    let laws: Vec<Law> = expected.iter().map(|expected| law_of(*expected)).collect();
    let moments = binomial_moments(laboratory, &laws)?;
    Ok((expected, laws, moments))
}
