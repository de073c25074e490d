//! Plans broken in one place: each is found.

use crate::contents::{Order, as_declared, as_planned};
use crate::frames::{Frame, requirements};
use crate::random::Random;
use crate::rules::faults;
use mica_graph::{Access, Barrier, Plan, ResourceId, Stages, Step, Usage};
use std::collections::BTreeSet;

/// Breaks a plan in one place, if it has such a place.
type Mutation = fn(&mut Plan, &mut Random) -> bool;

/// Breaks the plans of 2,000 frames. The rules must find every fault: each barrier, stage and access of a plan is there
/// because a conflict needs it, so that a plan is as small as it is sufficient. Returns the percentage of the broken
/// plans that also compute something else when executed as late as they allow.
fn percent_seen_in_contents(mutation: Mutation) -> u32 {
    let (mut applied, mut seen) = (0, 0);
    for seed in 0..2_000 {
        let frame = Frame::random(seed);
        let mut plan = frame.plan();
        if !mutation(&mut plan, &mut Random::new(seed)) {
            continue;
        }
        applied += 1;
        let found = !faults(&frame, &plan).is_empty();
        assert!(found, "frame {seed}: the rules allow\n{plan}\nwhich was broken from\n{}", frame.plan());
        let declared = as_declared(&frame);
        let same = [Order::Latest, Order::Any(seed)]
            .into_iter()
            .all(|order| as_planned(&frame, &plan, order).as_ref() == Ok(&declared));
        seen += u32::from(!same);
    }
    assert!(applied > 1_000, "{applied} frames are too few to show anything");
    seen * 100 / applied
}

fn barriers(plan: &mut Plan) -> Vec<(&mut Barrier, &mut Vec<ResourceId>)> {
    let barriers = plan.steps.iter_mut().filter_map(|step| match step {
        Step::Synchronize { barrier, discard } => Some((barrier, discard)),
        Step::Run(_) => None,
    });
    barriers.collect()
}

/// Takes one element out of a set; false if there is none.
fn drop_access(set: &mut BTreeSet<Access>, random: &mut Random) -> bool {
    let chosen = random.choose(&set.iter().copied().collect::<Vec<_>>());
    chosen.is_some_and(|access| set.remove(&access))
}

fn drop_stage(stages: &mut Stages, random: &mut Random) -> bool {
    let all: Vec<Stages> = stages.iter().collect();
    let chosen = random.choose(&all);
    *stages = all.into_iter().filter(|stage| Some(*stage) != chosen).fold(Stages::NONE, Stages::union);
    chosen.is_some()
}

/// Applies `change` to one of the barriers that it can change.
fn change_one(plan: &mut Plan, random: &mut Random, change: fn(&mut Barrier, &mut Random) -> bool) -> bool {
    let mut barriers = barriers(plan);
    let start = if barriers.is_empty() { 0 } else { random.below(barriers.len()) };
    barriers.rotate_left(start);
    barriers.into_iter().any(|(barrier, _)| change(barrier, random))
}

#[test]
fn every_barrier_is_needed() {
    let seen = percent_seen_in_contents(|plan, random| {
        change_one(plan, random, |barrier, _| std::mem::take(barrier) != Barrier::default())
    });
    assert!(seen > 75, "{seen} %");
}

#[test]
fn every_stage_that_is_waited_for_is_needed() {
    let seen = percent_seen_in_contents(|plan, random| {
        change_one(plan, random, |barrier, random| drop_stage(&mut barrier.from_stages, random))
    });
    assert!(seen > 55, "{seen} %");
}

#[test]
fn every_stage_that_waits_is_needed() {
    let seen = percent_seen_in_contents(|plan, random| {
        change_one(plan, random, |barrier, random| drop_stage(&mut barrier.to_stages, random))
    });
    assert!(seen > 65, "{seen} %");
}

/// Contents show the order of things only, not what a cache holds back: accesses are the rules' alone to check.
#[test]
fn every_access_is_needed() {
    percent_seen_in_contents(|plan, random| {
        change_one(plan, random, |barrier, random| drop_access(&mut barrier.from_access, random))
    });
    percent_seen_in_contents(|plan, random| {
        change_one(plan, random, |barrier, random| drop_access(&mut barrier.to_access, random))
    });
}

