//! Methods measured: what they show against what the oracle says they should.

mod counts;
mod point;
mod stage;

pub use counts::{CountErrors, CountLaw};
pub use point::{
    BandErrors, Bytes, Cost, Errors, Estimate, Machine, Metric, POINT_SCHEMA, PathErrors, Place, Point,
    REFERENCE_SCHEMA, ReferenceLine,
};
pub use stage::{Condition, Stage, StageError};
