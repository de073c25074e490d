//! What is kept between frames, when it is freed, and that memory stays within its limit.

use crate::common::{Checked, bind, bytes_of, compute, words};
use mica_gpu::{Error, Executor, ExecutorOptions, Timing};
use mica_graph::{Access, BindingKind, Buffer, Extent, Format, Graph, Image, ImageDesc, Lifetime, Work};

const MIB: u64 = 1 << 20;

fn fill(executor: &mut Executor, buffer: &mut Buffer, word: u32) -> Result<(), Error> {
    let mut graph = Graph::new();
    graph.fill(buffer, word);
    executor.run(graph, Timing::Overlapped).map(|_| ())
}

fn read(executor: &mut Executor, buffer: &Buffer) -> Vec<u32> {
    let mut graph = Graph::new();
    let download = graph.download(buffer);
    let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
    words(&run.take(download))
}

fn bytes_named(executor: &Executor, name: &str) -> u64 {
    executor.memory().iter().filter(|row| row.name == name).map(|row| row.bytes).sum()
}

#[test]
fn what_one_large_frame_shared_is_given_back_by_the_next() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut shared_by = |bytes: u64| {
        let mut graph = Graph::new();
        let mut large = graph.buffer("large", bytes);
        graph.fill(&mut large, 1);
        graph.download(&large);
        executor.run(graph, Timing::Overlapped).expect("the frame runs");
        bytes_named(&executor, "frame (shared)")
    };
    assert!(shared_by(48 * MIB) >= 48 * MIB);
    assert!(shared_by(16 * MIB) >= 48 * MIB, "a frame of a third of it keeps it");
    assert!(shared_by(MIB) < 2 * MIB);
    assert!(shared_by(8 * MIB) < 9 * MIB);
    assert!(shared_by(MIB) >= 8 * MIB, "so little is kept in any case");
}

#[test]
fn content_outlives_the_frame_and_memory_goes_with_the_last_handle() {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut table = Buffer::new("table", 4096, Lifetime::Settings);
    fill(&mut executor, &mut table, 17).expect("the frame runs");
    let mut image = Image::new("map", ImageDesc::new(Format::R32Float, Extent::new(32, 32)), Lifetime::Scene);
    let mut graph = Graph::new();
    graph.clear(&mut image, 0.5);
    executor.run(graph, Timing::Overlapped).expect("the frame runs");

    assert_eq!(read(&mut executor, &table), [17; 1024]);
    let mut graph = Graph::new();
    let download = graph.download_image(&image);
    let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
    assert_eq!(words(&run.take(download)), [0.5_f32.to_bits(); 1024]);
    assert!(bytes_named(&executor, "table") >= 4096 && bytes_named(&executor, "map") >= 4096);
    assert!(executor.memory().iter().any(|row| row.name == "table" && row.lifetime == Lifetime::Settings));

    drop(table);
    executor.collect();
    assert_eq!(bytes_named(&executor, "table"), 0);
    drop(image);
    executor.collect();
    assert!(bytes_named(&executor, "map") >= 4096, "the plan of the last run still holds a handle");
    drop(run);
    executor.collect();
    assert_eq!(bytes_named(&executor, "map"), 0);
}

#[test]
fn two_executors_on_one_device_keep_what_is_theirs() {
    let checked = Checked::new();
    let (mut one, mut other) = (checked.executor(), checked.executor());
    let mut buffer = Buffer::new("buffer", 64, Lifetime::Scene);
    fill(&mut one, &mut buffer, 1).expect("the frame runs");
    fill(&mut other, &mut buffer, 2).expect("the frame runs");
    assert_eq!(read(&mut one, &buffer), [1; 16]);
    drop(one);
    assert_eq!(read(&mut other, &buffer), [2; 16]);
}

