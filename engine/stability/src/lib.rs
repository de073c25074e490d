//! The hard cases of glint rendering: where formulas lose their digits, what keeps them, and how much of both a device shows.
//!
//! A case is a place where a naive form fails; a [`Check`] holds the naive form and the stable one against the truth on the
//! same inputs, on a device. The stable form is the one that the renderer uses, out of the same file of GLSL; the truth
//! is in f64 and written independently. A case holds if every stable form stays within its tolerance; it has *teeth*
//! if every naive form does not, as otherwise the inputs would not be hard.

mod canaries;
mod cases;
mod count_law;
mod counted_loops;
mod errors;
mod flushed;
mod laboratory;
mod random;
mod rays;
mod spirv;
mod stage;
mod sweeps;
mod unary;
mod uses;

pub use canaries::{Canary, canaries};
pub use cases::CASES;
pub use errors::{share_wrong, worst_difference, worst_ratio};
pub use laboratory::{Effort, Laboratory};
pub use random::Random;
pub use sweeps::{Axis, MakeSweep, SWEEPS, Series, Sweep};
pub use unary::{Trial, UnaryLine};
pub use uses::StableForm;

use serde::{Deserialize, Serialize};

/// What lines of results say of themselves.
pub const STABILITY_SCHEMA: &str = "mica-stability-1";

/// A hard case.
#[derive(Clone, Copy)]
pub struct Case {
    /// `H01` to `H44`.
    pub id: &'static str,
    /// What is hard.
    pub title: &'static str,
    /// Names of the stable forms, for [`StableForm::named`].
    pub stable: &'static [&'static str],
    /// Measures it on a device.
    pub measure: fn(&mut Laboratory) -> Result<Vec<Check>, StabilityError>,
}

/// A form of a computation, and how wrong it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// What it computes, in a few words or a formula.
    pub form: String,
    /// Its worst error; infinite where it is no number at all.
    #[serde(deserialize_with = "number_or_infinity")]
    pub worst: f64,
}

impl Form {
    /// A form and its worst error; one that is not a number counts as infinite.
    pub fn new(form: impl Into<String>, worst: f64) -> Self {
        Self { form: form.into(), worst: if worst.is_nan() { f64::INFINITY } else { worst } }
    }
}

/// JSON has no word for infinity: it is written as `null`, and read back here.
fn number_or_infinity<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// Naive against stable, on the same inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What is computed of which inputs.
    pub what: String,
    /// What an error is: relative, absolute, share of wrong answers, and against what.
    pub error_of: String,
    /// Inputs tried.
    pub inputs: u64,
    /// The form that fails.
    pub naive: Form,
    /// The form that keeps them: in use, or of a library (see [`Case::stable`]).
    pub stable: Form,
    /// What the worst error of the stable form may be.
    pub tolerance: f64,
}

impl Check {
    /// Whether the stable form is as good as it should be.
    pub fn holds(&self) -> bool {
        self.stable.worst <= self.tolerance
    }

    /// Whether the naive form is not: the inputs are hard on this device.
    pub fn has_teeth(&self) -> bool {
        self.naive.worst > self.tolerance
    }
}

/// Why a case could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// The device does not run something.
    #[error(transparent)]
    Gpu(#[from] mica_gpu::Error),
    /// The truth cannot be computed.
    #[error(transparent)]
    Oracle(#[from] mica_oracle::OracleError),
    /// A frame cannot be declared.
    #[error(transparent)]
    Render(#[from] mica_render::RenderError),
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] mica_render::SettingError),
    /// A scene is not what it should be.
    #[error(transparent)]
    Scene(#[from] mica_render::scene::SceneError),
    /// Something else that is needed and not there.
    #[error("{0}")]
    Missing(String),
}
