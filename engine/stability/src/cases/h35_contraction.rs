//! H35. Operations are rounded one by one where they must be.
//!
//! That compiled shaders say so (`NoContraction`) is tested in tests/tests/precise.rs.

use crate::{Check, Form, Laboratory, Random, StabilityError, bits, share_wrong};
use mica_shaders::types::Words;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(35);
    let mut number = || {
        let size = random.log_between(1e-4, 1e4) as f32;
        if random.bits() & 1 == 0 { size } else { -size }
    };
    let mut pairs: Vec<[f32; 2]> = (0..laboratory.inputs(200_000, 20_000_000)).map(|_| [number(), number()]).collect();
    pairs.extend([[1e8, 1.0], [1.0, 1e8], [1e8, -1.0]]);
    let words: Vec<Words> =
        pairs.iter().map(|[x, y]| Words { a: [x.to_bits(), y.to_bits(), 0, 0], b: [0; 4] }).collect();
    // Sums of floats at most 2^28 apart, products of any two, and what is left of them are exact in f64.
    let truth = |rounded: fn(f32, f32) -> f32, exact: fn(f64, f64) -> f64| -> Vec<[f64; 2]> {
        let each = |[x, y]: &[f32; 2]| {
            let rounded = f64::from(rounded(*x, *y));
            [rounded, exact(f64::from(*x), f64::from(*y)) - rounded]
        };
        pairs.iter().map(each).collect()
    };
    let sums = truth(|x, y| x + y, |x, y| x + y);
    let products = truth(|x, y| x * y, |x, y| x * y);
    let share = |answers: Vec<[u32; 4]>, truth: &[[f64; 2]]| {
        let numbers = answers.iter().map(|words| [words[0], words[1]].map(|bits| f64::from(f32::from_bits(bits))));
        share_wrong(&numbers.collect::<Vec<_>>(), truth)
    };
    let inputs = pairs.len() as u64;
    let error_of = "share of pairs that are not exact".to_owned();
    Ok(vec![
        Check {
            what: "sums and what their rounding lost".to_owned(),
            error_of: error_of.clone(),
            inputs,
            naive: Form::new(
                "Knuth's sum without precise",
                share(laboratory.words(&words, bits!(sum_error_loose))?, &sums),
            ),
            stable: Form::new("Knuth's sum, precise", share(laboratory.words(&words, bits!(sum_error))?, &sums)),
            tolerance: 0.0,
        },
        Check {
            what: "products and what their rounding lost".to_owned(),
            error_of,
            inputs,
            naive: Form::new("fma(x, y, -x y)", share(laboratory.words(&words, bits!(product_error_fma))?, &products)),
            stable: Form::new(
                "Dekker's product, precise",
                share(laboratory.words(&words, bits!(product_error))?, &products),
            ),
            tolerance: 0.0,
        },
    ])
}