#[test]
fn executors_in_two_threads_share_a_queue() {
    let checked = Checked::new();
    std::thread::scope(|scope| {
        for word in 0..2 {
            let mut executor = checked.executor();
            scope.spawn(move || {
                let mut buffer = Buffer::new("buffer", 64, Lifetime::Scene);
                for round in 0..20 {
                    fill(&mut executor, &mut buffer, 2 * round + word).expect("the frame runs");
                    assert_eq!(read(&mut executor, &buffer), [2 * round + word; 16]);
                }
            });
        }
    });
}

#[test]
fn memory_beyond_the_limit_is_refused_by_name_and_what_is_there_stays_good() {
    let checked = Checked::new();
    let limit = 64 * MIB;
    let mut executor =
        checked.executor_with(ExecutorOptions { memory_limit_bytes: Some(limit), ..ExecutorOptions::default() });
    let mut small = Buffer::new("small", 4096, Lifetime::Scene);
    fill(&mut executor, &mut small, 3).expect("a small buffer fits");
    for (name, bytes) in [("half", 60 * MIB), ("whole", 80 * MIB), ("vast", 1 << 42)] {
        let mut large = Buffer::new(name, bytes, Lifetime::Scene);
        let error = fill(&mut executor, &mut large, 0).expect_err("a large buffer does not");
        assert!(error.to_string().contains(name), "{error}");
        // What no buffer of the device can hold is another error: no limit would help.
        let beyond_any = bytes > checked.device().info().limits.max_buffer_bytes;
        assert!(beyond_any || matches!(error, Error::MemoryLimit { .. }) && error.exit_code() == 4, "{error:?}");

        let mut graph = Graph::new();
        let mut large = graph.buffer(name, bytes);
        graph.fill(&mut large, 0);
        graph.download(&large);
        let error = executor.run(graph, Timing::Overlapped).expect_err("nor does a large frame");
        assert!(error.to_string().contains(name), "{error}");
    }
    let total: u64 = executor.memory().iter().map(|row| row.bytes).sum();
    assert!(total <= limit, "{total} bytes of {limit}");
    assert_eq!(read(&mut executor, &small), [3; 1024]);
}

#[test]
fn frames_of_changing_shapes_reuse_the_shared_memory_and_grow_it_at_need() {
    let double = compute(
        "double",
        "layout(local_size_x = 8, local_size_y = 8) in;
         layout(binding = 0, r32ui) uniform readonly uimage2D b0;
         layout(binding = 1, r32ui) uniform writeonly uimage2D b1;
         void main() {
           ivec2 at = ivec2(gl_GlobalInvocationID.xy);
           if (all(lessThan(at, imageSize(b0)))) imageStore(b1, at, 2 * imageLoad(b0, at));
         }",
        [8, 8, 1],
        0,
        &[(0, BindingKind::StorageImage, Access::StorageRead), (1, BindingKind::StorageImage, Access::StorageWrite)],
    );
    let checked = Checked::new();
    let mut executor = checked.executor();
    let mut most = 0;
    for side in [8, 8, 64, 16, 64, 200, 8, 200] {
        let extent = Extent::new(side, side);
        let mut graph = Graph::new();
        let mut from = graph.image("from", Format::R32Uint, extent);
        let texels: Vec<u32> = (0..side * side).collect();
        graph.upload_image(&mut from, bytes_of(&texels));
        for round in 0..3 {
            let to = graph.image(format!("to {round}"), Format::R32Uint, extent);
            let uses =
                vec![bind(0, from.resource(), Access::StorageRead), bind(1, to.resource(), Access::StorageWrite)];
            let groups = [side.div_ceil(8), side.div_ceil(8), 1];
            graph.push("double", Work::Compute { shader: double, params: Vec::new(), groups }, uses);
            from = to;
        }
        let download = graph.download_image(&from);
        let mut run = executor.run(graph, Timing::Overlapped).expect("the frame runs");
        assert_eq!(words(&run.take(download)), texels.iter().map(|texel| 8 * texel).collect::<Vec<u32>>());
        most = most.max(run.plan.shared_bytes);
        let shared = bytes_named(&executor, "frame (shared)");
        assert!(shared >= most && shared <= most + MIB, "{shared} bytes are shared, {most} were needed at most");
    }
}
