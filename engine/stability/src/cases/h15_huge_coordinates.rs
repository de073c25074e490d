//! H15. Huge, negative and tiled texture coordinates.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, bits};
use mica_shaders::types::{Operands, Words};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut checks = vec![places(laboratory)?];
    checks.extend(cells(laboratory)?);
    Ok(checks)
}

/// Places in triangles up to 2^20 squares from the origin.
fn places(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(15);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let sign = if random.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
            let far = sign * random.log_between(1.0, 1_048_576.0).round();
            // Eighths of a square: exact that far from the origin.
            let mut corner = || (far + random.between(-8.0, 8.0).round() / 8.0) as f32;
            let a = [corner(), corner(), corner(), 0.0];
            let second = random.between(0.0, 1.0);
            let third = random.between(0.0, 1.0 - second);
            Operands { a, b: [second as f32, third as f32, 0.0, 0.0], c: [0.0; 4] }
        })
        .collect();
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [first, second, third, _] = of.a.map(f64::from);
            let [of_second, of_third, ..] = of.b.map(f64::from);
            (first.fract() + of_second * (second - first) + of_third * (third - first)).rem_euclid(1.0)
        })
        .collect();
    // Just below 1 and just above 0 are neighbours.
    let worst = |places: Vec<f32>| {
        let apart = places.iter().zip(&truth).map(|(place, truth)| {
            let apart = (f64::from(*place) - truth).abs();
            apart.min(1.0 - apart).abs()
        });
        apart.fold(0.0, |worst: f64, apart| if apart.is_nan() { f64::INFINITY } else { worst.max(apart) })
    };
    let naive = laboratory.floats(&operands, arithmetic!(place_interpolated))?;
    let stable = laboratory.floats(&operands, arithmetic!(place_in_square))?;
    Ok(Check {
        what: "places in the squares of texture of triangles up to 2^20 squares from the origin".to_owned(),
        error_of: "distance from the place in f64, in squares".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("fract of what is interpolated", worst(naive)),
        stable: Form::new("whole squares taken off the corners first", worst(stable)),
        // Three roundings of numbers up to 4.
        tolerance: 1.5e-6,
    })
}

/// Cells, and where in them, of coordinates of any size and sign.
fn cells(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(1515);
    let count = laboratory.inputs(200_000, 20_000_000);
    let mut places: Vec<f32> = vec![0.0, -0.0, -1e-9, 1e-9, -1e-38, 0.999_999_94, -1.0, 1.0, 8_388_607.5, -8_388_607.5];
    places.extend((0..count).map(|_| {
        let sign = if random.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
        (sign * random.log_between(1e-10, 1_073_741_824.0)) as f32
    }));
    let questions: Vec<Words> =
        places.iter().map(|x| Words { a: [x.to_bits(), x.to_bits(), 0, 0], b: [0; 4] }).collect();
    let truncated = laboratory.words(&questions, bits!(tile_truncated))?;
    let unsigned = laboratory.words(&questions, bits!(tile_unsigned))?;
    let stable = laboratory.words(&questions, bits!(tile_and_fraction))?;
    let wrong = |answers: &[[u32; 4]]| {
        let wrong = |(answer, x): &(&[u32; 4], &f32)| answer[0] != f64::from(**x).floor() as i32 as u32;
        answers.iter().zip(&places).filter(wrong).count() as f64 / places.len() as f64
    };
    // How far a fraction is from the truth, unless it is 1 or more: then it is in another cell.
    let beside = |answers: &[[u32; 4]]| {
        let fractions = answers.iter().zip(&places).map(|(answer, x)| {
            let fraction = f64::from(f32::from_bits(answer[2]));
            let truth = f64::from(*x) - f64::from(*x).floor();
            if fraction < 1.0 { (fraction - truth).abs() } else { f64::INFINITY }
        });
        fractions.fold(0.0, f64::max)
    };
    let check = |what: &str, error_of: &str, naive: Form, stable: Form, tolerance: f64| Check {
        what: what.to_owned(),
        error_of: error_of.to_owned(),
        inputs: places.len() as u64,
        naive,
        stable,
        tolerance,
    };
    Ok(vec![
        check(
            "cells of coordinates of both signs up to 2^30",
            "share of wrong cells",
            Form::new("int(x): the cell about 0 is two wide", wrong(&truncated)),
            Form::new("int(floor(x)), clamped", wrong(&stable)),
            0.0,
        ),
        check(
            "words of those cells",
            "share of wrong words",
            Form::new("uint(floor(x)): undefined below 0", wrong(&unsigned)),
            Form::new("uint(int(floor(x))), clamped", wrong(&stable)),
            0.0,
        ),
        check(
            "places in those cells",
            "distance from the place in f64; infinite in another cell",
            Form::new("fract(x), which is 1 just below 0", beside(&truncated)),
            Form::new("min(x - floor(x), 1 - 2^-24)", beside(&stable)),
            // Half a place of a float below 1, and as much again where that would be 1.
            1.2e-7,
        ),
    ])
}
