//! A scene on a device, set up as the command line says, and the frames that are made of it.

use crate::args::{CameraChoice, DeviceArgs, SceneArgs};
use crate::environment_choice::{self, ChosenEnvironment};
use crate::error::Failure;
use crate::measure::{self, TracedRays};
use crate::occlusion_choice;
use crate::picture::Picture;
use crate::progress::Progress;
use crate::scene_choice::{self, ChosenScene};
use mica_gpu::{Device, DeviceInfo, DeviceKind, DeviceOptions, Executor, ExecutorOptions, Run, Timing, Validation};
use mica_graph::{Graph, Plan, Shader};
use mica_render::scene::{Camera, Light};
use mica_render::{Cache, Frame, LeftOut, Renderer, Update, View, check_method};
use mica_shaders::types::RayCounts;
use std::sync::Arc;
use std::time::Duration;

/// A scene on a device.
pub struct Session {
    /// The scene, as it was asked for.
    pub scene: String,
    /// The environment: name, path, `constant:R,G,B` or `none`.
    pub environment: String,
    /// How far it is turned, in degrees.
    pub environment_rotation_deg: f64,
    /// The scene's lights and the command line's.
    pub lights: Vec<Light>,
    /// Why occlusion is answered as it is.
    pub occlusion_why: String,
    /// The scene, prepared.
    pub renderer: Renderer,
    /// What runs its frames.
    pub executor: Executor,
    /// What they show.
    pub view: View,
    cache: Option<Cache>,
    asked_method: Option<String>,
}

/// A finished frame.
pub struct Shot {
    /// What was executed, and how long it took.
    pub run: Run,
    /// For each pass of the plan, whether it brought a table up to date.
    pub is_update: Vec<bool>,
    /// What the frame did without.
    pub left_out: Vec<LeftOut>,
    /// The picture, where it was wanted.
    pub picture: Option<Picture>,
    /// The rays of each pass that traces any, where the picture was wanted.
    pub rays: Vec<TracedRays>,
    /// What each pixel sees, where it was wanted.
    pub surface: Option<Surface>,
}

/// What a frame is to bring back beside its times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// The picture, and how many rays it took.
    pub picture: bool,
    /// What each pixel sees.
    pub surface: bool,
}

/// What each pixel sees, row by row from the top.
pub struct Surface {
    /// The instance, counted from 1, and its triangle; 0 where nothing is.
    pub ids: Vec<[u32; 2]>,
    /// Derivatives of the flakes' texture coordinates over the pixel: du/dx, dv/dx, du/dy, dv/dy; 0 where nothing glints.
    pub footprint: Vec<[f32; 4]>,
}

/// A frame that was declared and not executed.
pub struct Declared {
    /// Its passes.
    pub graph: Graph,
    /// Name and reason of each.
    passes: Vec<(String, String)>,
    frame: Frame,
}

impl Declared {
    /// What the frame does without.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.frame.left_out
    }

    /// For each pass that a plan of this frame kept, in order, whether it brings a table up to date.
    pub fn updates_of(&self) -> impl Fn(&Plan) -> Vec<bool> + use<> {
        let (declared, updates) = (self.passes.clone(), self.frame.updates.clone());
        move |plan| {
            let mut next = 0;
            let mut is_update = Vec::with_capacity(plan.passes.len());
            for pass in &plan.passes {
                // Planning leaves passes out and keeps the order of the others; what was appended later is no update.
                let same = |(name, why): &(String, String)| *name == pass.name && *why == pass.why;
                let found = declared[next..].iter().position(same).map(|skipped| next + skipped);
                let brings_back = pass.name.starts_with("download ");
                is_update.push(!brings_back && found.is_some_and(|index| updates.contains(&index)));
                next = found.map_or(next, |index| index + 1);
            }
            is_update
        }
    }
}

/// What is on the command line of a scene, loaded.
pub struct Loaded {
    chosen: ChosenScene,
    environment: ChosenEnvironment,
}

