//! The renderer: a scene, the passes that draw it, and the methods that make it glint.
//!
//! [`Renderer::frame`] declares a frame on a [`mica_graph::Graph`]; whoever owns the graph plans and executes it: an
//! [`mica_gpu::Executor`] on a device of its own, or one that records into a host's command buffer.

mod cache;
mod embedded;
mod environment_tables;
mod methods;
mod passes;
mod renderer;
pub mod scene;
mod scene_buffers;
mod settings;
mod view;

pub use cache::{Cache, CacheError};
pub use embedded::{EMBEDDED_SCENES, EmbeddedScene, embedded_scene};
pub use methods::{
    COMMON_SETTINGS, Claim, DEFAULT_METHOD, GlintMaterial, JakobTable, METHODS, MethodInfo, Rung, method,
};
pub use renderer::{Environment, Frame, LeftOut, OcclusionBackend, Progress, Renderer, Update};
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
    /// The scene cannot be searched for occluders.
    #[error("occlusion: {0}")]
    Bvh(#[from] scene::bvh::BvhError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] mica_gpu::Error),
}
