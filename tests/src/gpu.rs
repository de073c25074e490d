//! A device under validation, and frames rendered on it.

use crate::Picture;
use mica_gpu::{Device, DeviceOptions, Executor, Messages, Timing, Validation};
use mica_graph::{Buffer, Graph};
use mica_render::{Cache, LeftOut, OcclusionBackend, Question, Ray, RayAnswer, RayCounts, Renderer, View};
use std::sync::{Arc, LazyLock};

/// A device of our own with validation and synchronisation validation on, and an executor on it. Dropping it fails the
/// test if there was any message, leaks included.
///
/// Each test has its own, so that a message fails the test that caused it.
pub struct Gpu {
    /// Taken when dropped, before the device.
    executor: Option<Executor>,
    device: Option<Arc<Device>>,
    messages: Messages,
}

/// A frame that was rendered.
pub struct Shot {
    /// Its linear radiance.
    pub picture: Picture,
    /// Names of the declared passes that bring tables up to date, in order.
    pub updates: Vec<String>,
    /// Names of the declared passes that draw, in order.
    pub draws: Vec<String>,
    /// Names of all resources that the declared passes use.
    pub resources: Vec<String>,
    /// What the frame does without.
    pub left_out: Vec<LeftOut>,
}

impl Shot {
    /// The updates, less uploads, fills and other transfers.
    pub fn update_shaders(&self) -> Vec<&str> {
        self.updates.iter().map(String::as_str).filter(|name| !name.contains(' ')).collect()
    }

    /// Whether any declared pass has this name.
    pub fn declares(&self, pass: &str) -> bool {
        self.updates.iter().chain(&self.draws).any(|name| name == pass)
    }
}

impl Gpu {
    /// The best device there is.
    #[expect(clippy::new_without_default, reason = "nothing about opening a device is a default")]
    pub fn new() -> Self {
        let device =
            Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })
                .expect("a device with validation (ci/setup --test installs one)");
        let executor = Executor::new(device.clone()).expect("an executor");
        let messages = device.messages();
        Self { executor: Some(executor), device: Some(device), messages }
    }

    /// The executor.
    pub fn executor(&mut self) -> &mut Executor {
        self.executor.as_mut().expect("the executor lives until this is dropped")
    }

    /// Who answers about occlusion on this device: the BVH always, ray queries where it offers them. Where the environment
    /// says that it has to (`MICA_EXPECT=ray-query`), a device without them fails the test.
    pub fn occlusion_bodies(&self) -> Vec<OcclusionBackend> {
        let info = self.device.as_ref().expect("the device lives until this is dropped").info();
        let expected = std::env::var("MICA_EXPECT").is_ok_and(|expected| expected == "ray-query");
        let lacks = &info.ray_query_lacks;
        assert!(!expected || lacks.is_empty(), "ray queries are expected here: {} lacks {lacks:?}", info.name);
        let ray_query = info.offers_ray_query().then_some(OcclusionBackend::RayQuery);
        [OcclusionBackend::Bvh].into_iter().chain(ray_query).collect()
    }

    /// Makes or loads what takes too long for a frame, once for all tests of this process.
    pub fn precompute(&mut self, renderer: &mut Renderer) {
        let cache = dpf_cache();
        renderer.precompute(self.executor(), Some(cache), &mut |_, _, _| {}).expect("the tables are made");
    }

    /// Renders one frame.
    pub fn render(&mut self, renderer: &mut Renderer, view: &View) -> Shot {
        self.render_sample(renderer, view, None)
    }

    /// Renders one frame, which shows the mean of itself and so many `earlier` ones.
    pub fn render_sample(&mut self, renderer: &mut Renderer, view: &View, earlier: Option<u32>) -> Shot {
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, view, earlier).expect("the frame is declared");
        let name = |passes: &[mica_graph::Pass]| passes.iter().map(|pass| pass.name.clone()).collect();
        let updates = name(&graph.passes()[frame.updates.clone()]);
        let draws = name(&graph.passes()[frame.updates.end..]);
        let mut resources: Vec<String> =
            graph.passes().iter().flat_map(|pass| &pass.uses).map(|used| used.resource.name.clone()).collect();
        resources.sort();
        resources.dedup();
        let download = graph.download_image(&frame.radiance);
        let mut run = self.executor().run(graph, Timing::Overlapped).expect("the frame runs");
        let picture = Picture::from_bytes(view.size, &run.take(download));
        Shot { picture, updates, draws, resources, left_out: frame.left_out }
    }

    /// Asks a renderer about rays.
    pub fn trace(&mut self, renderer: &mut Renderer, rays: &[Ray], question: Question) -> (Vec<RayAnswer>, RayCounts) {
        let mut graph = Graph::new();
        let mut asked = graph.buffer("rays", size_of_val(rays) as u64);
        graph.upload(&mut asked, bytemuck::cast_slice::<_, u8>(rays));
        let mut answers = graph.buffer("answers", (rays.len() * size_of::<RayAnswer>()) as u64);
        let counts = renderer.trace(&mut graph, &asked, rays.len() as u32, question, &mut answers).expect("declared");
        let read = self.run(graph, &[&answers, &counts]);
        (bytemuck::pod_collect_to_vec(&read[0]), bytemuck::pod_read_unaligned(&read[1]))
    }

    /// Runs a graph of the test's own and returns the bytes of the buffers named.
    pub fn run(&mut self, mut graph: Graph, buffers: &[&Buffer]) -> Vec<Vec<u8>> {
        let downloads: Vec<_> = buffers.iter().map(|buffer| graph.download(buffer)).collect();
        let mut run = self.executor().run(graph, Timing::Overlapped).expect("the graph runs");
        downloads.into_iter().map(|download| run.take(download)).collect()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        drop(self.executor.take());
        drop(self.device.take());
        if !std::thread::panicking() {
            let said: Vec<String> = self.messages.take().iter().map(ToString::to_string).collect();
            assert!(said.is_empty(), "validation said:\n{}", said.join("\n"));
        }
    }
}

/// Where the directional probability tables are kept for the tests of this process. The folder is emptied first, so
/// that no test sees the tables of an older shader.
pub fn dpf_cache() -> &'static Cache {
    static CACHE: LazyLock<Cache> = LazyLock::new(|| {
        // Beside the test program, in the target folder. If another run of it is under way, it makes its tables again.
        let program = std::env::current_exe().expect("the test program has a path");
        let folder = program.with_file_name("mica-tests-tables");
        let _ = std::fs::remove_dir_all(&folder);
        Cache::new(folder)
    });
    &CACHE
}
