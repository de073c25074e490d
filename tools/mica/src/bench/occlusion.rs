//! `mica bench --occlusion`: every body of occlusion that the device offers, side by side on the same rays.

use super::BenchArgs;
use super::body::{Body, QUESTIONS, Ready, Traced, UploadedRays, bare, upload};
use super::rays;
use super::report::{
    BesideReport, BodyReport, MemoryReport, RaysReport, ReadyReport, ResourceReport, Rounds, SceneReport, Spread,
    StepReport,
};
use super::tables;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::progress::Progress;
use crate::report::DeviceReport;
use crate::scene_choice;
use crate::session::{cache, device, executor};
use crate::spare::Spare;
use mica_gpu::{DeviceInfo, DeviceKind, Executor};
use mica_render::scene::{Light, Mesh, Scene};
use mica_render::{OcclusionBackend, Question, Update, View};
use mica_shaders::types::{Ray, RayAnswer};
use std::path::{Path, PathBuf};

/// A small scene and one of a million triangles.
const DEFAULT_SCENES: [&str; 2] = ["shoe", "drift"];
/// Rounds before those that are measured.
const WARMUP: u32 = 1;

/// Measures, writes and prints. What was measured before Ctrl-C or a failure is kept.
pub fn occlusion(args: &BenchArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let destination = args.json.as_deref().filter(|_| !to_stdout).map(Destination::check).transpose()?;
    let open = || device(&args.device);
    let device = open()?;
    check_counts(args, device.info())?;
    let kept = cache(&args.device);
    let mut bench = Bench {
        args,
        size: camera_size(args)?,
        offered: vec![OcclusionBackend::Bvh],
        not_offered: Vec::new(),
        on_processor: device.info().kind == DeviceKind::Cpu,
        executor: executor(device.clone(), kept.as_ref(), args.device.memory)?,
        progress: Progress::new(args.quiet),
        interrupt,
    };
    match &device.info().ray_query_lacks[..] {
        [] => bench.offered.push(OcclusionBackend::RayQuery),
        lacks => {
            let why = format!("the device lacks {}", lacks.join(", "));
            bench.not_offered.push((OcclusionBackend::RayQuery, why));
        }
    }
    let described = DeviceReport::new(device.info());
    let scenes: Vec<PathBuf> = match &args.scene[..] {
        [] => DEFAULT_SCENES.iter().map(PathBuf::from).collect(),
        scenes => scenes.to_vec(),
    };
    let mut lines = String::new();
    let (mut failed, mut cut_short) = (None, false);
    let mut spare = Spare::default();
    interrupt.defer();
    for (index, scene) in scenes.iter().enumerate() {
        if interrupt.requested() {
            cut_short = true;
            break;
        }
        let mut done = bench.scene(scene);
        if done.as_ref().is_err_and(|failure| spare.serves(failure)) {
            bench.executor = executor(open()?, kept.as_ref(), args.device.memory)?;
            done = bench.scene(scene);
        }
        let report = match done {
            Ok(Some(report)) => report,
            Ok(None) => {
                cut_short = true;
                break;
            }
            Err(failure) => {
                failed = Some(failure);
                break;
            }
        };
        cut_short |= report.rounds.measured < args.rounds as usize;
        bench.progress.clear();
        let of_scene = report.lines(&described).map_err(|error| Failure::bad_input(error.to_string()))?;
        if to_stdout {
            output::print(&of_scene)?;
        } else if !args.quiet {
            let heading = if index == 0 { tables::heading(device.info()) } else { String::new() };
            output::print(&(heading + &tables::for_people(&report)))?;
        }
        lines += &of_scene;
        if let Some(destination) = &destination {
            destination.write(lines.as_bytes())?;
        }
    }
    bench.progress.clear();
    if let Some(destination) = destination.filter(|_| !args.quiet && !lines.is_empty()) {
        output::print(&format!("\nwrote {}\n", destination.path.display()))?;
    }
    match failed {
        Some(failure) => Err(failure),
        None if cut_short => {
            Err(Failure::with_code(INTERRUPTED, "interrupted; what was measured in whole rounds was kept"))
        }
        None => Ok(()),
    }
}

