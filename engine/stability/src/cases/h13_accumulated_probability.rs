//! H13. Chances accumulated over many lights.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use mica_shaders::types::Operands;

/// Lights; each operand has twelve of their chances.
const LIGHTS: usize = 64;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(13);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let scale = random.log_between(1e-12, 0.7);
            let mut four = || [0; 4].map(|_| (scale * random.between(0.1, 1.0)) as f32);
            Operands { a: four(), b: four(), c: four() }
        })
        .collect();
    let any = |of: &Operands| {
        let chances = [of.a, of.b, of.c].concat();
        let none: f64 = (0..LIGHTS).map(|light| (-f64::from(chances[light % 12])).ln_1p()).sum();
        -none.exp_m1()
    };
    let truth: Vec<f64> = operands.iter().map(any).collect();
    let naive = laboratory.floats(&operands, arithmetic!(any_of_many_product))?;
    let stable = laboratory.floats(&operands, arithmetic!(any_of_many_series))?;
    Ok(vec![Check {
        what: "the chance that a flake mirrors any of 64 lights, 1e-13 to .7 each".to_owned(),
        error_of: "|chance / chance in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("1 - product of 1 - P", worst_ratio(&naive, &truth)),
        stable: Form::new("1 - exp(sum of log(1 - P)), both by series", worst_ratio(&stable, &truth)),
        // A sum of 64 terms of one sign, rounded 63 times, each time by 2^-24 of what is summed at most.
        tolerance: 4e-6,
    }])
}
