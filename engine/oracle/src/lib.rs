//! The truth in f64: what the renderer's pictures and tables are held against, and the statistics that judge them.
//!
//! Every formula here is written from the papers, independently of the shaders; only numbers may be shared with the
//! renderer, never code. Nothing here touches a GPU.
//!
//! Spaces: scattering functions take unit directions in the **local frame**, with the shading normal along +Z and all
//! directions pointing away from the surface. Scenes and images live in **world space**, right-handed, +Y up, metres.
//! Radiance is linear RGB, angles are radians unless a name says otherwise.

pub mod albedo;
pub mod binomial;
pub mod cone_mean;
pub mod discrete;
mod error;
pub mod flake_image;
pub mod flake_list;
pub mod flake_set;
mod footprint;
pub mod image;
pub mod jakob;
pub mod lit_probability;
pub mod microfacet;
mod quadrature;
mod reflecting_set;
pub mod scene;
pub mod statistics;
pub mod wang2020;

pub use error::OracleError;
pub use glam::{DVec2, DVec3};
