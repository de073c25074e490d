//! What blocks rays: one interface for the passes that ask, and two bodies that answer.

mod bvh;
mod structures;

use crate::moved::Moved;
use crate::scene::{AlphaMode, Instance, Mesh, Scene};
use crate::scene_buffers::SceneBuffers;
use crate::{Progress, RenderError, Update};
use bvh::Bvh;
use glam::DAffine3;
use mica_gpu::{DeviceInfo, DeviceKind, Executor, Timing};
use mica_graph::{Buffer, Graph, Work};
use mica_shaders::types;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use structures::Structures;

/// Who answers whether something lies between two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OcclusionBackend {
    /// Nobody: everything is visible.
    None,
    /// A hierarchy of bounding volumes that the host builds, traversed in compute shaders.
    Bvh,
    /// The device's own acceleration structures, by ray queries. A device without them ([`DeviceInfo::offers_ray_query`])
    /// refuses the frame when it is run or recorded, and [`Renderer::precompute`](crate::Renderer::precompute) what builds
    /// them, with an error that says what the device lacks.
    RayQuery,
}

impl OcclusionBackend {
    /// The word used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Bvh => "bvh",
            Self::RayQuery => "ray-query",
        }
    }

    /// Which one is best on a device for a scene of so many triangles (of its meshes, however often each is placed), and
    /// why.
    pub fn auto(device: &DeviceInfo, triangles: u64) -> (Self, String) {
        if !device.offers_ray_query() {
            return (
                Self::Bvh,
                format!("{} offers no ray queries: it lacks {}", device.name, device.ray_query_lacks.join(", ")),
            );
        }
        let bytes = triangles.saturating_mul(size_of::<types::BvhTriangle>() as u64);
        let most = device.limits.max_storage_buffer_range_bytes;
        if bytes > most {
            return (Self::RayQuery, format!("{triangles} triangles take more than the {most} bytes of a buffer"));
        }
        if device.kind == DeviceKind::Cpu {
            // Mesa 25.0.7's lavapipe, 5,000 to 61,000 triangles: 2.1 to 2.9 times the rays a second.
            let why = "on a processor the compute traversal is 2 to 3 times faster than ray queries";
            return (Self::Bvh, why.to_owned());
        }
        (Self::RayQuery, format!("{} offers ray queries", device.name))
    }
}

/// The rays that a pass traced, counted while it ran.
#[derive(Debug)]
pub struct RaysOfPass {
    /// The pass.
    pub pass: &'static str,
    /// A [`types::RayCounts`] once the frame has run.
    pub counts: Buffer,
}

impl RaysOfPass {
    /// Counts that begin at 0.
    pub(crate) fn none_yet(g: &mut Graph, pass: &'static str) -> Self {
        let mut counts = g.buffer("ray_counts", size_of::<types::RayCounts>() as u64);
        g.fill(&mut counts, 0);
        Self { pass, counts }
    }
}

/// Each instance: its mesh, and where it is in scene space. Or those that moved: the instance, and where it is now.
type Places = [(usize, DAffine3)];

/// Why occluders come to be.
const FIRST_ASKED: &str = "first frame that asks for occlusion";

/// What long work is called while it is under way.
const BUILDING: &str = "building occlusion";

/// How often long work on the host reports its progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(20);

/// What blocks the rays of a scene.
pub(crate) struct Occluders {
    body: Body,
    /// Whether alpha masks cut holes into some of it. Scenes without bind and test nothing for them.
    masked: bool,
    /// Of each mesh, whether they cut holes into it.
    masked_meshes: Vec<bool>,
    /// The instances that moved since the last update.
    pub moved: Moved,
    /// Whether they were declared: what is done from then on has other reasons.
    declared: bool,
    /// Why the next update does what it does.
    why: String,
}

/// Who answers.
pub(crate) enum Body {
    Bvh(Bvh),
    Structures(Structures),
}

impl Occluders {
    /// For a scene as it stands; nothing where occlusion is off.
    pub fn new(backend: OcclusionBackend, scene: &Scene, buffers: &SceneBuffers) -> Result<Option<Self>, RenderError> {
        Self::new_counting(backend, scene, buffers, None)
    }

