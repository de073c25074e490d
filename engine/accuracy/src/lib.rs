//! Methods measured: what they show against what the oracle says they should.

mod stage;

pub use stage::{Condition, Stage, StageError};
