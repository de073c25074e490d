//! H44. Buffers larger than a descriptor can bind.

use crate::{Check, Form, Laboratory, StabilityError, bits};
use mica_gpu::{Error, Timing};
use mica_graph::Graph;

/// Measures it: whether a buffer that shaders would see a part of is refused by name. A driver creates it without a word.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let limits = laboratory.executor.device().info().limits;
    let range = limits.max_storage_buffer_range_bytes;
    // Beyond the limit by one word, by an eighth of it, and twice as large; what fits in no buffer is another mistake.
    let sizes: Vec<u64> =
        [range + 16, range + range / 8, 2 * range].into_iter().map(|bytes| bytes.next_multiple_of(16)).collect();
    // A device may have no room for such a buffer, or let none be so large: there it cannot be made at all.
    let fits = |bytes: u64| bytes <= limits.max_buffer_bytes && bytes <= limits.device_memory_bytes / 2;
    let (mut made, mut accepted) = (0, 0);
    for bytes in &sizes {
        // Filled alone, the buffer is made without complaint.
        if fits(*bytes) {
            let mut graph = Graph::new();
            let mut large = graph.buffer("large", *bytes);
            graph.fill(&mut large, 0);
            made += u32::from(laboratory.executor.run(graph, Timing::Overlapped).is_ok());
        }

        let mut graph = Graph::new();
        let large = graph.buffer("large", *bytes);
        let mut answers = graph.buffer("answers", 64);
        let mut large = large;
        graph.fill(&mut large, 0);
        bits!(hash_of_whole)(&mut graph, &large, &mut answers, 1);
        graph.download(&answers);
        match laboratory.executor.run(graph, Timing::Overlapped) {
            Err(Error::BufferRange { resource, limit, .. }) if resource == "large" && limit == range => {}
            Err(_) if !fits(*bytes) => {}
            _ => accepted += 1,
        }
    }
    let share = |count: u32| f64::from(count) / sizes.len() as f64;
    Ok(vec![Check {
        what: "buffers beyond maxStorageBufferRange".to_owned(),
        error_of: "share that is accepted".to_owned(),
        inputs: sizes.len() as u64,
        naive: Form::new("vkCreateBuffer", share(made)),
        stable: Form::new("the executor, before it binds", share(accepted)),
        tolerance: 0.0,
    }])
}
