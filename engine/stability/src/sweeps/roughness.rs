//! Roughness from .001 to 1, and footprints to a million times as long as wide.

use super::{Sweep, errors, greatest, log, log_spaced};
use crate::random::{Random, turned};
use crate::{Laboratory, StabilityError, arithmetic};
use glam::{DMat2, DVec2, DVec3};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Inputs for each point of a line, which is the worst of them.
const QUESTIONS: usize = 100;

/// D of Beckmann where flakes are.
///
/// # Errors
/// Those of the device.
pub fn alpha(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    let alphas = log_spaced(1e-3, 1.0, laboratory.inputs(120, 600));
    let mut random = Random::new(9);
    let (mut operands, mut truth) = (Vec::new(), Vec::new());
    for alpha in alphas.iter().map(|alpha| *alpha as f32) {
        let facets = Microfacets::new(Ndf::Beckmann, f64::from(alpha), SmithFit::Exact)?;
        for _ in 0..QUESTIONS {
            let normal = random.direction_about(DVec3::Z, PI).as_vec3();
            let slope = f64::from(alpha) * (-(1.0 - random.between(0.0, 1.0)).ln()).sqrt();
            let half = turned(normal.as_dvec3().normalize(), slope.atan(), random.between(0.0, TAU)).as_vec3();
            operands.push(Operands { a: half.extend(alpha).to_array(), b: normal.extend(0.0).to_array(), c: [0.0; 4] });
            // Of the directions as the device has them.
            let (half, normal) = (half.as_dvec3().normalize(), normal.as_dvec3().normalize());
            let sine = half.cross(normal).length();
            truth.push(facets.d(DVec3::new(sine, 0.0, half.dot(normal))));
        }
    }
    let naive = laboratory.floats(&operands, arithmetic!(beckmann_cosine))?;
    let stable = laboratory.floats(&operands, arithmetic!(beckmann_chord))?;
    let [naive, stable] = [naive, stable].map(|values| worst_of_each(&values, &truth));
    let over = |errors: &[f64]| alphas.iter().copied().zip(errors.iter().copied()).collect::<Vec<_>>();
    Ok(Sweep {
        name: "alpha".to_owned(),
        title: "Roughness from .001 to 1".to_owned(),
        x: log("alpha"),
        y: log("relative error of Beckmann's D, the worst of 100 flakes"),
        series: vec![errors("sine from the chord", over(&stable)), errors("sine from the cosine", over(&naive))],
        claim: "Beckmann's D keeps four digits from alpha .001 to 1.".to_owned(),
        worst: greatest(stable),
        // exp(x) is promised within 3 + 2 |x| ulp, and directions are unit within 1e-7: to |x| = 20 that is 5e-6.
        tolerance: 2e-5,
    })
}

/// The shorter axis of footprints.
///
/// # Errors
/// Those of the device.
pub fn anisotropy(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    let aspects = log_spaced(1.0, 1e6, laboratory.inputs(120, 600));
    let mut random = Random::new(10);
    let (mut operands, mut truth) = (Vec::new(), Vec::new());
    for aspect in &aspects {
        for _ in 0..QUESTIONS {
            let [left, right] = [(); 2].map(|()| DMat2::from_angle(random.between(0.0, TAU)));
            let sides = left * DMat2::from_diagonal(DVec2::new(1.0, 1.0 / aspect)) * right;
            let a = sides.to_cols_array().map(|side| side as f32);
            operands.push(Operands { a, b: [0.0; 4], c: [0.0; 4] });
            // Of the sides as the device has them: the area over the longer axis.
            let [x, y] = [DVec2::new(a[0].into(), a[1].into()), DVec2::new(a[2].into(), a[3].into())];
            let both = DVec2::new(x.x + y.y, x.y - y.x).length() + DVec2::new(x.x - y.y, x.y + y.x).length();
            truth.push(x.perp_dot(y).abs() / (0.5 * both));
        }
    }
    let naive = laboratory.floats(&operands, arithmetic!(minor_axis_roots))?;
    let stable = laboratory.floats(&operands, arithmetic!(minor_axis_quotient))?;
    let [naive, stable] = [naive, stable].map(|values| worst_of_each(&values, &truth));
    let over = |errors: &[f64]| aspects.iter().copied().zip(errors.iter().copied()).collect::<Vec<_>>();
    Ok(Sweep {
        name: "anisotropy".to_owned(),
        title: "Footprints to a million times as long as wide".to_owned(),
        x: log("longer axis / shorter axis"),
        y: log("relative error of the shorter axis, the worst of 100 footprints"),
        series: vec![
            errors("exact area over the longer axis", over(&stable)),
            errors("root of the quadratic", over(&naive)),
        ],
        claim: "The shorter axis of a footprint keeps six digits to 1e6 : 1.".to_owned(),
        worst: greatest(stable),
        tolerance: 1e-6,
    })
}

/// The worst error of each [`QUESTIONS`] values.
fn worst_of_each(values: &[f32], truth: &[f64]) -> Vec<f64> {
    let off: Vec<f64> =
        values.iter().zip(truth).map(|(value, truth)| (f64::from(*value) / truth - 1.0).abs()).collect();
    off.chunks(QUESTIONS).map(|of_point| greatest(of_point.iter().copied())).collect()
}