impl Loaded {
    /// Loads the scene and its environment.
    pub fn new(args: &SceneArgs, progress: &mut Progress) -> Result<Self, Failure> {
        if let Some(name) = &args.method {
            check_method(name)?;
        }
        let mut chosen = scene_choice::load(&args.scene, progress)?;
        if args.no_lights {
            chosen.scene.lights.clear();
        }
        let has_lights = !(chosen.scene.lights.is_empty() && args.light.is_empty());
        let environment =
            environment_choice::choose(args.env.as_deref(), args.env_rotate, &chosen, has_lights, progress)?;
        progress.clear();
        Ok(Self { chosen, environment })
    }

    /// Letters that change with anything that is seen of both.
    pub fn fingerprint(&self) -> String {
        let map = self.environment.environment.as_ref().map(|environment| environment.map.fingerprint());
        format!("{} {}", self.chosen.scene.fingerprint(), map.as_deref().unwrap_or("none"))
    }
}

impl Session {
    /// Loads the scene, finds a device, and applies all settings. No frame is made yet.
    pub fn new(args: &SceneArgs, progress: &mut Progress) -> Result<Self, Failure> {
        Self::of(Loaded::new(args, progress)?, args, None)
    }

    /// The same with a scene that is loaded already, and perhaps on the device of an earlier session, whose pipelines are
    /// there already: which device, how much memory and which cache were decided then.
    pub fn of(loaded: Loaded, args: &SceneArgs, earlier: Option<Executor>) -> Result<Self, Failure> {
        let Loaded { chosen, environment } = loaded;
        let camera = args.camera.map_or_else(|| chosen.scene.default_camera(), camera);
        let exposure = args.exposure.exp2() as f32;
        let view = View { exposure, ..View::new(camera, args.size) };

        let device = match &earlier {
            Some(executor) => executor.device().clone(),
            None => self::device(&args.device)?,
        };
        check_size(args.size, device.info())?;
        let triangles = chosen.scene.meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum();
        let occlusion = occlusion_choice::choose(args.occlusion, device.info(), triangles)?;

        let ChosenScene { name, scene, .. } = chosen;
        let lights = scene.lights.iter().chain(&args.light).copied().collect();
        let mut renderer = Renderer::new(scene, &args.light, environment.environment.as_ref(), occlusion.backend)?;
        for change in args.set.iter().chain(&args.glint) {
            change.check(renderer.materials())?;
        }
        if let Some(name) = &args.method {
            renderer.set_method(None, name)?;
        }
        for change in args.set.iter().chain(&args.glint) {
            change.apply(&mut renderer)?;
        }
        if renderer.materials().is_empty() && !(args.set.is_empty() && args.method.is_none()) {
            log::warn!("{name}: no material glints (none has glint_count in its extras): settings have no effect");
        }

        let cache = cache(&args.device);
        let executor = match earlier {
            Some(executor) => executor,
            None => executor(device, cache.as_ref(), args.device.memory)?,
        };
        Ok(Self {
            scene: name,
            environment: environment.name,
            environment_rotation_deg: args.env_rotate,
            lights,
            occlusion_why: occlusion.why,
            renderer,
            executor,
            view,
            cache,
            asked_method: args.method.clone(),
        })
    }

    /// Where tables and measurements are kept, if they are.
    pub fn cache(&self) -> Option<&Cache> {
        self.cache.as_ref()
    }

    /// The device.
    pub fn device(&self) -> &DeviceInfo {
        self.executor.device().info()
    }

    /// What runs frames, for another session.
    pub fn into_executor(self) -> Executor {
        self.executor
    }

    /// The names of the methods in use, or of the one that would be.
    pub fn method(&self) -> String {
        let mut names: Vec<&str> = self.renderer.materials().iter().map(|material| material.method.name).collect();
        names.sort_unstable();
        names.dedup();
        match (names.is_empty(), &self.asked_method) {
            (false, _) => names.join("+"),
            (true, Some(asked)) => asked.clone(),
            (true, None) => mica_render::DEFAULT_METHOD.to_owned(),
        }
    }

    /// Whether frames take tables from the cache, and store those that they make.
    pub fn keep_tables(&mut self, keep: bool) {
        let cache = self.cache.clone().filter(|_| keep);
        self.renderer.keep_tables(cache.map(|cache| (cache, self.executor.device().info())));
    }

