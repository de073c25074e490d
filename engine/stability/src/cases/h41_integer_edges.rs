//! H41. Shifts, divisions and conversions at their edges.

use crate::{Check, Form, Laboratory, Random, StabilityError, bits, share_wrong};
use mica_shaders::types::Words;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(41);
    let counts = [0, 1, 31, 32, 33, 63, 64, 255, u32::MAX];
    let numbers = [0.0, -0.0, -1.5, 3e9, 5e9, -3e9, 1e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    let words: Vec<Words> = (0..laboratory.inputs(200_000, 20_000_000))
        .map(|index| {
            let pick = random.bits() as usize;
            let count = if pick & 1 == 0 { counts[pick / 2 % counts.len()] } else { random.bits() as u32 % 40 };
            let divisor = if pick & 6 == 0 { 0 } else { random.bits() as u32 >> (pick / 8 % 32) };
            let number =
                if index % 3 == 0 { numbers[pick / 3 % numbers.len()].to_bits() } else { random.bits() as u32 };
            Words { a: [random.bits() as u32, count, divisor, 0], b: [number, (pick / 64 % 2) as u32, 0, 0] }
        })
        .collect();
    let truth: Vec<[u32; 4]> = words
        .iter()
        .map(|Words { a: [x, count, divisor, _], b: [number, right, ..] }| {
            let moved = if *right == 0 { x.checked_shl(*count) } else { x.checked_shr(*count) };
            let number = f32::from_bits(*number);
            // Rust's conversions saturate; the greatest floats below 2^31 and 2^32 are what shaders can clamp to.
            let integer = (number as i32).min(i32::MAX - 127);
            let whole = (number as u32).min(u32::MAX - 255);
            [moved.unwrap_or(0), x.checked_div(*divisor).unwrap_or(0), integer.cast_unsigned(), whole]
        })
        .collect();
    let plain = laboratory.words(&words, bits!(edges_plain))?;
    let guarded = laboratory.words(&words, bits!(edges_guarded))?;
    let names =
        ["shifts by any number", "quotients by any divisor", "integers of any bits", "whole numbers of any bits"];
    let check = |(at, what): (usize, &str)| {
        let of = |answers: &[[u32; 4]]| -> Vec<u32> { answers.iter().map(|answer| answer[at]).collect() };
        let truth = of(&truth);
        Check {
            what: what.to_owned(),
            error_of: "share of wrong answers".to_owned(),
            inputs: truth.len() as u64,
            naive: Form::new("as the language has it", share_wrong(&of(&plain), &truth)),
            stable: Form::new("with its edges closed", share_wrong(&of(&guarded), &truth)),
            tolerance: 0.0,
        }
    };
    Ok(names.into_iter().enumerate().map(check).collect())
}
