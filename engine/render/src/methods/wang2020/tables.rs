//! The tables that materials look up, and the passes that fill them: accumulated P, prefiltered environment, quadtree.

use super::ALPHAS;
use crate::environment_tables::EnvironmentTables;
use crate::kept::{Inputs, Kept};
use crate::methods::GlintMaterial;
use crate::methods::dpf::{self, AccumulatedKey, DpfSource};
use crate::methods::shared::{Shared, Wanted};
use crate::settings::Value;
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_shaders::{constants as c, prefilter, prefilter_probability, quadtree};

const PREFILTER_ENTRIES: u64 =
    (c::PREFILTER_THETA_N * c::PREFILTER_PHI_N * c::PREFILTER_THETA_O * c::PREFILTER_PHI_O) as u64;

/// What a prefiltered table depends on.
#[derive(Clone, Copy, PartialEq)]
struct PrefilteredKey {
    accumulated: AccumulatedKey,
    samples: f64,
    /// Whether P-hat is in closed form.
    closed: bool,
    /// Which of the maps there have been.
    environment: u64,
}

/// What a quadtree depends on: flakes, seed, depth.
type QuadtreeKey = (u64, u32, u32);

/// Counts of flakes.
pub(super) struct Quadtree {
    pub nodes: Buffer,
    pub bounds: Buffer,
}

/// All tables of the method.
pub(super) struct Tables {
    accumulated: Shared<AccumulatedKey, Buffer>,
    prefiltered: Shared<PrefilteredKey, Buffer>,
    quadtrees: Shared<QuadtreeKey, Quadtree>,
    /// Stands for a prefiltered table where there is no environment: shaders bind it but do not read it.
    no_environment: Buffer,
}

/// The tables that one material uses.
pub(super) struct Used<'a> {
    pub accumulated: &'a Buffer,
    pub prefiltered: &'a Buffer,
    pub quadtree: &'a Quadtree,
}

impl Default for Tables {
    fn default() -> Self {
        Self {
            accumulated: Shared::default(),
            prefiltered: Shared::default(),
            quadtrees: Shared::default(),
            no_environment: Buffer::new("prefiltered_absent", 16, Lifetime::Scene),
        }
    }
}

impl Tables {
    /// Those of a material.
    pub fn of(&self, material: &GlintMaterial) -> Option<Used<'_>> {
        Some(Used {
            accumulated: self.accumulated.of(material)?,
            prefiltered: self.prefiltered.of(material).unwrap_or(&self.no_environment),
            quadtree: self.quadtrees.of(material)?,
        })
    }

    /// Declares the passes of every table that these materials use and that is not there.
    pub fn update(
        &mut self,
        (g, kept): (&mut Graph, &mut Kept),
        materials: &[GlintMaterial],
        key: impl Fn(&GlintMaterial) -> AccumulatedKey,
        dpf: &Shared<DpfSource, Buffer>,
        environment: &EnvironmentTables,
    ) {
        self.accumulated.update(
            materials,
            |material| Some(key(material)),
            |wanted| {
                let table = dpf.get(wanted.key.2)?;
                Some(dpf::accumulated(g, wanted, (&ALPHAS, table)))
            },
        );
        let prefiltered = |material: &GlintMaterial| {
            environment.is_simulated().then(|| PrefilteredKey {
                accumulated: key(material),
                samples: material.values.number("samples"),
                closed: material.values.word("p_hat") == "closed",
                environment: environment.generation(),
            })
        };
        self.prefiltered.update(materials, prefiltered, |wanted| {
            let accumulated = self.accumulated.get(wanted.key.accumulated)?;
            Some(prefilter((g, kept), wanted, accumulated, environment))
        });
        let quadtree = |material: &GlintMaterial| {
            let [seed, depth] = ["seed", "depth"].map(|key| material.values.number(key) as u32);
            Some((material.flakes(), seed, depth))
        };
        self.quadtrees.update(materials, quadtree, |wanted| Some(split(g, wanted)));
    }
}

fn prefilter(
    (g, kept): (&mut Graph, &mut Kept),
    wanted: Wanted<PrefilteredKey, Buffer>,
    accumulated: &Buffer,
    environment: &EnvironmentTables,
) -> Buffer {
    let PrefilteredKey { accumulated: (alpha, ..), samples, closed, .. } = wanted.key;
    let change = match wanted.before {
        Some(before) if before.environment != wanted.key.environment => "the environment changed",
        Some(before) if before.accumulated != wanted.key.accumulated => "P(i, o, gamma) changed",
        Some(before) if before.samples != samples => "the number of samples changed",
        Some(_) => "P-hat changed",
        None => "first frame under this environment",
    };
    wanted.because(g, change);
    let directions = c::PREFILTER_THETA_O * c::PREFILTER_PHI_O;
    let of_probability = prefilter_probability::Params {
        alpha: alpha as f32,
        sin2_half_gamma: wanted.material.sin2_half_gamma() as f32,
        closed: u32::from(closed),
    };
    let params = prefilter::Params { alpha: alpha as f32, samples: samples as u32 };
    // P is made from these, by the shaders.
    let made = |inputs: Inputs| dpf::made_by(inputs.and(format_args!("{:?}", wanted.key.accumulated)), &ALPHAS);
    let inputs = environment.inputs().map(made);
    let new = || Buffer::new("prefiltered", PREFILTER_ENTRIES * 16, Lifetime::Settings);
    kept.table(g, inputs, wanted.spare.unwrap_or_else(new), |g, prefiltered| {
        let mut probability = g.buffer("prefilter_probability", u64::from(directions) * 4);
        let bind = prefilter_probability::Bind { accumulated, probability: &mut probability };
        g.pass(bind, of_probability, Extent::line(directions));
        let bind =
            prefilter::Bind { environment: environment.map(), probability: &probability, accumulated, prefiltered };
        let rows = c::PREFILTER_THETA_N * c::PREFILTER_PHI_N * c::PREFILTER_THETA_O;
        g.pass(bind, params, Extent::new(c::PREFILTER_PHI_O, rows));
    })
}

/// Nodes of a quadtree with leaves at this level.
fn node_count(depth: u32) -> u64 {
    ((1u64 << (2 * (depth + 1))) - 1) / 3
}

fn split(g: &mut Graph, wanted: Wanted<QuadtreeKey, Quadtree>) -> Quadtree {
    let (flakes, seed, depth) = wanted.key;
    let change = match wanted.before {
        Some((before, _, _)) if before != flakes => format!("count is now {}", Value::Number(flakes as f64)),
        Some((_, before, _)) if before != seed => format!("seed is now {seed}"),
        Some(_) => format!("depth is now {depth}"),
        None => format!("first frame with {} flakes", Value::Number(flakes as f64)),
    };
    wanted.because(g, change);
    let bytes = node_count(depth) * 16;
    let new = || Quadtree {
        nodes: Buffer::new("quadtree_nodes", bytes, Lifetime::Settings),
        bounds: Buffer::new("quadtree_bounds", bytes, Lifetime::Settings),
    };
    let mut quadtree = wanted.spare.filter(|spare| spare.nodes.bytes() == bytes).unwrap_or_else(new);
    for level in 0..depth {
        let params = quadtree::Params { level, depth, flakes: flakes as f32, seed };
        let bind = quadtree::Bind { nodes: &mut quadtree.nodes, bounds: &mut quadtree.bounds };
        g.pass(bind, params, Extent::line(1 << (2 * level)));
    }
    quadtree
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
