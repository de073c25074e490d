//! Methods measured: what they show against what the oracle says they should.

mod counts;
mod stage;

pub use counts::{CountErrors, CountLaw};
pub use stage::{Condition, Stage, StageError};
