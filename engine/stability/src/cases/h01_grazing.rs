//! H01. Grazing light and view: G1 / cos at the horizon.
//!
//! M = F G D / (4 (i.n) (o.n)) is 0 / 0 at the horizon, where it has a finite limit; cosines kept from 0 make it wrong by
//! orders instead. Both cosines cancel against those in G1 = cos (3.535 k + ...), k = 1 / (alpha sin).

use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use std::f64::consts::PI;

const ALPHAS: [f64; 3] = [0.001, 0.1, 1.0];
/// Class T1: 16 units in the last place.
const T1: f64 = 16.0 * f32::EPSILON as f64;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![masking(laboratory)?, beyond(laboratory)?, brdf(laboratory)?, reciprocity(laboratory)?])
}

fn facets(alpha: f32) -> Result<Microfacets, StabilityError> {
    Ok(Microfacets::new(Ndf::Beckmann, alpha.into(), SmithFit::Rational)?)
}

/// G1 / cos where numbers are normal.
fn masking(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(1);
    let each = laboratory.inputs(30_000, 3_000_000);
    let operands: Vec<Operands> = ALPHAS
        .into_iter()
        .flat_map(|alpha| vec![alpha; each])
        .map(|alpha| Operands {
            a: [random.log_between(1.2e-38, 1.0) as f32, alpha as f32, 0.0, 0.0],
            ..Operands::default()
        })
        .collect();
    let truth = operands
        .iter()
        .map(|of| {
            let cosine = f64::from(of.a[0]);
            let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
            Ok(facets(of.a[1])?.g1_over_cos(DVec3::new(sine, 0.0, cosine)))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let naive = laboratory.floats(&operands, arithmetic!(masking_tangent))?;
    let stable = laboratory.floats(&operands, arithmetic!(masking_cancelled))?;
    Ok(Check {
        what: "G1 / cos, cosines of 1.2e-38 to 1, alpha .001, .1, 1".to_owned(),
        error_of: "|value / value in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("G1(1 / (alpha tan(acos(cos)))) / cos", worst_ratio(&naive, &truth)),
        stable: Form::new("the cosine cancelled by hand", worst_ratio(&stable, &truth)),
        tolerance: T1,
    })
}

/// The same where there is no normal number, or no light: a device may take a denormal for 0, hence only sense is asked for.
fn beyond(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let cosines = [1e-39_f32, 1e-42, 1e-45, 0.0, -0.0, -1e-45, -1e-30, -1e-3, -1.0];
    let operands: Vec<Operands> = ALPHAS
        .into_iter()
        .flat_map(|alpha| cosines.map(|cosine| Operands { a: [cosine, alpha as f32, 0.0, 0.0], ..Operands::default() }))
        .collect();
    let out_of_range = |values: &[f32]| {
        let wrong = operands.iter().zip(values).filter(|(of, value)| {
            let most = if of.a[0] > 0.0 { 3.5351 / of.a[1] } else { 0.0 };
            !(0.0..=most).contains(*value)
        });
        wrong.count() as f64 / operands.len() as f64
    };
    let naive = laboratory.floats(&operands, arithmetic!(masking_tangent))?;
    let stable = laboratory.floats(&operands, arithmetic!(masking_cancelled))?;
    Ok(Check {
        what: "G1 / cos, cosines that are denormal, 0, -0 or negative".to_owned(),
        error_of: "share not from 0 to 3.535 / alpha, or not 0 below the horizon".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("G1(1 / (alpha tan(acos(cos)))) / cos", out_of_range(&naive)),
        stable: Form::new("the cosine cancelled by hand", out_of_range(&stable)),
        tolerance: 0.0,
    })
}

/// Light and view of which the first grazes, about +Z, and alpha.
fn pairs(count: usize) -> Vec<Operands> {
    let mut random = Random::new(2);
    (0..count)
        .map(|_| {
            let alpha = random.log_between(0.1, 1.0);
            let cosine = if random.between(0.0, 1.0) < 0.02 { 0.0 } else { random.log_between(1e-37, 0.01) };
            let i = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let o = turned(DVec3::Z, random.between(0.1, 1.5), random.between(0.0, PI));
            Operands { a: rounded(i, alpha), b: rounded(o, alpha), ..Operands::default() }
        })
        .collect()
}

/// M / F of the renderer's lobes at f32's own directions.
fn brdf(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let operands = pairs(laboratory.inputs(50_000, 5_000_000));
    // D is as steep as its exponent is large.
    let truth = operands
        .iter()
        .map(|of| {
            let (i, o) = (unit(of.a), unit(of.b));
            let h = (i + o).normalize();
            let exponent = (h.x * h.x + h.y * h.y) / (h.z * h.z * f64::from(of.a[3]).powi(2));
            // The horizon is dark by definition.
            let value = if i.z > 0.0 { facets(of.a[3])?.brdf(i, o) } else { 0.0 };
            Ok((value, 1.0 + exponent))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let worst = |values: &[f32]| {
        values.iter().zip(&truth).fold(0.0_f64, |worst, (value, (truth, steepness))| {
            let error = if *truth > 1e-30 {
                (f64::from(*value) / truth - 1.0).abs() / steepness
            } else {
                f64::from(*value).abs()
            };
            if error.is_nan() { f64::INFINITY } else { worst.max(error) }
        })
    };
    let naive = laboratory.floats(&operands, arithmetic!(brdf_printed))?;
    let stable = laboratory.floats(&operands, arithmetic!(brdf_cancelled))?;
    Ok(Check {
        what: "the BRDF, one cosine of 1e-37 to .01 or 0, alpha .1 to 1".to_owned(),
        error_of: "|value / value in f64 - 1| / (1 + exponent of D); absolute below 1e-30".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("D G / (4 max(i.n, 1e-4) max(o.n, 1e-4))", worst(&naive)),
        stable: Form::new("D (G1 / i.n) (G1 / o.n) / 4", worst(&stable)),
        tolerance: 2.0 * T1, // Of D and the two maskings.
    })
}

/// Light and view change places.
fn reciprocity(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let there = pairs(laboratory.inputs(50_000, 5_000_000));
    let back: Vec<Operands> = there.iter().map(|of| Operands { a: of.b, b: of.a, ..*of }).collect();
    let worst = |there: &[f32], back: &[f32]| {
        let back: Vec<f64> = back.iter().map(|value| f64::from(*value)).collect();
        worst_ratio(there, &back)
    };
    let naive_there = laboratory.floats(&there, arithmetic!(brdf_printed))?;
    let naive_back = laboratory.floats(&back, arithmetic!(brdf_printed))?;
    let stable_there = laboratory.floats(&there, arithmetic!(brdf_cancelled))?;
    let stable_back = laboratory.floats(&back, arithmetic!(brdf_cancelled))?;
    Ok(Check {
        what: "the BRDF with light and view exchanged".to_owned(),
        error_of: "|M(i, o) / M(o, i) - 1|".to_owned(),
        inputs: there.len() as u64,
        naive: Form::new("D G / (4 max(i.n, 1e-4) max(o.n, 1e-4))", worst(&naive_there, &naive_back)),
        stable: Form::new("D (G1 / i.n) (G1 / o.n) / 4", worst(&stable_there, &stable_back)),
        tolerance: T1,
    })
}
