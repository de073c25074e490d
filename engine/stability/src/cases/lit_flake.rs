//! Flakes on the cone's very edge: the test of H04 and H05 that `flakes` makes of each, in f64.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic};
use glam::DVec3;
use mica_shaders::types::Operands;

/// Light, view, flake, of any length, and the half-angle in radians, for flakes that mirror i about the edge: what is asked of
/// each is drawn by `pair`.
pub fn on_the_edge(
    laboratory: &mut Laboratory,
    what: &str,
    mut drawn: impl FnMut(&mut Random) -> ([DVec3; 2], DVec3),
) -> Result<Check, StabilityError> {
    let mut random = Random::new(45);
    let operands: Vec<Operands> = (0..laboratory.inputs(50_000, 5_000_000))
        .map(|_| {
            let ([i, o], flake) = drawn(&mut random);
            let length = random.log_between(1.0, 1e3);
            let [a, b, c] = [i, o, length * flake].map(|v| v.as_vec3().extend(0.0).to_array());
            let mut of = Operands { a, b, c };
            // The edge is put where the directions as f32 has them are, and up to 1e-4 of it beside.
            let beside = random.log_between(1e-9, 1e-4) * if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
            of.a[3] = (0.25 * chord_squared(&of) * (1.0 + beside)) as f32;
            of
        })
        .collect();
    // By how much of the cone each is outside.
    let truth: Vec<f64> =
        operands.iter().map(|of| (chord_squared(of) / (4.0 * f64::from(of.a[3]))).sqrt() - 1.0).collect();
    let farthest_wrong = |answers: &[f32]| {
        let wrong = answers.iter().zip(&truth).filter(|(answer, from_edge)| (**answer == 1.0) != (**from_edge <= 0.0));
        wrong.fold(0.0_f64, |farthest, (_, from_edge)| farthest.max(from_edge.abs()))
    };
    let naive = laboratory.floats(&operands, arithmetic!(lit_flake_single))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_flake))?;
    Ok(Check {
        what: what.to_owned(),
        error_of: "how far from the edge an answer is wrong, relative to gamma".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("|2 (i.m) m - |m|^2 (i + o)|^2 <= 4 |m|^4 sin^2(gamma / 2) in f32", farthest_wrong(&naive)),
        stable: Form::new("the same in f64", farthest_wrong(&stable)),
        // What the truth's own roundings are of the narrowest cone's chord squared.
        tolerance: 1e-9,
    })
}

/// The square of the chord between o and where the flake mirrors i, by the law of cosines: |i|^2 + |o|^2 - 2 r.o.
fn chord_squared(of: &Operands) -> f64 {
    let [i, o, m] = [of.a, of.b, of.c].map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
    let mirrored_cosine = 2.0 * i.dot(m) * o.dot(m) / m.length_squared() - i.dot(o);
    i.length_squared() + o.length_squared() - 2.0 * mirrored_cosine
}
