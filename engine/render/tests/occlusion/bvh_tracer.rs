//! Rays through `occlusion/bvh.glsl` compiled anew: with one passage changed, which the tests must notice, with masks of a
//! test's own, or with an account of its steps.

use crate::bodies::{Said, device, silent};
use glam::{DAffine3, DVec3};
use mica_gpu::{Executor, Timing};
use mica_graph::{Access, Binding, BindingKind, Buffer, Graph, Shader, Slot, Stage, StageCode, Stages, Use, Work};
use mica_render::scene::Scene;
use mica_render::scene::bvh::{MeshBvh, SceneBvh};
use mica_shaders::types::{Ray, RayAnswer};
use std::path::{Path, PathBuf};
use std::process::Command;

const GROUP: u32 = 64;

/// The storage buffers of `passes/trace_rays.comp` around the hierarchy.
const BINDINGS: [(u32, Access); 6] = [
    (20, Access::StorageRead),
    (21, Access::StorageRead),
    (22, Access::StorageRead),
    (27, Access::StorageReadWrite),
    (30, Access::StorageRead),
    (40, Access::StorageWrite),
];

/// What a ray that is to be moved off a surface takes the scene to fit into.
const SCENE_UNIT: f32 = 1.0;

/// A device with the shader on it.
pub struct BvhTracer {
    executor: Executor,
    shader: &'static Shader,
}

/// What `ray_steps.comp` says of a ray, asked both questions by one invocation.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Steps {
    /// Of the closest hit.
    pub t: f32,
    pub triangle: u32,
    /// 1 where the closest hit was found.
    pub closest: u32,
    /// 1 where any hit was found.
    pub any: u32,
    /// How many of the two ran out of steps.
    pub cut_short: u32,
    /// Of the invocation, after both.
    pub left: u32,
}

impl BvhTracer {
    /// With the shader as it is.
    pub fn unchanged() -> Self {
        Self::changed("", "")
    }

    /// With the first passage of `occlusion/bvh.glsl` that says `from` replaced by `to`.
    pub fn changed(from: &str, to: &str) -> Self {
        Self::with(shader("shaders_glsl/passes/trace_rays.comp", from, to, None))
    }

    /// With masks, and `covered` for `shared/alpha_mask.glsl`.
    pub fn masked(covered: &str) -> Self {
        Self::with(shader("shaders_glsl/passes/trace_rays.comp", "", "", Some(covered)))
    }

    /// For [`BvhTracer::count_steps`], changed or not.
    pub fn of_steps(from: &str, to: &str) -> Self {
        Self::with(shader("engine/render/tests/occlusion/ray_steps.comp", from, to, None))
    }

    fn with(shader: &'static Shader) -> Self {
        Self { executor: Executor::new(device()).expect("an executor"), shader }
    }

    /// What it says of each ray through a scene, about whose middle scene space has its origin.
    pub fn ask(&mut self, scene: &Scene, rays: &[Ray]) -> Vec<Said> {
        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let to_scene = DAffine3::from_translation(-center);
        let mesh = |mesh: &mica_render::scene::Mesh| MeshBvh::build(&mesh.positions, &mesh.indices).expect("a mesh");
        let meshes: Vec<MeshBvh> = scene.meshes.iter().map(mesh).collect();
        let places: Vec<(usize, DAffine3)> =
            scene.instances.iter().map(|instance| (instance.mesh, to_scene * instance.world_from_local)).collect();
        self.ask_of(&SceneBvh::build(&places, &meshes).expect("a scene"), rays)
    }

    /// The same through a hierarchy.
    pub fn ask_of(&mut self, bvh: &SceneBvh, rays: &[Ray]) -> Vec<Said> {
        let [closest, any] = [1, 0].map(|closest| self.run::<RayAnswer>(bvh, rays, closest));
        closest.into_iter().zip(any).map(|(closest, any)| Said { closest, any: Some(any) }).collect()
    }