    fn new_counting(
        backend: OcclusionBackend,
        scene: &Scene,
        buffers: &SceneBuffers,
        placed: Option<&AtomicU64>,
    ) -> Result<Option<Self>, RenderError> {
        let places = all_places(scene, buffers);
        let body = match backend {
            OcclusionBackend::None => return Ok(None),
            OcclusionBackend::Bvh => Body::Bvh(Bvh::build(scene, &places, placed)?),
            OcclusionBackend::RayQuery => Body::Structures(Structures::new(scene, buffers, &places)?),
        };
        let masked_meshes = masked_meshes(scene).collect::<Vec<_>>();
        let masked = scene.instances.iter().any(|instance| {
            let triangles = scene.meshes[instance.mesh].triangle_count();
            triangles > 0 && masked_meshes[instance.mesh]
        });
        let why = FIRST_ASKED.to_owned();
        Ok(Some(Self { body, masked, masked_meshes, moved: Moved::default(), declared: false, why }))
    }

    /// As [`Occluders::new`], with all that takes long done on a device of our own: a frame finds it ready.
    pub fn precomputed(
        backend: OcclusionBackend,
        scene: &Scene,
        buffers: &mut SceneBuffers,
        executor: &mut Executor,
        progress: Progress,
    ) -> Result<(Option<Self>, Vec<Update>), RenderError> {
        if backend == OcclusionBackend::Bvh {
            let start = Instant::now();
            let occluders = Self::built_with_progress(scene, buffers, progress)?;
            let ns = start.elapsed().as_nanos() as u64;
            let update = Update { pass: "build bvh".to_owned(), why: FIRST_ASKED.to_owned(), ns };
            return Ok((occluders, vec![update]));
        }
        let mut occluders = Self::new(backend, scene, buffers)?;
        let mut updates = Vec::new();
        if let Some(Self { body: Body::Structures(structures), declared, .. }) = &mut occluders {
            *declared = true;
            progress(BUILDING, 0, 2);
            let mut g = Graph::new();
            buffers.upload_triangles(&mut g);
            structures.build(&mut g, scene, buffers, 0);
            updates.extend(run(executor, g)?);
            progress(BUILDING, 1, 2);
            // Once the builds are finished, the device knows how large the copies are.
            let mut g = Graph::new();
            structures.compact(&mut g, |_| true);
            structures.build_top(&mut g);
            updates.extend(run(executor, g)?);
            progress(BUILDING, 2, 2);
        }
        Ok((occluders, updates))
    }

    /// Builds a hierarchy on another thread while this one reports how many triangles and instances have found their
    /// place in it.
    fn built_with_progress(
        scene: &Scene,
        buffers: &SceneBuffers,
        progress: Progress,
    ) -> Result<Option<Self>, RenderError> {
        let placed = AtomicU64::new(0);
        let triangles: u64 = scene.meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum();
        let all = triangles + scene.instances.len() as u64;
        // Nothing is sent: the channel closes when the builder ends, however it does.
        let (at_work, ended) = mpsc::channel::<()>();
        std::thread::scope(|threads| {
            let builder = threads.spawn(|| {
                let _at_work = at_work;
                Self::new_counting(OcclusionBackend::Bvh, scene, buffers, Some(&placed))
            });
            while ended.recv_timeout(PROGRESS_INTERVAL) == Err(RecvTimeoutError::Timeout) {
                progress(BUILDING, placed.load(Ordering::Relaxed), all);
            }
            let built = builder.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            progress(BUILDING, all, all);
            built
        })
    }

    /// Follows alpha masks that came or went, which makes all anew, and the instances that moved: what the host has to do,
    /// before anything is declared.
    pub fn follow(
        &mut self,
        backend: OcclusionBackend,
        scene: &Scene,
        buffers: &SceneBuffers,
    ) -> Result<(), RenderError> {
        if !masked_meshes(scene).eq(self.masked_meshes.iter().copied()) {
            if let Some(anew) = Self::new(backend, scene, buffers)? {
                *self = Self { why: "alpha masks came or went".to_owned(), ..anew };
            }
            return Ok(());
        }
        let Some(why) = self.moved.why() else { return Ok(()) };
        let why = if self.declared { why } else { FIRST_ASKED.to_owned() };
        let places = all_places(scene, buffers);
        let moved: Vec<(usize, DAffine3)> = self.moved.instances().map(|index| (index, places[index].1)).collect();
        match &mut self.body {
            Body::Bvh(bvh) => bvh.place(scene, buffers, &places, &moved)?,
            Body::Structures(structures) => structures.place(scene, buffers, &places, &moved, why.clone())?,
        }
        self.moved.clear();
        self.why = why;
        Ok(())
    }

