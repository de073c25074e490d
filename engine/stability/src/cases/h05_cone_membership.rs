//! H05. Whether a flake is lit, for narrow cones.

use super::lit_flake::on_the_edge;
use crate::random::{rounded, turned, unit};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic};
use glam::DVec3;
use mica_shaders::types::Operands;
use std::f64::consts::TAU;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![
        membership(laboratory, 0.05, 1.0)?,
        membership(laboratory, 0.01, 0.05)?,
        edge(laboratory)?,
        eigenvalue(laboratory)?,
    ])
}

/// Flakes within 20 % of the edge of cones between two half-angles in degrees.
fn membership(laboratory: &mut Laboratory, least: f64, most: f64) -> Result<Check, StabilityError> {
    let mut random = Random::new(5);
    let operands: Vec<Operands> = (0..laboratory.inputs(150_000, 10_000_000))
        .map(|_| {
            let gamma = random.log_between(least, most).to_radians();
            let (i, o) = (random.direction_about(DVec3::Z, 1.4), random.direction_about(DVec3::Z, 1.4));
            let mirrored = turned(o, gamma * random.between(0.8, 1.2), random.between(0.0, TAU));
            // Some face away from the light, and mirror it alike.
            let side = if random.between(0.0, 1.0) < 0.1 { -1.0 } else { 1.0 };
            Operands {
                a: rounded(i, (0.5 * gamma).sin().powi(2)),
                b: rounded(o, gamma.cos()),
                c: rounded(side * (i + mirrored).normalize(), 0.0),
            }
        })
        .collect();
    // How far each is from the edge, relative to gamma; negative inside, and without end where it faces away.
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let (i, o, m) = (unit(of.a), unit(of.b), unit(of.c));
            let chord = (2.0 * i.dot(m) * m - i).distance(o);
            let from_edge = (0.5 * chord).asin() / f64::from(of.a[3]).sqrt().asin() - 1.0;
            if i.dot(m) > 0.0 { from_edge } else { f64::INFINITY }
        })
        .collect();
    let farthest_wrong = |answers: &[f32]| {
        let wrong = answers.iter().zip(&truth).filter(|(answer, from_edge)| (**answer == 1.0) != (**from_edge <= 0.0));
        wrong.fold(0.0_f64, |farthest, (_, from_edge)| farthest.max(from_edge.abs()))
    };
    let naive = laboratory.floats(&operands, arithmetic!(membership_cosine))?;
    let matrix = laboratory.floats(&operands, arithmetic!(membership_matrix))?;
    let stable = laboratory.floats(&operands, arithmetic!(membership_chord))?;
    // The better of the two naive forms.
    let naive = farthest_wrong(&naive).min(farthest_wrong(&matrix));
    Ok(Check {
        what: format!("whether a flake within 20 % of the edge is lit, gamma {least} to {most} degrees"),
        error_of: "how far from the edge an answer is wrong, relative to gamma".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("2 (i.m) (o.m) - i.o >= cos(gamma), or m' C m <= 0", naive),
        stable: Form::new("|2 (i.m) m - i - o|^2 <= 4 sin^2(gamma / 2)", farthest_wrong(&stable)),
        // 1.7e-7 radians at .01 degrees: three units in the last place of the directions.
        tolerance: 1e-3,
    })
}

/// Flakes on the edge itself, as `flakes` tests each.
fn edge(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    on_the_edge(laboratory, "flakes on the edge of cones of .05 to 1 degrees", |random| {
        let gamma = random.log_between(0.05, 1.0).to_radians();
        let (i, o) = (random.direction_about(DVec3::Z, 1.4), random.direction_about(DVec3::Z, 1.4));
        ([i, o], (i + turned(o, gamma, random.between(0.0, TAU))).normalize())
    })
}

/// lambda_1, in half of the inputs near where it changes its sign.
fn eigenvalue(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(6);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|index| {
            let gamma = random.log_between(0.01, 30.0).to_radians();
            let i = random.direction_about(DVec3::Z, 1.5);
            // It is 0 where i and -o are gamma apart.
            let apart =
                if index.is_multiple_of(2) { gamma * random.between(0.5, 1.5) } else { random.between(0.0, 3.1) };
            let o = turned(-i, apart, random.between(0.0, TAU));
            Operands { a: rounded(i, (0.5 * gamma).sin().powi(2)), b: rounded(o, gamma.cos()), ..Operands::default() }
        })
        .collect();
    // cot^2(gamma/2) cos^2 t - sin^2 t, where 2 t is the angle of i and o, and the sum of both terms.
    let truth: Vec<[f64; 2]> = operands
        .iter()
        .map(|of| {
            let (i, o, s2) = (unit(of.a), unit(of.b), f64::from(of.a[3]));
            let terms = [(i + o).length_squared() / 4.0 * (1.0 - s2) / s2, (i - o).length_squared() / 4.0];
            [terms[0] - terms[1], terms[0] + terms[1]]
        })
        .collect();
    let worst = |values: &[f32]| {
        values.iter().zip(&truth).fold(0.0_f64, |worst, (value, [truth, terms])| {
            let error = (f64::from(*value) - truth).abs() / terms;
            if error.is_nan() { f64::INFINITY } else { worst.max(error) }
        })
    };
    let naive = laboratory.floats(&operands, arithmetic!(conic_cosine))?;
    let stable = laboratory.floats(&operands, arithmetic!(conic_chord))?;
    Ok(Check {
        what: "lambda_1 of the conic, gamma .01 to 30 degrees".to_owned(),
        error_of: "|value - value in f64| / (cos^2 t cot^2(gamma / 2) + sin^2 t)".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("(i.o + cos gamma) / (1 - cos gamma)", worst(&naive)),
        stable: Form::new("|i + o|^2 / (4 sin^2(gamma / 2)) - 1", worst(&stable)),
        tolerance: 16.0 * f64::from(f32::EPSILON),
    })
}
