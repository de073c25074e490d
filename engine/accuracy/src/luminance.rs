//! Luminance of linear radiance, and that of the pixels of two pictures.

/// Weights of red, green and blue (ITU-R BT.709).
const WEIGHTS: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Luminance of linear radiance.
pub fn luminance(radiance: [f32; 3]) -> f64 {
    WEIGHTS.iter().zip(radiance).map(|(weight, channel)| weight * f64::from(channel)).sum()
}

/// Luminance of every pixel of a picture and of its reference.
pub(crate) struct Luminance {
    pub(crate) picture: Vec<f64>,
    pub(crate) reference: Vec<f64>,
    /// Variance of the reference's about what it converges to.
    pub(crate) noise: Vec<f64>,
}

/// Variance of luminance from those of the channels. A flake that is lit in one sample and not in the next changes all of
/// them together: their deviations add, not their variances.
pub(crate) fn luminance_variance(variance: [f32; 3]) -> f64 {
    let deviations = WEIGHTS.iter().zip(variance).map(|(weight, channel)| weight * f64::from(channel.max(0.0)).sqrt());
    deviations.sum::<f64>().powi(2)
}
