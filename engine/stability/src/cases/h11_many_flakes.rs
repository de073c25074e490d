//! H11. From no flake to 1e12: halving without loss.

use super::quarters::{Node, quarters};
use crate::{Check, Form, Laboratory, StabilityError, bits};
use mica_gpu::Timing;
use mica_graph::{Extent, Graph};
use mica_shaders::flake_counts;

/// The most flakes that a square of texture may have.
const MOST: u64 = 1_000_000_000_000;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![loss(laboratory)?, spread(laboratory)?, total(laboratory)?])
}

/// Nodes of so many flakes, in different places.
fn nodes(flakes: u64, count: u32) -> impl Iterator<Item = Node> {
    (0..count).map(move |at| Node { flakes, level: 10, x: at & 1023, y: at >> 10, visit: 0 })
}

/// What a split loses or makes.
fn loss(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let around = |n: u64| [n - 1, n, n + 1];
    let flakes = [[0, 1, 2], [3, 32, 33], [64, 65, 1000], around(1 << 24), around(1 << 32), [1 << 39, MOST - 1, MOST]];
    let each = laboratory.inputs(1000, 100_000) as u32;
    let nodes: Vec<Node> = flakes.concat().into_iter().flat_map(|flakes| nodes(flakes, each)).collect();
    let naive = quarters(laboratory, &nodes, 1, bits!(quarters_rounded))?;
    let stable = quarters(laboratory, &nodes, 1, bits!(quarters_hashed))?;
    let worst = |children: &[[u64; 4]]| {
        let lost = nodes.iter().zip(children).map(|(node, children)| {
            let sum = children.iter().fold(0_u64, |sum, child| sum.wrapping_add(*child));
            sum.abs_diff(node.flakes)
        });
        lost.max().unwrap_or(u64::MAX) as f64
    };
    Ok(Check {
        what: "splits of 0 to 1e12 flakes, about 2^24 and 2^32 too".to_owned(),
        error_of: "flakes lost or made in a split".to_owned(),
        inputs: nodes.len() as u64,
        naive: Form::new("four normal numbers, rounded in f32", worst(&naive)),
        stable: Form::new("halves of whole numbers, deviations in f32", worst(&stable)),
        tolerance: 0.0,
    })
}

/// Variance of the children's counts.
fn spread(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let flakes = [3, 33, 65, 1000, (1 << 24) + 1, (1 << 32) - 1, MOST];
    // The variance of so many is known to .3 %.
    let each = laboratory.inputs(100_000, 1_000_000);
    let (mut naive, mut stable, mut inputs) = (0.0_f64, 0.0_f64, 0);
    for flakes in flakes {
        let nodes: Vec<Node> = nodes(flakes, each as u32).collect();
        inputs += nodes.len();
        let error = |children: Vec<[u64; 4]>| {
            let from_mean = |child: &u64| (*child as f64 - 0.25 * flakes as f64).powi(2);
            let squares: f64 = children.iter().flatten().map(from_mean).sum();
            (squares / (4.0 * each as f64) / (flakes as f64 * 3.0 / 16.0) - 1.0).abs()
        };
        naive = naive.max(error(quarters(laboratory, &nodes, 2, bits!(quarters_rounded))?));
        stable = stable.max(error(quarters(laboratory, &nodes, 2, bits!(quarters_hashed))?));
    }
    Ok(Check {
        what: "spread of a node's flakes over its children, 3 to 1e12 flakes".to_owned(),
        error_of: "|variance / (3/16 n) - 1|".to_owned(),
        inputs: inputs as u64,
        naive: Form::new("four normal numbers, rounded in f32", naive),
        stable: Form::new("bits up to 64 flakes, beyond that normal numbers less what rounding adds", stable),
        tolerance: 0.01,
    })
}

/// The flakes of all nodes of one level, as the renderer's own pass splits them.
fn total(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const LEVEL: u32 = 8;
    let mut graph = Graph::new();
    let mut counts = graph.buffer("root", 8);
    graph.upload(&mut counts, bytemuck::bytes_of(&MOST));
    for level in 0..LEVEL {
        let mut children = graph.buffer(format!("level {}", level + 1), 8 << (2 * (level + 1)));
        let bind = flake_counts::Bind { parents: &counts, children: &mut children };
        graph.pass(bind, flake_counts::Params { level, seed: 3 }, Extent::line(1 << (2 * level)));
        counts = children;
    }
    let download = graph.download(&counts);
    let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
    let counts: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
    let in_floats = counts.iter().fold(0.0_f32, |sum, count| sum + *count as f32);
    let in_integers: u64 = counts.iter().sum();
    Ok(Check {
        what: "1e12 flakes, added up over the 65,536 nodes of a level".to_owned(),
        error_of: "|sum / 1e12 - 1|".to_owned(),
        inputs: counts.len() as u64,
        naive: Form::new("sum in f32", (f64::from(in_floats) / MOST as f64 - 1.0).abs()),
        stable: Form::new("sum in 64-bit integers", in_integers.abs_diff(MOST) as f64 / MOST as f64),
        tolerance: 0.0,
    })
}
