//! What is wrong with a shader, and where: the one error type of the build.

use std::fmt;

/// One thing to mend in the GLSL or on the machine.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Problem {
    /// The GLSL file, relative to the folder above the shaders; empty where no file is to blame.
    pub file: String,
    /// The line, counted from 1; 0 where it is not known.
    pub line: u32,
    /// What is wrong and what to do.
    pub message: String,
}

impl Problem {
    /// A problem on one line of a file.
    pub fn at(file: impl Into<String>, line: u32, message: impl Into<String>) -> Self {
        Self { file: file.into(), line, message: message.into() }
    }

    /// A problem of a whole file.
    pub fn in_file(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self::at(file, 0, message)
    }

    /// A problem of the machine.
    pub fn of_machine(message: impl Into<String>) -> Self {
        Self::at("", 0, message)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.file.is_empty(), self.line) {
            (true, _) => write!(f, "{}", self.message),
            (false, 0) => write!(f, "{}: {}", self.file, self.message),
            (false, line) => write!(f, "{}:{line}: {}", self.file, self.message),
        }
    }
}
