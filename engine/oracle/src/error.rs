//! What can be wrong with a question put to the oracle.

/// A question the oracle cannot answer, with what is wrong and what would be right.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OracleError {
    /// A number outside the range where the model means something.
    #[error("{what} is {value}; it must be {range}")]
    OutOfRange {
        /// The quantity's name.
        what: &'static str,
        /// The value given.
        value: f64,
        /// The values that are accepted, in words.
        range: &'static str,
    },
    /// Two lists that belong together differ in length.
    #[error("{what}: {left} and {right} values were given; there must be as many of one as of the other")]
    LengthMismatch {
        /// The pair of lists.
        what: &'static str,
        /// Length of the first.
        left: usize,
        /// Length of the second.
        right: usize,
    },
    /// Too few values to say anything.
    #[error("{what}: {given} values were given; at least {needed} are needed")]
    TooFew {
        /// What was to be computed.
        what: &'static str,
        /// How many there were.
        given: usize,
        /// How many it takes.
        needed: usize,
    },
    /// A flake of a list that cannot be one.
    #[error("flake {row}, counted from 0, {what}")]
    Flake {
        /// Its place in the list.
        row: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// The camera has no viewing direction.
    #[error("the camera's target is its eye; move one of them")]
    CameraWithoutDirection,
    /// The camera is behind the surface it should see.
    #[error("the camera's eye is not on the outer side of the surface; move it out")]
    CameraBehindSurface,
}

/// `value`, when `accepted`; otherwise an error that names it.
pub(crate) fn in_range(
    what: &'static str,
    value: f64,
    accepted: bool,
    range: &'static str,
) -> Result<f64, OracleError> {
    if accepted { Ok(value) } else { Err(OracleError::OutOfRange { what, value, range }) }
}
