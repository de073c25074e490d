//! The report of a render, as JSON.

use crate::budget::BudgetReport;
use crate::measure::{PassRow, TracedRays};
use crate::picture::ImageSummary;
use mica_gpu::{DeviceInfo, MemoryRow, PipelinesMade};
use mica_render::scene::Camera;
use mica_render::{GlintMaterial, LeftOut, Value};
use serde::Serialize;
use serde_json::{Map, Value as Json};
use std::time::Duration;

/// Names this form of the report; it changes when a field changes its meaning or goes.
pub const SCHEMA: &str = "mica-render-1";

/// What was rendered, what it cost, and what came out.
#[derive(Serialize)]
pub struct RenderReport {
    pub schema: &'static str,
    pub scene: String,
    /// Names of the methods in use, joined with `+`.
    pub method: String,
    /// What chose them; absent without a budget or a wanted error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<BudgetReport>,
    /// By material: `method`, and every setting.
    pub settings: Json,
    pub size: [u32; 2],
    /// Averaged for each pixel of the picture.
    pub samples: u32,
    pub camera: CameraReport,
    pub environment: EnvironmentReport,
    /// Lights that shine in the picture.
    pub lights: usize,
    pub device: DeviceReport,
    /// Who answered what blocks light.
    pub occlusion: &'static str,
    /// Why that one.
    pub occlusion_why: String,
    pub frames: FrameCounts,
    pub passes: Vec<PassRow>,
    pub frame_ns: FrameTimes,
    /// Sum of the medians of the passes that are there for the glints.
    pub glint_ns: Option<u64>,
    /// By pass.
    pub rays: Vec<RaysReport>,
    pub memory: Vec<MemoryReport>,
    /// As typed: the first comes before frame 1.
    pub edits: Vec<String>,
    pub updates: Vec<UpdateReport>,
    pub start: StartReport,
    pub image: ImageSummary,
    pub left_out: Vec<LeftOutReport>,
    /// What the validation layer said; absent without `--validation`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<Vec<String>>,
    /// Whether Ctrl-C cut samples or measurements short.
    pub interrupted: bool,
}

#[derive(Serialize)]
pub struct CameraReport {
    pub eye: [f64; 3],
    /// Unit.
    pub forward: [f64; 3],
    pub vertical_fov_deg: f64,
}

impl CameraReport {
    pub fn new(camera: &Camera) -> Self {
        Self {
            eye: camera.eye().to_array(),
            forward: camera.forward().to_array(),
            vertical_fov_deg: camera.vertical_fov_radians.to_degrees(),
        }
    }
}

#[derive(Serialize)]
pub struct EnvironmentReport {
    /// Name, path, `constant:R,G,B` or `none`.
    pub name: String,
    pub rotation_deg: f64,
}

#[derive(Serialize)]
pub struct DeviceReport {
    pub name: String,
    pub kind: &'static str,
    pub driver: String,
    pub api: String,
}

impl DeviceReport {
    pub fn new(info: &DeviceInfo) -> Self {
        Self {
            name: info.name.clone(),
            kind: info.kind.name(),
            driver: format!("{} {}", info.driver, info.driver_version).trim().to_owned(),
            api: info.api_version.to_string(),
        }
    }
}

#[derive(Serialize)]
pub struct FrameCounts {
    /// Frames rendered before the first one that was measured.
    pub warmup: u32,
    /// Frames measured for each kind of timing.
    pub measured: usize,
}

#[derive(Serialize)]
pub struct FrameTimes {
    /// Sum of the passes' medians.
    pub isolated_sum: Option<u64>,
    /// Median of the frames as they really run.
    pub overlapped_median: Option<u64>,
    /// Median processor time of those, of all threads: what a driver on the processor really worked.
    pub overlapped_cpu_median: Option<u64>,
}

/// The rays of a pass in one frame.
#[derive(Serialize)]
pub struct RaysReport {
    pub pass: &'static str,
    pub rays: u64,
    /// Those that ran out of steps: what they had not found by then did not block.
    pub cut_short: u64,
    /// Millions a second, over the pass's median time.
    pub mrays_per_s: Option<f64>,
}

