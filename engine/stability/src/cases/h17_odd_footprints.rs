//! H17. Footprints without area, below a flake, larger than the texture, without end.

use crate::stage::{ALPHA, GAMMA_DEG, SIDE, Stage};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic};
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use std::f64::consts::TAU;

/// Flakes that a footprint holds on average, where a texture of 1e12 at most makes that possible. Some 3 in 1,000 are lit.
const FLAKES: f64 = 400.0;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    // Squares of texture in a footprint; 0 where all corners have the same coordinates.
    let areas: &[f64] = if laboratory.inputs(0, 1) == 0 {
        &[0.0, 1e-36, 1e-11, 1e-6, 1.0, 1e6, 1e20]
    } else {
        &[0.0, 1e-36, 1e-33, 1e-11, 1e-10, 1e-9, 1e-6, 1e-4, 1.0, 1e3, 1e6, 1e12, 1e20, 1e30]
    };
    let mut random = Random::new(17);
    let upright = Stage { tilt_deg: 0.0, ..Stage::default() };
    let [i, o] = upright.directions();
    let facets = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational)?;
    let truth = ConeMeans::new(&facets, i, o, GAMMA_DEG.to_radians());
    let (mut naive, mut stable) = (0.0f64, 0.0f64);
    for &area in areas {
        // Pixels that see the same flakes again are no samples of their own, but there what is expected is shown.
        let count = if area < 1e-3 { (FLAKES / area).min(1e12) } else { 1e6 };
        let unscaled = upright.footprints()[0].determinant().abs();
        let stage = Stage { uv_per_metre: (area / unscaled).sqrt(), flakes: ("flakes", count), ..upright };
        let glinting = stage.seen(laboratory, stage.scene())?;
        let ratios: Vec<f64> =
            glinting.radiance.iter().map(|radiance| f64::from(*radiance) / (truth.discrete * i.z)).collect();
        stable = stable.max(beyond_chance(&ratios));
        let operands: Vec<Operands> = glinting
            .footprint
            .iter()
            .map(|sides| {
                let [uniform, of_radius, turn] = [(); 3].map(|()| random.between(0.0, 1.0));
                let normal = (-2.0 * (1.0 - of_radius).ln()).sqrt() * (TAU * turn).cos();
                Operands {
                    a: *sides,
                    b: [count as f32, truth.lit_probability as f32, 0.0, 0.0],
                    c: [uniform as f32, normal as f32, 0.0, 0.0],
                }
            })
            .collect();
        let ratios = laboratory.floats(&operands, arithmetic!(lit_over_expected))?;
        naive = naive.max(beyond_chance(&ratios.into_iter().map(f64::from).collect::<Vec<_>>()));
    }
    Ok(vec![Check {
        what: "footprints of 0 to 1e20 squares of texture, of 1e-11 and more with 10 flakes or more".to_owned(),
        error_of: "|mean radiance / mean of the BRDF over the cone in f64 - 1| / (3 standard errors + 0.001)"
            .to_owned(),
        inputs: areas.len() as u64 * u64::from(SIDE * SIDE),
        naive: Form::new("lit flakes by a gate over the number expected, as published", naive),
        stable: Form::new("the same, or what is expected where areas mean nothing", stable),
        // The row's 3 standard errors; and 0.001 for what the picture's half degree makes of the lobe.
        tolerance: 1.0,
    }])
}

/// How far the mean of numbers that should be 1 on average is from that, beside what it may be by chance.
fn beyond_chance(ratios: &[f64]) -> f64 {
    let count = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / count;
    let variance = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let beyond = (mean - 1.0).abs() / (3.0 * (variance / count).sqrt() + 1e-3);
    if beyond.is_nan() { f64::INFINITY } else { beyond }
}
