//! H09. Beckmann's D at small roughness, and underflow.
//!
//! What underflows is 0 in the renderer and nothing divides by it: lobes are sampled where they are. Roughness is .001
//! to 1, and other settings are refused.

use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic};
use glam::DVec3;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![density(laboratory)?, furnace(laboratory)?])
}

/// About any normal, down to where D is 1e-30 of 1 and to nothing.
fn density(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(9);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let alpha = random.log_between(0.001, 1.0);
            let normal = random.direction_about(DVec3::Z, PI);
            // Exponents of up to 100: D underflows from 87 on.
            let slope = alpha * random.log_between(1e-4, 100.0).sqrt();
            let h = turned(normal, slope.atan(), random.between(0.0, TAU));
            Operands { a: rounded(h, alpha), b: rounded(normal, 0.0), ..Operands::default() }
        })
        .collect();
    // The value, by what an error of f32's size in its tangent is magnified, and the value's smallest concern.
    let truth = operands
        .iter()
        .map(|of| {
            let (h, n, alpha) = (unit(of.a), unit(of.b), f64::from(of.a[3]));
            let (sine, cosine) = (h.cross(n).length(), h.dot(n));
            let value = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact)?.d(DVec3::new(sine, 0.0, cosine));
            let tangent = sine / cosine;
            // D is exp(-tan^2 / alpha^2) / cos^4, its cosine off by 1e-7.
            Ok((value, 1.0 + (tangent / alpha).powi(2) / cosine + 1.0 / cosine))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let worst = |values: &[f32]| {
        values.iter().zip(&truth).fold(0.0_f64, |worst, (value, (truth, steepness))| {
            let error = if *truth > 1e-30 {
                (f64::from(*value) / truth - 1.0).abs() / steepness
            } else {
                (f64::from(*value) - truth).abs()
            };
            if error.is_nan() { f64::INFINITY } else { worst.max(error) }
        })
    };
    let cosine = laboratory.floats(&operands, arithmetic!(beckmann_cosine))?;
    let cross = laboratory.floats(&operands, arithmetic!(beckmann_cross))?;
    let stable = laboratory.floats(&operands, arithmetic!(beckmann_chord))?;
    Ok(Check {
        what: "D, alpha .001 to 1, exponents to 100".to_owned(),
        error_of: "|D / D in f64 - 1| / (1 + (exponent + 1) / cos), absolute below 1e-30".to_owned(),
        inputs: operands.len() as u64,
        // The better of the two naive forms.
        naive: Form::new("sine from 1 - cos^2, or from |h x n|", worst(&cosine).min(worst(&cross))),
        stable: Form::new("sine from |h - n|", worst(&stable)),
        tolerance: 16.0 * f64::from(f32::EPSILON),
    })
}

/// The integral of D(m) (m.n) over the hemisphere, of the device's D, about a normal that lies askew.
fn furnace(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const TURNS: usize = 16;
    let normal = DVec3::new(0.36, 0.48, 0.8);
    let rings = laboratory.inputs(1_000, 100_000);
    let (mut naive, mut stable, mut inputs) = (0.0_f64, 0.0_f64, 0);
    for alpha in [0.001, 0.01, 0.1, 1.0] {
        // Rings of equal steps of t = asinh(tan / alpha), to where the lobe is over; points on each.
        let end = 5.5_f64.asinh();
        let (mut operands, mut weights) = (Vec::new(), Vec::new());
        for ring in 0..rings {
            let t = end * (ring as f64 + 0.5) / rings as f64;
            let tangent = alpha * t.sinh();
            let cosine = 1.0 / tangent.hypot(1.0);
            for turn in 0..TURNS {
                let turn = TAU * (turn as f64 + 0.5 * (ring % 2) as f64) / TURNS as f64;
                let m = turned(normal, tangent.atan(), turn);
                operands.push(Operands { a: rounded(m, alpha), b: rounded(normal, 0.0), ..Operands::default() });
                // dm = tan cos^3 d(tan) d(turn), times m.n.
                weights.push(tangent * cosine.powi(4) * alpha * t.cosh() * end / rings as f64 * TAU / TURNS as f64);
            }
        }
        let off = |values: &[f32]| {
            let integral: f64 = values.iter().zip(&weights).map(|(value, weight)| f64::from(*value) * weight).sum();
            if integral.is_nan() { f64::INFINITY } else { (integral - 1.0).abs() }
        };
        naive = naive.max(off(&laboratory.floats(&operands, arithmetic!(beckmann_cosine))?));
        stable = stable.max(off(&laboratory.floats(&operands, arithmetic!(beckmann_chord))?));
        inputs += operands.len() as u64;
    }
    Ok(Check {
        what: "the integral of D(m) (m.n), alpha .001, .01, .1, 1".to_owned(),
        error_of: "|integral - 1|".to_owned(),
        inputs,
        naive: Form::new("sine from 1 - cos^2", naive),
        stable: Form::new("sine from |h - n|", stable),
        tolerance: 1e-4,
    })
}
