//! What becomes of NaN and infinity.

use super::{Canary, shown, words};
use crate::{Laboratory, StabilityError, bits};

/// Expressions in the order of the shader's cases.
const EXPRESSIONS: [&str; 17] = [
    "min(NaN, 1)",
    "min(1, NaN)",
    "max(NaN, 1)",
    "max(1, NaN)",
    "clamp(NaN, 0, 1)",
    "isnan(NaN)",
    "inf - inf",
    "0 inf",
    "NaN == NaN",
    "1 / 0",
    "sqrt(-1)",
    "atan(0, 0)",
    "pow(0, 0)",
    "normalize(0)",
    "fract(-1e-9)",
    "isinf(inf)",
    "inversesqrt(0)",
];

pub(super) fn ask(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    let operands = [f32::NAN, f32::INFINITY, 1.0, 0.0];
    let asked: Vec<_> =
        (0..EXPRESSIONS.len()).map(|at| words(operands, [at as u32, (-1e-9_f32).to_bits(), 0, 0])).collect();
    let answers: Vec<u32> =
        laboratory.words(&asked, bits!(canary_not_a_number))?.iter().map(|answer| answer[0]).collect();
    let listed = |of: std::ops::Range<usize>| {
        let each = EXPRESSIONS[of.clone()].iter().zip(&answers[of]);
        each.map(|(expression, answer)| format!("{expression} = {}", shown(*answer))).collect::<Vec<_>>().join(", ")
    };
    let is = |at: usize, value: f32| f32::from_bits(answers[at]) == value;
    let hides = (0..4).all(|at| is(at, 1.0)) && f32::from_bits(answers[4]).is_finite();
    let sees = is(5, 1.0) && is(8, 0.0) && f32::from_bits(answers[6]).is_nan() && is(15, 1.0);
    Ok(vec![
        Canary::new(
            "nan_selection",
            "what do min, max and clamp make of NaN?",
            listed(0..5),
            if hides {
                "NaN is hidden by them here and may show on another device: it is looked for by its bits"
            } else {
                "NaN may pass through them: it is looked for by its bits"
            },
        ),
        Canary::new(
            "nan_tests",
            "is NaN seen, and made where IEEE 754 makes it?",
            listed(5..9) + ", " + &listed(15..16),
            if sees {
                "tests for NaN work here; shaders ask bits all the same"
            } else {
                "expressions that should be NaN are not, or not seen: shaders ask bits"
            },
        ),
        Canary::new(
            "poles",
            "what are functions where they have no value?",
            listed(9..14) + ", " + &listed(16..17),
            "another device has other answers: no shader may go there",
        ),
        Canary::new(
            "fract_below_zero",
            "is fract(x) below 1 for every x?",
            listed(14..15),
            if is(14, 1.0) {
                "no: cells would have one too many, so fractions of coordinates are capped at 0.99999994"
            } else {
                "it is here; fractions of coordinates are capped at 0.99999994 all the same"
            },
        ),
    ])
}
