//! What a frame computes. A byte is simulated as a 64-bit word, and a pass writes a hash of its name and all it reads:
//! whoever reads a wrong byte anywhere ends in another result.

use crate::frames::{Frame, garbage};
use crate::random::{Random, mix, mix_name};
use mica_graph::{Lifetime, Pass, Plan, ResourceId, Stages, Step, Use, Work};
use std::collections::BTreeMap;

/// What can be seen of a frame afterwards: downloads, exports, and all that outlives it.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Seen {
    downloads: BTreeMap<u32, Vec<u64>>,
    kept: BTreeMap<ResourceId, Vec<u64>>,
}

/// How freely a plan is executed.
#[derive(Clone, Copy)]
pub enum Order {
    /// What may run late does: of all that no barrier holds back, the last declared runs first.
    Latest,
    /// Any order that the barriers allow, by a seed.
    Any(u64),
}

/// The frame as declared: one pass after the other, each resource with bytes of its own.
pub fn as_declared(frame: &Frame) -> Seen {
    let mut memory: BTreeMap<ResourceId, Vec<u64>> =
        frame.resources().map(|it| (it.id, (0..it.bytes()).map(|byte| before(&it.name, byte)).collect())).collect();
    let mut seen = Seen::default();
    for pass in &frame.passes {
        let read: Vec<Vec<u64>> =
            pass.uses.iter().filter(|used| used.access.reads()).map(|used| memory[&used.resource.id].clone()).collect();
        let digest = digest(pass, read.iter());
        if let Work::Download { download } = pass.work {
            seen.downloads.insert(download.0, read[0].clone());
        }
        for used in pass.uses.iter().filter(|used| used.access.writes()) {
            let bytes = memory.get_mut(&used.resource.id).expect("every resource has memory");
            write(frame, pass, used, digest, bytes);
        }
    }
    let outlives =
        |it: &&std::sync::Arc<mica_graph::Resource>| it.lifetime != Lifetime::Frame || frame.exports.contains(&it.id);
    seen.kept = frame.resources().filter(outlives).map(|it| (it.id, memory[&it.id].clone())).collect();
    seen
}

/// The frame as planned: resources where they are placed, and work as unordered as the barriers leave it.
/// An error if the plan cannot be executed at all.
pub fn as_planned(frame: &Frame, plan: &Plan, order: Order) -> Result<Seen, String> {
    let mut run = Run::new(frame, plan)?;
    let nodes = nodes(plan);
    let mut waits: Vec<usize> = vec![0; nodes.len()];
    let mut frees: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    for (a, earlier) in nodes.iter().enumerate() {
        for (b, later) in nodes.iter().enumerate() {
            if precedes(plan, earlier, later) {
                waits[b] += 1;
                frees[a].push(b);
            }
        }
    }
    let mut random = match order {
        Order::Latest => None,
        Order::Any(seed) => Some(Random::new(seed)),
    };
    let mut ready: Vec<usize> = (0..nodes.len()).filter(|&node| waits[node] == 0).collect();
    while !ready.is_empty() {
        let next = match &mut random {
            None => (0..ready.len()).max_by_key(|&index| ready[index]).unwrap_or(0),
            Some(random) => random.below(ready.len()),
        };
        let node = ready.swap_remove(next);
        run.execute(&nodes[node])?;
        for &freed in &frees[node] {
            waits[freed] -= 1;
            if waits[freed] == 0 {
                ready.push(freed);
            }
        }
    }
    run.finish()
}

/// Something that happens at once.
enum Node {
    /// A pass reads a resource.
    Read { step: usize, pass: usize, used: usize },
    /// A pass writes a resource, after all its reads.
    Write { step: usize, pass: usize, used: usize },
    /// A barrier, and the images it takes out of the undefined state.
    Barrier { step: usize },
}

fn nodes(plan: &Plan) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (step, what) in plan.steps.iter().enumerate() {
        let Step::Run(pass) = *what else {
            nodes.push(Node::Barrier { step });
            continue;
        };
        for (used, it) in plan.passes[pass].uses.iter().enumerate() {
            if it.access.reads() {
                nodes.push(Node::Read { step, pass, used });
            }
            if it.access.writes() {
                nodes.push(Node::Write { step, pass, used });
            }
        }
    }
    nodes
}

/// All the order there is: a pass reads before it writes, and barriers hold back the stages they name.
fn precedes(plan: &Plan, earlier: &Node, later: &Node) -> bool {
    let stages = |pass: usize, used: usize| plan.passes[pass].uses[used].stages;
    match (earlier, later) {
        (Node::Read { step: a, .. }, Node::Write { step: b, .. }) if a == b => true,
        (Node::Read { step, pass, used } | Node::Write { step, pass, used }, Node::Barrier { step: barrier }) => {
            step < barrier && scopes(plan, *barrier).0.contains(stages(*pass, *used))
        }
        (Node::Barrier { step: barrier }, Node::Read { step, pass, used } | Node::Write { step, pass, used }) => {
            barrier < step && scopes(plan, *barrier).1.contains(stages(*pass, *used))
        }
        _ => false,
    }
}

