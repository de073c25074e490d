//! Large allocations that a file asks for: one that fails is an error here, where `Vec` would end the process.

use super::{SceneError, SceneErrorCode};

/// `count` copies of a value.
pub(super) fn filled<T: Clone>(value: T, count: usize, location: &str) -> Result<Vec<T>, SceneError> {
    let mut values = with_room(count, location)?;
    values.resize(count, value);
    Ok(values)
}

/// An empty list with room for `count`.
pub(super) fn with_room<T>(count: usize, location: &str) -> Result<Vec<T>, SceneError> {
    let mut values = Vec::new();
    match values.try_reserve_exact(count) {
        Ok(()) => Ok(values),
        Err(_) => Err(exhausted((count as u64).saturating_mul(size_of::<T>() as u64), location)),
    }
}

/// The error of an allocation that failed.
pub(super) fn exhausted(bytes: u64, location: &str) -> SceneError {
    let what = format!("there is no memory for its {bytes} bytes");
    SceneError::new(SceneErrorCode::OutOfMemory, location, what, "make it smaller, or free memory")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_an_error() {
        let refused = filled(0u8, isize::MAX as usize, "images[0]");
        assert_eq!(refused.map_err(|error| error.code), Err(SceneErrorCode::OutOfMemory));
        assert!(with_room::<[f32; 4]>(usize::MAX, "").is_err());
        assert_eq!(filled(7, 3, ""), Ok(vec![7; 3]));
    }
}
