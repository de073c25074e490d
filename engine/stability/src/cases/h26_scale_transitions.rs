//! H26. Mean and variance across scales, without a step.
//!
//! A footprint in which `expected` of N flakes lie shows Binomial(N, expected P / N) lit ones. One sampler draws that at every scale, so
//! that there is nothing to switch. Switched at 4 and 64 flakes, as Wang, Deng and Holzschuch 2020 do, the mean goes on and the
//! deviation does not: in between, all flakes that are there shine a little, and beyond, all that are expected.

use crate::count_law::{
    Law, Moments, binomial_moments, exact_moments, gated_law, gated_moments, greatest_step, in_steps, law_of,
    scale_moments,
};
use crate::{Check, Form, Laboratory, StabilityError};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let steps = in_steps(0.03, 3e4, laboratory.inputs(4, 1) as u32);
    let laws: Vec<Law> = steps.iter().map(|expected| law_of(*expected)).collect();
    let moments = binomial_moments(laboratory, &laws)?;
    let truth: Vec<Moments> = laws.iter().map(|law| exact_moments(*law)).collect();
    // Where scales are switched; naive forms are asked nowhere else.
    let switches = in_steps(3.0, 80.0, 1);
    let switched = scale_moments(laboratory, &switches)?;
    let of_switches: Vec<Moments> = switches.iter().map(|expected| exact_moments(law_of(*expected))).collect();
    let inputs = laws.len() as u64;
    let largest_bias = |moments: &[Moments], truth: &[Moments]| {
        moments.iter().zip(truth).map(|(of, truth)| (of.mean / truth.mean - 1.0).abs()).fold(0.0, f64::max)
    };
    let gates: Vec<Law> = steps.iter().map(|expected| gated_law(*expected)).collect();
    let gated = gated_moments(laboratory, &gates)?;
    Ok(vec![
        Check {
            what: "standard deviation of the lit flakes, from .03 expected to 30,000".to_owned(),
            error_of: "greatest change of ln(deviation / deviation of the law) between neighbours".to_owned(),
            inputs,
            naive: Form::new(
                "each flake, then all of them a little, then what is expected",
                greatest_step(deviations(&switched), deviations(&of_switches)),
            ),
            stable: Form::new("one binomial count", greatest_step(deviations(&moments), deviations(&truth))),
            // A tenth of what the list of cases allows: nothing is switched but the branch of the sampler.
            tolerance: 5e-3,
        },
        Check {
            what: "mean of the lit flakes, from .03 expected to 30,000".to_owned(),
            error_of: "|mean / mean of the law - 1|".to_owned(),
            inputs,
            naive: Form::new("a gate and a rounded normal number", largest_bias(&gated, &truth)),
            stable: Form::new("one binomial count", largest_bias(&moments, &truth)),
            tolerance: 1e-3,
        },
    ])
}

fn deviations(moments: &[Moments]) -> impl Iterator<Item = f64> + '_ {
    moments.iter().map(|of| of.deviation)
}