    /// Makes the tables that take too long for a frame, or takes them from the cache.
    pub fn precompute(&mut self, progress: &mut Progress) -> Result<Vec<Update>, Failure> {
        let mut show = |what: &str, done, total| progress.update(what, done, total);
        let updates = self.renderer.precompute(&mut self.executor, self.cache.as_ref(), &mut show)?;
        progress.clear();
        Ok(updates)
    }

    /// The same, whatever the cache has: for who wants to know how long it takes.
    pub fn precompute_anew(&mut self) -> Result<Vec<Update>, Failure> {
        Ok(self.renderer.precompute(&mut self.executor, None, &mut |_, _, _| {})?)
    }

    /// Declares a frame. With `sample`, it shows the mean of itself and the samples before it.
    pub fn declare(&mut self, sample: Option<u32>) -> Result<Declared, Failure> {
        let view = sample.map_or_else(|| self.view.clone(), |sample| self.view.sample(sample));
        self.declare_view(&view, sample)
    }

    /// Declares a frame of any view; with `earlier`, the mean of itself and so many before it.
    fn declare_view(&mut self, view: &View, earlier: Option<u32>) -> Result<Declared, Failure> {
        let mut graph = Graph::new();
        let frame = self.renderer.frame(&mut graph, view, earlier)?;
        graph.export(&frame.display);
        let passes = graph.passes().iter().map(|pass| (pass.name.clone(), pass.why.clone())).collect();
        Ok(Declared { graph, passes, frame })
    }

    /// Makes a frame, and brings its picture back if `picture` says so.
    pub fn frame(&mut self, sample: Option<u32>, timing: Timing, picture: bool) -> Result<Shot, Failure> {
        let declared = self.declare(sample)?;
        self.execute(declared, timing, Wanted { picture, surface: false })
    }

    /// Makes a frame of another view than the session's own.
    pub fn look(&mut self, view: &View, timing: Timing, wanted: Wanted) -> Result<Shot, Failure> {
        let declared = self.declare_view(view, None)?;
        self.execute(declared, timing, wanted)
    }

    /// The same frame with other shaders in the place of some, and how many passes that exchanged.
    pub fn look_by(
        &mut self,
        view: &View,
        timing: Timing,
        exchanged: &[[&'static Shader; 2]],
    ) -> Result<(Shot, usize), Failure> {
        let mut declared = self.declare_view(view, None)?;
        let count = exchanged.iter().map(|[from, to]| declared.graph.exchange(from, to)).sum();
        Ok((self.execute(declared, timing, Wanted { picture: true, ..Wanted::default() })?, count))
    }

    fn execute(&mut self, mut declared: Declared, timing: Timing, wanted: Wanted) -> Result<Shot, Failure> {
        let updates_of = declared.updates_of();
        let Declared { graph: g, frame, .. } = &mut declared;
        let size = [frame.radiance.extent().width, frame.radiance.extent().height];
        let pictures = wanted.picture.then(|| (g.download_image(&frame.radiance), g.download_image(&frame.display)));
        let surfaces = wanted.surface.then(|| {
            let footprint = frame.footprint.as_ref().map(|footprint| g.download_image(footprint));
            (g.download_image(&frame.ids), footprint)
        });
        let counts: Vec<_> =
            frame.rays.iter().filter(|_| wanted.picture).map(|of| (of.pass, g.download(&of.counts))).collect();
        let mut run = self.executor.run(std::mem::take(g), timing)?;
        std::mem::take(&mut frame.made).into_iter().for_each(|table| table.store(&mut run));
        let picture = pictures.map(|(radiance, display)| Picture {
            size,
            radiance: floats(&run.take(radiance)),
            display: run.take(display),
        });
        let surface = surfaces.map(|(ids, footprint)| Surface {
            ids: bytemuck::pod_collect_to_vec(&run.take(ids)),
            footprint: match footprint {
                Some(footprint) => bytemuck::pod_collect_to_vec(&run.take(footprint)),
                None => vec![[0.0; 4]; (size[0] * size[1]) as usize],
            },
        });
        let counts = counts.into_iter().map(|(pass, download)| (pass, run.take(download)));
        let counts = counts.map(|(pass, bytes)| (pass, bytemuck::pod_read_unaligned::<RayCounts>(&bytes)));
        let rays = measure::rays(counts);
        let is_update = updates_of(&run.plan);
        Ok(Shot { is_update, run, left_out: declared.frame.left_out, picture, rays, surface })
    }
}

/// 32-bit floats as the device stores them.
fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|word| f32::from_ne_bytes(*word)).collect()
}

