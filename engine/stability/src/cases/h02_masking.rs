//! H02. Smith's masking for Beckmann: the rational fit and the exact form.
//!
//! The renderer has the fit of Walter et al. 2007 cut off at 1, which is what the discrete stochastic papers use; the exact form with
//! erf is in the oracle, and here the truth. As printed the fit exceeds 1 by 5.7e-5 just below a = 1.6 and falls to 1 there.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::types::Operands;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(2);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let (cosine, alpha) = (random.log_between(1e-8, 1.0), random.log_between(0.001, 1.0));
            Operands { a: [cosine as f32, alpha as f32, 0.0, 0.0], ..Operands::default() }
        })
        .collect();
    let truth = operands
        .iter()
        .map(|of| {
            let cosine = f64::from(of.a[0]);
            let facets = Microfacets::new(Ndf::Beckmann, of.a[1].into(), SmithFit::Exact)?;
            Ok(facets.g1_over_cos(DVec3::new(((1.0 - cosine) * (1.0 + cosine)).sqrt(), 0.0, cosine)))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let naive = laboratory.floats(&operands, arithmetic!(masking_tangent))?;
    let stable = laboratory.floats(&operands, arithmetic!(masking_cancelled))?;
    let fit = Check {
        what: "G1 / cos, cosines of 1e-8 to 1, alpha .001 to 1".to_owned(),
        error_of: "|value / exact value - 1|, the exact one with erf".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("the fit of Walter et al. 2007 in tan(acos(cos))", worst_ratio(&naive, &truth)),
        stable: Form::new("the fit, at most 1, its cosine cancelled", worst_ratio(&stable, &truth)),
        tolerance: 3.2e-3, // Of the fit: 3.1e-3 at a = 1.34.
    };

    // From the horizon towards the normal across a = 1.6, each alpha by itself.
    let count = laboratory.inputs(20_000, 2_000_000);
    let rows: Vec<Vec<Operands>> = [0.05_f64, 0.3, 1.0]
        .into_iter()
        .map(|alpha| {
            let cosine = |index: usize| {
                let a = alpha * (0.1 + 2.0 * index as f64 / count as f64);
                a / a.hypot(1.0)
            };
            (0..count)
                .map(|index| Operands { a: [cosine(index) as f32, alpha as f32, 0.0, 0.0], ..Operands::default() })
                .collect()
        })
        .collect();
    let (mut above, mut falls) = ([0.0_f64; 2], [0.0_f64; 2]);
    for row in &rows {
        let values = [
            laboratory.floats(row, arithmetic!(masking_tangent))?,
            laboratory.floats(row, arithmetic!(masking_cancelled))?,
        ];
        for (form, values) in values.iter().enumerate() {
            let mut greatest = 0.0_f64;
            for (of, value) in row.iter().zip(values) {
                let g1 = f64::from(of.a[0]) * f64::from(*value);
                above[form] = above[form].max(if g1.is_nan() { f64::INFINITY } else { g1 - 1.0 });
                falls[form] = falls[form].max(greatest - g1);
                greatest = greatest.max(g1);
            }
        }
    }
    let inputs = rows.iter().map(Vec::len).sum::<usize>() as u64;
    let check = |what: &str, error_of: &str, [naive, stable]: [f64; 2]| Check {
        what: what.to_owned(),
        error_of: error_of.to_owned(),
        inputs,
        naive: Form::new("the fit of Walter et al. 2007 as printed", naive),
        stable: Form::new("the fit, at most 1", stable),
        tolerance: 8.0 * f64::from(f32::EPSILON), // Two divisions and a root.
    };
    let most = check("G1 is at most 1, a of .1 to 2.1", "G1 - 1", above);
    let monotone = check("G1 grows with a, from .1 to 2.1", "how far G1 falls below what it was at a lesser a", falls);
    Ok(vec![fit, most, monotone])
}
