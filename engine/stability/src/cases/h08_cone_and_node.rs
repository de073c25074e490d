//! H08. A cone against a node of the angular hierarchy.

use crate::{Check, Laboratory, StabilityError};

/// Measures it.
pub fn measure(_: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(Vec::new())
}