/// The camera that was asked for.
pub fn camera(choice: CameraChoice) -> Camera {
    let CameraChoice { eye, target, vertical_fov_deg } = choice;
    // Depth is reversed and a float, so a near plane this close costs nothing.
    let near = 1e-6 * eye.distance(target).min(100.0);
    Camera::looking_at("command line", eye, target, vertical_fov_deg.to_radians(), near)
}

/// The device that is asked for.
pub fn device(args: &DeviceArgs) -> Result<Arc<Device>, Failure> {
    let validation = if args.validation { Validation::Synchronization } else { Validation::Off };
    Ok(Device::new(&DeviceOptions { select: args.device.clone(), validation })?)
}

/// Whether a device holds pictures of this size.
pub fn check_size(size: [u32; 2], device: &DeviceInfo) -> Result<(), Failure> {
    let most = device.limits.max_image_side_2d;
    if size.into_iter().all(|side| side <= most) {
        return Ok(());
    }
    let [width, height] = size;
    Err(Failure::bad_input(format!("--size {width}x{height}: {} holds images of {most} pixels a side", device.name)))
}

/// Where tables and pipelines are kept, if they are.
pub fn cache(args: &DeviceArgs) -> Option<Cache> {
    match (&args.cache, args.no_cache) {
        (_, true) => None,
        (Some(folder), false) => Some(Cache::new(folder)),
        (None, false) => Cache::of_user(),
    }
}

/// What runs frames on a device.
pub fn executor(
    device: Arc<Device>,
    cache: Option<&Cache>,
    memory_mebibytes: Option<u64>,
) -> Result<Executor, Failure> {
    let DeviceInfo { name, driver, driver_version, .. } = device.info();
    let pipeline_cache = cache.map(|cache| cache.folder().join(pipelines_file([name, driver, driver_version])));
    let mut options = ExecutorOptions { pipeline_cache, ..Default::default() };
    if device.info().kind == DeviceKind::Cpu {
        // A driver on the processor grants more than there is, and the system then ends the process: stop before that.
        options.memory_limit_bytes = available_memory_bytes().map(|bytes| bytes / 4 * 3);
        // It does not hang either: it is slow, and large tables take minutes.
        options.timeout = Duration::from_secs(3600);
    }
    if let Some(mebibytes) = memory_mebibytes {
        options.memory_limit_bytes = Some(mebibytes << 20);
    }
    Ok(Executor::with_options(device, options)?)
}

/// The file for the pipelines of one driver on one device: two drivers may offer a device of the same name.
fn pipelines_file(words: [&str; 3]) -> String {
    let plain = words.join(" ").replace(|c: char| !c.is_ascii_alphanumeric() && c != '.', " ");
    let mut name = plain.split_whitespace().collect::<Vec<_>>().join("-");
    // Each of the words may be as long as a file name.
    name.truncate(200);
    format!("pipelines-{name}.bin")
}

/// What Linux could give to a process without swapping.
fn available_memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix(" kB")?.parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::pipelines_file;

    #[test]
    fn drivers_of_one_device_keep_their_pipelines_apart() {
        let of = |version| pipelines_file(["llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe", version]);
        let older = of("Mesa 22.3.6 (LLVM 15.0.6)");
        assert_eq!(older, "pipelines-llvmpipe-LLVM-15.0.6-256-bits-llvmpipe-Mesa-22.3.6-LLVM-15.0.6.bin");
        assert_ne!(older, of("Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"));
        assert_eq!(pipelines_file(["../a/b", "\u{e9}\n", ""]), "pipelines-..-a-b.bin");
        assert!(pipelines_file([&"x".repeat(256), &"y".repeat(256), "1"]).len() < 255);
    }
}
