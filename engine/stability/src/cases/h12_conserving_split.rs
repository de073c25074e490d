//! H12. Multinomial splits that lose no flake.

use super::quarters::{Node, quarters};
use crate::{Check, Form, Laboratory, StabilityError, bits};
use mica_graph::{Buffer, Graph};

const ROOT: Node = Node { flakes: 1_000_000, level: 0, x: 0, y: 0, visit: 0 };

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![kept(laboratory)?, parts(laboratory)?])
}

/// The nodes of one level below those given, breadth first; `within` says which nodes are looked at. Nodes are numbered in
/// the order in which they are split.
fn expand(
    laboratory: &mut Laboratory,
    level: u32,
    within: impl Fn(&Node) -> bool,
    declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32) + Copy,
) -> Result<Vec<Node>, StabilityError> {
    let mut nodes = vec![ROOT];
    let mut visits = 0;
    for _ in 0..level {
        for node in &mut nodes {
            node.visit = visits;
            visits += 1;
        }
        let counts = quarters(laboratory, &nodes, 4, declare)?;
        nodes = nodes.iter().zip(counts).flat_map(|(node, counts)| node.children(counts)).filter(&within).collect();
    }
    Ok(nodes)
}

fn flakes(nodes: &[Node]) -> u64 {
    nodes.iter().map(|node| node.flakes).sum()
}

/// What is left of the flakes in the leaves.
fn kept(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let level = laboratory.inputs(9, 11) as u32;
    let lost = |nodes: &[Node]| flakes(nodes).abs_diff(ROOT.flakes) as f64 / ROOT.flakes as f64;
    let naive = expand(laboratory, level, |_| true, bits!(quarters_truncated))?;
    let stable = expand(laboratory, level, |_| true, bits!(quarters_hashed))?;
    Ok(Check {
        what: format!("1e6 flakes, split down to level {level}"),
        error_of: "share of them that is lost".to_owned(),
        inputs: stable.len() as u64,
        naive: Form::new("uint(n / 4) each", lost(&naive)),
        stable: Form::new("halves of whole numbers", lost(&stable)),
        tolerance: 0.0,
    })
}

/// A region looked at on its own, against the same region as a part of the whole.
fn parts(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const LEVEL: u32 = 5;
    const REGIONS: u32 = 2; // Level of their nodes.
    let inside = |node: &Node, [x, y]: [u32; 2]| {
        if node.level < REGIONS {
            let shift = REGIONS - node.level;
            (x >> shift, y >> shift) == (node.x, node.y)
        } else {
            let shift = node.level - REGIONS;
            (node.x >> shift, node.y >> shift) == (x, y)
        }
    };
    let mut worst = |declare: &dyn Fn(&mut Graph, &Buffer, &mut Buffer, u32)| -> Result<f64, StabilityError> {
        let whole = expand(laboratory, LEVEL, |_| true, declare)?;
        let mut worst = 0.0_f64;
        for region in (0..1 << REGIONS).flat_map(|x| (0..1 << REGIONS).map(move |y| [x, y])) {
            let alone = flakes(&expand(laboratory, LEVEL, |node| inside(node, region), declare)?);
            let part: Vec<Node> = whole.iter().filter(|node| inside(node, region)).copied().collect();
            worst = worst.max(alone.abs_diff(flakes(&part)) as f64);
        }
        Ok(worst)
    };
    Ok(Check {
        what: "flakes of a sixteenth of the square, looked at alone and as a part of all of it".to_owned(),
        error_of: "difference in flakes".to_owned(),
        inputs: 1 << (2 * REGIONS),
        naive: Form::new("random numbers by the order of splits", worst(&bits!(quarters_by_visit))?),
        stable: Form::new("random numbers by a node's level and place", worst(&bits!(quarters_hashed))?),
        tolerance: 0.0,
    })
}
