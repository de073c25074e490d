//! Rays of the caller's own.

use crate::RenderError;
use crate::occluders::{Occluders, RaysOfPass, pass_with_rays};
use crate::scene_buffers::SceneBuffers;
use mica_graph::{Buffer, Extent, Graph, Over};
use mica_shaders::types;

/// Rays in one row of the dispatch: every device runs 65,535 groups, of 64 each, along an axis.
const RAYS_A_ROW: u32 = 65_535 * 64;

/// What is asked about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// Whether anything blocks it.
    Any,
    /// What blocks it first.
    Closest,
}

/// Refuses buffers that are too small for so many rays and their answers.
pub(crate) fn check_room(rays: &Buffer, count: u32, answers: &Buffer) -> Result<(), RenderError> {
    for (what, buffer, each) in
        [("rays", rays, size_of::<types::Ray>()), ("answers", answers, size_of::<types::RayAnswer>())]
    {
        let (bytes, needed) = (buffer.bytes(), u64::from(count) * each as u64);
        if bytes < needed {
            return Err(RenderError::RaysDoNotFit { what, count, bytes, needed });
        }
    }
    Ok(())
}

/// Answers each of the first `count` of `rays`.
pub(crate) fn trace(
    g: &mut Graph,
    scene: &SceneBuffers,
    occluders: &Occluders,
    (rays, count): (&Buffer, u32),
    question: Question,
    answers: &mut Buffer,
) -> RaysOfPass {
    let extent = Extent::new(count.min(RAYS_A_ROW), count.div_ceil(RAYS_A_ROW));
    let mut counted = RaysOfPass::none_yet(g, "trace_rays");
    pass_with_rays!(
        g,
        trace_rays,
        occluders,
        scene,
        Over::Texels(extent),
        Params { count, closest: u32::from(question == Question::Closest), scene_unit: scene.scene_unit },
        Bind { rays, ray_answers: answers, ray_counts: &mut counted.counts }
    );
    counted
}