/// Pixels of the camera's picture, of which each has a ray.
fn camera_size(args: &BenchArgs) -> Result<[u32; 2], Failure> {
    match args.size[..] {
        [] => Ok([1280, 720]),
        [size] => Ok(size),
        _ => Err(Failure::bad_input("--occlusion takes one --size")),
    }
}

/// Says early what no device would be given.
fn check_counts(args: &BenchArgs, device: &DeviceInfo) -> Result<(), Failure> {
    let each = size_of::<Ray>().max(size_of::<RayAnswer>()) as u64;
    let most = device.limits.max_storage_buffer_range_bytes / each;
    let [width, height] = camera_size(args)?;
    let pixels = u64::from(width) * u64::from(height);
    for (option, count) in
        [(format!("--rays {}", args.rays), args.rays.into()), (format!("--size {width}x{height}"), pixels)]
    {
        if count > most {
            let name = &device.name;
            return Err(Failure::bad_input(format!(
                "{option}: {name} takes at most {most} rays at once; ask for fewer"
            )));
        }
    }
    Ok(())
}

struct Bench<'a> {
    args: &'a BenchArgs,
    /// Of the camera's picture.
    size: [u32; 2],
    /// The first of them is the one that every device has.
    offered: Vec<OcclusionBackend>,
    /// The others, and what the device lacks for them.
    not_offered: Vec<(OcclusionBackend, String)>,
    on_processor: bool,
    executor: Executor,
    progress: Progress,
    interrupt: &'a Interrupt,
}

/// A body that the device offers, and what was found about it.
struct Measured {
    backend: OcclusionBackend,
    /// Of each kind of rays with each question.
    facts: Vec<Facts>,
    /// Of what is compacted later.
    bytes_as_built: Option<u64>,
    rounds: Vec<Round>,
}

/// What stays the same from round to round.
struct Facts {
    blocked: usize,
    cut_short: u32,
    /// Of the answers of the first body: in whether anything is hit, and in what.
    differ: [usize; 2],
    /// The largest relative difference of the distance where both hit.
    distance: f64,
}

/// What a body did in one round: how it got ready, and each kind of rays with each question.
struct Round {
    ready: Ready,
    traced: Vec<Traced>,
}

