//! The library on devices that hang or whose memory comes in small pieces.

use crate::run_under_layer;
use mica_gpu::{Device, DeviceOptions, Error, Executor, ExecutorOptions, Timing, Validation};
use mica_graph::{Buffer, Graph, Lifetime};
use std::time::{Duration, Instant};

/// Fills a buffer of the executor's own and brings it back.
fn fill(executor: &mut Executor, buffer: &mut Buffer, word: u8) -> Result<Vec<u8>, Error> {
    let mut graph = Graph::new();
    graph.fill(buffer, u32::from_ne_bytes([word; 4]));
    let download = graph.download(buffer);
    let mut run = executor.run(graph, Timing::Isolated)?;
    Ok(run.take(download))
}

fn buffer(bytes: u64) -> Buffer {
    Buffer::new("words", bytes, Lifetime::Scene)
}

const MIB: u64 = 1 << 20;

#[test]
#[ignore = "is run under the layer by the test below"]
fn use_memory_in_small_pieces() {
    let device = Device::new(&DeviceOptions { validation: Validation::Core, ..DeviceOptions::default() });
    let device = device.expect("a device");
    let messages = device.messages();
    let mut executor = Executor::new(device).expect("an executor");
    let mut kept: Vec<Buffer> = Vec::new();
    for word in 1..=4 {
        kept.push(buffer(3 * MIB));
        let buffer = kept.last_mut().expect("it was just put there");
        let bytes = fill(&mut executor, buffer, word).expect("a piece of this size is there");
        assert!(bytes.len() as u64 == 3 * MIB && bytes.iter().all(|byte| *byte == word));
    }
    let error = fill(&mut executor, &mut buffer(5 * MIB), 1).expect_err("a larger piece is not");
    assert!(matches!(&error, Error::OutOfMemory { what, .. } if what.contains("words")), "{error:?}");
    drop((kept, executor));
    assert_eq!(messages.take(), [], "everything was given back");
}

#[test]
fn f24_where_a_block_is_refused_a_piece_of_just_the_size_is_asked_for() {
    run_under_layer("moods::use_memory_in_small_pieces", &format!("largestAllocation={}", 4 * MIB));
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn wait_for_what_never_begins() {
    const TIMEOUT: Duration = Duration::from_millis(500);
    let device = Device::new(&DeviceOptions::default()).expect("a device");
    let options = ExecutorOptions { timeout: TIMEOUT, ..ExecutorOptions::default() };
    let mut executor = Executor::with_options(device.clone(), options).expect("an executor");
    let mut words = buffer(64);
    fill(&mut executor, &mut words, 1).expect("the first submission runs");
    let start = Instant::now();
    let error = fill(&mut executor, &mut words, 2).expect_err("the second never begins");
    assert!(start.elapsed() >= TIMEOUT, "it was waited for");
    assert!(matches!(error, Error::Timeout { .. }) && error.exit_code() == 4, "{error:?}");
    let error = fill(&mut executor, &mut words, 3).expect_err("the device is given up");
    assert!(matches!(error, Error::DeviceLost { .. }), "{error:?}");
    // Nothing here may wait for the device, which would last for ever.
    drop((words, executor, device));
}

#[test]
fn f26_a_device_that_hangs_is_given_up_after_the_time_and_never_waited_for_again() {
    run_under_layer("moods::wait_for_what_never_begins", "hang=1");
}
