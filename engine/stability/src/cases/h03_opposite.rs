//! H03. Light and view nearly opposite: the half vector.

use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_difference, worst_ratio};
use glam::DVec3;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Class T1: 16 units in the last place.
const T1: f64 = 16.0 * f32::EPSILON as f64;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let count = laboratory.inputs(50_000, 5_000_000);
    Ok(vec![half_cosine(laboratory, count)?, half_vector(laboratory, count)?])
}

/// Directions whose half-angle is so far from a right angle, in radians, and others.
fn pairs(count: usize, least: f64) -> Vec<Operands> {
    let mut random = Random::new(3);
    (0..count)
        .map(|_| {
            let i = random.direction_about(DVec3::Z, PI);
            let o = turned(-i, 2.0 * random.log_between(least, 1.0), random.between(0.0, TAU));
            let along = random.direction_about(DVec3::Z, PI);
            Operands { a: rounded(i, 0.0), b: rounded(o, 0.0), c: rounded(along, 0.0) }
        })
        .collect()
}

/// i.h. What f32 leaves the vectors short of unit length is worth 1e-7 of it at a half-angle of pi/2 - 1e-4, and grows from
/// there: nearer no form has it.
fn half_cosine(laboratory: &mut Laboratory, count: usize) -> Result<Check, StabilityError> {
    let operands = pairs(count, 1e-4);
    let truth: Vec<f64> = operands.iter().map(|of| 0.5 * (unit(of.a) + unit(of.b)).length()).collect();
    let naive = laboratory.floats(&operands, arithmetic!(half_cosine_normalized))?;
    let stable = laboratory.floats(&operands, arithmetic!(half_cosine_length))?;
    Ok(Check {
        what: "i.h, half-angles of up to pi/2 - 1e-4".to_owned(),
        error_of: "|value / value in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("i . normalize(i + o)", worst_ratio(&naive, &truth)),
        stable: Form::new("|i + o| / 2", worst_ratio(&stable, &truth)),
        tolerance: T1,
    })
}

/// h itself, by its component along any direction, and 0 where there is none: of the vectors as the device has them, as
/// their sum loses nothing.
fn half_vector(laboratory: &mut Laboratory, count: usize) -> Result<Check, StabilityError> {
    let mut operands = pairs(count, 1e-5);
    for (index, of) in operands.iter_mut().enumerate() {
        if index.is_multiple_of(16) {
            let opposite = of.a.map(|component| -component);
            // A sum of 1e-23, whose square is no number, or of nothing.
            of.b = if index.is_multiple_of(32) { opposite } else { [opposite[0], opposite[1], 1e-23, 0.0] };
            of.a[2] = if index.is_multiple_of(32) { of.a[2] } else { 0.0 };
        }
    }
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [i, o, along] = [of.a, of.b, of.c].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
            let sum = i + o;
            if sum.length() > 1e-6 { sum.normalize().dot(along) } else { 0.0 }
        })
        .collect();
    let naive = laboratory.floats(&operands, arithmetic!(half_vector_normalized))?;
    let stable = laboratory.floats(&operands, arithmetic!(half_vector_guarded))?;
    Ok(Check {
        what: "h, half-angles of up to pi/2 - 1e-5, and opposite directions".to_owned(),
        error_of: "|component - component in f64|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("normalize(i + o)", worst_difference(&naive, &truth)),
        stable: Form::new("i + o over its length, 0 below a length of 1e-6", worst_difference(&stable, &truth)),
        tolerance: T1,
    })
}
