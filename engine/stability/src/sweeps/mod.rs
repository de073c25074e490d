//! Quantities over wide ranges of one number, on a device: where a form loses its digits, and where the stable one keeps them.

mod angles;
mod counts;
mod frames;
mod roughness;

use crate::{Laboratory, StabilityError};
use serde::{Deserialize, Serialize};

/// An axis of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// What is on it, with its unit.
    pub label: String,
    /// Whether equal lengths are equal factors.
    pub log: bool,
}

/// A line of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Which form it is.
    pub name: String,
    /// In the order of x, all finite; above 0 where the axis is logarithmic.
    pub points: Vec<(f64, f64)>,
}

/// A quantity over a range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// Of a file.
    pub name: String,
    /// Of a chart.
    pub title: String,
    /// What is varied.
    pub x: Axis,
    /// What is measured.
    pub y: Axis,
    /// The stable form first, then the naive one, and the truth if it is not plain.
    pub series: Vec<Series>,
    /// What holds over all of the range, in a sentence.
    pub claim: String,
    /// How far the stable form is from that at worst.
    pub worst: f64,
    /// How far it may be.
    pub tolerance: f64,
}

impl Sweep {
    /// Whether the claim is true on this device.
    pub fn holds(&self) -> bool {
        self.worst <= self.tolerance
    }
}

/// Makes a sweep on a device.
pub type MakeSweep = fn(&mut Laboratory) -> Result<Sweep, StabilityError>;

/// All sweeps by their names.
pub const SWEEPS: [(&str, MakeSweep); 8] = [
    ("distance", frames::distance),
    ("flakes_mean", counts::mean),
    ("flakes_deviation", counts::deviation),
    ("grazing", angles::grazing),
    ("alpha", roughness::alpha),
    ("gamma", angles::gamma),
    ("offset", frames::offset),
    ("anisotropy", roughness::anisotropy),
];

fn linear(label: &str) -> Axis {
    Axis { label: label.to_owned(), log: false }
}

fn log(label: &str) -> Axis {
    Axis { label: label.to_owned(), log: true }
}

/// A line of what a logarithmic axis can show: an error of 0 is drawn at the last digit of a float, one that is no number or more than
/// all at 1.
fn errors(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    let shown = |(x, error): (f64, f64)| {
        (x, if error.is_nan() { 1.0 } else { error.clamp(f64::from(f32::EPSILON) / 8.0, 1.0) })
    };
    Series { name: name.to_owned(), points: points.into_iter().map(shown).collect() }
}

/// The greatest of errors; infinite where one is no number.
fn greatest(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, |worst, error| if error.is_nan() { f64::INFINITY } else { worst.max(error) })
}

/// So many numbers from `least` to `most`, evenly spaced in the logarithm.
fn log_spaced(least: f64, most: f64, count: usize) -> Vec<f64> {
    (0..count).map(|at| least * (most / least).powf(at as f64 / (count - 1) as f64)).collect()
}
