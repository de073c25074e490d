//! H19. Tangent frames where they are singular; triangles without area.

use crate::{Check, Laboratory, StabilityError};

/// Measures it.
pub fn measure(_: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(Vec::new())
}