    /// Declares what brings them up to date in the `frame`-th graph that does.
    pub fn update(&mut self, g: &mut Graph, scene: &Scene, buffers: &SceneBuffers, frame: u64) {
        self.declared = true;
        g.because(self.why.clone());
        match &mut self.body {
            Body::Bvh(bvh) => bvh.update(g),
            Body::Structures(structures) => structures.update(g, scene, buffers, frame),
        }
    }

    /// Who answers.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Whether alpha masks are to be tested.
    pub fn masked(&self) -> bool {
        self.masked
    }
}

fn all_places(scene: &Scene, buffers: &SceneBuffers) -> Vec<(usize, DAffine3)> {
    let place = |instance: &Instance| (instance.mesh, buffers.scene_from_local(instance));
    scene.instances.iter().map(place).collect()
}

/// Of each mesh, whether an alpha mask cuts holes into it.
fn masked_meshes(scene: &Scene) -> impl Iterator<Item = bool> + '_ {
    scene.meshes.iter().map(|mesh| is_masked(scene, mesh))
}

/// Whether an alpha mask cuts holes into a mesh.
fn is_masked(scene: &Scene, mesh: &Mesh) -> bool {
    scene.materials.get(mesh.material).is_some_and(|material| material.alpha != AlphaMode::Opaque)
}

/// Runs a frame of updates, each pass by itself; uploads are no news.
fn run(executor: &mut Executor, g: Graph) -> Result<Vec<Update>, RenderError> {
    let run = executor.run(g, Timing::Isolated)?;
    let passes = run.plan.passes.iter().zip(&run.passes);
    let built = passes.filter(|(pass, _)| !matches!(pass.work, Work::Upload { .. }));
    Ok(built
        .map(|(pass, time)| Update { pass: pass.name.clone(), why: pass.why.clone(), ns: time.ns.unwrap_or(0) })
        .collect())
}

/// Declares a pass that asks the occluders, by that variant of its shader that knows who answers. In `Bind` is what the
/// pass itself binds, less what variants with masks bind anyway: that is in `Unmasked`.
macro_rules! pass_with_rays {
    ($g:expr, $shader:ident, $occluders:expr, $scene:expr, $over:expr, $params:expr, Bind { $($own:tt)* }
     $(, Unmasked { $($field:ident: $value:expr),* $(,)? })? $(,)?) => {
        match $occluders.body() {
            $crate::occluders::Body::Bvh(bvh) => $crate::occluders::pass_with_rays!(
                @ $g, $shader, bvh, bvh_masked, $occluders, $scene, $over, $params,
                {
                    bvh_nodes: &bvh.nodes.buffer,
                    bvh_triangles: &bvh.triangles.buffer,
                    bvh_instances: &bvh.instances.buffer,
                    $($own)*
                },
                { $($($field: $value,)*)? }
            ),
            $crate::occluders::Body::Structures(structures) => $crate::occluders::pass_with_rays!(
                @ $g, $shader, ray_query, ray_query_masked, $occluders, $scene, $over, $params,
                { scene_structure: &structures.scene, $($own)* },
                { $($($field: $value,)*)? }
            ),
        }
    };
    (@ $g:expr, $shader:ident, $plain:ident, $masked:ident, $occluders:expr, $scene:expr, $over:expr, $params:expr,
     { $($bound:tt)* }, { $($unmasked:tt)* }) => {
        if $occluders.masked() {
            use mica_shaders::$shader::$masked::*;
            let bind = Bind {
                instances: &$scene.instances.buffer,
                indices: &$scene.indices.buffer,
                uvs: &$scene.uvs.buffer,
                colors: &$scene.colors.buffer,
                materials: &$scene.materials,
                textures: &$scene.textures.buffer,
                atlas_srgb: &$scene.atlas_srgb.image,
                atlas_linear: &$scene.atlas_linear.image,
                $($bound)*
            };
            $g.pass_over(bind, $params, $over);
        } else {
            use mica_shaders::$shader::$plain::*;
            $g.pass_over(Bind { $($unmasked)* $($bound)* }, $params, $over);
        }
    };
}
pub(crate) use pass_with_rays;
