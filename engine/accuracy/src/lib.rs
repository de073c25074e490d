//! Methods measured: what they show against what the oracle says they should.

mod bands;
mod choice;
mod counts;
mod errors;
pub mod exactness;
mod flip;
mod front;
mod luminance;
mod path;
mod point;
mod reference;
#[cfg(test)]
mod sparkle;
mod stage;
mod tiles;
mod weight;

pub use choice::{Choice, Goal, NothingFits, choose};
pub use counts::{CountErrors, CountLaw};
pub use errors::{ErrorsError, Pixels, Radiance, Reference};
pub use flip::{ErrorMap, displayed};
pub use front::front;
pub use luminance::luminance;
pub use point::{
    BandErrors, Bytes, Cost, Errors, Estimate, Machine, Metric, POINT_SCHEMA, PathErrors, Place, Point,
    REFERENCE_SCHEMA, ReferenceLine,
};
pub use reference::MeanOfTwo;
pub use stage::{Condition, Stage, StageError};
pub use weight::Weight;
