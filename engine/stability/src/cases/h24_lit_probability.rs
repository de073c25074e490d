//! H24. P near the edge of the cone.

use crate::random::turned;
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_oracle::lit_probability::lit_probability;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![wide(laboratory)?, wider(laboratory)?, narrow(laboratory)?, open(laboratory)?])
}

/// Lights about where a flake drawn from the lobe mirrors the view, up to twice as far from there as the cone reaches; light
/// and view are at most so far from the normal.
fn questions(random: &mut Random, [alpha, gamma_deg, grazing_deg]: [f64; 3], count: usize) -> Vec<Operands> {
    let gamma = gamma_deg.to_radians();
    let grazing = grazing_deg.to_radians();
    let mut questions = Vec::with_capacity(count);
    while questions.len() < count {
        let o = random.direction_about(DVec3::Z, grazing);
        let (radius, turn) = (alpha * (-(1.0 - random.between(0.0, 1.0)).ln()).sqrt(), random.between(0.0, TAU));
        let m = DVec3::new(radius * turn.cos(), radius * turn.sin(), 1.0).normalize();
        let mirrored = 2.0 * o.dot(m) * m - o;
        let i = turned(mirrored, 2.0 * gamma * random.between(0.0, 1.0).sqrt(), random.between(0.0, TAU));
        if o.dot(m) > 0.0 && i.z > grazing.cos() {
            let four = |v: DVec3, fourth: f64| [v.x as f32, v.y as f32, v.z as f32, fourth as f32];
            questions.push(Operands { a: four(i, alpha), b: four(o, (0.5 * gamma).sin().powi(2)), c: [0.0; 4] });
        }
    }
    questions
}

/// P of the operands as the device has them, directions made unit vectors.
fn truth(operands: &[Operands]) -> Result<Vec<f64>, StabilityError> {
    let of = |of: &Operands| {
        let unit = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into()).normalize();
        let facets = Microfacets::new(Ndf::Beckmann, of.a[3].into(), SmithFit::Exact)?;
        let gamma = 2.0 * f64::from(of.b[3]).sqrt().asin();
        Ok(lit_probability(&facets, unit(of.a), unit(of.b), gamma))
    };
    operands.par_iter().map(of).collect()
}

/// Cones about as wide as the lobe.
fn wide(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(24);
    let each = laboratory.inputs(2000, 100_000);
    // To 60 degrees from the normal: an ellipse grows with the tangent.
    let lobes = [[0.02, 0.3], [0.02, 1.0], [0.02, 1.7], [0.1, 1.0], [0.1, 6.0], [0.5, 6.0], [0.5, 30.0], [1.0, 30.0]];
    let operands: Vec<Operands> =
        lobes.iter().flat_map(|[alpha, gamma_deg]| questions(&mut random, [*alpha, *gamma_deg, 60.0], each)).collect();
    let truth = truth(&operands)?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_small_cone))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_ellipse_centred))?;
    Ok(Check {
        what: "P(i, o, gamma) for cones .25 to 1.5 times as wide as the lobe".to_owned(),
        error_of: "|P / P in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("the density at the cone's axis for all of it", worst_ratio(&naive, &truth)),
        stable: Form::new("16 nodes over the exact ellipse of slopes", worst_ratio(&stable, &truth)),
        tolerance: 1e-4,
    })
}

/// Cones three and five times as wide as the lobe, to 80 degrees: ellipses that are far longer than the lobe, or begin far out in it.
fn wider(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(242);
    let each = laboratory.inputs(2000, 100_000);
    let lobes = [[0.02, 3.4], [0.02, 5.7], [0.05, 8.6], [0.05, 14.3], [0.1, 17.2], [0.1, 28.6]];
    let operands: Vec<Operands> =
        lobes.iter().flat_map(|[alpha, gamma_deg]| questions(&mut random, [*alpha, *gamma_deg, 80.0], each)).collect();
    let truth = truth(&operands)?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_ellipse_reach))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_ellipse_centred))?;
    Ok(Check {
        what: "P(i, o, gamma) for cones three and five times as wide as the lobe".to_owned(),
        error_of: "95th percentile of |P / P in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("16 nodes within 5 alpha of the normal", percentile_95(&naive, &truth)),
        stable: Form::new("16 nodes within 3.9 alpha beyond where the set begins", percentile_95(&stable, &truth)),
        // What 16 nodes resolve of a lobe that is a fifth of the set.
        tolerance: 1e-3,
    })
}

/// Cones much narrower than the lobe.
fn narrow(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(2424);
    let each = laboratory.inputs(2000, 100_000);
    let lobes = [[0.02, 0.02], [0.02, 0.1], [0.1, 0.01], [0.1, 0.2], [0.5, 0.01], [0.5, 0.5], [1.0, 0.2]];
    let operands: Vec<Operands> =
        lobes.iter().flat_map(|[alpha, gamma_deg]| questions(&mut random, [*alpha, *gamma_deg, 80.0], each)).collect();
    let truth = truth(&operands)?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_ellipse_assembled))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_ellipse_centred))?;
    Ok(Check {
        what: "P(i, o, gamma) for cones of .01 to .5 degrees".to_owned(),
        error_of: "|P / P in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("the ellipse from i.o + cos gamma, seen from the origin", worst_ratio(&naive, &truth)),
        stable: Form::new(
            "the ellipse from |i + o|^2 and sin^2(gamma/2), seen from the slope of h",
            worst_ratio(&stable, &truth),
        ),
        tolerance: 1e-4,
    })
}

/// Light and view near the horizon, where the ellipse of slopes is none.
fn open(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(242_424);
    let tried = laboratory.inputs(20_000, 400_000);
    let lobes = [[0.5, 30.0], [1.0, 30.0], [1.0, 15.0]];
    let all = lobes.iter().flat_map(|[alpha, gamma_deg]| questions(&mut random, [*alpha, *gamma_deg, 85.0], tried));
    // The determinant of Jakob et al. 2014, Eq. 13, on slopes; 1.01 leaves out what f32 might take for closed.
    let opens = |of: &Operands| {
        let [i, o] = [of.a, of.b].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()).normalize());
        let k = 0.5 * (i + o).length_squared() - 2.0 * f64::from(of.b[3]);
        let (xx, yy, xy) = (k - 2.0 * i.x * o.x, k - 2.0 * i.y * o.y, i.x * o.y + i.y * o.x);
        xx * yy * 1.01 <= xy * xy
    };
    let operands: Vec<Operands> = all.filter(opens).collect();
    let truth = truth(&operands)?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_cap_cubature))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_ellipse_centred))?;
    Ok(Check {
        what: "P(i, o, gamma) where light and view are within the cone of the horizon".to_owned(),
        error_of: "95th percentile of |P / P in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("seven densities over the cone", percentile_95(&naive, &truth)),
        stable: Form::new("16 nodes over the set, cut to what faces both", percentile_95(&stable, &truth)),
        // The cuts are corners, of which 16 nodes see as much.
        tolerance: 0.02,
    })
}

/// Of |value / truth - 1|; infinite if there is none.
fn percentile_95(values: &[f32], truth: &[f64]) -> f64 {
    let mut errors: Vec<f64> =
        values.iter().zip(truth).map(|(value, truth)| (f64::from(*value) / truth - 1.0).abs()).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors.get(errors.len() * 95 / 100).copied().unwrap_or(f64::INFINITY)
}
