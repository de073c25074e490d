//! Rays through `occlusion/bvh.glsl` on a device, with validation on: a message fails the test.

use crate::shapes::Mesh;
use glam::{DAffine3, DVec3};
use mica_gpu::{Device, DeviceOptions, Executor, Timing};
use mica_graph::{Access, Binding, BindingKind, Buffer, Graph, Shader, Slot, Stage, StageCode, Stages, Use, Work};
use mica_render::scene::bvh::{MeshBvh, SceneBvh};
use std::path::Path;
use std::process::Command;

const GROUP: u32 = 64;

/// A ray, as the shader reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Ray {
    pub origin: [f32; 3],
    pub t_min: f32,
    pub direction: [f32; 3],
    pub t_max: f32,
    /// Unless 0, the shader first moves the origin off the surface along it.
    pub normal: [f32; 3],
    /// The power of two that the scene fits into.
    pub scene_unit: f32,
}

impl Ray {
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin: origin.as_vec3().to_array(),
            t_min: 0.0,
            direction: direction.as_vec3().to_array(),
            t_max: 1e30,
            normal: [0.0; 3],
            scene_unit: 1.0,
        }
    }
}

/// What the shader says of a ray.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Answer {
    pub t: f32,
    pub instance: u32,
    pub triangle: u32,
    pub closest: u32,
    pub barycentrics: [f32; 2],
    pub any: u32,
    pub steps_left: u32,
}

impl Answer {
    pub fn hit(&self) -> bool {
        self.closest != 0
    }
}

/// A device with the shader on it.
pub struct Tracer {
    executor: Executor,
    shader: &'static Shader,
}

impl Tracer {
    /// With the shader as it is.
    pub fn new() -> Self {
        Self::with_change("", "")
    }

    /// With one passage of `occlusion/bvh.glsl` replaced by another: what a test must notice.
    pub fn with_change(from: &str, to: &str) -> Self {
        let options = DeviceOptions { validation: true, ..DeviceOptions::default() };
        let device = Device::new(&options).expect("a device with validation");
        Self { executor: Executor::new(device).expect("an executor"), shader: shader(from, to) }
    }

    /// What the device says of each ray.
    pub fn trace(&mut self, scene: &SceneBvh, rays: &[Ray]) -> Vec<Answer> {
        let mut graph = Graph::new();
        let mut filled = |name: &str, bytes: &[u8]| {
            let mut buffer = graph.buffer(name, bytes.len() as u64);
            graph.upload(&mut buffer, bytes);
            buffer
        };
        let read = [
            (20, filled("nodes", bytemuck::cast_slice(&scene.nodes))),
            (21, filled("triangles", bytemuck::cast_slice(&scene.triangles))),
            (22, filled("instances", bytemuck::cast_slice(&scene.instances))),
            (30, filled("rays", bytemuck::cast_slice(rays))),
        ];
        let answers = graph.buffer("answers", (rays.len() * size_of::<Answer>()) as u64);
        let bind = |slot, buffer: &Buffer, access| Use {
            resource: buffer.resource().clone(),
            slot: Slot::Binding(slot),
            access,
            stages: Stages::COMPUTE,
        };
        let mut uses: Vec<Use> = read.iter().map(|(slot, buffer)| bind(*slot, buffer, Access::StorageRead)).collect();
        uses.push(bind(31, &answers, Access::StorageWrite));
        let groups = [(rays.len() as u32).div_ceil(GROUP), 1, 1];
        graph.push("trace_rays", Work::Compute { shader: self.shader, params: Vec::new(), groups }, uses);
        let download = graph.download(&answers);
        let mut run = self.executor.run(graph, Timing::Overlapped).expect("a frame");
        let messages = self.executor.device().take_messages();
        assert!(messages.is_empty(), "validation said {messages:?}");
        read_all(&run.take(download))
    }
}

/// The hierarchy over placements of one mesh.
pub fn scene(mesh: &Mesh, instances: &[(usize, DAffine3)]) -> SceneBvh {
    let bvh = MeshBvh::build(&mesh.positions, &mesh.indices).expect("a usable mesh");
    SceneBvh::build(instances, &[bvh]).expect("a usable scene")
}

/// The hierarchy over one mesh where it is.
pub fn alone(mesh: &Mesh) -> SceneBvh {
    scene(mesh, &[(0, DAffine3::IDENTITY)])
}

/// Compiles `trace_rays.comp` around `occlusion/bvh.glsl`, changed or not. Shaders are statics in the program; a test's
/// live as long as its process.
fn shader(from: &str, to: &str) -> &'static Shader {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shaders = package.join("../../shaders_glsl");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = std::fs::read_to_string(shaders.join("occlusion/bvh.glsl")).expect("the shader's source");
    assert!(source.contains(from), "occlusion/bvh.glsl no longer says {from:?}: change this test with it");
    std::fs::create_dir(folder.path().join("occlusion")).expect("a folder");
    std::fs::write(folder.path().join("occlusion/bvh.glsl"), source.replacen(from, to, 1)).expect("its copy");
    let output = folder.path().join("trace_rays.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let include = |path: &Path| format!("-I{}", path.display());
    let done = Command::new(tool)
        .args(["--target-env", "vulkan1.2", &include(folder.path()), &include(&shaders), "-o"])
        .args([output.as_path(), &package.join("tests/bvh/trace_rays.comp")])
        .output()
        .expect("glslangValidator runs (Debian: glslang-tools)");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    let spirv: Vec<u32> = read_all(&std::fs::read(output).expect("its output"));

    let accesses = [(20, "nodes"), (21, "triangles"), (22, "instances"), (30, "rays"), (31, "answers")];
    let bindings = accesses.map(|(slot, name)| Binding {
        name,
        slot,
        kind: BindingKind::StorageBuffer,
        access: if name == "answers" { Access::StorageWrite } else { Access::StorageRead },
        stages: Stages::COMPUTE,
    });
    Box::leak(Box::new(Shader {
        name: "trace_rays",
        variant: "",
        stages: vec![StageCode { stage: Stage::Compute, spirv: spirv.leak() }].leak(),
        group: [GROUP, 1, 1],
        bindings: bindings.to_vec().leak(),
        params_bytes: 0,
        outputs: &[],
    }))
}

/// Bytes as what they stand for.
fn read_all<T: bytemuck::AnyBitPattern>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}
