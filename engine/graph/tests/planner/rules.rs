//! The rules of a plan, checked one pair at a time, without a thought for speed and without a line of the planner's.

use crate::frames::{Frame, requirements};
use mica_graph::{Access, Barrier, Description, Lifetime, Plan, ResourceId, Step, Usage, Use, Work};
use std::collections::BTreeSet;

/// Every way in which `plan` is not a plan of `frame`.
pub fn faults(frame: &Frame, plan: &Plan) -> Vec<String> {
    let mut faults = Vec::new();
    check_passes(frame, plan, &mut faults);
    check_steps(plan, &mut faults);
    check_resources(plan, &mut faults);
    check_placements(plan, &mut faults);
    if faults.is_empty() {
        check_barriers(plan, &mut faults);
        check_discards(plan, &mut faults);
    }
    faults
}

/// Whose content each read sees, asked forwards from what is wanted: the planner's culling walks the other way.
pub fn needed(frame: &Frame) -> BTreeSet<usize> {
    let passes = &frame.passes;
    let writers_seen_from = |end: usize, resource: ResourceId| {
        let mut writers = Vec::new();
        for (index, pass) in passes[..end].iter().enumerate().rev() {
            let writing = pass.uses.iter().find(|used| used.resource.id == resource && used.access.writes());
            writers.extend(writing.map(|_| index));
            // A planner cannot know how much of a storage image a shader writes.
            let storage = |used: &Use| matches!(used.access, Access::StorageWrite | Access::StorageReadWrite);
            if writing.is_some_and(|used| frame.replaces_all(pass, used) && !storage(used)) {
                break;
            }
        }
        writers
    };
    let outlives = |used: &Use| used.access.writes() && used.resource.lifetime != Lifetime::Frame;
    let is_root = |index: &usize| {
        matches!(passes[*index].work, Work::Download { .. }) || passes[*index].uses.iter().any(outlives)
    };
    let mut wanted: Vec<usize> = (0..passes.len()).filter(is_root).collect();
    wanted.extend(frame.exports.iter().flat_map(|&export| writers_seen_from(passes.len(), export)));
    let mut needed = BTreeSet::new();
    while let Some(index) = wanted.pop() {
        if needed.insert(index) {
            let reads = passes[index].uses.iter().filter(|used| used.access.reads());
            wanted.extend(reads.flat_map(|used| writers_seen_from(index, used.resource.id)));
        }
    }
    needed
}

fn check_passes(frame: &Frame, plan: &Plan, faults: &mut Vec<String>) {
    let needed = needed(frame);
    let names = |wanted: bool| -> Vec<&str> {
        let passes = frame.passes.iter().enumerate().filter(|(index, _)| needed.contains(index) == wanted);
        passes.map(|(_, pass)| pass.name.as_str()).collect()
    };
    let kept: Vec<&str> = plan.passes.iter().map(|pass| pass.name.as_str()).collect();
    if kept != names(true) {
        faults.push(format!("kept {kept:?}, needed {:?}", names(true)));
    }
    if plan.culled != names(false) {
        faults.push(format!("culled {:?}, not needed {:?}", plan.culled, names(false)));
    }
}

fn check_steps(plan: &Plan, faults: &mut Vec<String>) {
    let runs = plan.steps.iter().filter_map(|step| if let Step::Run(pass) = step { Some(*pass) } else { None });
    if !runs.eq(0..plan.passes.len()) {
        faults.push("the passes do not run once each in their order".into());
    }
    for (index, step) in plan.steps.iter().enumerate() {
        let followed = matches!(plan.steps.get(index + 1), Some(Step::Run(_)));
        if matches!(step, Step::Synchronize { .. }) && !followed {
            faults.push(format!("step {index} synchronizes, but no pass follows"));
        }
    }
}