    /// What becomes of the steps of each invocation.
    pub fn count_steps(&mut self, bvh: &SceneBvh, rays: &[Ray]) -> Vec<Steps> {
        self.run(bvh, rays, 1)
    }

    fn run<Answer: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
        &mut self,
        bvh: &SceneBvh,
        rays: &[Ray],
        closest: u32,
    ) -> Vec<Answer> {
        let mut graph = Graph::new();
        let mut filled = |name: &str, bytes: &[u8]| {
            let mut buffer = graph.buffer(name, bytes.len() as u64);
            graph.upload(&mut buffer, bytes);
            buffer
        };
        let read = [
            filled("nodes", bytemuck::cast_slice(&bvh.nodes)),
            filled("triangles", bytemuck::cast_slice(&bvh.triangles)),
            filled("instances", bytemuck::cast_slice(&bvh.instances)),
            filled("counts", &[0; 8]),
            filled("rays", bytemuck::cast_slice(rays)),
        ];
        let answers = graph.buffer("answers", (rays.len() * size_of::<Answer>()) as u64);
        let uses = BINDINGS.iter().zip(read.iter().chain([&answers])).map(|(&(slot, access), buffer): (_, &Buffer)| {
            Use { resource: buffer.resource().clone(), slot: Slot::Binding(slot), access, stages: Stages::COMPUTE }
        });
        let params = bytemuck::bytes_of(&[rays.len() as u32, closest, SCENE_UNIT.to_bits()]).to_vec();
        let groups = [(rays.len() as u32).div_ceil(GROUP), 1, 1];
        graph.push(self.shader.name, Work::Compute { shader: self.shader, params, groups }, uses.collect());
        let download = graph.download(&answers);
        let mut run = self.executor.run(graph, Timing::Overlapped).expect("a frame");
        silent(self.executor.device());
        bytemuck::pod_collect_to_vec(&run.take(download))
    }
}

/// Compiles the program in this file around the hierarchy, changed or not, with masks or not. Shaders are statics in the
/// program; a test's live as long as its process.
fn shader(file: &str, from: &str, to: &str, covered: Option<&str>) -> &'static Shader {
    // The checkout that this was built in, or where that is far away what holds its shaders.
    let built_in = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let root = std::env::var_os("MICA_ROOT").map_or_else(built_in, PathBuf::from);
    let shaders = root.join("shaders_glsl");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = std::fs::read_to_string(shaders.join("occlusion/bvh.glsl")).expect("the shader's source");
    assert!(source.contains(from), "occlusion/bvh.glsl no longer says {from:?}: change this test with it");
    std::fs::write(folder.path().join("occlusion.glsl"), source.replacen(from, to, 1)).expect("its copy");
    if let Some(covered) = covered {
        std::fs::create_dir(folder.path().join("shared")).expect("a folder");
        std::fs::write(folder.path().join("shared/alpha_mask.glsl"), covered).expect("a mask");
    }
    let output = folder.path().join("shader.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let include = |path: &Path| format!("-I{}", path.display());
    let done = Command::new(tool)
        .args(covered.map(|_| "-DMASKED"))
        .args(["--target-env", "vulkan1.2", &include(folder.path()), &include(&shaders), "-o"])
        .args([output.as_path(), &root.join(file)])
        .output()
        .expect("glslangValidator runs (Debian: glslang-tools)");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    let spirv: Vec<u32> = bytemuck::pod_collect_to_vec(&std::fs::read(output).expect("its output"));
    let bindings = BINDINGS.map(|(slot, access)| Binding {
        name: "buffer",
        slot,
        kind: BindingKind::StorageBuffer,
        access,
        stages: Stages::COMPUTE,
    });
    Box::leak(Box::new(Shader {
        name: "trace_rays",
        variant: "of a test",
        stages: vec![StageCode { stage: Stage::Compute, spirv: spirv.leak() }].leak(),
        group: [GROUP, 1, 1],
        bindings: bindings.to_vec().leak(),
        params_bytes: 12,
        outputs: &[],
        effects: mica_graph::Effects::NONE,
    }))
}
