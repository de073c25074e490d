//! The renderer: a scene, the passes that draw it, and the methods that make it glint.
//!
//! [`Renderer::frame`] declares a frame on a [`mica_graph::Graph`]; whoever owns the graph plans and executes it: an
//! [`mica_gpu::Executor`] on a device of its own, or one that records into a host's command buffer.
//!
//! Without the feature `glints` there are no methods, and nothing glints: to compare with what their presence costs where they are
//! not called for, which is nothing (`examples/plain_frames.rs`).

#![cfg_attr(not(feature = "glints"), allow(unused, reason = "much serves methods alone"))]

mod cache;
mod census;
mod embedded;
mod environment_tables;
mod filled;
mod frame;
mod kept;
mod methods;
mod moved;
mod occluders;
mod passes;
mod renderer;
pub mod scene;
mod scene_buffers;
mod settings;
mod view;

pub use cache::{Cache, CacheError};
pub use census::{Census, Effect, EnvironmentCensus, GlintCensus, LightCensus, MaterialCensus};
pub use embedded::{EMBEDDED_SCENES, EmbeddedScene, embedded_scene};
pub use frame::{Frame, LeftOut};
pub use kept::MadeTable;
pub use methods::{
    AUTO_METHOD, COMMON_SETTINGS, Claim, DEFAULT_METHOD, GlintMaterial, METHODS, MethodInfo, Rung, check_method, method,
};
#[cfg(feature = "glints")]
pub use methods::{JakobTable, lit_probability_table};
/// What [`Renderer::trace`] reads and writes.
pub use mica_shaders::types::{Ray, RayAnswer, RayCounts};
pub use occluders::{OcclusionBackend, RaysOfPass};
pub use passes::trace::Question;
pub use renderer::{Environment, Progress, Renderer, Update};
pub use settings::{Kind, Setting, SettingError, Value, Values};
pub use view::View;

/// What keeps a scene from being rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A part of the scene is larger than the renderer can address.
    #[error("{what} exceed {limit}: split the scene")]
    TooLarge {
        /// Which part.
        what: &'static str,
        /// What it must stay below.
        limit: &'static str,
    },
    /// More lights than a shadow mask has bits.
    #[error("{count} lights are more than the {limit} a frame can hold: remove some")]
    TooManyLights {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// An instance that is to be moved does not exist.
    #[error("there is no instance {index}: the scene has {count}, counted from 0")]
    NoSuchInstance {
        /// Which was named.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A material that is to be replaced does not exist.
    #[error("there is no material {index}: the scene has {count}, counted from 0")]
    NoSuchMaterial {
        /// Which was named.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A material's texture does not exist.
    #[error("there is no texture {index}: the scene has {count}, counted from 0")]
    NoSuchTexture {
        /// Which was named.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// An instance cannot be where it is to be moved to.
    #[error(
        "instance {index} cannot be moved there: its transform must be finite and keep it within coordinates of 1e12"
    )]
    BadPlacement {
        /// Which one.
        index: usize,
    },
    /// Rays were to be traced without anybody to ask.
    #[error("rays cannot be traced: occlusion is off; make the renderer with another occlusion backend")]
    NoOcclusion,
    /// A buffer of rays or answers is too small.
    #[error("{count} {what} take {needed} bytes, and their buffer has {bytes}: make it larger")]
    RaysDoNotFit {
        /// Rays or answers.
        what: &'static str,
        /// How many there are to be.
        count: u32,
        /// Size of the buffer.
        bytes: u64,
        /// What they take.
        needed: u64,
    },
    /// The scene cannot be searched for occluders.
    #[error("occlusion: {0}")]
    Bvh(#[from] scene::bvh::BvhError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] mica_gpu::Error),
}