impl Bench<'_> {
    /// Measures one scene; nothing if Ctrl-C came before the first round was done.
    fn scene(&mut self, choice: &Path) -> Result<Option<SceneReport>, Failure> {
        let chosen = scene_choice::load(choice, &mut self.progress)?;
        let view = View::new(chosen.scene.default_camera(), self.size);
        let light = chosen.scene.lights.first().copied();
        let scene = bare(chosen.scene);
        let mut left_out = Vec::new();
        let rays = self.rays(&scene, &view, light.as_ref(), &mut left_out)?;
        let mut bodies = self.warm_up(&scene, &rays)?;
        self.measure(&format!("measuring {}", chosen.name), &scene, &rays, &mut bodies)?;
        let measured = bodies.iter().map(|body| body.rounds.len()).min().unwrap_or_default();
        if measured == 0 {
            return Ok(None);
        }
        let mut report = SceneReport {
            scene: chosen.name,
            triangles: scene.meshes.iter().map(Mesh::triangle_count).sum(),
            triangles_placed: scene.triangle_count(),
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            size: self.size,
            rounds: Rounds { warmup: WARMUP, measured },
            bodies: Vec::new(),
            left_out,
        };
        for body in &bodies {
            let body = body_report(body, &rays, report.triangles, report.bodies.first(), self.on_processor);
            report.bodies.push(body);
        }
        let lacking = self.not_offered.iter();
        report.bodies.extend(lacking.map(|(body, why)| BodyReport::not_offered(body.name(), why.clone())));
        Ok(Some(report))
    }

    /// The first round of each body, of which answers are kept and times are not: drivers compile shaders at their
    /// first use.
    fn warm_up(&mut self, scene: &Scene, rays: &[UploadedRays]) -> Result<Vec<Measured>, Failure> {
        let mut first: Vec<Vec<RayAnswer>> = Vec::new();
        let mut bodies = Vec::new();
        for backend in self.offered.clone() {
            if self.interrupt.requested() {
                break;
            }
            let bytes_as_built = match backend {
                OcclusionBackend::RayQuery => Some(Body::bytes_as_built(scene, backend, &mut self.executor)?),
                OcclusionBackend::Bvh | OcclusionBackend::None => None,
            };
            let Round { traced, .. } = self.round(scene, backend, rays, true)?;
            bodies.push(Measured { backend, facts: compare(&traced, &first), bytes_as_built, rounds: Vec::new() });
            if first.is_empty() {
                first = traced.into_iter().map(|traced| traced.answers).collect();
            }
        }
        Ok(bodies)
    }

    /// All other rounds, or as many whole ones as there are before Ctrl-C.
    fn measure(
        &mut self,
        what: &str,
        scene: &Scene,
        rays: &[UploadedRays],
        bodies: &mut [Measured],
    ) -> Result<(), Failure> {
        for round in 0..self.args.rounds {
            let mut done = Vec::new();
            for body in bodies.iter() {
                self.progress.update(what, round.into(), self.args.rounds.into());
                if self.interrupt.requested() {
                    return Ok(());
                }
                done.push(self.round(scene, body.backend, rays, false)?);
            }
            bodies.iter_mut().zip(done).for_each(|(body, round)| body.rounds.push(round));
        }
        Ok(())
    }

    /// Rays of each kind, on the device. The camera's are traced once to find where the others begin.
    fn rays(
        &mut self,
        scene: &Scene,
        view: &View,
        light: Option<&Light>,
        left_out: &mut Vec<String>,
    ) -> Result<Vec<UploadedRays>, Failure> {
        let mut body = Body::build(scene, self.offered[0], &mut self.executor, &mut self.progress)?;
        let center = body.renderer.scene_center();
        let camera = rays::camera(view, center);
        let mut uploaded = vec![upload(&mut self.executor, &camera)?];
        let answers = body.trace(&mut self.executor, &uploaded[0], Question::Closest, true)?.answers;
        let seen = rays::seen(scene, center, &camera, &answers);
        let diffuse = rays::diffuse(&seen, self.args.rays).ok_or("diffuse rays: the camera sees nothing");
        let shadow = match light {
            Some(light) => rays::shadow(&seen, light, center, self.args.rays)
                .ok_or("shadow rays: nothing that the camera sees faces the first light"),
            None => Err("shadow rays: the scene has no light"),
        };
        for rays in [diffuse, shadow] {
            match rays {
                Ok(rays) => uploaded.push(upload(&mut self.executor, &rays)?),
                Err(why) => left_out.push(why.to_owned()),
            }
        }
        Ok(uploaded)
    }

    fn round(
        &mut self,
        scene: &Scene,
        backend: OcclusionBackend,
        rays: &[UploadedRays],
        answers: bool,
    ) -> Result<Round, Failure> {
        let mut body = Body::build(scene, backend, &mut self.executor, &mut self.progress)?;
        let mut traced = Vec::new();
        for rays in rays {
            for (question, _) in QUESTIONS {
                traced.push(body.trace(&mut self.executor, rays, question, answers)?);
            }
        }
        Ok(Round { ready: body.ready, traced })
    }
}

/// What the answers of a body say, alone and beside those of the first body.
fn compare(traced: &[Traced], first: &[Vec<RayAnswer>]) -> Vec<Facts> {
    let mut beside = first.iter();
    traced
        .iter()
        .map(|Traced { answers, cut_short, .. }| {
            let blocked = answers.iter().filter(|answer| answer.blocked != 0).count();
            let (mut differ, mut distance) = ([0; 2], 0.0_f64);
            for (a, b) in answers.iter().zip(beside.next().into_iter().flatten()) {
                let same_place = (a.instance, a.triangle) == (b.instance, b.triangle);
                differ[0] += usize::from(a.blocked != b.blocked);
                if a.blocked != 0 && b.blocked != 0 {
                    differ[1] += usize::from(!same_place);
                    let [a, b] = [a.t, b.t].map(f64::from);
                    distance = distance.max((a - b).abs() / a.abs().max(b.abs()).max(f64::MIN_POSITIVE));
                }
            }
            Facts { blocked, cut_short: *cut_short, differ, distance }
        })
        .collect()
}