fn check_resources(plan: &Plan, faults: &mut Vec<String>) {
    let mut used = Vec::new();
    for (index, it) in
        plan.passes.iter().enumerate().flat_map(|(index, pass)| pass.uses.iter().map(move |it| (index, it)))
    {
        if !used.contains(&it.resource.id) {
            used.push(it.resource.id);
        }
        let Some(usage) = plan.resources.iter().find(|usage| usage.resource.id == it.resource.id) else {
            faults.push(format!("{} is not listed", it.resource.name));
            continue;
        };
        if !usage.accesses.contains(&it.access) {
            faults.push(format!("{}: {:?} is not listed", it.resource.name, it.access));
        }
        if index < usage.passes.0 || usage.passes.1 < index {
            faults.push(format!("{}: pass {index} is outside of {:?}", it.resource.name, usage.passes));
        }
    }
    if !plan.resources.iter().map(|usage| usage.resource.id).eq(used) {
        faults.push("resources are not listed once each in order of first use".into());
    }
    for usage in &plan.resources {
        let uses = |pass: usize| {
            plan.passes.get(pass).is_some_and(|it| it.uses.iter().any(|used| used.resource.id == usage.resource.id))
        };
        if !uses(usage.passes.0) || !uses(usage.passes.1) {
            faults.push(format!("{} is not used at the ends of {:?}", usage.resource.name, usage.passes));
        }
    }
}

fn check_placements(plan: &Plan, faults: &mut Vec<String>) {
    let mut total = 0;
    let mut placed = Vec::new();
    for usage in &plan.resources {
        let name = &usage.resource.name;
        match usage.placement {
            None if usage.resource.lifetime == Lifetime::Frame => faults.push(format!("{name} is placed nowhere")),
            Some(_) if usage.resource.lifetime != Lifetime::Frame => {
                faults.push(format!("{name} is not the frame's to place"))
            }
            None => {}
            Some(place) => {
                let wanted = requirements(&usage.resource, &usage.accesses);
                if place.bytes != wanted.bytes || !place.offset.is_multiple_of(wanted.alignment) {
                    faults.push(format!("{name} got {place:?}, needs {wanted:?}"));
                }
                total = total.max(place.offset + place.bytes);
                let end = if plan.exports.contains(&usage.resource.id) { usize::MAX } else { usage.passes.1 };
                placed.push((name, usage.passes.0, end, place));
            }
        }
    }
    for (index, (name, first, last, place)) in placed.iter().enumerate() {
        for (other_name, other_first, other_last, other) in &placed[..index] {
            let together = first.max(other_first) <= last.min(other_last);
            let overlap = place.offset.max(other.offset) < (place.offset + place.bytes).min(other.offset + other.bytes);
            if together && overlap {
                faults.push(format!("{name} and {other_name} are needed together but overlap"));
            }
        }
    }
    if total != plan.shared_bytes || total > plan.unshared_bytes {
        faults.push(format!("{total} bytes placed, {} shared, {} unshared", plan.shared_bytes, plan.unshared_bytes));
    }
}

/// Whether two resources have a byte in common.
fn overlap(plan: &Plan, a: ResourceId, b: ResourceId) -> bool {
    let place =
        |id: ResourceId| plan.resources.iter().find(|usage| usage.resource.id == id).and_then(|it| it.placement);
    match (place(a), place(b)) {
        _ if a == b => true,
        (Some(a), Some(b)) => a.offset.max(b.offset) < (a.offset + a.bytes).min(b.offset + b.bytes),
        _ => false,
    }
}

fn uses_at(plan: &Plan, step: usize) -> &[Use] {
    match plan.steps[step] {
        Step::Run(pass) => &plan.passes[pass].uses,
        Step::Synchronize { .. } => &[],
    }
}

fn waits_for(barrier: &Barrier, earlier: &Use) -> bool {
    barrier.from_stages.contains(earlier.stages)
        && (!earlier.access.writes() || barrier.from_access.contains(&earlier.access))
}

fn holds_back(barrier: &Barrier, later: &Use, shows_writes: bool) -> bool {
    barrier.to_stages.contains(later.stages) && (!shows_writes || barrier.to_access.contains(&later.access))
}

/// Whether a pass between two steps writes bytes of both resources: then each is ordered against that pass.
fn is_settled(plan: &Plan, first: usize, a: ResourceId, last: usize, b: ResourceId) -> bool {
    let settles =
        |used: &Use| used.access.writes() && overlap(plan, used.resource.id, a) && overlap(plan, used.resource.id, b);
    (first + 1..last).any(|step| uses_at(plan, step).iter().any(settles))
}

