//! The lobe that pixels are compared with, and what is asked of many pixels' values.

use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};

/// The Beckmann lobe of this roughness, with the masking that the shaders have.
pub fn facets(alpha: f64) -> Microfacets {
    facets_of(Ndf::Beckmann, alpha)
}

/// The lobe of this distribution and roughness, with the masking that the shaders have.
pub fn facets_of(ndf: Ndf, alpha: f64) -> Microfacets {
    Microfacets::new(ndf, alpha, SmithFit::Rational).expect("a valid roughness")
}

/// The mean of the values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Their variance: the mean squared distance from their mean.
pub fn variance(values: &[f64]) -> f64 {
    let middle = mean(values);
    values.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / values.len() as f64
}

/// The correlation of two sets of pixels.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "values come in pairs");
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum::<f64>() / a.len() as f64;
    product / (variance(a) * variance(b)).sqrt()
}
