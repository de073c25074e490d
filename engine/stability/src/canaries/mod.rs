//! What a device's arithmetic does, found by asking it: for reports, and for who reads strange pictures.
//!
//! None of it is wrong by itself: Vulkan leaves it open. Each canary says what was found, and what that means for what is
//! computed there.

mod conversions;
mod device;
mod not_a_number;
mod precision;
mod rewriting;

use crate::{Laboratory, StabilityError};
use mica_shaders::types::Words;
use serde::{Deserialize, Serialize};

/// One question to a device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Canary {
    /// A name for scripts: `loop_limit`.
    pub name: String,
    /// What was asked.
    pub question: String,
    /// The answer.
    pub found: String,
    /// What it means for results here.
    pub means: String,
}

impl Canary {
    fn new(name: &str, question: &str, found: impl Into<String>, means: impl Into<String>) -> Self {
        Self { name: name.to_owned(), question: question.to_owned(), found: found.into(), means: means.into() }
    }
}

/// Asks a device all of them; takes about a second.
///
/// # Errors
/// Those of the device.
pub fn canaries(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    let mut found = device::ask(laboratory)?;
    found.extend(rewriting::ask(laboratory)?);
    found.extend(not_a_number::ask(laboratory)?);
    found.extend(conversions::ask(laboratory)?);
    found.extend(precision::ask(laboratory)?);
    Ok(found)
}

/// Floats, and whole numbers, as a question.
fn words(floats: [f32; 4], numbers: [u32; 4]) -> Words {
    Words { a: floats.map(f32::to_bits), b: numbers }
}

/// A float for people: NaN and infinities by name.
fn shown(bits: u32) -> String {
    let x = f32::from_bits(bits);
    match x {
        _ if x.is_nan() => "NaN".to_owned(),
        _ if x.is_infinite() => if x > 0.0 { "inf" } else { "-inf" }.to_owned(),
        _ => format!("{x}"),
    }
}
