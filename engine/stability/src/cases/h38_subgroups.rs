//! H38. No algorithm assumes a size of subgroups or groups.
//!
//! What may differ from device to device is varied where a shader can: the shape of groups, whether the edge of a dispatch cuts
//! them, how many rounds their invocations take, and the order of the work. Which size subgroups have is the driver's choice;
//! nothing here asks for one.

use crate::{Check, Form, Laboratory, Random, StabilityError};
use mica_graph::Extent;
use mica_shaders::{group_counts, group_counts_in_step};

/// Invocations along a row: no shape of groups divides it.
const WIDTH: u32 = 331;
/// Rounds that an invocation takes are fewer.
const ROUNDS: u32 = 48;

/// Measures it: what every pass that traces rays counts with.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(39);
    let mixed: Vec<u32> = (0..laboratory.inputs(40_009, 4_000_037)).map(|_| random.bits() as u32).collect();
    // Short invocations beside long ones, and each beside its like.
    let mut sorted = mixed.clone();
    sorted.sort_unstable_by_key(|asked| asked % ROUNDS);
    let mut worst: f64 = 0.0;
    let mut inputs = 0;
    // So many rays that the count passes its end, too.
    for (rays, list) in [1, 1 << 16].into_iter().flat_map(|rays| [&mixed, &sorted].map(|list| (rays, list))) {
        let truth = counted_one_by_one(list).map(|count| (count * u64::from(rays)).min(u32::MAX.into()));
        let extent = Extent::new(WIDTH, (list.len() as u32).div_ceil(WIDTH));
        macro_rules! counted {
            ($($shape:ident),*) => {
                [$(laboratory.totals(list, 2, |graph, asked, ray_counts, count| {
                    let params = group_counts::$shape::Params { width: WIDTH, count, rays };
                    graph.pass(group_counts::$shape::Bind { asked, ray_counts }, params, extent);
                })?),*]
            };
        }
        for found in counted!(line_32, line_33, line_64, line_128, square_8, column_64) {
            worst = found.iter().zip(truth).map(|(found, truth)| wrong(*found, truth)).fold(worst, f64::max);
            inputs += list.len() as u64;
        }
    }
    // Whole groups, and sums below 2^32: what it needs besides.
    let small: Vec<u32> = mixed[..mixed.len() / 64 * 64].iter().map(|asked| asked % 1000).collect();
    let in_step = laboratory.totals(&small, 1, |graph, asked, total, count| {
        graph.pass(group_counts_in_step::Bind { asked, total }, (), Extent::new(count, 1));
    })?;
    let naive = wrong(in_step[0], small.iter().copied().map(u64::from).sum());
    Ok(vec![Check {
        what: "rays counted by groups of six shapes, cut by edges, short loops beside long, to 2^32 and beyond"
            .to_owned(),
        error_of: "|count / true count - 1|".to_owned(),
        inputs,
        naive: Form::new("a tree without barriers among 32", naive),
        stable: Form::new("integer atomics between barriers", worst),
        tolerance: 0.0,
    }])
}

fn wrong(found: u32, truth: u64) -> f64 {
    (f64::from(found) / truth as f64 - 1.0).abs()
}

/// What the invocations of a list should count, traced and cut short, if every ray is one.
fn counted_one_by_one(list: &[u32]) -> [u64; 2] {
    let mut counts = [0; 2];
    for asked in list {
        let mut bits = *asked;
        for _ in 0..asked % ROUNDS {
            // The generator of Numerical Recipes.
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            counts[0] += u64::from(bits >> 31);
            counts[1] += u64::from(bits >> 30 & 1);
        }
    }
    counts
}
