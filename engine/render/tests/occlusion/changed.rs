//! Rays through `occlusion/bvh.glsl` with one passage changed: what the tests must notice.

use crate::device::{Said, device, silent};
use glam::{DAffine3, DVec3};
use mica_gpu::{Executor, Timing};
use mica_graph::{Access, Binding, BindingKind, Buffer, Graph, Shader, Slot, Stage, StageCode, Stages, Use, Work};
use mica_render::scene::Scene;
use mica_render::scene::bvh::{MeshBvh, SceneBvh};
use mica_shaders::types::{Ray, RayAnswer};
use std::path::Path;
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

/// A device with the changed shader on it.
pub struct Changed {
    executor: Executor,
    shader: &'static Shader,
}

impl Changed {
    /// With the first passage of `occlusion/bvh.glsl` that says `from` replaced by `to`.
    pub fn new(from: &str, to: &str) -> Self {
        Self { executor: Executor::new(device()).expect("an executor"), shader: shader(from, to) }
    }

    /// What it says of each ray.
    pub fn ask(&mut self, scene: &Scene, rays: &[Ray]) -> Vec<Said> {
        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let to_scene = DAffine3::from_translation(-center);
        let mesh = |mesh: &mica_render::scene::Mesh| MeshBvh::build(&mesh.positions, &mesh.indices).expect("a mesh");
        let meshes: Vec<MeshBvh> = scene.meshes.iter().map(mesh).collect();
        let places: Vec<(usize, DAffine3)> =
            scene.instances.iter().map(|instance| (instance.mesh, to_scene * instance.world_from_local)).collect();
        let bvh = SceneBvh::build(&places, &meshes).expect("a scene");

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
        let downloads = [1u32, 0].map(|closest| {
            let answers = graph.buffer("answers", (rays.len() * size_of::<RayAnswer>()) as u64);
            let buffers = read.iter().chain([&answers]);
            let uses = BINDINGS.iter().zip(buffers).map(|(&(slot, access), buffer): (_, &Buffer)| Use {
                resource: buffer.resource().clone(),
                slot: Slot::Binding(slot),
                access,
                stages: Stages::COMPUTE,
            });
            let params = bytemuck::bytes_of(&[rays.len() as u32, closest, 1.0f32.to_bits()]).to_vec();
            let groups = [(rays.len() as u32).div_ceil(GROUP), 1, 1];
            graph.push("trace_rays", Work::Compute { shader: self.shader, params, groups }, uses.collect());
            graph.download(&answers)
        });
        let mut run = self.executor.run(graph, Timing::Overlapped).expect("a frame");
        silent(self.executor.device());
        let [closest, any] =
            downloads.map(|download| bytemuck::pod_collect_to_vec::<u8, RayAnswer>(&run.take(download)));
        closest.into_iter().zip(any).map(|(closest, any)| Said { closest, any: Some(any) }).collect()
    }
}

/// Compiles `passes/trace_rays.comp` around the changed hierarchy. Shaders are statics in the program; a test's live as
/// long as its process.
fn shader(from: &str, to: &str) -> &'static Shader {
    let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders_glsl");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = std::fs::read_to_string(shaders.join("occlusion/bvh.glsl")).expect("the shader's source");
    assert!(source.contains(from), "occlusion/bvh.glsl no longer says {from:?}: change this test with it");
    std::fs::write(folder.path().join("occlusion.glsl"), source.replacen(from, to, 1)).expect("its copy");
    let output = folder.path().join("trace_rays.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let include = |path: &Path| format!("-I{}", path.display());
    let done = Command::new(tool)
        .args(["--target-env", "vulkan1.2", &include(folder.path()), &include(&shaders), "-o"])
        .args([output.as_path(), &shaders.join("passes/trace_rays.comp")])
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
        variant: "changed",
        stages: vec![StageCode { stage: Stage::Compute, spirv: spirv.leak() }].leak(),
        group: [GROUP, 1, 1],
        bindings: bindings.to_vec().leak(),
        params_bytes: 12,
        outputs: &[],
    }))
}
