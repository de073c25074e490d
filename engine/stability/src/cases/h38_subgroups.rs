//! H38. No algorithm assumes a size of subgroups or groups.

use crate::{Check, Form, Laboratory, Random, StabilityError};
use mica_graph::Extent;
use mica_shaders::{group_counts_32, group_counts_64, group_counts_128, group_counts_in_step};

/// Measures it: what every pass that traces rays counts with, in groups of three sizes.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(39);
    // A multiple of the largest group; the sum stays below 2^32.
    let count = laboratory.inputs(1 << 16, 1 << 22);
    let rays: Vec<u32> = (0..count).map(|_| random.bits() as u32 % 1000).collect();
    let truth = [rays.iter().sum::<u32>(), rays.iter().map(|rays| rays & 1).sum()];
    let in_step = laboratory.totals(&rays, 1, |graph, asked, total, count| {
        graph.pass(group_counts_in_step::Bind { asked, total }, (), Extent::new(count, 1));
    })?;
    macro_rules! counted {
        ($module:ident) => {
            laboratory.totals(&rays, 2, |graph, asked, ray_counts, count| {
                graph.pass($module::Bind { asked, ray_counts }, (), Extent::new(count, 1));
            })?
        };
    }
    let counted = [counted!(group_counts_32), counted!(group_counts_64), counted!(group_counts_128)];
    let wrong = |found: u32, truth: u32| (f64::from(found) / f64::from(truth) - 1.0).abs();
    let worst = counted.iter().flat_map(|found| found.iter().zip(truth)).map(|(found, truth)| wrong(*found, truth));
    Ok(vec![Check {
        what: "rays counted by groups of 32, 64 and 128 invocations".to_owned(),
        error_of: "|count / true count - 1|".to_owned(),
        inputs: count as u64,
        naive: Form::new("a tree without barriers among 32", wrong(in_step[0], truth[0])),
        stable: Form::new("integer atomics between barriers", worst.fold(0.0, f64::max)),
        tolerance: 0.0,
    }])
}
