//! What the tests of the whole program share: a device under validation, frames as linear pixels, shapes whose truth is
//! known, and a count of what was run.
//!
//! What goes wrong here fails the test that called: everything panics with a message instead of returning errors.

mod gpu;
mod picture;
pub mod shaders;
pub mod shapes;
pub mod sky;
mod tally;
pub mod triangles;
pub mod twin;
pub mod unusual;
pub mod values;

pub use gpu::{Gpu, Shot, dpf_cache};
pub use picture::Picture;
pub use tally::Tally;
