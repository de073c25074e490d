//! Jakob et al. 2014: "Discrete Stochastic Microfacet Models", flake by flake: the reference on the GPU.
//!
//! The model is the paper's; the flakes are those of `engine/design/0007-flake-set.md`, the same in the oracle. Each flake in
//! the footprint is tested against each light in f64, and mirrors its own cone of the environment: the texels' exact share of it,
//! and of small bright lights, as the sun is, what lies in the cone. Nothing is estimated, but:
//! - F, G and h are those of the cone's centre, as in the paper;
//! - flakes weigh 1 / (m.n), which the paper's own program leaves out;
//! - a footprint of more than `most` flakes shows what is expected of it, which is the same in the mean and has no fluctuation: P for each
//!   light, also the environment's small ones, and under the rest of it the mean over 512 normals spread evenly over their distribution;
//! - shadowing is Smith's rational fit, for flakes as for the smooth surface.
//!
//! A pixel may take more loop iterations than an invocation may: the work is split over passes, each of which goes
//! on where the last one stopped. Pixels that are finished cost hardly anything. There are as many passes as the largest footprint
//! that is walked through may need: with one light and a million flakes a square about one for each 2,000 flakes of
//! `most` (3,300 for the largest `most` in the smallest `steps`), and never more than 4,000: where these do not suffice, as
//! under many lights, the largest footprints show what is expected of them. Needs shaderInt64 and shaderFloat64.

use super::shared::{Shared, Wanted};
use super::{Claim, GlintMaterial, Method, MethodInfo, Reads, Rung, Shading, bind_glints, leaf_level};
use crate::environment_tables::EnvironmentTables;
use crate::kept::Kept;
use crate::settings::{Kind, Setting, Value};
use mica_graph::{Buffer, Extent, Graph, Image, Lifetime};
use mica_shaders::glints::flakes::{Bind, Params};
use mica_shaders::{constants as c, flake_counts, types};
use std::sync::Arc;

pub(super) const INFO: MethodInfo = MethodInfo {
    name: "flakes",
    citation: "W. Jakob, M. Hasan, L.-Q. Yan, J. Lawrence, R. Ramamoorthi, S. Marschner, Discrete Stochastic Microfacet \
               Models, ACM Transactions on Graphics 33(4), 2014",
    summary: "The reference: every flake in the footprint is looked at, and every light tested against it; a footprint \
              of more than `most` flakes shows what is expected of it, without fluctuation.",
    claim: Claim::Pixels,
    mean_between: [0.99, 1.01],
    repeats: true,
    settings: &[
        Setting {
            key: "most",
            unit: "flakes in the footprint",
            kind: Kind::Integer { min: 0, max: 1_000_000 },
            default: Value::Number(2e4),
            meaning: "A footprint of more than this shows what is expected of it; the number of passes grows with it.",
        },
        Setting {
            key: "steps",
            unit: "steps",
            kind: Kind::Integer { min: 1000, max: c::FLAKE_STEPS_A_PASS as u64 },
            default: Value::Number(c::FLAKE_STEPS_A_PASS as f64),
            meaning: "What a pixel does in one pass at most; the picture does not depend on it.",
        },
    ],
    ladder: &[
        Rung { name: "most 100", set: &[("most", "100")] },
        Rung { name: "most 2000", set: &[("most", "2000")] },
        Rung { name: "most 20000", set: &[] },
    ],
};

/// Passes that the walk is split into at most.
const MOST_PASSES: f64 = 4000.0;

/// Steps that a walk through a square footprint of `most` flakes takes, as `flake_walk_steps` reckons them.
fn most_steps(most: f64, count: u64, tests: f64) -> f64 {
    let level = leaf_level(count);
    let below = f64::from(level.saturating_sub(c::FLAKE_TABLE_LEVEL));
    let a_leaf = count as f64 / (1u64 << (2 * level)) as f64;
    let area = most / a_leaf;
    let side = area.sqrt();
    let met = area + 6.0 * side + 16.0;
    let looked_at = met * a_leaf;
    let walked = met * if below > 0.0 { 3.0 } else { 1.0 } + (side + 3.0) * (below + 1.0);
    let squares = most / (count as f64).max(1.0);
    let repeated = 1.0 + squares + 2.0 * squares.sqrt();
    let flakes = |expected: f64| expected + 6.0 * (repeated * expected).sqrt() + 16.0;
    if most > 0.0 { walked + flakes(looked_at) + tests * flakes(most) } else { 0.0 }
}

/// Flakes in a square of texture space, and their seed.
type FlakeSet = (u64, u32);

/// The method at work.
#[derive(Default)]
pub(crate) struct EveryFlake {
    /// Of the quadtree's nodes on one level.
    counts: Shared<FlakeSet, Buffer>,
}

