//! Compute shaders of the tests' own, compiled around the program's GLSL as it is or with one passage changed.

use mica_graph::{Access, Binding, BindingKind, Buffer, Graph, Shader, Slot, Stage, StageCode, Stages, Use, Work};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Invocations in a group: what each of these shaders declares.
pub const GROUP: u32 = 64;

/// One passage of a file below `shaders_glsl` replaced by another: what a test must notice.
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// The file's path, as it is included.
    pub file: &'a str,
    /// Its first passage that says this.
    pub from: &'a str,
    /// What stands there instead.
    pub to: &'a str,
}

/// Where the shaders' sources lie: the checkout that this was built in, or what `MICA_ROOT` names where that is far away.
fn root() -> PathBuf {
    std::env::var_os("MICA_ROOT").map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), PathBuf::from)
}

/// Compiles `tests/tests/FILE`, which may include the program's shaders; `accesses` are its storage buffers, by
/// binding.
///
/// Shaders are statics in the program; a test's live as long as its process.
pub fn test_shader(
    file: &'static str,
    change: Option<Change<'_>>,
    accesses: &[(u32, Access)],
    params_bytes: u32,
) -> &'static Shader {
    let root = root();
    let shaders = root.join("shaders_glsl");
    let folder = tempfile::tempdir().expect("a temporary folder");
    if let Some(Change { file, from, to }) = change {
        let source = std::fs::read_to_string(shaders.join(file)).expect("the shader's source");
        assert!(source.contains(from), "{file} no longer says {from:?}: change this test with it");
        let copy = folder.path().join(file);
        std::fs::create_dir_all(copy.parent().expect("a file lies in a folder")).expect("a folder");
        std::fs::write(copy, source.replacen(from, to, 1)).expect("its copy");
    }
    let output = folder.path().join("shader.spv");
    let tool = std::env::var_os("GLSLANG_VALIDATOR").unwrap_or_else(|| "glslangValidator".into());
    let include = |path: &Path| format!("-I{}", path.display());
    // The changed file is found first.
    let done = Command::new(tool)
        .args(["--target-env", "vulkan1.2", &include(folder.path()), &include(&shaders), "-o"])
        .args([output.as_path(), &root.join("tests/tests").join(file)])
        .output()
        .expect("glslangValidator runs (Debian: glslang-tools)");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    let spirv: Vec<u32> = bytemuck::pod_collect_to_vec(&std::fs::read(output).expect("its output"));
    let binding = |&(slot, access): &(u32, Access)| Binding {
        name: "buffer",
        slot,
        kind: BindingKind::StorageBuffer,
        access,
        stages: Stages::COMPUTE,
    };
    Box::leak(Box::new(Shader {
        name: file,
        variant: "",
        stages: vec![StageCode { stage: Stage::Compute, spirv: spirv.leak() }].leak(),
        group: [GROUP, 1, 1],
        bindings: accesses.iter().map(binding).collect::<Vec<_>>().leak(),
        params_bytes,
        outputs: &[],
        effects: mica_graph::Effects::NONE,
    }))
}

/// Adds a pass of such a shader over so many elements, with its buffers by binding.
pub fn push_pass(
    graph: &mut Graph,
    shader: &'static Shader,
    params: &[u32],
    elements: usize,
    buffers: &[(u32, &Buffer, Access)],
) {
    let uses = buffers.iter().map(|&(slot, buffer, access)| Use {
        resource: buffer.resource().clone(),
        slot: Slot::Binding(slot),
        access,
        stages: Stages::COMPUTE,
    });
    let params = bytemuck::cast_slice(params).to_vec();
    let work = Work::Compute { shader, params, groups: [(elements as u32).div_ceil(GROUP), 1, 1] };
    graph.push(shader.name, work, uses.collect());
}

/// A buffer that holds these bytes.
pub fn filled(graph: &mut Graph, name: &str, bytes: &[u8]) -> Buffer {
    let mut buffer = graph.buffer(name, bytes.len() as u64);
    graph.upload(&mut buffer, bytes);
    buffer
}
