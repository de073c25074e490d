//! Nodes of a quadtree of flakes, split on a device.

use crate::{Laboratory, StabilityError};
use mica_graph::{Buffer, Graph};
use mica_shaders::types::Words;

/// A node that is split.
#[derive(Clone, Copy)]
pub struct Node {
    /// Flakes in it.
    pub flakes: u64,
    /// Its level, the root's being 0.
    pub level: u32,
    /// Its column on it.
    pub x: u32,
    /// Its row on it.
    pub y: u32,
    /// How many were split before.
    pub visit: u32,
}

impl Node {
    /// Its children, who have so many flakes.
    pub fn children(&self, flakes: [u64; 4]) -> [Self; 4] {
        let child = |at: u32| Self {
            flakes: flakes[at as usize],
            level: self.level + 1,
            x: 2 * self.x + (at & 1),
            y: 2 * self.y + (at >> 1),
            visit: 0,
        };
        [0, 1, 2, 3].map(child)
    }
}

/// The flakes of each node's four children by a rung of `rungs/bits` of the name `quarters_*`.
pub fn quarters(
    laboratory: &mut Laboratory,
    nodes: &[Node],
    seed: u32,
    declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32) + Copy,
) -> Result<Vec<[u64; 4]>, StabilityError> {
    let questions = |word: u32| -> Vec<Words> {
        let question = |node: &Node| Words {
            a: [node.flakes as u32, (node.flakes >> 32) as u32, node.x, node.y],
            b: [node.level, seed, word, node.visit],
        };
        nodes.iter().map(question).collect()
    };
    let low = laboratory.words(&questions(0), declare)?;
    let high = laboratory.words(&questions(1), declare)?;
    let whole = |(low, high): ([u32; 4], [u32; 4])| -> [u64; 4] {
        std::array::from_fn(|at| u64::from(low[at]) | u64::from(high[at]) << 32)
    };
    Ok(low.into_iter().zip(high).map(whole).collect())
}
