//! H18. UV derivatives.

use crate::stage::{SIDE, Seen, Stage};
use crate::{Check, Form, Laboratory, StabilityError};
use glam::{DMat2, DVec2};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let distances: &[f64] = if laboratory.inputs(0, 1) == 0 {
        &[1e-4, 1e-2, 1.0, 1e3, 1e6]
    } else {
        &[1e-4, 1e-3, 1e-2, 0.1, 1.0, 1e2, 1e4, 1e6]
    };
    let mut stages = Vec::new();
    for &distance in distances {
        for (uv_offset, tilt_deg) in [(0.0, 20.0), (1e4, 60.0)] {
            stages.push(Stage { distance, half: distance.max(1.0), tilt_deg, uv_offset, ..Stage::default() });
        }
    }
    let anywhere = check(laboratory, &stages, "surfaces 1e-4 to 1e6 m away, texture coordinates up to 1e4")?;
    let seam = [Stage { uv_jump: 0.5, tilt_deg: 60.0, ..Stage::default() }];
    let across_a_seam = check(laboratory, &seam, "two charts of an atlas, side by side")?;
    Ok(vec![anywhere, across_a_seam])
}

fn check(laboratory: &mut Laboratory, stages: &[Stage], what: &str) -> Result<Check, StabilityError> {
    let (mut naive, mut stable) = (0.0f64, 0.0f64);
    for stage in stages {
        let seen = stage.seen(laboratory, stage.scene())?;
        let truth = stage.footprints();
        // Points of a surface are known to a few units of rounding of its size, and so is how far it is from an eye close to
        // it: this much of any derivative is lost to positions in f32, whatever is made of them.
        let known = 1.0 + stage.half / (stage.distance * stage.tilt_deg.to_radians().cos());
        let stated: Vec<DMat2> =
            seen.footprint.iter().map(|numbers| DMat2::from_cols_array(&numbers.map(f64::from))).collect();
        stable = stable.max(worst(&stated, &truth) / known);
        naive = naive.max(worst(&differences(&seen), &truth) / known);
    }
    Ok(Check {
        what: what.to_owned(),
        error_of: "|derivative - derivative in f64| / the largest of the pixel / (1 + surface's size / its distance)"
            .to_owned(),
        inputs: stages.len() as u64 * u64::from(SIDE * SIDE),
        naive: Form::new("differences between pixels", naive),
        stable: Form::new("the triangle's Jacobian times the ray's differentials", stable),
        // Some 30 operations one after the other, each within half a unit in the last place, quotients within 2.5.
        tolerance: 4e-6,
    })
}

/// Of texture coordinates between neighbours, as the derivatives of fragment shaders are: in each square of 2 x 2.
fn differences(seen: &Seen) -> Vec<DMat2> {
    let at = |x: u32, y: u32| DVec2::from(seen.uv[(y * SIDE + x) as usize].map(f64::from));
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            // One to the left, so that squares lie across the seam in the middle.
            let (left, top) = (((x + 1) & !1).saturating_sub(1).min(SIDE - 2), y & !1);
            DMat2::from_cols(at(left + 1, y) - at(left, y), at(x, top + 1) - at(x, top))
        })
        .collect()
}

fn worst(values: &[DMat2], truth: &[DMat2]) -> f64 {
    let largest = |matrix: DMat2| matrix.to_cols_array().into_iter().fold(0.0, |most: f64, of| most.max(of.abs()));
    values.iter().zip(truth).fold(0.0, |worst: f64, (value, truth)| {
        let finite = value.is_finite();
        worst.max(if finite { largest(*value - *truth) / largest(*truth) } else { f64::INFINITY })
    })
}
