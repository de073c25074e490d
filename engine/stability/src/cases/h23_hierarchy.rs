//! H23. Hierarchies of degenerate triangles: build and walk.

use crate::{Check, Laboratory, StabilityError};

/// Measures it.
pub fn measure(_: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(Vec::new())
}
