//! H32. Storage in half floats.

use crate::{Check, Laboratory, StabilityError};

/// Measures it.
pub fn measure(_: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(Vec::new())
}
