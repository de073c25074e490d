//! Small files, good and bad, made by code; the first of each kind is good. Most are a few hundred bytes.

pub mod cache;
pub mod exr;
pub mod gltf;
pub mod hdr;
pub mod jpeg;
pub mod png;