#[test]
fn an_image_that_is_not_begun_is_found() {
    percent_seen_in_contents(|plan, random| {
        let mut barriers = barriers(plan);
        barriers.retain(|(_, discard)| !discard.is_empty());
        let chosen = random.below(barriers.len().max(1));
        let Some((_, discard)) = barriers.get_mut(chosen) else { return false };
        discard.remove(random.below(discard.len()));
        true
    });
}

#[test]
fn an_image_that_is_begun_too_late_is_found() {
    let seen = percent_seen_in_contents(|plan, random| {
        let steps = &mut plan.steps;
        let begins = |step: &Step| matches!(step, Step::Synchronize { discard, .. } if !discard.is_empty());
        let places: Vec<usize> = (0..steps.len()).filter(|&step| begins(&steps[step])).collect();
        let Some(place) = random.choose(&places) else { return false };
        steps.swap(place, place + 1);
        true
    });
    assert!(seen > 65, "{seen} %");
}

/// Moves one resource onto another that is needed in the same pass, if only in the last pass of the one and the first of
/// the other.
#[test]
fn overlapping_resources_are_found() {
    let seen = percent_seen_in_contents(|plan, random| {
        let end = |index: usize, plan: &Plan| {
            let usage = &plan.resources[index];
            if plan.exports.contains(&usage.resource.id) { usize::MAX } else { usage.passes.1 }
        };
        let mut pairs = Vec::new();
        for a in 0..plan.resources.len() {
            for b in 0..plan.resources.len() {
                let (first, second) = (&plan.resources[a], &plan.resources[b]);
                let together = first.passes.0 <= second.passes.0 && second.passes.0 <= end(a, plan);
                if a != b && together && first.placement.is_some() && second.placement.is_some() {
                    pairs.push((a, b));
                }
            }
        }
        let Some((a, b)) = random.choose(&pairs) else { return false };
        let offset = plan.resources[a].placement.map(|place| place.offset);
        if let (Some(offset), Some(place)) = (offset, &mut plan.resources[b].placement) {
            place.offset = offset;
            plan.shared_bytes = plan.shared_bytes.max(place.offset + place.bytes);
        }
        true
    });
    assert!(seen > 75, "{seen} %");
}

#[test]
fn a_misplaced_resource_is_found() {
    percent_seen_in_contents(|plan, random| {
        let is_aligned = |usage: &Usage| requirements(&usage.resource, &usage.accesses).alignment > 1;
        let aligned: Vec<usize> = (0..plan.resources.len()).filter(|&it| is_aligned(&plan.resources[it])).collect();
        let placement = random.choose(&aligned).and_then(|it| plan.resources[it].placement.as_mut());
        placement.is_some_and(|place| {
            place.offset += 1;
            true
        })
    });
}

#[test]
fn a_pass_culled_in_error_is_found() {
    let seen = percent_seen_in_contents(|plan, random| {
        if plan.passes.is_empty() {
            return false;
        }
        let pass = random.below(plan.passes.len());
        plan.culled.push(plan.passes.remove(pass).name);
        plan.steps.retain(|step| !matches!(step, Step::Run(it) if *it == pass));
        for step in &mut plan.steps {
            if let Step::Run(it) = step {
                *it -= usize::from(*it > pass);
            }
        }
        true
    });
    assert!(seen > 90, "{seen} %");
}

#[test]
fn passes_in_another_order_are_found() {
    let seen = percent_seen_in_contents(|plan, random| {
        let runs: Vec<usize> = (0..plan.steps.len()).filter(|&it| matches!(plan.steps[it], Step::Run(_))).collect();
        if runs.len() < 2 {
            return false;
        }
        let first = random.below(runs.len() - 1);
        plan.steps.swap(runs[first], runs[first + 1]);
        true
    });
    assert!(seen > 60, "{seen} %");
}
