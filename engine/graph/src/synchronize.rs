//! The steps of a plan: its passes, and between them the barriers that their conflicts ask for.

use crate::declare::{Pass, Use};
use crate::plan::{Barrier, Step, Usage};
use crate::resource::{Description, Lifetime, ResourceId};
use crate::shader::Access;
use std::collections::BTreeMap;

/// Puts before each pass at most one barrier. It answers the conflicts of the pass with earlier ones, except those that
///
/// - one barrier between the two passes answers already, or
/// - a third pass between them settles by writing bytes of both: it waited for the one, and the other waits for it.
///
/// So every barrier is needed, and so is each stage and access in it.
///
/// Leaving the undefined state writes an image's bytes *in* the barrier: no earlier barrier can hold that back, so this
/// one names the earlier users of those bytes, and the pass that follows waits for it.
pub(crate) fn synchronize(passes: &[Pass], resources: &[Usage]) -> Vec<Step> {
    let history = History::new(passes, resources);
    let mut barriers: Vec<(usize, Barrier)> = Vec::new();
    let mut steps = Vec::new();
    for (position, pass) in passes.iter().enumerate() {
        let mut barrier = Barrier::default();
        let mut discard = Vec::new();
        for later in &pass.uses {
            let begins = begins_undefined(&resources[history.index_of[&later.resource.id]], position);
            if begins {
                discard.push(later.resource.id);
                barrier.to_stages = barrier.to_stages | later.stages;
                barrier.to_access.insert(later.access);
            }
            let is_answered = |before: usize, earlier: &Use| {
                let covers = |(at, barrier): &(usize, Barrier)| *at > before && barrier.covers(earlier, later);
                !begins && (!conflict(earlier, later) || barriers.iter().any(covers))
            };
            for mut unanswered in history.unsettled(position, later) {
                unanswered.retain(|(before, earlier)| !is_answered(*before, earlier));
                for (_, earlier) in &unanswered {
                    barrier.order(earlier, later);
                }
                let reason = reason(passes, &unanswered, position, later);
                barrier.why.extend(reason.filter(|it| !barrier.why.contains(it)));
            }
        }
        if !discard.is_empty() || !barrier.why.is_empty() {
            barriers.push((position, barrier.clone()));
            steps.push(Step::Synchronize { barrier, discard });
        }
        steps.push(Step::Run(position));
    }
    steps
}

/// Who uses which bytes when.
struct History<'a> {
    index_of: BTreeMap<ResourceId, usize>,
    /// For each resource, all its uses with their passes, in order.
    uses: Vec<Vec<(usize, &'a Use)>>,
    /// For each resource, which have a byte in common with it, itself among them.
    overlapping: Vec<Vec<usize>>,
}

impl<'a> History<'a> {
    fn new(passes: &'a [Pass], resources: &[Usage]) -> Self {
        let index_of: BTreeMap<ResourceId, usize> =
            resources.iter().enumerate().map(|(index, usage)| (usage.resource.id, index)).collect();
        let mut uses = vec![Vec::new(); resources.len()];
        for (position, pass) in passes.iter().enumerate() {
            for used in &pass.uses {
                uses[index_of[&used.resource.id]].push((position, used));
            }
        }
        let overlapping = resources.iter().map(|usage| indices_overlapping(usage, resources)).collect();
        Self { index_of, uses, overlapping }
    }

    /// The uses before `position` that no pass in between settles with `later`; a list for each resource.
    fn unsettled(&self, position: usize, later: &Use) -> Vec<Vec<(usize, &'a Use)>> {
        let near = &self.overlapping[self.index_of[&later.resource.id]];
        let before = |resource: usize| self.uses[resource].iter().copied().filter(move |(pass, _)| *pass < position);
        let last_write = |resource: usize| before(resource).rfind(|(_, used)| used.access.writes());
        let unsettled = |&resource: &usize| {
            let near_both = near.iter().filter(|other| self.overlapping[resource].contains(other));
            let settled = near_both.filter_map(|&other| last_write(other)).map(|(pass, _)| pass).max().unwrap_or(0);
            before(resource).filter(|(pass, _)| *pass >= settled).collect()
        };
        near.iter().map(unsettled).collect()
    }
}

impl Barrier {
    /// Whether `earlier` is over and its writes are visible when `later` begins, if the barrier lies between them.
    fn covers(&self, earlier: &Use, later: &Use) -> bool {
        let ordered = self.from_stages.contains(earlier.stages) && self.to_stages.contains(later.stages);
        let visible = self.from_access.contains(&earlier.access) && self.to_access.contains(&later.access);
        ordered && (visible || !earlier.access.writes())
    }

    /// Widens the barrier until it [`covers`](Self::covers) the two. Write after read needs no memory made visible.
    fn order(&mut self, earlier: &Use, later: &Use) {
        self.from_stages = self.from_stages | earlier.stages;
        self.to_stages = self.to_stages | later.stages;
        if earlier.access.writes() {
            self.from_access.insert(earlier.access);
            self.to_access.insert(later.access);
        }
    }
}

/// The rule, for two uses whose bytes overlap.
fn conflict(earlier: &Use, later: &Use) -> bool {
    earlier.access.writes() || later.access.writes()
}

/// The resources with a byte in common with `usage`, itself among them.
fn indices_overlapping(usage: &Usage, resources: &[Usage]) -> Vec<usize> {
    let overlaps = |other: &Usage| match (usage.placement, other.placement) {
        _ if usage.resource.id == other.resource.id => true,
        (Some(a), Some(b)) => a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes,
        _ => false,
    };
    (0..resources.len()).filter(|&index| overlaps(&resources[index])).collect()
}

/// Whether the pass is the first to touch an image that has no content yet.
fn begins_undefined(usage: &Usage, pass: usize) -> bool {
    let is_image = matches!(usage.resource.description, Description::Image(_));
    is_image && usage.resource.lifetime == Lifetime::Frame && usage.passes.0 == pass
}

/// `radiance: glints writes, blur reads`, or `radiance in the bytes of depth: shade reads, blur writes`.
fn reason(passes: &[Pass], earlier: &[(usize, &Use)], pass: usize, later: &Use) -> Option<String> {
    let (_, first) = earlier.first()?;
    let mut what = later.resource.name.clone();
    if first.resource.id != later.resource.id {
        what = format!("{what} in the bytes of {}", first.resource.name);
    }
    let uses = earlier.iter().copied().chain([(pass, later)]);
    let mut parts: Vec<String> =
        uses.map(|(pass, used)| format!("{} {}", passes[pass].name, verb(used.access))).collect();
    parts.dedup();
    Some(format!("{what}: {}", parts.join(", ")))
}

fn verb(access: Access) -> &'static str {
    match (access.reads(), access.writes()) {
        (true, true) => "updates",
        (_, true) => "writes",
        _ => "reads",
    }
}
