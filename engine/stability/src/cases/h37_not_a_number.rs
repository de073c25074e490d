//! H37. What is not a number, and finite or not.

use crate::{Check, Laboratory, StabilityError};

/// Measures it.
pub fn measure(_: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(Vec::new())
}
