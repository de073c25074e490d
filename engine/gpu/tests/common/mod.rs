//! What the tests of this crate share: a device whose every validation message fails the test, and shaders compiled
//! from a few lines of GLSL.

pub mod host;

use mica_gpu::{Device, DeviceOptions, Executor, ExecutorOptions, Feature, Messages, Validation};
use mica_graph::{Access, Binding, BindingKind, Effects, Resource, Shader, Slot, Stage, StageCode, Stages, Use};
use std::io::Write;
use std::process::{Command, Stdio};
use std::sync::Arc;

/// A device with validation on. Dropping it fails the test if there was any message, leaks included.
pub struct Checked {
    device: Option<Arc<Device>>,
    messages: Messages,
}

impl Checked {
    pub fn new() -> Self {
        let options = DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() };
        let device = Device::new(&options).expect("a device with validation");
        let messages = device.messages();
        Self { device: Some(device), messages }
    }

    pub fn device(&self) -> Arc<Device> {
        self.device.clone().expect("the device lives as long as this")
    }

    /// The device, if it offers ray queries. Where the environment says that it has to (`MICA_EXPECT=ray-query`), one
    /// without fails the test.
    pub fn with_ray_query(&self) -> Option<Arc<Device>> {
        let device = self.device();
        let lacks = &device.info().ray_query_lacks;
        let expected = std::env::var("MICA_EXPECT").is_ok_and(|expected| expected == "ray-query");
        assert!(!expected || lacks.is_empty(), "ray queries are expected here: {} lacks {lacks:?}", device.info().name);
        Some(device).filter(|device| device.has(Feature::RayQuery))
    }

    pub fn executor(&self) -> Executor {
        self.executor_with(ExecutorOptions::default())
    }

    pub fn executor_with(&self, options: ExecutorOptions) -> Executor {
        Executor::with_options(self.device(), options).expect("an executor")
    }
}

impl Drop for Checked {
    fn drop(&mut self) {
        let device = self.device.take().expect("the device is dropped here");
        let others = Arc::strong_count(&device) - 1;
        drop(device);
        if !std::thread::panicking() {
            assert_eq!(others, 0, "the device is still held, so leaks cannot be seen");
            assert_no_messages(&self.messages);
        }
    }
}

pub fn assert_no_messages(messages: &Messages) {
    let said: Vec<String> = messages.take().iter().map(ToString::to_string).collect();
    assert!(said.is_empty(), "validation said:\n{}", said.join("\n"));
}

/// A binding of a test's shader: its number, kind and access.
pub type BindingOf = (u32, BindingKind, Access);

/// A compute shader with bindings named `b0`, `b1` and so on.
pub fn compute(
    name: &'static str,
    glsl: &str,
    group: [u32; 3],
    params_bytes: u32,
    bindings: &[BindingOf],
) -> &'static Shader {
    let stages = vec![StageCode { stage: Stage::Compute, spirv: compile(glsl, "comp") }];
    let bindings = bindings_of(bindings, Stages::COMPUTE);
    leak(Shader {
        name,
        variant: "",
        stages: stages.leak(),
        group,
        bindings,
        params_bytes,
        outputs: &[],
        effects: Effects::NONE,
    })
}

/// A vertex and a fragment shader.
pub fn raster(
    name: &'static str,
    (vertex, fragment): (&str, &str),
    params_bytes: u32,
    outputs: &'static [&'static str],
    bindings: &[BindingOf],
) -> &'static Shader {
    let stages = vec![
        StageCode { stage: Stage::Vertex, spirv: compile(vertex, "vert") },
        StageCode { stage: Stage::Fragment, spirv: compile(fragment, "frag") },
    ];
    let bindings = bindings_of(bindings, Stages::VERTEX | Stages::FRAGMENT);
    leak(Shader {
        name,
        variant: "",
        stages: stages.leak(),
        group: [1; 3],
        bindings,
        params_bytes,
        outputs,
        effects: Effects::NONE,
    })
}

fn bindings_of(bindings: &[BindingOf], stages: Stages) -> &'static [Binding] {
    let binding = |&(slot, kind, access): &BindingOf| {
        let name = format!("b{slot}").leak();
        Binding { name, slot, kind, access, stages }
    };
    bindings.iter().map(binding).collect::<Vec<_>>().leak()
}

/// Shaders are statics in the program; a test's live as long as its process.
fn leak(shader: Shader) -> &'static Shader {
    Box::leak(Box::new(shader))
}

/// SPIR-V of GLSL given without its version line.
pub fn compile(glsl: &str, stage: &str) -> &'static [u32] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join("shader.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let mut glslang = Command::new(tool)
        .args(["--target-env", "vulkan1.3", "--stdin", "-S", stage, "-o"])
        .arg(&output)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("glslangValidator runs (Debian: glslang-tools)");
    let source = format!("#version 460\n{glsl}");
    glslang.stdin.take().expect("its input").write_all(source.as_bytes()).expect("it reads its input");
    let finished = glslang.wait_with_output().expect("it ends");
    assert!(finished.status.success(), "{}\n{source}", String::from_utf8_lossy(&finished.stdout));
    let bytes = std::fs::read(output).expect("its output");
    let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().expect("four bytes"));
    bytes.chunks_exact(4).map(word).collect::<Vec<u32>>().leak()
}

/// A use in compute shaders.
pub fn bind(slot: u32, resource: &Arc<Resource>, access: Access) -> Use {
    Use { resource: resource.clone(), slot: Slot::Binding(slot), access, stages: Stages::COMPUTE }
}

/// A use in both stages of a raster pass.
pub fn bind_raster(slot: u32, resource: &Arc<Resource>, access: Access) -> Use {
    Use { stages: Stages::VERTEX | Stages::FRAGMENT, ..bind(slot, resource, access) }
}

/// A colour attachment.
pub fn color(location: u32, resource: &Arc<Resource>) -> Use {
    let (slot, access, stages) = (Slot::Color(location), Access::ColorWrite, Stages::COLOR_OUTPUT);
    Use { resource: resource.clone(), slot, access, stages }
}

/// The depth attachment.
pub fn depth(resource: &Arc<Resource>) -> Use {
    let (slot, access, stages) = (Slot::Depth, Access::DepthWrite, Stages::DEPTH_TEST);
    Use { resource: resource.clone(), slot, access, stages }
}

pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four bytes"))).collect()
}

pub fn floats(bytes: &[u8]) -> Vec<f32> {
    words(bytes).into_iter().map(f32::from_bits).collect()
}

pub fn bytes_of(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}
