//! Decoders of other crates, whose panics become errors of the file that they read.

use super::error::SceneError;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a decoder makes of bytes from anywhere; where it panics, the error that its caller has for a file like that.
pub(super) fn contained<T>(
    decode: impl FnOnce() -> Result<T, SceneError>,
    invalid: impl FnOnce(String) -> SceneError,
) -> Result<T, SceneError> {
    // What a decoder leaves half done is dropped with it.
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err(invalid("its decoder gave up on it".to_owned())))
}
