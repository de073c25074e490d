//! A frame under way, and what came of one.

use crate::timing::{PassTime, Timing};
use mica_graph::{Download, Plan};
use std::collections::HashMap;
use std::ops::Range;
use std::time::Instant;

/// A frame that was recorded into a command buffer of the host. Once the device has finished it, it goes to
/// [`crate::Executor::finish`]; until then it keeps its staging memory, and its plan keeps the resources.
#[derive(Debug)]
#[must_use = "a recorded frame has to be given to Executor::finish once the device is done with it"]
pub struct Recorded {
    pub(crate) slot: usize,
    pub(crate) plan: Plan,
    pub(crate) timing: Timing,
    /// Before anything of it could run.
    pub(crate) recorded_at: Instant,
    /// Where each download lies in staging memory.
    pub(crate) downloads: HashMap<Download, Range<usize>>,
}

impl Recorded {
    /// What was recorded.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
}

/// A finished frame. Its plan holds handles: resources are freed only after it is dropped.
pub struct Run {
    /// What was executed.
    pub plan: Plan,
    /// The passes in order, each with its time if timing was [`Timing::Isolated`].
    pub passes: Vec<PassTime>,
    /// Nanoseconds from the first pass to the end of the last, if timing was [`Timing::Overlapped`].
    pub frame_ns: Option<u64>,
    /// Processor time of the process from submission to the end, in nanoseconds, of all its threads: what a software
    /// driver really worked. `None` where the host submits, or the system does not say.
    pub cpu_ns: Option<u64>,
    pub(crate) downloads: HashMap<Download, Vec<u8>>,
}

impl std::fmt::Debug for Run {
    /// Without the bytes of the downloads.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { plan: _, passes, frame_ns, cpu_ns, downloads: _ } = self;
        let mut run = f.debug_struct("Run");
        run.field("passes", passes).field("frame_ns", frame_ns).field("cpu_ns", cpu_ns).finish_non_exhaustive()
    }
}

impl Run {
    /// The bytes of a download of this frame; for images as in [`mica_graph::ImageDesc::bytes`].
    ///
    /// # Panics
    /// If it is of another frame or was taken before: a mistake of the caller, not of any input.
    pub fn take(&mut self, download: Download) -> Vec<u8> {
        self.downloads.remove(&download).expect("a download is taken once, from the frame that declared it")
    }
}
