//! What ends a command early: one line for people, and the exit code that scripts see.

use mica_render::{
    RenderError, SettingError,
    scene::{SceneError, SceneErrorCode},
};
use mica_stability::StabilityError;
use std::fmt;

/// Bad input or usage.
pub const BAD_INPUT: u8 = 2;
/// No usable device or driver.
pub const NO_DEVICE: u8 = 3;
/// Out of memory, or the device was lost.
pub const NO_MEMORY: u8 = 4;
/// Ended by Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// Why a command ended early. Prints as one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The exit code.
    pub code: u8,
    /// Whether a device was lost: another one may serve.
    pub device_lost: bool,
    message: String,
}

impl Failure {
    /// Something that the user gave cannot be used.
    pub fn bad_input(message: impl Into<String>) -> Self {
        Self::with_code(BAD_INPUT, message)
    }

    /// A failure with a code of its own.
    pub fn with_code(code: u8, message: impl Into<String>) -> Self {
        Self { code, device_lost: false, message: message.into() }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&one_line(&self.message))
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let code = if error.code == SceneErrorCode::OutOfMemory { NO_MEMORY } else { BAD_INPUT };
        Self::with_code(code, error.to_string())
    }
}

impl From<SettingError> for Failure {
    fn from(error: SettingError) -> Self {
        Self::bad_input(format!("{error}; `mica methods` lists all settings"))
    }
}

impl From<mica_gpu::Error> for Failure {
    fn from(error: mica_gpu::Error) -> Self {
        let code = u8::try_from(error.exit_code()).unwrap_or(NO_DEVICE);
        let device_lost = matches!(error, mica_gpu::Error::DeviceLost { .. });
        let message = match error {
            // The library cannot know how its host lets the limit be raised.
            mica_gpu::Error::MemoryLimit { what, bytes, used, limit } => format!(
                "out of memory: {what} needs {bytes} bytes, {used} are taken, and no more than {limit} may be; use a smaller --size or scene, or --occlusion none, or allow more with --memory"
            ),
            error @ mica_gpu::Error::BufferRange { .. } if error.to_string().contains("buffer bvh_") => {
                format!("{error}; --occlusion none does without it, as does ray-query on a device that offers it")
            }
            error => error.to_string(),
        };
        Self { device_lost, ..Self::with_code(code, message) }
    }
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Gpu(error) => error.into(),
            error @ RenderError::Bvh(_) => Self::bad_input(format!("{error}; or render with --occlusion none")),
            error => Self::bad_input(error.to_string()),
        }
    }
}

impl From<StabilityError> for Failure {
    fn from(error: StabilityError) -> Self {
        match error {
            StabilityError::Gpu(error) => error.into(),
            StabilityError::Render(error) => error.into(),
            StabilityError::Setting(error) => error.into(),
            StabilityError::Scene(error) => error.into(),
            StabilityError::Missing(what) => Self::with_code(NO_DEVICE, what),
            StabilityError::Oracle(error) => Self::bad_input(error.to_string()),
        }
    }
}

impl From<mica_accuracy::ErrorsError> for Failure {
    fn from(error: mica_accuracy::ErrorsError) -> Self {
        Self::bad_input(error.to_string())
    }
}

/// Text that may come from anywhere, fit to be one line of a terminal or a log.
pub fn one_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() || matches!(character, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}') {
            line.extend(character.escape_default());
        } else {
            line.push(character);
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_is_one_line_whatever_it_quotes() {
        let failure = Failure::bad_input("no file `a\nb\u{1b}[31m\u{202e}`");
        assert_eq!(failure.to_string(), "no file `a\\nb\\u{1b}[31m\\u{202e}`");
    }
}
