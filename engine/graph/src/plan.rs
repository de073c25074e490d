//! What will happen in a frame: the steps in order, the barriers between them, the place of every byte.

use crate::check::{PlanError, check};
use crate::cull::cull;
use crate::declare::{Graph, Pass};
use crate::place::{Block, share, side_by_side};
use crate::resource::{Description, Lifetime, Resource, ResourceId};
use crate::shader::{Access, Stages};
use crate::synchronize::synchronize;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What a device needs to store a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirements {
    /// Size in bytes.
    pub bytes: u64,
    /// Alignment of its offset, a power of two.
    pub alignment: u64,
}

/// Everything a frame does with one resource.
#[derive(Clone, Debug)]
pub struct Usage {
    /// The resource.
    pub resource: Arc<Resource>,
    /// The accesses it must allow.
    pub accesses: BTreeSet<Access>,
    /// First and last pass that uses it, as indices into [`Plan::passes`].
    pub passes: (usize, usize),
    /// Bytes of its content: tightly packed, or what the device said of acceleration structures and their scratch.
    pub bytes: u64,
    /// Where it lies: `Some` for resources of [`Lifetime::Frame`].
    pub placement: Option<Placement>,
}

/// A byte range in the memory that the frame's resources share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// First byte.
    pub offset: u64,
    /// How many.
    pub bytes: u64,
}

/// Everything before it, in the given stages, is finished and visible to everything after it in the given stages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Barrier {
    /// Stages waited for.
    pub from_stages: Stages,
    /// Writes made visible.
    pub from_access: BTreeSet<Access>,
    /// Stages that wait.
    pub to_stages: Stages,
    /// Accesses that see them.
    pub to_access: BTreeSet<Access>,
    /// The conflicts it answers, for people: pairs of earlier and later pass with the resources of each.
    pub why: Vec<String>,
}

/// One step of a plan.
#[derive(Clone, Debug)]
pub enum Step {
    /// Order memory, and take the named images out of the undefined state: their old content is given up.
    /// With no images it is a memory barrier alone; with empty `from_stages` the images wait for nothing, but what
    /// follows always waits for them.
    Synchronize {
        /// The barrier.
        barrier: Barrier,
        /// Images whose first use follows.
        discard: Vec<ResourceId>,
    },
    /// Run a pass: an index into [`Plan::passes`].
    Run(usize),
}

/// A frame: what will happen.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The passes that are left after culling, in order.
    pub passes: Vec<Pass>,
    /// Names of the passes that nobody needed.
    pub culled: Vec<String>,
    /// The steps.
    pub steps: Vec<Step>,
    /// Every resource used, in order of first use.
    pub resources: Vec<Usage>,
    /// Those of them that were exported: their content stays until the end of the plan.
    pub exports: BTreeSet<ResourceId>,
    /// Bytes of the memory shared by resources of [`Lifetime::Frame`].
    pub shared_bytes: u64,
    /// Bytes those resources would take side by side.
    pub unshared_bytes: u64,
    /// How many downloads were declared.
    pub downloads: u32,
}

impl Plan {
    /// Plans a frame: leaves out passes that nobody needs, gives every resource of [`Lifetime::Frame`] its bytes in one
    /// memory that they share, and puts a barrier wherever two passes conflict that no earlier barrier orders.
    ///
    /// `requirements` is asked once for each resource of [`Lifetime::Frame`] that is left, with all its accesses, and for
    /// each acceleration structure.
    /// The same declarations give the same plan.
    ///
    /// # Errors
    /// If the frame is not well formed, as the variants of [`PlanError`] say.
    pub fn new(
        graph: Graph,
        requirements: &dyn Fn(&Resource, &BTreeSet<Access>) -> Requirements,
    ) -> Result<Self, PlanError> {
        check(&graph)?;
        let Graph { passes, exports, downloads, .. } = graph;
        let (passes, culled) = cull(passes, &exports);
        let mut resources = usages(&passes);
        let exports = exports.iter().map(|resource| resource.id).collect();
        let (shared_bytes, unshared_bytes) = place(&mut resources, &exports, passes.len(), requirements)?;
        let steps = synchronize(&passes, &resources);
        Ok(Self { passes, culled, steps, resources, exports, shared_bytes, unshared_bytes, downloads })
    }
}

fn usages(passes: &[Pass]) -> Vec<Usage> {
    let mut usages: Vec<Usage> = Vec::new();
    let mut index_of = BTreeMap::new();
    for (pass, used) in passes.iter().enumerate().flat_map(|(pass, it)| it.uses.iter().map(move |used| (pass, used))) {
        let index = *index_of.entry(used.resource.id).or_insert_with(|| {
            let resource = used.resource.clone();
            let (accesses, bytes) = (BTreeSet::new(), resource.bytes());
            usages.push(Usage { resource, accesses, passes: (pass, pass), bytes, placement: None });
            usages.len() - 1
        });
        usages[index].accesses.insert(used.access);
        usages[index].passes.1 = pass;
    }
    usages
}

/// Fills in the placements; returns the bytes of the shared memory, and those that it would take without sharing.
fn place(
    usages: &mut [Usage],
    exports: &BTreeSet<ResourceId>,
    passes: usize,
    requirements: &dyn Fn(&Resource, &BTreeSet<Access>) -> Requirements,
) -> Result<(u64, u64), PlanError> {
    for usage in usages.iter_mut().filter(|usage| matches!(usage.resource.description, Description::Structure(_))) {
        usage.bytes = requirements(&usage.resource, &usage.accesses).bytes;
    }
    let mut frame: Vec<&mut Usage> =
        usages.iter_mut().filter(|usage| usage.resource.lifetime == Lifetime::Frame).collect();
    let blocks: Vec<Block> = frame
        .iter()
        .map(|usage| {
            let Requirements { bytes, alignment } = requirements(&usage.resource, &usage.accesses);
            let end = if exports.contains(&usage.resource.id) { passes } else { usage.passes.1 };
            Block { bytes, alignment, passes: (usage.passes.0, end) }
        })
        .collect();
    let too_large = |index: usize| PlanError::TooLarge { resource: frame[index].resource.name.clone() };
    let unshared = side_by_side(&blocks).map_err(too_large)?;
    let layout = share(&blocks).map_err(too_large)?;
    for ((usage, block), &offset) in frame.iter_mut().zip(&blocks).zip(&layout.offsets) {
        if matches!(usage.resource.description, Description::Scratch(_)) {
            usage.bytes = block.bytes;
        }
        usage.placement = Some(Placement { offset, bytes: block.bytes });
    }
    Ok((layout.bytes, unshared))
}
