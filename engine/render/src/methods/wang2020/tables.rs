//! The tables of one material, and the passes that fill them: accumulated P, prefiltered environment, quadtree.

use super::{ALPHAS, alpha};
use crate::environment_tables::EnvironmentTables;
use crate::methods::GlintMaterial;
use crate::methods::dpf::{Accumulated, AccumulatedKey, DpfSource};
use crate::settings::Value;
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_shaders::{constants as c, prefilter, prefilter_probability, quadtree};
use std::f64::consts::PI;

const PREFILTER_ENTRIES: u64 =
    (c::PREFILTER_THETA_N * c::PREFILTER_PHI_N * c::PREFILTER_THETA_O * c::PREFILTER_PHI_O) as u64;

/// What a prefiltered table depends on, beside the accumulated one: samples, and whether P-hat is in closed form. The
/// environment is a renderer's own and does not change.
type PrefilteredKey = (AccumulatedKey, f64, bool);
/// What a quadtree depends on: flakes, seed, depth.
type QuadtreeKey = (u64, f64, f64);

/// The tables of one material.
pub(super) struct Tables {
    pub accumulated: Accumulated,
    pub prefiltered: Buffer,
    prefiltered_for: Option<PrefilteredKey>,
    pub nodes: Buffer,
    pub bounds: Buffer,
    quadtree_for: Option<QuadtreeKey>,
}

/// Nodes of a quadtree with leaves at this level.
fn node_count(depth: u32) -> u64 {
    ((1u64 << (2 * (depth + 1))) - 1) / 3
}

fn table(what: &str, material: &str, bytes: u64) -> Buffer {
    Buffer::new(format!("{what} {material}"), bytes, Lifetime::Settings)
}

impl Tables {
    /// Tables that the first update fills. Without an environment there is nothing to prefilter.
    pub fn new(material: &str, environment: bool) -> Self {
        Self {
            accumulated: Accumulated::new(material),
            prefiltered: table("prefilter", material, if environment { PREFILTER_ENTRIES * 16 } else { 16 }),
            prefiltered_for: None,
            nodes: table("quadtree_nodes", material, 16),
            bounds: table("quadtree_bounds", material, 16),
            quadtree_for: None,
        }
    }

    /// Declares the passes of every table that something changed for.
    pub fn update(
        &mut self,
        g: &mut Graph,
        material: &GlintMaterial,
        (source, dpf): (DpfSource, &Buffer),
        environment: &EnvironmentTables,
    ) {
        let accumulated = self.accumulated.update(g, material, alpha(material), (source, &ALPHAS, dpf));
        let closed = material.values.word("p_hat") == "closed";
        let prefiltered = (accumulated, material.values.number("samples"), closed);
        if environment.present() && self.prefiltered_for != Some(prefiltered) {
            self.prefilter(g, material, prefiltered, environment);
        }
        let quadtree = (material.flakes(), material.values.number("seed"), material.values.number("depth"));
        if self.quadtree_for != Some(quadtree) {
            self.split(g, material, quadtree);
        }
    }

    fn prefilter(
        &mut self,
        g: &mut Graph,
        material: &GlintMaterial,
        key: PrefilteredKey,
        environment: &EnvironmentTables,
    ) {
        let (accumulated, samples, closed) = key;
        let change = match self.prefiltered_for {
            Some((before, ..)) if before != accumulated => "P(i, o, gamma) changed",
            Some((_, before, _)) if before != samples => "the number of samples changed",
            Some(_) => "P-hat changed",
            None => "first frame under this environment",
        };
        g.because(format!("material {}: {change}", material.name));
        let directions = c::PREFILTER_THETA_O * c::PREFILTER_PHI_O;
        let mut probability = g.buffer("prefilter_probability", u64::from(directions) * 4);
        let bind = prefilter_probability::Bind { accumulated: &self.accumulated.table, probability: &mut probability };
        let params = prefilter_probability::Params {
            alpha: accumulated.0 as f32,
            sin2_half_gamma: (material.solid_angle() / (4.0 * PI)) as f32,
            closed: u32::from(closed),
        };
        g.pass(bind, params, Extent::line(directions));
        let params = prefilter::Params { alpha: accumulated.0 as f32, samples: samples as u32 };
        let bind = prefilter::Bind {
            environment: environment.map(),
            probability: &probability,
            accumulated: &self.accumulated.table,
            prefiltered: &mut self.prefiltered,
        };
        let rows = c::PREFILTER_THETA_N * c::PREFILTER_PHI_N * c::PREFILTER_THETA_O;
        g.pass(bind, params, Extent::new(c::PREFILTER_PHI_O, rows));
        self.prefiltered_for = Some(key);
    }

    fn split(&mut self, g: &mut Graph, material: &GlintMaterial, key: QuadtreeKey) {
        let (flakes, seed, depth) = (key.0, key.1, key.2 as u32);
        let change = match self.quadtree_for {
            Some((before, _, _)) if before != flakes => format!("count is now {}", Value::Number(flakes as f64)),
            Some((_, before, _)) if before != seed => format!("seed is now {seed}"),
            Some(_) => format!("depth is now {depth}"),
            None => format!("first frame with {} flakes", Value::Number(flakes as f64)),
        };
        g.because(format!("material {}: {change}", material.name));
        let bytes = node_count(depth) * 16;
        if self.nodes.bytes() != bytes {
            self.nodes = table("quadtree_nodes", &material.name, bytes);
            self.bounds = table("quadtree_bounds", &material.name, bytes);
        }
        for level in 0..depth {
            let params = quadtree::Params { level, depth, flakes: flakes as f32, seed: seed as u32 };
            let bind = quadtree::Bind { nodes: &mut self.nodes, bounds: &mut self.bounds };
            g.pass(bind, params, Extent::line(1 << (2 * level)));
        }
        self.quadtree_for = Some(key);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadtree_of_the_paper_fits_the_guaranteed_range() {
        assert_eq!(node_count(11), 5_592_405);
        assert!(node_count(11) * 16 <= 1 << 27);
    }
}
