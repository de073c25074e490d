//! H40. Loops within the device's budget.

use crate::{Check, Form, Laboratory, StabilityError, bits};
use mica_shaders::constants::{FLAKE_STEPS_A_PASS, JAKOB_STEPS, STEPS_A_INVOCATION};
use mica_shaders::types::Words;

/// Invocations whose loops lavapipe counts together.
const LANES: u32 = 8;
/// Iterations that every device is trusted with; lavapipe ends loops after 65,535.
const MOST_ITERATIONS: u32 = 60_000;

// No traversal is declared longer than what one vector of invocations may take.
const _: () = {
    assert!(STEPS_A_INVOCATION as u32 * LANES <= MOST_ITERATIONS);
    assert!(FLAKE_STEPS_A_PASS <= STEPS_A_INVOCATION);
    assert!(JAKOB_STEPS <= STEPS_A_INVOCATION as u32);
};

/// Measures it: rounds asked for and rounds gone, in one invocation and in as many as the budget asks for. Not every
/// device ends loops (lavapipe 22.3 does, 25.0 does not), so the error is how much is asked of one that does.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let rounds: Vec<u32> = vec![7_000, 59_999, 65_536, 70_000, 200_000];
    let budget = STEPS_A_INVOCATION as u32;
    let parts = |of: u32| (0..of.div_ceil(budget)).map(move |part| (of - part * budget).min(budget));
    let shares: Vec<u32> = rounds.iter().flat_map(|of| parts(*of)).collect();
    let mut form = |form: &str, loops: &[u32]| -> Result<Form, StabilityError> {
        let asked: Vec<Words> = loops.iter().map(|rounds| Words { a: [*rounds, 0, 0, 0], b: [0; 4] }).collect();
        let gone = laboratory.words(&asked, bits!(rounds_of_a_loop))?;
        let whole = gone.iter().zip(loops).all(|(gone, asked)| gone[0] == *asked);
        let longest = loops.iter().max().copied().unwrap_or_default();
        let demand = f64::from(longest * LANES) / f64::from(MOST_ITERATIONS);
        Ok(Form::new(form, if whole { demand } else { f64::INFINITY }))
    };
    Ok(vec![Check {
        what: "loops of 7,000 to 200,000 rounds".to_owned(),
        error_of: "rounds of 8 invocations over 60,000; infinite where this device ends them early".to_owned(),
        inputs: rounds.len() as u64,
        naive: form("in one invocation", &rounds)?,
        stable: form("7,000 an invocation", &shares)?,
        tolerance: 1.0,
    }])
}
