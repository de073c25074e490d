//! Which passes a frame can do without.

use crate::declare::{Pass, Use, Work};
use crate::resource::{Description, Lifetime, Resource};
use crate::shader::Access;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Splits the passes into those that are needed, in their order, and the names of the others.
///
/// A pass is needed if it writes something that outlives the frame, if it is a download, or if it writes content that
/// an export or a needed later pass reads. Walked backwards, so that each pass knows all its readers.
pub(crate) fn cull(passes: Vec<Pass>, exports: &[Arc<Resource>]) -> (Vec<Pass>, Vec<String>) {
    let mut live: BTreeSet<_> = exports.iter().map(|resource| resource.id).collect();
    let mut kept = Vec::new();
    let mut culled = Vec::new();
    for pass in passes.into_iter().rev() {
        let is_wanted = |used: &Use| {
            used.access.writes() && (used.resource.lifetime != Lifetime::Frame || live.contains(&used.resource.id))
        };
        if !matches!(pass.work, Work::Download { .. }) && !pass.uses.iter().any(is_wanted) {
            culled.push(pass.name);
            continue;
        }
        for used in pass.uses.iter().filter(|used| replaces_all(used)) {
            live.remove(&used.resource.id);
        }
        live.extend(pass.uses.iter().filter(|used| used.access.reads()).map(|used| used.resource.id));
        kept.push(pass);
    }
    kept.reverse();
    culled.reverse();
    (kept, culled)
}

/// Whether nothing of the earlier content is left after the use. A shader may leave texels of a storage image as they
/// were, and drawing clears the first level and layer only.
fn replaces_all(used: &Use) -> bool {
    match used.access {
        Access::TransferWrite | Access::BuildWrite => true,
        Access::ColorWrite | Access::DepthWrite => match &used.resource.description {
            Description::Image(image) => image.mips == 1 && image.layers <= 1,
            _ => false,
        },
        _ => false,
    }
}
