//! The pipeline cache on disk, and shaders that a driver or device cannot take.

use crate::common::{Checked, bind, compute};
use mica_gpu::{Error, ExecutorOptions, Timing};
use mica_graph::{Access, BindingKind, Buffer, Graph, Lifetime, Shader, Work};
use std::path::Path;

fn run_once(checked: &Checked, cache: &Path, shader: &'static Shader) {
    let options = ExecutorOptions { pipeline_cache: Some(cache.to_owned()), ..ExecutorOptions::default() };
    let mut executor = checked.executor_with(options);
    let buffer = Buffer::new("buffer", 256, Lifetime::Scene);
    let mut graph = Graph::new();
    let work = Work::Compute { shader, params: vec![0; shader.params_bytes as usize], groups: [1; 3] };
    graph.push(shader.name, work, vec![bind(0, buffer.resource(), Access::StorageWrite)]);
    executor.run(graph, Timing::Overlapped).expect("the frame runs");
}

#[test]
fn f28_a_damaged_pipeline_cache_is_rebuilt() {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(binding = 0) writeonly buffer B0 { uint b0[]; };
        void main() { b0[gl_GlobalInvocationID.x] = 1; }";
    let shader = compute("write", glsl, [64, 1, 1], 0, &[(0, BindingKind::StorageBuffer, Access::StorageWrite)]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("pipelines");
    let checked = Checked::new();
    run_once(&checked, &path, shader);
    let whole = std::fs::read(&path).expect("the cache was written");

    for damage in [whole[..whole.len() / 2].to_vec(), vec![0xff; whole.len()], Vec::new()] {
        std::fs::write(&path, damage).expect("the file is damaged");
        run_once(&checked, &path, shader);
        assert_eq!(std::fs::read(&path).expect("the cache was written again"), whole);
    }
    let names: Vec<_> = std::fs::read_dir(folder.path()).expect("the folder").flatten().collect();
    assert_eq!(names.len(), 1, "{names:?}");
}

#[test]
fn a_cache_that_cannot_be_written_costs_the_cache_and_nothing_else() {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(binding = 0) writeonly buffer B0 { uint b0[]; };
        void main() { b0[gl_GlobalInvocationID.x] = 2; }";
    let shader = compute("write", glsl, [64, 1, 1], 0, &[(0, BindingKind::StorageBuffer, Access::StorageWrite)]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("a file");
    std::fs::write(&file, b"").expect("a file where a folder should be");
    run_once(&Checked::new(), &file.join("pipelines"), shader);
}

#[test]
fn push_constants_beyond_the_device_s_limit_are_refused_by_name() {
    let checked = Checked::new();
    let most = checked.device().info().limits.max_push_constants_bytes;
    let glsl = format!(
        "layout(local_size_x = 64) in;
         layout(push_constant) uniform Params {{ uint values[{}]; }};
         layout(binding = 0) writeonly buffer B0 {{ uint b0[]; }};
         void main() {{ b0[0] = values[1]; }}",
        most / 4 + 1
    );
    let bindings = [(0, BindingKind::StorageBuffer, Access::StorageWrite)];
    let shader = compute("wordy", &glsl, [64, 1, 1], most + 4, &bindings);
    let mut executor = checked.executor();
    let buffer = Buffer::new("buffer", 256, Lifetime::Scene);
    let mut graph = Graph::new();
    let work = Work::Compute { shader, params: vec![0; most as usize + 4], groups: [1; 3] };
    graph.push("wordy", work, vec![bind(0, buffer.resource(), Access::StorageWrite)]);
    let error = executor.run(graph, Timing::Overlapped).expect_err("there are too many");
    assert!(matches!(&error, Error::BadPass { pass, .. } if pass == "wordy"), "{error:?}");
}