/// A body over its rounds, beside the first one if it is not that.
fn body_report(
    body: &Measured,
    rays: &[UploadedRays],
    triangles: usize,
    first: Option<&BodyReport>,
    on_processor: bool,
) -> BodyReport {
    let Measured { backend, facts, bytes_as_built, rounds } = body;
    let ready = |value: fn(&Ready) -> Option<u64>| Spread::of(rounds.iter().map(|round| value(&round.ready)));
    let kinds = rays.iter().flat_map(|rays| QUESTIONS.map(|(_, question)| (rays, question)));
    let rays = kinds.zip(facts).enumerate().map(|(index, ((rays, question), facts))| {
        let over =
            |value: fn(&Traced) -> Option<u64>| Spread::of(rounds.iter().map(|round| value(&round.traced[index])));
        let ns = over(|traced| traced.ns);
        let cpu_ns = over(|traced| traced.cpu_ns).filter(|_| on_processor);
        let millions = |time: Spread| (time.median > 0).then(|| f64::from(rays.count) * 1e3 / time.median as f64);
        let beside = first.map(|first| BesideReport {
            body: first.body,
            speed: ratio(first.rays[index].ns, ns),
            speed_by_cpu: ratio(first.rays[index].cpu_ns, cpu_ns),
            differ_in_blocked: facts.differ[0],
            differ_in_triangle: facts.differ[1],
            largest_difference_of_distance: facts.distance,
        });
        RaysReport {
            rays: rays.name,
            question,
            count: rays.count,
            blocked: facts.blocked,
            cut_short: facts.cut_short,
            ns,
            cpu_ns,
            mrays_per_s: ns.and_then(millions),
            mrays_per_cpu_s: cpu_ns.and_then(millions),
            beside,
        }
    });
    BodyReport {
        body: backend.name(),
        not_offered: None,
        rays: rays.collect(),
        ready: ready(|ready| Some(ready.wall_ns)).map(|wall_ns| ReadyReport {
            wall_ns,
            cpu_ns: ready(|ready| ready.cpu_ns),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            steps: steps(rounds),
        }),
        memory: rounds.last().map(|round| memory(&round.ready, *bytes_as_built, triangles)),
    }
}

/// How many times as fast this one is as the first, by their medians.
fn ratio(first: Option<Spread>, this: Option<Spread>) -> Option<f64> {
    let (first, this) = (first?.median, this?.median);
    (this > 0).then(|| first as f64 / this as f64)
}

/// Each step of the build over the rounds; steps of one name are added up, and so are copies without spare room.
fn steps(rounds: &[Round]) -> Vec<StepReport> {
    let name_of =
        |step: &Update| if step.pass.starts_with("compact ") { "compact".to_owned() } else { step.pass.clone() };
    let mut names: Vec<String> = Vec::new();
    for name in rounds.iter().flat_map(|round| round.ready.steps.iter().map(name_of)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let of_round = |round: &Round, name: &str| {
        round.ready.steps.iter().filter(|step| name_of(step) == name).map(|step| step.ns).sum::<u64>()
    };
    let spread = |name: &str| Spread::of(rounds.iter().map(|round| Some(of_round(round, name))));
    names.into_iter().filter_map(|step| Some(StepReport { ns: spread(&step)?, step })).collect()
}

fn memory(ready: &Ready, bytes_as_built: Option<u64>, triangles: usize) -> MemoryReport {
    let resources: Vec<ResourceReport> =
        ready.memory.iter().map(|(name, bytes)| ResourceReport { name: name.clone(), bytes: *bytes }).collect();
    let bytes = resources.iter().map(|resource| resource.bytes).sum();
    MemoryReport { bytes, bytes_per_triangle: bytes as f64 / triangles.max(1) as f64, bytes_as_built, resources }
}
