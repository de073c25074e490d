//! A plan, executed on Vulkan: the device, its memory, pipelines, commands and timestamps.
//!
//! [`Device::new`] makes a device of our own, without a window; [`Device::borrow`] takes a host's. [`Executor::run`]
//! plans a [`mica_graph::Graph`], submits it and waits; [`Executor::record`] writes it into a command buffer of the host,
//! who submits it and later gives it to [`Executor::finish`].
//!
//! Images are in the general layout whenever a pass runs, and every barrier is the plan's: what is added here is one
//! full barrier where a frame begins, which puts it after the frames before it.
//!
//! All unsafe code of the project is in this crate.
//!
//! ```no_run
//! use mica_gpu::{Device, DeviceOptions, Executor, Timing};
//! use mica_graph::Graph;
//!
//! let device = Device::new(&DeviceOptions::default())?;
//! let mut executor = Executor::new(device)?;
//! let mut graph = Graph::new();
//! let mut words = graph.buffer("words", 64);
//! graph.fill(&mut words, 7);
//! let download = graph.download(&words);
//! let mut run = executor.run(graph, Timing::Overlapped)?;
//! assert_eq!(run.take(download), [7, 0, 0, 0].repeat(16));
//! # Ok::<(), mica_gpu::Error>(())
//! ```

mod borrow;
mod descriptors;
mod device;
mod error;
mod executor;
mod features;
mod info;
mod instance;
mod memory;
mod messages;
mod pipeline;
mod pipeline_cache;
mod prepare;
mod present;
mod record;
mod resources;
mod run;
mod shader_limits;
mod slot;
mod structures;
mod submit;
mod timing;
mod vulkan_types;

pub use borrow::{HostBuffer, HostDevice, HostImage, HostState};
pub use device::{Device, DeviceOptions};
pub use error::Error;
pub use executor::{Executor, ExecutorOptions};
pub use features::{DeviceRequirements, Feature, FeatureRequirement, Version};
pub use info::{DeviceInfo, DeviceKind, Limits, devices};
pub use messages::{Message, Messages, Validation};
pub use pipeline::PipelinesMade;
pub use pipeline_cache::NOT_KEPT;
pub use present::{HostSurface, Presenter, Target};
pub use resources::MemoryRow;
pub use run::{Recorded, Run};
pub use timing::{PassTime, Timing, elapsed_ns, process_cpu_ns};