/// Parts flakes level by level, down to leaves or to the last level that is tabulated.
fn count_flakes(g: &mut Graph, wanted: Wanted<FlakeSet, Buffer>) -> Buffer {
    let (count, seed) = wanted.key;
    let change = match wanted.before {
        Some((before, _)) if before != count => format!("count is now {}", Value::Number(count as f64)),
        Some(_) => format!("seed is now {seed}"),
        None => format!("first frame with {} flakes", Value::Number(count as f64)),
    };
    wanted.because(g, change);
    let level = leaf_level(count).min(c::FLAKE_TABLE_LEVEL);
    let bytes = |at: u32| 8 << (2 * at);
    let spare = wanted.spare.filter(|spare| spare.bytes() == bytes(level));
    let mut table = Some(spare.unwrap_or_else(|| Buffer::new("flake_counts", bytes(level), Lifetime::Settings)));
    let mut on = |g: &mut Graph, at: u32| {
        let last = table.take_if(|_| at == level);
        last.unwrap_or_else(|| g.buffer(format!("flake_counts {at}"), bytes(at)))
    };
    let mut counts = on(g, 0);
    g.upload(&mut counts, Arc::<[u8]>::from(count.to_le_bytes().as_slice()));
    for above in 0..level {
        let mut children = on(g, above + 1);
        let bind = flake_counts::Bind { parents: &counts, children: &mut children };
        g.pass(bind, flake_counts::Params { level: above, seed }, Extent::line(1 << (2 * above)));
        counts = children;
    }
    counts
}

impl Method for EveryFlake {
    fn update(
        &mut self,
        g: &mut Graph,
        _kept: &mut Kept,
        materials: &[GlintMaterial],
        _environment: &EnvironmentTables,
    ) {
        let set = |material: &GlintMaterial| Some((material.flakes(), material.values.number("seed") as u32));
        self.counts.update(materials, set, |wanted| Some(count_flakes(g, wanted)));
    }

    fn reads(&self) -> Reads {
        Reads::Cones
    }

    fn shade(&self, g: &mut Graph, material: &GlintMaterial, shading: &Shading, glints: &mut Image) {
        let half_angle_radians = material.values.number("gamma_deg").to_radians();
        let cones = shading.environment.cones(half_angle_radians);
        let Some(flake_counts) = self.counts.of(material) else { return };
        let count = material.flakes();
        let alpha = material.values.number("alpha");
        let leaf_level = leaf_level(count);
        let sin2 = material.sin2_half_gamma().to_bits();
        // The environment is one test more.
        let tests = f64::from(shading.scene.light_count) + 1.0;
        let steps = material.values.number("steps");
        let most_steps = most_steps(material.values.number("most"), count, tests).min(MOST_PASSES * steps);
        let extent = shading.gbuffer.ids.extent();
        let mut walkers = g.buffer("flake_walkers", extent.texels() * size_of::<types::Walker>() as u64);
        g.fill(&mut walkers, 0);
        let passes = (most_steps / steps).ceil().max(1.0) as u32;
        for pass in 1..=passes {
            let params = Params {
                material: material.index as u32,
                alpha: alpha as f32,
                flakes: count as f32,
                slope_deviation: (alpha / std::f64::consts::SQRT_2) as f32,
                sin2_half_gamma_low: sin2 as u32,
                sin2_half_gamma_high: (sin2 >> 32) as u32,
                seed: material.values.number("seed") as u32,
                leaf_level,
                table_level: leaf_level.min(c::FLAKE_TABLE_LEVEL),
                most_steps: most_steps as f32,
                steps: steps as u32,
                last: u32::from(pass == passes),
                small_light_count: cones.light_count,
            };
            let bind = bind_glints!(
                Bind, shading, glints,
                walkers: &mut walkers,
                environment_cone: &cones.means,
                light_rings: &cones.rings,
                small_lights: &cones.lights,
                flake_counts: flake_counts,
            );
            shading.pass(g, bind, params, material);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_levels_below_the_table_reach_all_leaves() {
        assert_eq!(leaf_level(1_000_000_000_000) - c::FLAKE_TABLE_LEVEL, c::FLAKE_LEVELS_BELOW);
    }

    #[test]
    fn passes_are_as_many_as_documented() {
        let passes = (most_steps(2e4, 1_000_000, 2.0) / f64::from(c::FLAKE_STEPS_A_PASS)).ceil();
        assert_eq!(passes, 11.0);
        let passes = (most_steps(1e6, 1_000_000, 2.0) / 1000.0).ceil();
        assert!((3300.0..3320.0).contains(&passes), "{passes}");
        assert_eq!(most_steps(0.0, 1_000_000, 2.0), 0.0);
    }
}
