//! Times: there for each pass when isolated, for the frame when overlapped, and waits that end.

use crate::common::{Checked, bind, color, compute, depth, raster};
use mica_gpu::{Device, DeviceOptions, Error, Executor, ExecutorOptions, Timing};
use mica_graph::{Access, BindingKind, Draw, Extent, Format, Graph, Shader, Work};
use std::time::{Duration, Instant};

/// Multiplies and adds for a while. The loop is short, as lavapipe 22.3 ends all loops of an invocation after 65535
/// rounds together: what takes long has many groups.
fn busy() -> &'static Shader {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(binding = 0) buffer B0 { uint b0[]; };
        void main() {
          uint value = b0[gl_GlobalInvocationID.x];
          for (uint i = 0; i < 2000; ++i) value = value * 1664525u + (value >> 7);
          if (value != 0) b0[gl_GlobalInvocationID.x] = 1;
        }";
    compute("busy", glsl, [64, 1, 1], 0, &[(0, BindingKind::StorageBuffer, Access::StorageReadWrite)])
}

/// A frame of busy passes, each so many times the least work.
fn busy_frame(shader: &'static Shader, weights: &[u32]) -> Graph {
    let mut graph = Graph::new();
    let mut buffer = graph.buffer("buffer", 4 * 64 * 64);
    graph.fill(&mut buffer, 1);
    for (index, weight) in weights.iter().enumerate() {
        let work = Work::Compute { shader, params: Vec::new(), groups: [64, *weight, 1] };
        graph.push(format!("busy {index}"), work, vec![bind(0, buffer.resource(), Access::StorageReadWrite)]);
    }
    graph.download(&buffer);
    graph
}

#[test]
fn isolated_times_every_pass_and_overlapped_the_frame_alone() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let shader = busy();
    executor.run(busy_frame(shader, &[1]), Timing::Overlapped).expect("the first dispatch compiles");

    let started = Instant::now();
    let isolated = executor.run(busy_frame(shader, &[1, 10, 1]), Timing::Isolated).expect("the frame runs");
    let wall_ns = started.elapsed().as_nanos() as u64;
    let names: Vec<&str> = isolated.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert_eq!(names, ["fill buffer", "busy 0", "busy 1", "busy 2", "download buffer"]);
    let times: Vec<u64> = isolated.passes.iter().map(|pass| pass.ns.expect("each pass has a time")).collect();
    assert!(times.iter().sum::<u64>() <= wall_ns, "{times:?} ns in a frame of {wall_ns} ns");
    assert!(times[2] > times[1] && times[2] > times[3], "ten times the work takes longer: {times:?}");
    assert_eq!(isolated.frame_ns, None);

    let overlapped = executor.run(busy_frame(shader, &[1, 10, 1]), Timing::Overlapped).expect("the frame runs");
    assert!(overlapped.passes.iter().all(|pass| pass.ns.is_none()));
    let frame_ns = overlapped.frame_ns.expect("the frame has a time");
    assert!(frame_ns > 0 && overlapped.cpu_ns.expect("the process has a clock") > 0);
}

#[test]
fn f26_a_frame_that_does_not_end_in_time_names_its_pass_and_ends_the_device() {
    // Without validation and on a device of its own: what hangs is left behind on purpose.
    let device = Device::new(&DeviceOptions::default()).expect("a device");
    let options = ExecutorOptions { timeout: Duration::from_millis(300), ..ExecutorOptions::default() };
    let mut executor = Executor::with_options(device, options).expect("an executor");
    let shader = busy();
    executor.run(busy_frame(shader, &[1]), Timing::Isolated).expect("the first dispatch compiles");

    let started = Instant::now();
    let error = executor.run(busy_frame(shader, &[1, 1000, 1]), Timing::Isolated).expect_err("it takes too long");
    assert!(started.elapsed() < Duration::from_secs(10), "the wait has an end");
    assert!(matches!(&error, Error::Timeout { pass: Some(pass), .. } if pass == "busy 1"), "{error:?}");
    assert_eq!(error.exit_code(), 4);
    let error = executor.run(busy_frame(shader, &[1]), Timing::Isolated).expect_err("the device is given up");
    assert!(matches!(error, Error::DeviceLost { .. }), "{error:?}");
}

#[test]
fn work_after_a_raster_pass_is_not_over_before_its_time_begins() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let vertex = "void main() { gl_Position = vec4(gl_VertexIndex & 1, gl_VertexIndex >> 1, 0.5, 1.0); }";
    let fragment = "layout(location = 0) out float shade; void main() { shade = 1.0; }";
    let triangle = raster("triangle", (vertex, fragment), 0, &["shade"], &[]);
    let frame = |weights: &[u32]| {
        let mut graph = Graph::new();
        let extent = Extent::new(16, 16);
        let shade = graph.image("shade", Format::R32Float, extent);
        let depths = graph.image("depth", Format::Depth32, extent);
        let draws = [Draw { vertices: 3, instance: 0 }].into();
        let work = Work::Raster { shader: triangle, params: Vec::new(), draws, extent };
        graph.push("triangle", work, vec![color(0, shade.resource()), depth(depths.resource())]);
        graph.download_image(&shade);
        for pass in busy_frame(busy(), weights).passes() {
            graph.push(pass.name.clone(), pass.work.clone(), pass.uses.clone());
        }
        graph
    };
    executor.run(frame(&[1]), Timing::Overlapped).expect("the first dispatch compiles");
    let run = executor.run(frame(&[1, 40]), Timing::Isolated).expect("the frame runs");
    let time = |name: &str| run.passes.iter().find(|pass| pass.name == name).and_then(|pass| pass.ns).expect("a time");
    let (light, heavy) = (time("busy 0"), time("busy 1"));
    // Where dispatches were over before their first timestamp, the two differed by chance alone.
    assert!(heavy > 4 * light, "{heavy} ns for forty times the work of {light} ns");
}
