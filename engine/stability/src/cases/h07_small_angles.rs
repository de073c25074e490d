//! H07. Small angles between directions.

use crate::random::turned;
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(7);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let a = random.direction_about(DVec3::Z, PI);
            let b = turned(a, random.log_between(1e-5, 1.0), random.between(0.0, TAU));
            let four = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
            Operands { a: four(a), b: four(b), c: [0.0; 4] }
        })
        .collect();
    // Of the directions as the device has them.
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [a, b] = [of.a, of.b].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
            a.cross(b).length().atan2(a.dot(b))
        })
        .collect();
    let naive = laboratory.floats(&operands, arithmetic!(angle_acos))?;
    let stable = laboratory.floats(&operands, arithmetic!(angle_chord))?;
    Ok(vec![Check {
        what: "angles of 1e-5 to 1 radian".to_owned(),
        error_of: "|angle / angle in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("acos(a.b)", worst_ratio(&naive, &truth)),
        stable: Form::new("2 asin(|a - b| / 2)", worst_ratio(&stable, &truth)),
        tolerance: 1.9e-3,
    }])
}
