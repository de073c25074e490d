//! H39. Sums that do not depend on the order of invocations.
//!
//! The renderer's own atomics are on integers: rays (shared/ray_counts.glsl) and hits (passes/dpf).

use crate::{Check, Form, Laboratory, Random, StabilityError};
use mica_graph::Extent;
use mica_shaders::{sum_by_exchange, sum_in_fixed_point};

/// Measures it: the worst of several runs, which must all be one.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(40);
    // Heavy-tailed as glints are, every number of at least 8, so that multiples of 2^-20 hold it exactly.
    let count = laboratory.inputs(1 << 15, 1 << 20);
    let radiances: Vec<f32> = (0..count).map(|_| (8.0 / random.between(1e-5, 1.0)) as f32).collect();
    let truth: f64 = radiances.iter().map(|x| f64::from(*x)).sum();
    let runs = laboratory.inputs(8, 1000);
    let (mut by_exchange, mut in_fixed_point) = (0.0_f64, 0.0_f64);
    for _ in 0..runs {
        let sum = laboratory.totals(&radiances, 1, |graph, asked, total, count| {
            graph.pass(sum_by_exchange::Bind { asked, total }, (), Extent::new(count, 1));
        })?;
        by_exchange = by_exchange.max((f64::from(f32::from_bits(sum[0])) / truth - 1.0).abs());
        let sum = laboratory.totals(&radiances, 2, |graph, asked, total, count| {
            graph.pass(sum_in_fixed_point::Bind { asked, total }, (), Extent::new(count, 1));
        })?;
        let units = u64::from(sum[0]) << 32 | u64::from(sum[1]);
        in_fixed_point = in_fixed_point.max((units as f64 / 1_048_576.0 / truth - 1.0).abs());
    }
    Ok(vec![Check {
        what: format!("heavy-tailed sums, {runs} times"),
        error_of: "|sum / sum in f64 - 1|".to_owned(),
        inputs: (count * runs) as u64,
        naive: Form::new("floats exchanged atomically", by_exchange),
        stable: Form::new("multiples of 2^-20 in two words", in_fixed_point),
        // The sums are exact; 64 bits round once as they become an f64.
        tolerance: 1e-15,
    }])
}
