//! What a bench of occlusion found: a line of JSON for each body.

use crate::measure::median;
use crate::report::DeviceReport;
use serde::Serialize;

/// Names this form of the lines; it changes when a field changes its meaning or goes.
pub const SCHEMA: &str = "mica-bench-occlusion-1";

/// A scene, and the bodies side by side.
#[derive(Serialize)]
pub struct SceneReport {
    pub scene: String,
    /// In all meshes, each counted once.
    pub triangles: usize,
    /// As placed by all instances.
    pub triangles_placed: usize,
    pub meshes: usize,
    pub instances: usize,
    /// Of the camera's picture.
    pub size: [u32; 2],
    pub rounds: Rounds,
    #[serde(skip)]
    pub bodies: Vec<BodyReport>,
    /// Kinds of rays that this scene has none of, and why.
    pub left_out: Vec<String>,
}

#[derive(Clone, Copy, Serialize)]
pub struct Rounds {
    /// Rounds before the first one that was measured.
    pub warmup: u32,
    pub measured: usize,
}

/// A body on a scene.
#[derive(Serialize)]
pub struct BodyReport {
    pub body: &'static str,
    /// Why the device cannot; all else is empty then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_offered: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ready: Option<ReadyReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryReport>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rays: Vec<RaysReport>,
}

impl BodyReport {
    /// Of one that the device does not offer.
    pub fn not_offered(body: &'static str, why: String) -> Self {
        Self { body, not_offered: Some(why), ready: None, memory: None, rays: Vec::new() }
    }
}

/// What it took to make it ready.
#[derive(Serialize)]
pub struct ReadyReport {
    /// From the scene in memory to the first answer, uploads included.
    pub wall_ns: Spread,
    /// Processor time of that, of all threads.
    pub cpu_ns: Option<Spread>,
    /// Threads that the host may build with.
    pub threads: usize,
    /// Each step of the build: on the host by its clock, on the device by the device's.
    pub steps: Vec<StepReport>,
}

#[derive(Serialize)]
pub struct StepReport {
    pub step: String,
    pub ns: Spread,
}

#[derive(Serialize)]
pub struct MemoryReport {
    pub bytes: u64,
    pub bytes_per_triangle: f64,
    /// Before structures were compacted; absent where nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes_as_built: Option<u64>,
    pub resources: Vec<ResourceReport>,
}

#[derive(Serialize)]
pub struct ResourceReport {
    pub name: String,
    pub bytes: u64,
}

/// Rays of one kind, asked one question.
#[derive(Serialize)]
pub struct RaysReport {
    pub rays: &'static str,
    pub question: &'static str,
    pub count: u32,
    /// How many met something.
    pub blocked: usize,
    /// How many ran out of steps.
    pub cut_short: u32,
    /// Time of the pass on the device.
    pub ns: Option<Spread>,
    /// Processor time of the frame with the pass in it, where the device is a processor.
    pub cpu_ns: Option<Spread>,
    /// Millions a second, of the median time.
    pub mrays_per_s: Option<f64>,
    /// Millions for each second of processor time, of the median.
    pub mrays_per_cpu_s: Option<f64>,
    /// Beside the first body of the device; absent for that one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beside: Option<BesideReport>,
}

/// A body beside another.
#[derive(Serialize)]
pub struct BesideReport {
    pub body: &'static str,
    /// How many times the rays of the other in the same time.
    pub speed: Option<f64>,
    /// The same by processor time, which other programs hardly disturb; where the device is a processor.
    pub speed_by_cpu: Option<f64>,
    /// Rays of which only one body says that they meet something.
    pub differ_in_blocked: usize,
    /// Rays that meet something by both, but not the same triangle.
    pub differ_in_triangle: usize,
    /// Of the distances where both meet something, relative.
    pub largest_difference_of_distance: f64,
}

/// The middle, the least and the greatest of several rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Spread {
    pub median: u64,
    pub min: u64,
    pub max: u64,
}

impl Spread {
    /// Of values, none of which may be missing.
    pub fn of(values: impl IntoIterator<Item = Option<u64>>) -> Option<Self> {
        let values: Vec<u64> = values.into_iter().collect::<Option<_>>()?;
        let (min, max) = (values.iter().copied().min()?, values.iter().copied().max()?);
        Some(Self { median: median(&values)?, min, max })
    }
}

impl SceneReport {
    /// A line for each body, each ended.
    pub fn lines(&self, device: &DeviceReport) -> Result<String, serde_json::Error> {
        #[derive(Serialize)]
        struct Line<'a> {
            schema: &'static str,
            device: &'a DeviceReport,
            #[serde(flatten)]
            scene: &'a SceneReport,
            #[serde(flatten)]
            body: &'a BodyReport,
        }
        let line = |body| serde_json::to_string(&Line { schema: SCHEMA, device, scene: self, body });
        self.bodies.iter().map(|body| Ok(line(body)? + "\n")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Spread;

    #[test]
    fn what_was_not_measured_has_no_spread() {
        assert_eq!(Spread::of([Some(3), Some(1), Some(8)]), Some(Spread { median: 3, min: 1, max: 8 }));
        assert_eq!(Spread::of([Some(3), None]), None);
        assert_eq!(Spread::of([]), None);
    }
}
