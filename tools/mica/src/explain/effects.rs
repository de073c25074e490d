//! The effects of a frame: what calls for each, and for those that are left out, what they would cost.

use crate::error::Failure;
use crate::measure;
use crate::session::Session;
use mica_gpu::Timing;
use mica_graph::{Effects, Plan, ResourceId};
use mica_render::{Effect, OcclusionBackend};
use serde::Serialize;
use std::collections::BTreeMap;

/// Frames that are measured in a turn, after one that builds tables and one that warms up.
const FRAMES: usize = 5;
/// Turns, with frames as they are between those with an effect.
const TURNS: usize = 3;

/// Something that a frame may simulate.
#[derive(Serialize)]
pub struct EffectReport {
    pub what: &'static str,
    pub called_for: bool,
    /// What calls for it, or why nothing does.
    pub why: String,
    /// Of what is left out: what the same frame would cost with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub would_cost: Option<CostReport>,
}

/// What a frame would cost beyond what it does.
#[derive(Serialize)]
pub struct CostReport {
    /// Passes, each as often as it would run: in the first frame, and in all later ones.
    pub first_passes: BTreeMap<String, usize>,
    pub later_passes: BTreeMap<String, usize>,
    /// Bytes of tables and of what frames share.
    pub bytes: u64,
    /// Nanoseconds a frame, the median of turns with less that of turns without; where it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ns: Option<i64>,
}

/// Every effect that there is. Costs are reckoned from plans; times only if `measured`, by frames.
pub fn report(session: &mut Session, measured: bool) -> Result<Vec<EffectReport>, Failure> {
    let occlusion = session.renderer.occlusion() != OcclusionBackend::None;
    let list = session.renderer.census().effect_list(occlusion);
    let mut reports = Vec::new();
    for Effect { what, bit, called_for, why } in list {
        let would_cost = if called_for { None } else { Some(cost(session, bit, measured)?) };
        reports.push(EffectReport { what, called_for, why, would_cost });
    }
    Ok(reports)
}

fn cost(session: &mut Session, effect: Effects, measured: bool) -> Result<CostReport, Failure> {
    let without = plan(session, Effects::NONE)?;
    let first = plan(session, effect)?;
    let later = plan(session, effect)?;
    let mut report = CostReport {
        first_passes: more(&passes(&first), &passes(&without)),
        later_passes: more(&passes(&later), &passes(&without)),
        bytes: bytes(&first).saturating_sub(bytes(&without)),
        ns: None,
    };
    if measured {
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..TURNS {
            for (effect, times) in [Effects::NONE, effect].into_iter().zip(&mut times) {
                times.extend(frames(session, effect)?);
            }
        }
        let [without, with] = times.map(|times| measure::median(&times));
        report.ns = with.zip(without).map(|(with, without)| with.cast_signed() - without.cast_signed());
    }
    session.renderer.simulate(Effects::NONE);
    Ok(report)
}

/// The plan of the next frame with an effect. It is not run.
fn plan(session: &mut Session, effect: Effects) -> Result<Plan, Failure> {
    session.renderer.simulate(effect);
    let declared = session.declare(None)?;
    Ok(session.executor.plan(declared.graph)?)
}

fn passes(plan: &Plan) -> BTreeMap<String, usize> {
    let mut passes = BTreeMap::new();
    for pass in &plan.passes {
        *passes.entry(pass.name.clone()).or_insert(0) += 1;
    }
    passes
}

/// What there is more of.
fn more(with: &BTreeMap<String, usize>, without: &BTreeMap<String, usize>) -> BTreeMap<String, usize> {
    let beyond = |(name, count): (&String, &usize)| {
        let more = count.saturating_sub(without.get(name).copied().unwrap_or(0));
        (more > 0).then(|| (name.clone(), more))
    };
    with.iter().filter_map(beyond).collect()
}

/// Bytes of a frame: what its passes share, and each table and each part of the scene that they use.
pub fn bytes(plan: &Plan) -> u64 {
    let kept: BTreeMap<ResourceId, u64> = plan
        .resources
        .iter()
        .filter(|usage| usage.placement.is_none())
        .map(|usage| (usage.resource.id, usage.bytes))
        .collect();
    plan.shared_bytes + kept.values().sum::<u64>()
}

fn frames(session: &mut Session, effect: Effects) -> Result<Vec<u64>, Failure> {
    session.renderer.simulate(effect);
    let mut times = Vec::new();
    for frame in 0..FRAMES + 2 {
        let shot = session.frame(None, Timing::Overlapped, false)?;
        times.extend(shot.run.frame_ns.filter(|_| frame >= 2));
    }
    Ok(times)
}

impl CostReport {
    /// In words.
    pub fn text(&self) -> String {
        let names = |passes: &BTreeMap<String, usize>| {
            let named =
                passes.iter().map(|(name, count)| if *count > 1 { format!("{name} x{count}") } else { name.clone() });
            named.collect::<Vec<_>>().join(", ")
        };
        let once: BTreeMap<String, usize> = more(&self.first_passes, &self.later_passes);
        let mut parts = Vec::new();
        if !once.is_empty() {
            parts.push(format!("{} once", names(&once)));
        }
        if !self.later_passes.is_empty() {
            parts.push(format!("{} every frame", names(&self.later_passes)));
        }
        if self.bytes > 0 {
            parts.push(crate::table::bytes(self.bytes));
        }
        if let Some(ns) = self.ns {
            parts.push(format!("{:+.3} ms a frame", ns as f64 / 1e6));
        }
        if parts.is_empty() { "code in shaders and nothing else".to_owned() } else { parts.join("; ") }
    }
}
