//! H36. Minus zero.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, bits, share_wrong, worst_difference};
use mica_shaders::types::{Operands, Words};
use std::f64::consts::TAU;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![hashed(laboratory)?, framed(laboratory)?])
}

/// Cells around the origin have one hash, however their zero came about.
fn hashed(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(36);
    let count = laboratory.inputs(10_000, 1_000_000);
    let others: Vec<f32> = (0..count).map(|_| random.between(-1e6, 1e6) as f32).collect();
    let with = |zero: f32| -> Vec<Words> {
        let each = |(index, other): (usize, &f32)| {
            let cell = if index % 2 == 0 { [zero, *other] } else { [*other, zero] };
            Words { a: [cell[0].to_bits(), cell[1].to_bits(), 0, 0], b: [0; 4] }
        };
        others.iter().enumerate().map(each).collect()
    };
    let (plus, minus) = (with(0.0), with(-0.0));
    let of_bits =
        share_wrong(&laboratory.words(&minus, bits!(hash_of_bits))?, &laboratory.words(&plus, bits!(hash_of_bits))?);
    let of_whole =
        share_wrong(&laboratory.words(&minus, bits!(hash_of_whole))?, &laboratory.words(&plus, bits!(hash_of_whole))?);
    Ok(Check {
        what: "hashes of cells (0, y) and (x, 0) with 0 and -0".to_owned(),
        error_of: "share of cells with two hashes".to_owned(),
        inputs: count as u64,
        naive: Form::new("of the bits of floor(x)", of_bits),
        stable: Form::new("of floor(x) as integers", of_whole),
        tolerance: 0.0,
    })
}

/// Frames about normals on the equator, whose z is 0 of either sign.
fn framed(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(37);
    let operands: Vec<Operands> = (0..laboratory.inputs(10_000, 1_000_000))
        .map(|index| {
            let (y, x) = random.between(0.0, TAU).sin_cos();
            let zero = if index % 2 == 0 { 0.0 } else { -0.0 };
            Operands { a: [x as f32, y as f32, zero, 0.0], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    let truth = vec![0.0; operands.len()];
    let by_sign = laboratory.floats(&operands, arithmetic!(frame_by_sign))?;
    let by_comparison = laboratory.floats(&operands, arithmetic!(frame_by_comparison))?;
    Ok(Check {
        what: "frames about normals with z = 0 and -0".to_owned(),
        error_of: "|M^T M - 1|, columns, against 0".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("side = sign(z)", worst_difference(&by_sign, &truth)),
        stable: Form::new("side = z < 0 ? -1 : 1", worst_difference(&by_comparison, &truth)),
        // Rounded normals are unit vectors within 1.2e-7, and the check itself rounds.
        tolerance: 5e-7,
    })
}