fn scopes(plan: &Plan, step: usize) -> (Stages, Stages) {
    match &plan.steps[step] {
        Step::Synchronize { barrier, .. } => (barrier.from_stages, barrier.to_stages),
        Step::Run(_) => (Stages::NONE, Stages::NONE),
    }
}

/// A plan in execution.
struct Run<'a> {
    frame: &'a Frame,
    plan: &'a Plan,
    shared: Vec<u64>,
    own: BTreeMap<ResourceId, Vec<u64>>,
    /// First byte in the shared memory, of the content, and of all that was asked for.
    placed: BTreeMap<ResourceId, (usize, usize, usize)>,
    read: BTreeMap<(usize, usize), Vec<u64>>,
    seen: Seen,
}

impl<'a> Run<'a> {
    fn new(frame: &'a Frame, plan: &'a Plan) -> Result<Self, String> {
        let mut own = BTreeMap::new();
        for it in frame.resources().filter(|it| it.lifetime != Lifetime::Frame) {
            own.insert(it.id, (0..it.bytes()).map(|byte| before(&it.name, byte)).collect());
        }
        let mut placed = BTreeMap::new();
        for usage in &plan.resources {
            if let Some(place) = usage.placement {
                let content = place.offset + usage.resource.bytes();
                let all = place.offset + place.bytes;
                if content.max(all) > plan.shared_bytes {
                    return Err(format!("{} lies outside of the shared memory", usage.resource.name));
                }
                placed.insert(usage.resource.id, (place.offset as usize, content as usize, all as usize));
            }
        }
        let shared = (0..plan.shared_bytes).map(|byte| garbage(0, byte)).collect();
        Ok(Self { frame, plan, shared, own, placed, read: BTreeMap::new(), seen: Seen::default() })
    }

    fn bytes(&mut self, resource: ResourceId) -> Result<&mut [u64], String> {
        match (self.own.get_mut(&resource), self.placed.get(&resource)) {
            (Some(own), _) => Ok(own),
            (None, Some(&(start, end, _))) => Ok(&mut self.shared[start..end]),
            (None, None) => Err(format!("{resource:?} lies nowhere")),
        }
    }

    fn execute(&mut self, node: &Node) -> Result<(), String> {
        let plan = self.plan;
        match *node {
            Node::Read { pass, used, .. } => {
                let content = self.bytes(plan.passes[pass].uses[used].resource.id)?.to_vec();
                if let Work::Download { download } = plan.passes[pass].work {
                    self.seen.downloads.insert(download.0, content.clone());
                }
                self.read.insert((pass, used), content);
            }
            Node::Write { pass: index, used, .. } => {
                let pass = &plan.passes[index];
                let digest = digest(pass, self.read.range((index, 0)..(index + 1, 0)).map(|(_, content)| content));
                let (frame, used) = (self.frame, &pass.uses[used]);
                write(frame, pass, used, digest, self.bytes(used.resource.id)?);
            }
            Node::Barrier { step } => {
                let Step::Synchronize { discard, .. } = &plan.steps[step] else { return Ok(()) };
                for id in discard {
                    let &(start, _, end) = self.placed.get(id).ok_or(format!("{id:?} is begun but lies nowhere"))?;
                    for (byte, word) in (0..).zip(&mut self.shared[start..end]) {
                        *word = garbage(1 + step as u64, byte);
                    }
                }
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Seen, String> {
        for &export in &self.frame.exports {
            let content = self.bytes(export)?.to_vec();
            self.seen.kept.insert(export, content);
        }
        self.seen.kept.append(&mut self.own);
        Ok(self.seen)
    }
}

fn digest<'a>(pass: &Pass, read: impl Iterator<Item = &'a Vec<u64>>) -> u64 {
    read.fold(mix_name(&pass.name), |digest, content| mix(&[digest, mix(content)]))
}

fn write(frame: &Frame, pass: &Pass, used: &Use, digest: u64, bytes: &mut [u64]) {
    let all = frame.replaces_all(pass, used);
    for (byte, word) in (0..).zip(bytes) {
        let value = mix(&[digest, mix_name(&used.resource.name), byte]);
        if all || mix_name(&pass.name).wrapping_add(byte) % 3 != 0 {
            *word = value;
        }
    }
}

/// What a resource holds when the frame begins.
fn before(name: &str, byte: u64) -> u64 {
    garbage(mix_name(name), byte)
}
