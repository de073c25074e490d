//! Times of passes and frames, and what they come to.

use crate::session::Shot;
use mica_shaders::types::RayCounts;
use serde::Serialize;

/// A pass, with its times over the measured frames; runs of the same name within a frame are added up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassRow {
    /// The pass.
    pub name: String,
    /// How often a frame runs it.
    pub runs: usize,
    /// Whether it built something that later frames only read: its times are then of that one build, which includes the
    /// driver's compilation of its shader if that was not cached.
    pub once: bool,
    /// Median, in nanoseconds; none where nothing was measured.
    pub median_ns: Option<u64>,
    /// Least.
    pub min_ns: Option<u64>,
    /// Greatest.
    pub max_ns: Option<u64>,
}

/// A pass of one frame, all its runs together.
#[derive(Clone, Debug, PartialEq)]
pub struct PassSum {
    /// The pass.
    pub name: String,
    /// Why its first run is there.
    pub why: String,
    /// How often it ran.
    pub runs: usize,
    /// Nanoseconds; none where nothing was measured.
    pub ns: Option<u64>,
}

/// The passes of a frame that are updates, or those that are not, in order; runs of one name are added up.
pub fn sums(shot: &Shot, updates: bool) -> Vec<PassSum> {
    let mut sums: Vec<PassSum> = Vec::new();
    let passes = shot.run.plan.passes.iter().zip(&shot.run.passes).zip(&shot.is_update);
    for ((pass, time), _) in passes.filter(|(_, is_update)| **is_update == updates) {
        // Updates are told apart by their reasons: two materials, two rows.
        match sums.iter_mut().find(|sum| sum.name == pass.name && (!updates || sum.why == pass.why)) {
            Some(sum) => {
                sum.runs += 1;
                sum.ns = sum.ns.zip(time.ns).map(|(a, b)| a + b);
            }
            None => sums.push(PassSum { name: pass.name.clone(), why: pass.why.clone(), runs: 1, ns: time.ns }),
        }
    }
    sums
}

/// The rays of a pass in one frame, all its runs together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracedRays {
    /// The pass.
    pub pass: &'static str,
    /// How many it traced.
    pub rays: u64,
    /// Those of them that ran out of steps.
    pub cut_short: u64,
}

/// Counts of the runs of passes, those of one name added up.
pub fn rays(counts: impl IntoIterator<Item = (&'static str, RayCounts)>) -> Vec<TracedRays> {
    let mut sums: Vec<TracedRays> = Vec::new();
    for (pass, RayCounts { traced, cut_short, .. }) in counts {
        let (traced, cut_short) = (u64::from(traced), u64::from(cut_short));
        match sums.iter_mut().find(|sum| sum.pass == pass) {
            Some(sum) => {
                sum.rays += traced;
                sum.cut_short += cut_short;
            }
            None => sums.push(TracedRays { pass, rays: traced, cut_short }),
        }
    }
    sums
}

/// Frames measured after warming up, all of the same passes.
#[derive(Default)]
pub struct Measurements {
    isolated: Vec<Vec<PassSum>>,
    overlapped_ns: Vec<u64>,
    cpu_ns: Vec<u64>,
}

impl Measurements {
    /// Takes a frame with isolated timing.
    pub fn add_isolated(&mut self, shot: &Shot) {
        self.isolated.push(sums(shot, false));
    }

    /// Takes a frame with overlapped timing.
    pub fn add_overlapped(&mut self, shot: &Shot) {
        self.overlapped_ns.extend(shot.run.frame_ns);
        self.cpu_ns.extend(shot.run.cpu_ns);
    }

    /// The passes with their statistics; `fallback` names them where no frame was measured in isolation.
    pub fn passes(&self, fallback: &[PassSum]) -> Vec<PassRow> {
        let names = self.isolated.first().map_or(fallback, Vec::as_slice);
        names
            .iter()
            .map(|PassSum { name, runs, .. }| {
                let of_frame = |frame: &Vec<PassSum>| frame.iter().find(|sum| sum.name == *name).and_then(|sum| sum.ns);
                let times: Vec<u64> = self.isolated.iter().filter_map(of_frame).collect();
                PassRow {
                    name: name.clone(),
                    runs: *runs,
                    once: false,
                    median_ns: median(&times),
                    min_ns: times.iter().copied().min(),
                    max_ns: times.iter().copied().max(),
                }
            })
            .collect()
    }

    /// How many frames were measured in the way of which there are more.
    pub fn count(&self) -> usize {
        self.isolated.len().max(self.overlapped_ns.len())
    }

    /// Median time of the frames as they really run.
    pub fn overlapped_median_ns(&self) -> Option<u64> {
        median(&self.overlapped_ns)
    }

    /// Median processor time of those frames, of all threads of the process.
    pub fn cpu_median_ns(&self) -> Option<u64> {
        median(&self.cpu_ns)
    }
}

/// The middle value; of an even number, the mean of the middle two.
pub fn median(values: &[u64]) -> Option<u64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        odd if odd % 2 == 1 => Some(sorted[middle]),
        _ => Some(u64::midpoint(sorted[middle - 1], sorted[middle])),
    }
}

/// Whether a pass is part of what glints cost in every frame.
pub fn is_of_glints(pass: &str) -> bool {
    const PASSES: [&str; 9] = [
        "upload tile_lists",
        "glint_tiles",
        "layer_tiles",
        "clear specular_layer",
        "clear glints_blurred",
        "clear visibility",
        "clear visibility_blurred",
        "occlusion",
        "composite",
    ];
    pass.starts_with("glints") || pass.starts_with("blur_") || PASSES.contains(&pass)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[7]), Some(7));
        assert_eq!(median(&[9, 1, 5]), Some(5));
        assert_eq!(median(&[9, 1, 5, 6]), Some(5));
        assert_eq!(median(&[u64::MAX, u64::MAX]), Some(u64::MAX));
    }

    #[test]
    fn rays_of_one_pass_add_up_beyond_32_bits() {
        let counts = |traced, cut_short| RayCounts { traced, cut_short };
        let all = rays([("shadows", counts(u32::MAX, 1)), ("occlusion", counts(5, 0)), ("shadows", counts(2, 3))]);
        let shadows = TracedRays { pass: "shadows", rays: (1 << 32) + 1, cut_short: 4 };
        assert_eq!(all, [shadows, TracedRays { pass: "occlusion", rays: 5, cut_short: 0 }]);
    }
}
