//! H42. Area lights: interpolation on the sphere, black subdivisions.

use crate::random::{rounded, turned};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_difference};
use glam::DVec3;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![arcs(laboratory)?, chances(laboratory)?])
}

/// Points of arcs from nothing to 2.5 radians, as lights are seen that are small, distant or near.
fn arcs(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(42);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|index| {
            let a = random.direction_about(DVec3::Z, PI);
            let angle = if index.is_multiple_of(8) { 0.0 } else { random.log_between(1e-8, 2.5) };
            let b = turned(a, angle, random.between(0.0, TAU));
            // The error is told along any direction, length and place alike.
            let along = random.direction_about(DVec3::Z, PI);
            Operands { a: rounded(a, random.between(0.0, 1.0)), b: rounded(b, 0.0), c: rounded(along, 0.0) }
        })
        .collect();
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [a, b, along] = [of.a, of.b, of.c].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
            let (sine, t) = (a.cross(b).length(), f64::from(of.a[3]));
            let angle = sine.atan2(a.dot(b));
            // What is shorter than f32's own rounding has no arc.
            let weights = if angle > 1e-7 {
                [((1.0 - t) * angle).sin() / angle.sin(), (t * angle).sin() / angle.sin()]
            } else {
                [1.0 - t, t]
            };
            (weights[0] * a + weights[1] * b).dot(along)
        })
        .collect();
    let naive = laboratory.floats(&operands, arithmetic!(slerp_sines))?;
    let stable = laboratory.floats(&operands, arithmetic!(slerp_guarded))?;
    Ok(Check {
        what: "points of arcs of 0 to 2.5 radians".to_owned(),
        error_of: "|point - point in f64| along any direction".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("(sin((1 - t) w) a + sin(t w) b) / sin w, w = acos(a.b)", worst_difference(&naive, &truth)),
        stable: Form::new(
            "sines of chords by series, the chord below a sine of 1e-3",
            worst_difference(&stable, &truth),
        ),
        tolerance: 16.0 * f64::from(f32::EPSILON),
    })
}

/// Which half of a light to look into, down to halves that are black.
fn chances(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(43);
    let mut held = |index: usize| match index % 4 {
        0 => 0.0,
        _ => random.log_between(1e-29, 1e30) as f32,
    };
    let operands: Vec<Operands> = (0..laboratory.inputs(50_000, 5_000_000))
        .map(|index| Operands { a: [held(index), held(index / 4), 0.0, 0.0], ..Operands::default() })
        .collect();
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let both = f64::from(of.a[0]) + f64::from(of.a[1]);
            if both > 0.0 { f64::from(of.a[0]) / both } else { 0.5 }
        })
        .collect();
    let naive = laboratory.floats(&operands, arithmetic!(chance_quotient))?;
    let stable = laboratory.floats(&operands, arithmetic!(chance_guarded))?;
    Ok(Check {
        what: "the chance of one of two parts that hold 0 or 1e-29 to 1e30".to_owned(),
        error_of: "|chance - chance in f64|, an even chance where both hold nothing".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("first / (first + second)", worst_difference(&naive, &truth)),
        stable: Form::new("the same, 1/2 where the sum is nothing", worst_difference(&stable, &truth)),
        tolerance: 4.0 * f64::from(f32::EPSILON),
    })
}
