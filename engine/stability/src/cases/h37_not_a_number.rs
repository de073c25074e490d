//! H37. What is not a number, and finite or not.
//!
//! What min, max and clamp make of NaN is the device's choice: `mica doctor --canaries` says which. So NaN is asked for
//! by its bits, and every picture is asked on the host how many of its pixels are not finite.

use crate::{Check, Form, Laboratory, Random, StabilityError, bits, share_wrong};
use mica_shaders::types::Words;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(38);
    // Of all bit patterns one in 256 is no number; half of these are made so.
    let mut words: Vec<[u32; 4]> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|index| {
            let exponent = if index % 2 == 0 { 0x7f80_0000 } else { 0 };
            [(); 4].map(|()| random.bits() as u32 | exponent)
        })
        .collect();
    words.push([0.0, -0.0, f32::INFINITY, f32::NEG_INFINITY].map(f32::to_bits));
    words.push([f32::NAN, f32::MAX, f32::MIN, f32::from_bits(1)].map(f32::to_bits));
    words.push([0x7f80_0001, 0xffff_ffff, 0x7f7f_ffff, 0x007f_ffff]);
    let truth: Vec<[u32; 4]> =
        words.iter().map(|bits| bits.map(|bits| u32::from(f32::from_bits(bits).is_finite()))).collect();
    let asked: Vec<Words> = words.iter().map(|a| Words { a: *a, b: [0; 4] }).collect();
    let by_difference = laboratory.words(&asked, bits!(finite_by_difference))?;
    let by_bits = laboratory.words(&asked, bits!(finite_by_bits))?;
    Ok(vec![Check {
        what: "which of any four bit patterns are finite numbers".to_owned(),
        error_of: "share of wrong answers".to_owned(),
        inputs: asked.len() as u64,
        naive: Form::new("x - x == 0", share_wrong(&by_difference, &truth)),
        stable: Form::new("not all bits of the exponent", share_wrong(&by_bits, &truth)),
        tolerance: 0.0,
    }])
}
