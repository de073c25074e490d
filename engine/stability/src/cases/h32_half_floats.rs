//! H32. Storage in half floats.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, bits, worst_ratio};
use mica_shaders::types::{Operands, Words};

/// Greatest finite half float.
const GREATEST_HALF: f64 = 65504.0;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![stored(laboratory)?, accumulated(laboratory)?])
}

/// Radiances up to that of a sun, as half floats that were not to become infinite.
fn stored(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(32);
    // The last ones are where the conversion itself turns infinite, or may.
    let mut radiances: Vec<f32> =
        (0..laboratory.inputs(100_000, 10_000_000)).map(|_| random.log_between(1e-4, 1e6) as f32).collect();
    radiances.extend([65503.0, 65504.0, 65519.0, 65520.0, 65536.0, 1e6, f32::MAX]);
    let words: Vec<Words> =
        radiances.iter().map(|x| Words { a: [x.to_bits(), (-x).to_bits(), 0, 0], b: [0; 4] }).collect();
    let truth: Vec<f64> = radiances
        .iter()
        .flat_map(|x| {
            let nearest = f64::from(*x).min(GREATEST_HALF);
            [nearest, -nearest]
        })
        .collect();
    // What came back of each number and of its negative.
    let unpacked = |answers: Vec<[u32; 4]>| -> Vec<f32> {
        let halves = |packed: u32| [packed & 0xffff, packed >> 16].map(|bits| float_of_half(bits as u16));
        answers.iter().flat_map(|answer| halves(answer[0])).collect()
    };
    let plain = unpacked(laboratory.words(&words, bits!(halves_plain))?);
    let saturated = unpacked(laboratory.words(&words, bits!(halves_saturated))?);
    Ok(Check {
        what: "radiances of 1e-4 to 1e6, and where half floats end, as half floats".to_owned(),
        error_of: "|half / min(radiance, 65504) - 1|".to_owned(),
        inputs: truth.len() as u64,
        naive: Form::new("packHalf2x16(x)", worst_ratio(&plain, &truth)),
        stable: Form::new("packHalf2x16(clamp(x, -65504, 65504))", worst_ratio(&saturated, &truth)),
        // A unit in the last place of 11 bits, as rounding may go either way.
        tolerance: 2_f64.powi(-10),
    })
}

/// The mean of as many frames as a still picture has.
fn accumulated(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(33);
    let operands: Vec<Operands> = (0..laboratory.inputs(256, 100_000))
        .map(|_| {
            let (first, step) = (random.log_between(0.01, 8.0), random.between(0.0, 1e-4));
            Operands { a: [first as f32, 4096.0, step as f32, 0.0], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    let truth: Vec<f64> =
        operands.iter().map(|of| f64::from(of.a[0]) + f64::from(of.a[2]) * (f64::from(of.a[1]) - 1.0) / 2.0).collect();
    let halves = laboratory.floats(&operands, arithmetic!(mean_in_halves))?;
    let running = laboratory.floats(&operands, arithmetic!(mean_running))?;
    Ok(Check {
        what: "the mean of 4,096 frames".to_owned(),
        error_of: "|mean / mean in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("sum and count in half floats", worst_ratio(&halves, &truth)),
        stable: Form::new("running mean in f32", worst_ratio(&running, &truth)),
        // Each step rounds the mean once, and all may round the same way: these frames drift slowly.
        tolerance: 4096.0 * 2_f64.powi(-24),
    })
}

/// The value of a half float.
fn float_of_half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 0x3ff));
    sign * match exponent {
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        0 => fraction * 2_f32.powi(-24),
        _ => (1024.0 + fraction) * 2_f32.powi(exponent - 25),
    }
}
