//! One body of occlusion on one scene: what it takes to make it ready, and how fast it answers.

use super::rays::Rays;
use crate::error::Failure;
use crate::progress::Progress;
use glam::DVec3;
use mica_gpu::{Executor, Timing, process_cpu_ns};
use mica_graph::{Buffer, Graph, Lifetime};
use mica_render::scene::{AlphaMode, Light, Scene};
use mica_render::{OcclusionBackend, Question, Renderer, Update};
use mica_shaders::types::{Ray, RayAnswer, RayCounts};
use std::sync::Arc;
use std::time::Instant;

/// Both questions, with their names in reports.
pub const QUESTIONS: [(Question, &str); 2] = [(Question::Any, "any"), (Question::Closest, "closest")];

/// Memory rows that belong to a body begin so.
const OF_OCCLUDERS: [&str; 2] = ["bvh_", "structure of "];

/// Rays on the device.
pub struct UploadedRays {
    /// In the report.
    pub name: &'static str,
    /// How many.
    pub count: u32,
    buffer: Buffer,
}

/// A scene that only occludes: nothing in it glints, and nothing is told of what no pass renders.
pub fn bare(mut scene: Scene) -> Scene {
    // A light, so that something asks for occlusion; rays to others are traced all the same.
    scene.lights = vec![Light::Directional { direction: DVec3::NEG_Y, irradiance: [1.0; 3] }];
    for material in &mut scene.materials {
        (material.glint, material.sheen, material.clearcoat) = (None, None, None);
        if material.alpha == AlphaMode::Blend {
            // Rays take it so in any case.
            material.alpha = AlphaMode::Mask { cutoff: 0.5 };
        }
    }
    scene
}

/// Puts rays on the device.
pub fn upload(executor: &mut Executor, rays: &Rays) -> Result<UploadedRays, Failure> {
    let bytes: &[u8] = bytemuck::cast_slice::<Ray, u8>(&rays.list);
    let mut buffer = Buffer::new(format!("rays {}", rays.name), bytes.len() as u64, Lifetime::Settings);
    let mut g = Graph::new();
    g.upload(&mut buffer, Arc::<[u8]>::from(bytes));
    executor.run(g, Timing::Overlapped)?;
    Ok(UploadedRays { name: rays.name, count: rays.list.len() as u32, buffer })
}

/// What it took to make a body ready.
pub struct Ready {
    /// From the scene in memory to the first answer, uploads included.
    pub wall_ns: u64,
    /// Processor time of that, of all threads.
    pub cpu_ns: Option<u64>,
    /// Each step of the build.
    pub steps: Vec<Update>,
    /// What is kept, in bytes.
    pub memory: Vec<(String, u64)>,
}

/// Answers to some rays.
pub struct Traced {
    /// Time on the device.
    pub ns: Option<u64>,
    /// Processor time of all threads, where the device is a processor.
    pub cpu_ns: Option<u64>,
    /// How many rays ran out of steps.
    pub cut_short: u32,
    /// An answer each, where they were wanted.
    pub answers: Vec<RayAnswer>,
}

/// A body that is ready.
pub struct Body {
    /// Its renderer.
    pub renderer: Renderer,
    /// What that took.
    pub ready: Ready,
}

impl Body {
    /// Builds what a backend asks of, anew.
    pub fn build(
        scene: &Scene,
        backend: OcclusionBackend,
        executor: &mut Executor,
        progress: &mut Progress,
    ) -> Result<Self, Failure> {
        let mut renderer = Renderer::new(scene.clone(), &[], None, backend)?;
        let first = first_ray(executor)?;
        let (start, cpu) = (Instant::now(), process_cpu_ns());
        let mut show = |what: &str, done, total| progress.update(what, done, total);
        let steps = renderer.precompute(executor, None, &mut show)?;
        trace(&mut renderer, executor, &first, Question::Any, false)?;
        let wall_ns = start.elapsed().as_nanos() as u64;
        let cpu_ns = process_cpu_ns().zip(cpu).map(|(after, before)| after - before);
        Ok(Self { renderer, ready: Ready { wall_ns, cpu_ns, steps, memory: memory(executor) } })
    }

    /// The bytes of a body before anything is compacted, which takes more than the first frame: what a host has whose
    /// frames build what they need.
    pub fn bytes_as_built(scene: &Scene, backend: OcclusionBackend, executor: &mut Executor) -> Result<u64, Failure> {
        let mut renderer = Renderer::new(scene.clone(), &[], None, backend)?;
        let first = first_ray(executor)?;
        trace(&mut renderer, executor, &first, Question::Any, false)?;
        Ok(memory(executor).iter().map(|(_, bytes)| bytes).sum())
    }

    /// Traces rays, and brings the answers back if `answers` says so.
    pub fn trace(
        &mut self,
        executor: &mut Executor,
        rays: &UploadedRays,
        question: Question,
        answers: bool,
    ) -> Result<Traced, Failure> {
        trace(&mut self.renderer, executor, rays, question, answers)
    }
}

/// A ray away from everything: that it can be asked about is what counts.
fn first_ray(executor: &mut Executor) -> Result<UploadedRays, Failure> {
    let ray = Ray { direction: [0.0, 1.0, 0.0], origin: [1e12; 3], t_max: 1.0, ..Ray::default() };
    upload(executor, &Rays { name: "first", list: vec![ray] })
}

/// What the bodies keep on the device; of those that are dropped, nothing.
fn memory(executor: &mut Executor) -> Vec<(String, u64)> {
    executor.collect();
    let is_theirs = |name: &str| OF_OCCLUDERS.iter().any(|prefix| name.starts_with(prefix));
    let rows = executor.memory().into_iter().filter(|row| is_theirs(&row.name));
    rows.map(|row| (row.name, row.bytes)).collect()
}

fn trace(
    renderer: &mut Renderer,
    executor: &mut Executor,
    rays: &UploadedRays,
    question: Question,
    answers: bool,
) -> Result<Traced, Failure> {
    let mut g = Graph::new();
    let mut answered = g.buffer("answers", u64::from(rays.count) * size_of::<RayAnswer>() as u64);
    let counts = renderer.trace(&mut g, &rays.buffer, rays.count, question, &mut answered)?;
    let counts = g.download(&counts);
    let answers = answers.then(|| g.download(&answered));
    let mut run = executor.run(g, Timing::Isolated)?;
    let ns = run.passes.iter().find(|pass| pass.name == "trace_rays").and_then(|pass| pass.ns);
    let counts: RayCounts = bytemuck::pod_read_unaligned(&run.take(counts));
    let answers = answers.map(|answers| bytemuck::pod_collect_to_vec(&run.take(answers))).unwrap_or_default();
    Ok(Traced { ns, cpu_ns: run.cpu_ns, cut_short: counts.cut_short, answers })
}
