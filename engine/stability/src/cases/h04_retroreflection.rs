//! H04. Light from where the viewer is: axes of the reflecting set.
//!
//! The conic's axes i x o and i - o vanish at i = o, where the set is round and any axes would do.

use super::lit_flake::on_the_edge;
use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_oracle::lit_probability::lit_probability;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![membership(laboratory)?, edge(laboratory)?, probability(laboratory)?])
}

/// Light and view that are the same in every other pair, and 1e-8 to 1e-2 apart in the rest, at most
/// so many radians from the normal.
fn pair(random: &mut Random, index: usize, from_normal: f64) -> [DVec3; 2] {
    let i = random.direction_about(DVec3::Z, from_normal);
    let apart = if index.is_multiple_of(2) { 0.0 } else { random.log_between(1e-8, 1e-2) };
    [i, turned(i, apart, random.between(0.0, TAU))]
}

fn membership(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(4);
    let operands: Vec<Operands> = (0..laboratory.inputs(50_000, 5_000_000))
        .map(|index| {
            let [i, o] = pair(&mut random, index, 1.2);
            let gamma = random.log_between(1.0, 30.0).to_radians();
            // Away from the edge, where no form is to be wrong.
            let from_edge =
                if random.between(0.0, 1.0) < 0.5 { random.between(0.0, 0.99) } else { random.between(1.01, 2.0) };
            let m = turned((i + o).normalize(), 0.5 * gamma * from_edge, random.between(0.0, TAU));
            Operands { a: rounded(i, (0.5 * gamma).sin().powi(2)), b: rounded(o, 0.0), c: rounded(m, 0.0) }
        })
        .collect();
    let truth: Vec<bool> = operands
        .iter()
        .map(|of| {
            let (i, o, m) = (unit(of.a), unit(of.b), unit(of.c));
            (2.0 * i.dot(m) * m - i).distance_squared(o) <= 4.0 * f64::from(of.a[3]) && i.dot(m) > 0.0
        })
        .collect();
    let wrong = |answers: &[f32]| {
        let wrong = answers.iter().zip(&truth).filter(|(answer, lit)| (**answer == 1.0) != **lit);
        wrong.count() as f64 / truth.len() as f64
    };
    let naive = laboratory.floats(&operands, arithmetic!(membership_axes))?;
    let stable = laboratory.floats(&operands, arithmetic!(membership_chord))?;
    Ok(Check {
        what: "whether a flake is lit, light and view 0 to .01 apart, gamma 1 to 30 degrees".to_owned(),
        error_of: "share of wrong answers, 1 % and more from the edge".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("the conic in the axes i x o, i - o, i + o", wrong(&naive)),
        stable: Form::new("|2 (i.m) m - i - o|^2 <= 4 sin^2(gamma / 2)", wrong(&stable)),
        tolerance: 0.0,
    })
}

/// The same on the edge, as `flakes` tests each flake.
fn edge(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut index = 0;
    on_the_edge(
        laboratory,
        "flakes on the edge of cones of .05 to 30 degrees, light and view 0 to .01 apart",
        |random| {
            index += 1;
            let [i, o] = pair(random, index, 1.2);
            let gamma = random.log_between(0.05, 30.0).to_radians();
            ([i, o], turned((i + o).normalize(), 0.5 * gamma, random.between(0.0, TAU)))
        },
    )
}

/// Of i = o and of what tends to it: right in both, P is continuous there.
fn probability(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(5);
    let operands: Vec<Operands> = (0..laboratory.inputs(2_000, 200_000))
        .map(|index| {
            let alpha = random.log_between(0.3, 1.0);
            // Where there are flakes to be lit: to a slope of three alpha.
            let [i, o] = pair(&mut random, index, (3.0 * alpha).atan().min(1.2));
            Operands { a: rounded(i, 1f64.to_radians().sin().powi(2)), b: rounded(o, alpha), ..Operands::default() }
        })
        .collect();
    let truth = operands
        .par_iter()
        .map(|of| {
            let facets = Microfacets::new(Ndf::Beckmann, of.b[3].into(), SmithFit::Exact)?;
            Ok(lit_probability(&facets, unit(of.a), unit(of.b), 2f64.to_radians()))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_probability_axes))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_probability_quadrature))?;
    Ok(Check {
        what: "P(i, o, 2 degrees), light and view 0 to .01 apart, alpha .3 to 1".to_owned(),
        error_of: "|P / P in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("the conic's ellipse from the axes i x o and i - o", worst_ratio(&naive, &truth)),
        stable: Form::new("the conic about the slope of i + o, no axes", worst_ratio(&stable, &truth)),
        tolerance: 1e-5,
    })
}
