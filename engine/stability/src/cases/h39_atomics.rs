//! H39. Sums that do not depend on the order of invocations.
//!
//! The renderer's own atomics are on integers: rays (shared/ray_counts.glsl, H38) and hits (passes/dpf).

use crate::{Check, Form, Laboratory, Random, StabilityError};
use mica_graph::{Buffer, Extent, Graph};
use mica_shaders::{sum_by_exchange, sum_in_fixed_point, sum_in_one_word};

/// 2^-20 is one.
const UNITS: f64 = 1_048_576.0;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![heavy_tailed(laboratory)?, carried(laboratory)?, beyond_the_end(laboratory)?])
}

/// Declares a pass that adds up a list, dealt to so many sums.
macro_rules! summed {
    ($module:ident, $sums:expr) => {
        |graph: &mut Graph, asked: &Buffer, total: &mut Buffer, count: u32| {
            let params = $module::Params { count, sums: $sums };
            graph.pass($module::Bind { asked, total }, params, Extent::new(count, 1));
        }
    };
}

/// The sums of a list in two words each, in units of 2^-20.
fn in_fixed_point(laboratory: &mut Laboratory, list: &[f32], sums: u32) -> Result<Vec<u64>, StabilityError> {
    let words = laboratory.totals(list, 2 * sums as usize, summed!(sum_in_fixed_point, sums))?;
    Ok(words.as_chunks::<2>().0.iter().map(|[upper, lower]| u64::from(*upper) << 32 | u64::from(*lower)).collect())
}

/// One sum of floats, exchanged until nobody came between.
fn by_exchange(laboratory: &mut Laboratory, list: &[f32]) -> Result<f64, StabilityError> {
    Ok(f32::from_bits(laboratory.totals(list, 1, summed!(sum_by_exchange, 1))?[0]).into())
}

/// The unit fractions of a number, in f64: the nearest multiple of 2^-20.
fn units(x: f32) -> u64 {
    (f64::from(x) * UNITS).round_ties_even() as u64
}

/// Numbers as glints are, most of them small and a few large, added up several times by few invocations and by many, into one
/// sum that all want and into several.
fn heavy_tailed(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(40);
    let count = laboratory.inputs(1 << 15, 1 << 20);
    let mut radiances: Vec<f32> = (0..count).map(|_| random.log_between(1e-9, 1e6) as f32).collect();
    // What is no radiance counts as none.
    radiances[..6].copy_from_slice(&[0.0, -0.0, -1.0, f32::NAN, f32::NEG_INFINITY, 1e-40]);
    let (mut naive, mut stable, mut inputs) = (0.0_f64, 0.0_f64, 0);
    for run in 0..laboratory.inputs(8, 1000) {
        let list = &radiances[..[count, 1000, 65, 6][run % 4]];
        let sums = [1, 64][run / 4 % 2];
        let found = in_fixed_point(laboratory, list, sums)?;
        for (first, found) in found.iter().enumerate() {
            let own = || list.iter().skip(first).step_by(sums as usize).copied().filter(|x| *x > 0.0);
            // Bit for bit what integers make of the numbers, and all in all the sum in f64.
            let exact = own().map(units).sum::<u64>() == *found;
            let truth: f64 = own().map(f64::from).sum();
            let roundings = own().count().max(1) as f64;
            let error = (*found as f64 / UNITS - truth).abs() / (0.5 / UNITS * roundings);
            stable = stable.max(if exact { error } else { f64::INFINITY });
        }
        let truth: f64 = list.iter().filter(|x| **x > 0.0).copied().map(f64::from).sum();
        let positive: Vec<f32> = list.iter().copied().filter(|x| *x > 0.0).collect();
        let error = (by_exchange(laboratory, &positive)? - truth).abs();
        naive = naive.max(error / (0.5 / UNITS * positive.len() as f64));
        inputs += list.len() as u64;
    }
    Ok(Check {
        what: "sums of 6 to 32,768 and more radiances from 1e-9 to 1e6, again and again".to_owned(),
        error_of: "|sum - sum in f64| / 2^-21 of each number, infinite unless the words are those of integers"
            .to_owned(),
        inputs,
        naive: Form::new("floats exchanged atomically", naive),
        stable: Form::new("multiples of 2^-20 in two words", stable),
        // Each number is off by half a unit at most.
        tolerance: 1.0,
    })
}

/// Numbers of which nearly each carries from the lower word to the upper.
fn carried(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let count = laboratory.inputs(1 << 14, 1 << 19);
    let list: Vec<f32> = (0..count).map(|index| f32::from_bits(4096_f32.to_bits() - 1 - index as u32 % 3)).collect();
    let truth: u64 = list.iter().map(|x| units(*x)).sum();
    let error = |sum: f64| (sum / truth as f64 - 1.0).abs();
    let stable = in_fixed_point(laboratory, &list, 1)?[0];
    let in_one_word = laboratory.totals(&list, 1, summed!(sum_in_one_word, 1))?[0];
    Ok(Check {
        what: "numbers just below 4096, of which each carries".to_owned(),
        error_of: "|sum / exact sum - 1|".to_owned(),
        inputs: count as u64,
        naive: Form::new("multiples of 2^-20 in one word", error(in_one_word.into())),
        stable: Form::new("multiples of 2^-20 in two words", if stable == truth { 0.0 } else { error(stable as f64) }),
        tolerance: 0.0,
    })
}

/// Numbers and sums up to the end of the range and beyond, where they stay.
fn beyond_the_end(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let end = 2_f64.powi(44);
    let lists = [
        vec![f32::MAX; 3],
        vec![f32::INFINITY; 200],
        vec![(0.25 * end) as f32, (0.5 * end) as f32],
        vec![(0.5 * end) as f32; 2],
        (0..100_000).map(|index| if index % 2 == 0 { 1e9 } else { 0.3 }).collect(),
    ];
    let (mut naive, mut stable, mut inputs) = (0.0_f64, 0.0_f64, 0);
    for list in &lists {
        let truth = list.iter().map(|x| f64::from(*x)).sum::<f64>().min(end);
        let error = |sum: f64| (sum / truth - 1.0).abs();
        stable = stable.max(error(in_fixed_point(laboratory, list, 1)?[0] as f64 / UNITS));
        let in_one_word = laboratory.totals(list, 1, summed!(sum_in_one_word, 1))?[0];
        naive = naive.max(error(f64::from(in_one_word) / UNITS));
        inputs += list.len() as u64;
    }
    Ok(Check {
        what: "sums up to 2^44 and beyond, which stay at the end".to_owned(),
        error_of: "|sum / true sum, or 2^44 if that is less, - 1|".to_owned(),
        inputs,
        naive: Form::new("multiples of 2^-20 in one word", naive),
        stable: Form::new("multiples of 2^-20 in two words", stable),
        // The upper word's last unit, 4096 of 2^44.
        tolerance: 2.4e-10,
    })
}
