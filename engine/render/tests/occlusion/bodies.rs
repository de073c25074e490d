//! A device under validation, and both bodies of occlusion on it, through the renderer as a program has it.

use mica_gpu::{Device, DeviceOptions, Executor, Timing, Validation};
use mica_graph::{Download, Graph};
use mica_render::scene::Scene;
use mica_render::{OcclusionBackend, Question, Renderer};
use mica_shaders::types::{Ray, RayAnswer, RayCounts};
use std::sync::Arc;

/// What one body says of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Said {
    pub closest: RayAnswer,
    /// Where that was asked too.
    pub any: Option<RayAnswer>,
}

/// What one body says of a list of rays.
pub struct Asked {
    pub of: OcclusionBackend,
    pub said: Vec<Said>,
    /// Rays that were rays, over both questions.
    pub traced: u32,
    /// Rays that ran out of steps, over both questions.
    pub cut_short: u32,
}

/// A device; every run fails the test where validation has something to say.
pub struct Bodies {
    executor: Executor,
    with_ray_query: bool,
}

impl Bodies {
    /// On the best device there is. One without ray queries has one body, and refuses the other by name: this test of it
    /// is made each time, so that no device goes without either. Where the environment sets `MICA_EXPECT=ray-query`, such
    /// a device fails the test.
    pub fn new() -> Self {
        let device = device();
        let with_ray_query = device.info().offers_ray_query();
        let mut bodies = Self { executor: Executor::new(device.clone()).expect("an executor"), with_ray_query };
        if !with_ray_query {
            let expected = std::env::var("MICA_EXPECT").is_ok_and(|expected| expected == "ray-query");
            assert!(!expected, "MICA_EXPECT=ray-query, and {} offers none", device.info().name);
            bodies.is_refused();
        }
        bodies
    }

    /// Asserts that ray queries are refused, in words.
    fn is_refused(&mut self) {
        let scene = crate::scenes::alone("one", crate::meshes::identical(1));
        let renderer = Renderer::new(scene, &[], None, OcclusionBackend::RayQuery);
        let mut renderer = renderer.expect("a renderer");
        let mut graph = Graph::new();
        let mut rays = graph.buffer("rays", size_of::<Ray>() as u64);
        graph.upload(&mut rays, bytemuck::bytes_of(&Ray::default()));
        let mut answers = graph.buffer("answers", size_of::<RayAnswer>() as u64);
        let said = match renderer.trace(&mut graph, &rays, 1, Question::Any, &mut answers) {
            Err(error) => error.to_string(),
            Ok(_) => match self.executor.run(graph, Timing::Overlapped) {
                Err(error) => error.to_string(),
                Ok(_) => panic!("a device without ray queries answered one"),
            },
        };
        assert!(said.to_lowercase().contains("ray quer"), "the refusal does not say what is missing: {said}");
    }

    /// The bodies that this device has.
    pub fn backends(&self) -> &'static [OcclusionBackend] {
        const BOTH: &[OcclusionBackend] = &[OcclusionBackend::Bvh, OcclusionBackend::RayQuery];
        if self.with_ray_query { BOTH } else { &BOTH[..1] }
    }

    /// The device's name, by which a driver's habits are known.
    pub fn device_name(&self) -> String {
        self.executor.device().info().name.clone()
    }

    /// A renderer for each body.
    pub fn open(&self, scene: &Scene) -> Vec<Renderer> {
        let open = |&backend| Renderer::new(scene.clone(), &[], None, backend).expect("a renderer");
        self.backends().iter().map(open).collect()
    }

    /// What each renderer says of each ray: what it meets first, and of the first `any` of them whether it meets anything.
    pub fn ask(&mut self, renderers: &mut [Renderer], rays: &[Ray], any: usize) -> Vec<Asked> {
        let mut graph = Graph::new();
        let mut list = graph.buffer("rays", size_of_val(rays) as u64);
        graph.upload(&mut list, Arc::<[u8]>::from(bytemuck::cast_slice(rays)));
        let mut downloads = Vec::new();
        for renderer in renderers {
            let asked = [(Question::Closest, rays.len()), (Question::Any, any)].map(|(question, count)| {
                let mut answers = graph.buffer("answers", (count.max(1) * size_of::<RayAnswer>()) as u64);
                let counts = renderer.trace(&mut graph, &list, count as u32, question, &mut answers);
                (graph.download(&answers), graph.download(&counts.expect("rays are traced")))
            });
            downloads.push((renderer.occlusion(), asked));
        }
        let mut run = self.executor.run(graph, Timing::Overlapped).expect("a frame");
        silent(self.executor.device());
        let mut read = |(of, asked): (OcclusionBackend, [(Download, Download); 2])| {
            let (mut traced, mut cut_short) = (0, 0);
            let [closest, any_hits] = asked.map(|(answers, counts)| {
                let counts: RayCounts = bytemuck::pod_read_unaligned(&run.take(counts));
                traced += counts.traced;
                cut_short += counts.cut_short;
                bytemuck::pod_collect_to_vec::<u8, RayAnswer>(&run.take(answers))
            });
            let any_hits = any_hits.into_iter().take(any).map(Some).chain(std::iter::repeat(None));
            let said = closest.into_iter().zip(any_hits).map(|(closest, any)| Said { closest, any }).collect();
            Asked { of, said, traced, cut_short }
        };
        downloads.into_iter().map(&mut read).collect()
    }
}

/// The best device there is, with validation.
pub fn device() -> Arc<Device> {
    Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })
        .expect("a device with validation")
}

/// Fails where validation has said something.
pub fn silent(device: &Device) {
    let messages = device.take_messages();
    assert!(messages.is_empty(), "validation said {messages:?}");
}
