//! Pictures made of random numbers, for the tests of figures.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Independent numbers, even in 0..1.
pub(crate) fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    (0..count).map(|_| (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64).collect()
}

/// Independent numbers, exponentially distributed: mean 1, variance 1.
pub(crate) fn exponential(seed: u64, count: usize) -> Vec<f64> {
    uniform(seed, count).into_iter().map(|unit| -f64::ln(1.0 - unit)).collect()
}

/// Independent numbers of mean 0 and variance 1, symmetric and bounded.
pub(crate) fn symmetric(seed: u64, count: usize) -> Vec<f64> {
    uniform(seed, count).into_iter().map(|unit| 12.0_f64.sqrt() * (unit - 0.5)).collect()
}

/// Grey pixels of these luminances.
pub(crate) fn grey(luminance: &[f64]) -> Vec<[f32; 3]> {
    luminance.iter().map(|value| [*value as f32; 3]).collect()
}

/// Pixels of which every channel is so many times as large.
pub(crate) fn scaled(pixels: &[[f32; 3]], factor: f32) -> Vec<[f32; 3]> {
    pixels.iter().map(|pixel| pixel.map(|channel| factor * channel)).collect()
}