/// All pairs of uses that conflict, with their steps.
fn conflicts(plan: &Plan) -> Vec<(usize, &Use, usize, &Use)> {
    let mut conflicts = Vec::new();
    for last in 0..plan.steps.len() {
        for later in uses_at(plan, last) {
            for first in 0..last {
                for earlier in uses_at(plan, first) {
                    let writes = earlier.access.writes() || later.access.writes();
                    if writes && overlap(plan, earlier.resource.id, later.resource.id) {
                        conflicts.push((first, earlier, last, later));
                    }
                }
            }
        }
    }
    conflicts
}

/// Between two uses that conflict and that no third settles lies one barrier that answers them.
fn check_barriers(plan: &Plan, faults: &mut Vec<String>) {
    for (first, earlier, last, later) in conflicts(plan) {
        let answered = barriers(plan, first, last)
            .any(|it| waits_for(it, earlier) && holds_back(it, later, earlier.access.writes()));
        if !answered && !is_settled(plan, first, earlier.resource.id, last, later.resource.id) {
            let (a, b) = (&earlier.resource.name, &later.resource.name);
            faults.push(format!("no barrier between step {first} ({a}) and step {last} ({b})"));
        }
    }
}

/// Two uses that conflict are ordered in the words of the Vulkan specification: by a chain of barriers, each waiting for
/// a stage that the one before it holds back; the first makes the write available, the last makes it visible. This
/// knows nothing of third passes.
pub fn unchained(plan: &Plan) -> Vec<String> {
    let mut faults = Vec::new();
    for (first, earlier, last, later) in conflicts(plan) {
        let mut reached: Vec<&Barrier> = Vec::new();
        for barrier in barriers(plan, first, last) {
            let chained = reached.iter().any(|it| it.to_stages.iter().any(|stage| barrier.from_stages.contains(stage)));
            if chained || waits_for(barrier, earlier) {
                reached.push(barrier);
            }
        }
        if !reached.iter().any(|barrier| holds_back(barrier, later, earlier.access.writes())) {
            let (a, b) = (&earlier.resource.name, &later.resource.name);
            faults.push(format!("no chain between step {first} ({a}) and step {last} ({b})"));
        }
    }
    faults
}

fn barriers(plan: &Plan, first: usize, last: usize) -> impl Iterator<Item = &Barrier> {
    plan.steps[first..last].iter().filter_map(|step| match step {
        Step::Synchronize { barrier, .. } => Some(barrier),
        Step::Run(_) => None,
    })
}

fn check_discards(plan: &Plan, faults: &mut Vec<String>) {
    let begun = |id: &ResourceId| {
        let discards = |step: &&Step| matches!(step, Step::Synchronize { discard, .. } if discard.contains(id));
        plan.steps.iter().filter(discards).count()
    };
    let is_image = |usage: &Usage| matches!(usage.resource.description, Description::Image(_));
    for usage in &plan.resources {
        let wanted = usize::from(is_image(usage) && usage.resource.lifetime == Lifetime::Frame);
        if begun(&usage.resource.id) != wanted {
            faults.push(format!("{} is begun {} times", usage.resource.name, begun(&usage.resource.id)));
        }
    }
    for (step, what) in plan.steps.iter().enumerate() {
        let Step::Synchronize { barrier, discard } = what else { continue };
        for &image in discard {
            let mut firsts = uses_at(plan, step + 1).iter().filter(|used| used.resource.id == image).peekable();
            if firsts.peek().is_none() {
                faults.push(format!("{image:?} is begun at step {step}, but not used next"));
            }
            if !firsts.all(|used| holds_back(barrier, used, true)) {
                faults.push(format!("{image:?} may be used before step {step} has begun it"));
            }
            for before in 0..step {
                for earlier in uses_at(plan, before).iter().filter(|used| overlap(plan, used.resource.id, image)) {
                    let settled = is_settled(plan, before, earlier.resource.id, step, image);
                    if earlier.resource.id == image || !(waits_for(barrier, earlier) || settled) {
                        faults.push(format!("step {step} begins {image:?} while {} is in use", earlier.resource.name));
                    }
                }
            }
        }
    }
}
