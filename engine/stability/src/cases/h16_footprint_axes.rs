//! H16. Area and axes of long footprints.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::{DMat2, DVec2};
use mica_shaders::types::Operands;
use std::f64::consts::TAU;

/// T1: 16 units in the last place.
const TOLERANCE: f64 = 1.9e-6;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(16);
    let count = laboratory.inputs(100_000, 4_000_000);
    let operands: Vec<Operands> =
        (0..count).map(|_| Operands { a: sides(&mut random), ..Operands::default() }).collect();
    let inputs = count as u64;
    let exact = |of: &Operands| DMat2::from_cols_array(&of.a.map(f64::from));
    let areas: Vec<f64> = operands.iter().map(|of| exact(of).determinant().abs()).collect();
    let shorter: Vec<f64> = operands
        .iter()
        .zip(&areas)
        .map(|(of, area)| {
            let [x, y] = [exact(of).x_axis, exact(of).y_axis];
            let both = DVec2::new(x.x + y.y, x.y - y.x).length() + DVec2::new(x.x - y.y, x.y + y.x).length();
            area / (0.5 * both)
        })
        .collect();
    let magnitudes = |values: Vec<f32>| values.into_iter().map(f32::abs).collect::<Vec<_>>();
    Ok(vec![
        Check {
            what: "areas of footprints up to 1e6 times as long as wide, 1e-12 to 1e9 large".to_owned(),
            error_of: "|area / area in f64 - 1|".to_owned(),
            inputs,
            naive: Form::new(
                "a d - b c",
                worst_ratio(&magnitudes(laboratory.floats(&operands, arithmetic!(determinant_plain))?), &areas),
            ),
            stable: Form::new(
                "the same, scaled, from products without error",
                worst_ratio(&laboratory.floats(&operands, arithmetic!(footprint_area))?, &areas),
            ),
            tolerance: TOLERANCE,
        },
        Check {
            what: "shorter axes of the same".to_owned(),
            error_of: "|axis / axis in f64 - 1|".to_owned(),
            inputs,
            naive: Form::new(
                "the smaller root of the quadratic of the squared axes",
                worst_ratio(&laboratory.floats(&operands, arithmetic!(minor_axis_roots))?, &shorter),
            ),
            stable: Form::new(
                "area over the longer axis",
                worst_ratio(&laboratory.floats(&operands, arithmetic!(minor_axis_quotient))?, &shorter),
            ),
            tolerance: TOLERANCE,
        },
    ])
}

/// Sides of a parallelogram in any position, whose ellipse has axes of a ratio up to 1e6.
fn sides(random: &mut Random) -> [f32; 4] {
    let [left, right] = [(); 2].map(|()| DMat2::from_angle(random.between(0.0, TAU)));
    let axes = DVec2::new(1.0, 1.0 / random.log_between(1.0, 1e6));
    let sides = random.log_between(1e-12, 1e9) * (left * DMat2::from_diagonal(axes) * right);
    sides.to_cols_array().map(|side| side as f32)
}
