//! H25. Division by the probability of selection.

use crate::{Check, Form, Laboratory, StabilityError, arithmetic, bits, worst_ratio};
use glam::DVec3;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_oracle::wang2020::expected_probability;
use mica_shaders::types::{Operands, Words};

/// Random words, as a power of 2.
const WORDS: f64 = 4_294_967_296.0;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![probability(laboratory)?, acceptance(laboratory)?])
}

/// P-hat of Wang, Deng and Holzschuch 2020, Eq. 17.
fn probability(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let steps = laboratory.inputs(16, 400);
    let cosines = (0..steps).map(|step| 0.02 + 0.98 * step as f64 / (steps - 1) as f64);
    let mut operands = Vec::new();
    let mut truth = Vec::new();
    for o_n in cosines {
        for alpha in [0.001, 0.02, 0.1, 0.2, 0.5, 1.0] {
            for gamma_deg in [1.0_f64, 6.0] {
                let sin2_half_gamma = (0.5 * gamma_deg.to_radians()).sin().powi(2) as f32;
                let a = [o_n as f32, alpha as f32, sin2_half_gamma, 0.0];
                operands.push(Operands { a, b: [0.0; 4], c: [0.0; 4] });
                let [o_n, alpha, sin2, _] = a.map(f64::from);
                let facets = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact)?;
                let o = DVec3::new((1.0 - o_n * o_n).max(0.0).sqrt(), 0.0, o_n);
                truth.push(expected_probability(&facets, o, 2.0 * sin2.sqrt().asin()));
            }
        }
    }
    let naive = laboratory.floats(&operands, arithmetic!(selection_printed))?;
    let stable = laboratory.floats(&operands, arithmetic!(selection_closed))?;
    Ok(Check {
        what: "P-hat of Wang, Deng and Holzschuch 2020, alpha .001 to 1, o.n from .02".to_owned(),
        error_of: "|P-hat / P-hat in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("36 x 9 directions, as printed", worst_ratio(&naive, &truth)),
        stable: Form::new("4 pi sin^2(gamma/2) V(o), V by 16 nodes", worst_ratio(&stable, &truth)),
        // Of the 16 nodes: 1e-4 at alpha 1.
        tolerance: 2e-4,
    })
}

/// E[accepted] / N against the chance: all words below four times the chance are asked.
fn acceptance(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let chances = [1e-6_f32, 1.7e-6, 2.3e-6, 4.1e-6, 9.9e-6];
    let mut questions = Vec::new();
    let mut ends = Vec::new();
    for chance in chances {
        let most = (4.0 * f64::from(chance) * WORDS) as u32;
        questions.extend((0..most).map(|word| Words { a: [word, chance.to_bits(), 0, 0], b: [0; 4] }));
        ends.push(questions.len());
    }
    let naive = laboratory.words(&questions, bits!(rare_by_24_bits))?;
    let stable = laboratory.words(&questions, bits!(rare_by_32_bits))?;
    let worst = |answers: &[[u32; 4]]| {
        let mut from = 0;
        let of_chance = |(chance, end): (&f32, &usize)| {
            let accepted: u32 = answers[from..*end].iter().map(|answer| answer[0]).sum();
            from = *end;
            (f64::from(accepted) / WORDS / f64::from(*chance) - 1.0).abs()
        };
        chances.iter().zip(&ends).map(of_chance).fold(0.0, f64::max)
    };
    Ok(Check {
        what: "flakes accepted with chances of 1e-6 to 1e-5, which divide what they add".to_owned(),
        error_of: "|share of words accepted / chance - 1|".to_owned(),
        inputs: questions.len() as u64,
        naive: Form::new("24 bits of the word below the chance", worst(&naive)),
        stable: Form::new("32 bits of it below the chance", worst(&stable)),
        tolerance: 1e-3,
    })
}