impl RaysReport {
    /// Of what was counted, with the times of the passes.
    pub fn new(traced: &TracedRays, passes: &[PassRow]) -> Self {
        let TracedRays { pass, rays, cut_short } = *traced;
        let median_ns = passes.iter().find(|row| row.name == pass).and_then(|row| row.median_ns);
        let mrays_per_s = median_ns.filter(|ns| *ns > 0).map(|ns| rays as f64 / ns as f64 * 1e3);
        Self { pass, rays, cut_short, mrays_per_s }
    }

    /// What is to be said if rays were cut short.
    pub fn warning(&self) -> Option<String> {
        let Self { pass, rays, cut_short, .. } = self;
        (*cut_short > 0).then(|| {
            format!(
                "{pass}: {cut_short} of {rays} rays ran out of steps, and what they had not found by then does not block \
                 light in the picture; use --occlusion ray-query where a device offers it, or a scene with fewer triangles"
            )
        })
    }
}

#[derive(Serialize)]
pub struct MemoryReport {
    pub name: String,
    pub bytes: u64,
    pub lifetime: &'static str,
}

impl MemoryReport {
    pub fn new(row: MemoryRow) -> Self {
        Self { name: row.name, bytes: row.bytes, lifetime: row.lifetime.name() }
    }
}

/// How the first frame came to be.
#[derive(Clone, Copy, Serialize)]
pub struct StartReport {
    /// From the start of the command to the end of the first frame, with loading, tables and pipelines.
    pub first_frame_ns: u64,
    /// Pipelines that it was made with: those of its plan and no others.
    pub pipelines: usize,
    /// How long making them took.
    pub pipelines_ns: u64,
}

impl StartReport {
    pub fn new(elapsed: Duration, PipelinesMade { count, ns }: PipelinesMade) -> Self {
        Self { first_frame_ns: elapsed.as_nanos() as u64, pipelines: count, pipelines_ns: ns }
    }
}

/// Work that brought a table up to date.
#[derive(Clone, Serialize)]
pub struct UpdateReport {
    pub pass: String,
    pub why: String,
    pub runs: usize,
    pub ns: Option<u64>,
    /// 0 for the first frame, then the number of the edit, from 1; frames without an edit come after these.
    pub frame: usize,
    /// What was edited before that frame.
    pub edit: Option<String>,
}

#[derive(Serialize)]
pub struct LeftOutReport {
    pub what: &'static str,
    pub why: String,
}

impl LeftOutReport {
    pub fn new(left_out: &LeftOut) -> Self {
        Self { what: left_out.what, why: left_out.why.clone() }
    }
}

/// Method and settings of each glinting material, by its name; a name used twice gets the material's number.
pub fn settings(materials: &[GlintMaterial]) -> Json {
    let mut by_name = Map::new();
    for material in materials {
        let mut settings = Map::new();
        settings.insert("method".to_owned(), Json::from(material.method.name));
        settings.extend(material.values.iter().map(|(key, value)| (key.to_owned(), json(value))));
        let name = &material.name;
        let key = if by_name.contains_key(name) { format!("{name} #{}", material.index) } else { name.clone() };
        by_name.insert(key, Json::Object(settings));
    }
    Json::Object(by_name)
}

/// A setting's value; whole numbers as such.
pub fn json(value: Value) -> Json {
    match value {
        Value::Number(number) if number.fract() == 0.0 && number.abs() < 9e15 => Json::from(number as i64),
        Value::Number(number) => Json::from(number),
        Value::Flag(flag) => Json::from(flag),
        Value::Word(word) => Json::from(word),
        Value::Color(color) => Json::from(color.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_put_beside_the_time_of_their_pass() {
        let row = |name: &str, median_ns| PassRow {
            name: name.to_owned(),
            runs: 1,
            once: false,
            median_ns,
            min_ns: None,
            max_ns: None,
        };
        let passes = [row("visibility", Some(7)), row("shadows", Some(2_000_000)), row("occlusion", None)];
        let of = |pass, cut_short| RaysReport::new(&TracedRays { pass, rays: 5_000, cut_short }, &passes);
        assert_eq!(of("shadows", 0).mrays_per_s, Some(2.5));
        assert_eq!(of("occlusion", 0).mrays_per_s, None);
        assert_eq!(of("shadows", 0).warning(), None);
        assert!(of("shadows", 3).warning().is_some_and(|line| line.starts_with("shadows: 3 of 5000 rays")));
    }
}
