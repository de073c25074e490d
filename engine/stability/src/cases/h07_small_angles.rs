//! H07. Small angles between directions.

use crate::random::{rounded, turned};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Class T1. Rounding to f32 leaves vectors up to 1e-7 short of unit length, which adds the square of that to the square of the
/// chord: 5e-7 of an angle of 1e-4, 5e-5 of 1e-5. There no chord tells, nor does any other form that trusts the lengths.
const TOLERANCE: f64 = 16.0 * f32::EPSILON as f64;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(7);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|index| {
            let a = random.direction_about(DVec3::Z, PI);
            let angle = if index.is_multiple_of(4) { random.between(0.0, 3.0) } else { random.log_between(1e-4, 1.0) };
            Operands {
                a: rounded(a, 0.0),
                b: rounded(turned(a, angle, random.between(0.0, TAU)), 0.0),
                ..Operands::default()
            }
        })
        .collect();
    // Of the directions as the device has them, whatever their lengths.
    let (mut angles, mut sines) = (Vec::new(), Vec::new());
    for of in &operands {
        let [a, b] = [of.a, of.b].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
        angles.push(a.cross(b).length().atan2(a.dot(b)));
        sines.push(a.cross(b).length());
    }
    let naive = laboratory.floats(&operands, arithmetic!(angle_acos))?;
    let stable = laboratory.floats(&operands, arithmetic!(angle_chord))?;
    let naive_sine = laboratory.floats(&operands, arithmetic!(sine_cosine))?;
    let stable_sine = laboratory.floats(&operands, arithmetic!(sine_chord))?;
    let check = |what: &str, naive: Form, stable: Form| Check {
        what: what.to_owned(),
        error_of: "|value / value in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive,
        stable,
        tolerance: TOLERANCE,
    };
    Ok(vec![
        check(
            "angles of 1e-4 to 3 radians",
            Form::new("acos(a.b)", worst_ratio(&naive, &angles)),
            Form::new("2 asin(|a - b| / 2), asin by series", worst_ratio(&stable, &angles)),
        ),
        check(
            "sines of angles of 1e-4 to 3 radians",
            Form::new("sqrt(1 - (a.b)^2)", worst_ratio(&naive_sine, &sines)),
            Form::new("|a - b| |a + b| / 2", worst_ratio(&stable_sine, &sines)),
        ),
    ])
}
