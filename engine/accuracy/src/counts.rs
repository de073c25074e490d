//! The law of the count: what the pixels of a stage show, against the number of lit flakes as it is distributed.
//!
//! N flakes of which a share a(A) P is lit in a footprint: the number is Binomial(N, a P), and as a P is below 1e-4 on the
//! stage, Poisson with mean n P for n flakes expected in the footprint. A pixel's value over its mean is that number over
//! its mean: the weights of flakes that are lit together hardly differ.

use crate::Condition;
use glam::DVec3;
use mica_oracle::OracleError;
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::jakob::lit_share;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_oracle::statistics::{ChiSquare, Moments, chi_square, upper_gamma, wasserstein_1};

/// What is true of every pixel of a stage.
#[derive(Clone, Debug)]
pub struct CountLaw {
    /// Flakes expected to be lit.
    lit: f64,
    /// Mean of f(A, i, o), 1/sr.
    mean: f64,
    /// The probability of at most so many lit flakes, from `first` upwards until it is 1 to the last digit that matters.
    cumulative: Vec<f64>,
    first: u64,
}

impl CountLaw {
    /// The law under a condition, for F = 1 and Smith's G with its rational fit, as the renderer's shaders have it.
    ///
    /// # Errors
    /// If the roughness is out of range.
    pub fn of(condition: &Condition) -> Result<Self, OracleError> {
        let (facets, i, o, gamma) = asked(condition)?;
        let means = ConeMeans::new(&facets, i, o, gamma);
        Ok(Self::with(condition, means.lit_probability, means.discrete))
    }

    /// The law of the flakes that a method draws. `jakob` draws them with density D / S_D and gives all the weight S_D:
    /// fewer are lit than of flakes that are drawn from the distribution of slopes, and their mean is the same.
    ///
    /// # Errors
    /// As [`CountLaw::of`].
    pub fn of_method(name: &str, condition: &Condition) -> Result<Self, OracleError> {
        if name != "jakob" {
            return Self::of(condition);
        }
        let (facets, i, o, gamma) = asked(condition)?;
        let means = ConeMeans::new(&facets, i, o, gamma);
        Ok(Self::with(condition, lit_share(&facets, i, o, gamma), means.discrete))
    }

    /// The law of flakes that are lit with this probability, for this mean of f(A, i, o).
    fn with(condition: &Condition, probability: f64, mean: f64) -> Self {
        let lit = condition.flakes * probability;
        let reach = 9.0 * lit.sqrt() + 12.0;
        let first = (lit - reach).max(0.0).floor();
        let last = (lit + reach).ceil();
        // P(K <= k) = Q(k + 1, lit).
        let steps = (last - first) as usize + 1;
        let cumulative = (0..steps).map(|step| upper_gamma(first + step as f64 + 1.0, lit)).collect();
        Self { lit, mean, cumulative, first: first as u64 }
    }

    /// Flakes expected to be lit.
    pub fn lit(&self) -> f64 {
        self.lit
    }

    /// Mean of f(A, i, o) in 1/sr.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Variance over squared mean.
    pub fn relative_variance(&self) -> f64 {
        1.0 / self.lit
    }

    /// The probability that no flake is lit.
    pub fn probability_of_none(&self) -> f64 {
        (-self.lit).exp()
    }

    /// The number of lit flakes over its mean that is exceeded with probability 1 - `u`.
    pub fn quantile(&self, u: f64) -> f64 {
        let step = self.cumulative.partition_point(|probability| *probability < u);
        (self.first + step as u64) as f64 / self.lit
    }

    /// Tests whether values of f(A, i, o) are whole numbers of lit flakes that follow the law, each flake being worth as much
    /// as the true mean says. Values that are no whole numbers are taken to the nearest.
    ///
    /// # Errors
    /// When so few flakes are lit that there is nothing to test.
    pub fn chi_square(&self, samples: &[f64]) -> Result<ChiSquare, OracleError> {
        // A cell for what lies below the first number, one for what lies above the last.
        let cells = self.cumulative.len() + 2;
        let mut observed = vec![0.0; cells];
        for f in samples {
            let number = (f / self.mean * self.lit).round();
            let cell = (number - self.first as f64 + 1.0).clamp(0.0, (cells - 1) as f64);
            observed[cell as usize] += 1.0;
        }
        let total = samples.len() as f64;
        let below = if self.first == 0 { 0.0 } else { upper_gamma(self.first as f64, self.lit) };
        let mut expected = vec![total * below];
        let mut before = below;
        for at_most in &self.cumulative {
            expected.push(total * (at_most - before).max(0.0));
            before = *at_most;
        }
        expected.push(total * (1.0 - before).max(0.0));
        chi_square(&observed, &expected)
    }

    /// As many values of number over mean as wanted, spread over the law evenly.
    pub fn quantiles(&self, count: usize) -> Vec<f64> {
        (0..count).map(|index| self.quantile((index as f64 + 0.5) / count as f64)).collect()
    }
}

/// The flakes' distribution, the directions about the normal, the cone's half-angle in radians.
fn asked(condition: &Condition) -> Result<(Microfacets, DVec3, DVec3, f64), OracleError> {
    let facets = Microfacets::new(Ndf::Beckmann, condition.alpha, SmithFit::Rational)?;
    Ok((facets, condition.i(), condition.o(), condition.gamma_deg.to_radians()))
}

/// How far a method's pixels are from the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountErrors {
    /// Pixels looked at.
    pub samples: usize,
    /// Their mean over the true mean.
    pub mean_ratio: f64,
    /// Its standard error, if the pixels followed the law.
    pub mean_ratio_error: f64,
    /// Variance over squared mean, over the law's; not a number where nothing was lit.
    pub variance_ratio: f64,
    /// Its standard error, if the pixels followed the law.
    pub variance_ratio_error: f64,
    /// The share of pixels without any light.
    pub none: f64,
    /// That less the probability that no flake is lit.
    pub none_error: f64,
    /// Distance (Wasserstein-1) of the pixels over the true mean from number over mean.
    pub w1: f64,
    /// The distance that so many pixels which follow the law would have on average.
    pub w1_floor: f64,
}

impl CountErrors {
    /// Judges the values of f(A, i, o) that pixels show.
    ///
    /// # Errors
    /// When there are fewer than two.
    pub fn of(law: &CountLaw, samples: &[f64]) -> Result<Self, OracleError> {
        let moments = Moments::of(samples)?;
        let count = samples.len();
        let true_quantiles = law.quantiles(count);
        let over_mean: Vec<f64> = samples.iter().map(|f| f / law.mean).collect();
        let none = samples.iter().filter(|f| **f < 1e-6 * law.mean).count() as f64 / count as f64;
        // Fourth central moment of Poisson's law: lit (1 + 3 lit).
        let relative = law.relative_variance();
        Ok(Self {
            samples: count,
            mean_ratio: moments.mean / law.mean,
            mean_ratio_error: (relative / count as f64).sqrt(),
            variance_ratio: moments.variance / (moments.mean * moments.mean * relative),
            variance_ratio_error: ((relative + 2.0) / count as f64).sqrt(),
            none,
            none_error: none - law.probability_of_none(),
            w1: wasserstein_1(&over_mean, &true_quantiles)?,
            w1_floor: floor(law, &true_quantiles)?,
        })
    }
}

/// Mean distance from the law of four sets of values drawn from it.
fn floor(law: &CountLaw, true_quantiles: &[f64]) -> Result<f64, OracleError> {
    const SETS: u64 = 4;
    let mut sum = 0.0;
    for set in 0..SETS {
        let values = 0..true_quantiles.len() as u64;
        let drawn: Vec<f64> = values.map(|index| law.quantile(uniform(index + (set << 40)))).collect();
        sum += wasserstein_1(&drawn, true_quantiles)?;
    }
    Ok(sum / SETS as f64)
}

/// The random number of that index in [0, 1) (SplitMix64, Steele et al. 2014).
fn uniform(index: u64) -> f64 {
    let mut word = (index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((word ^ word >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn condition(flakes: f64) -> Condition {
        Condition { alpha: 0.1, gamma_deg: 6.0, flakes, theta_i_deg: 30.0, theta_o_deg: 36.0, phi_deg: 0.0 }
    }

    #[test]
    fn quantiles_have_the_moments_of_the_law() {
        for flakes in [0.1, 3.0, 40.0, 1e3, 1e5] {
            let law = CountLaw::of(&condition(flakes)).expect("a law");
            let quantiles = law.quantiles(200_000);
            let moments = Moments::of(&quantiles).expect("moments");
            let none = quantiles.iter().filter(|value| **value == 0.0).count() as f64 / 200_000.0;
            println!("{flakes}: {} lit, mean {}, variance {}", law.lit(), moments.mean, moments.variance);
            assert!((moments.mean - 1.0).abs() < 1e-3, "{}", moments.mean);
            assert!((moments.variance / law.relative_variance() - 1.0).abs() < 5e-3, "{}", moments.variance);
            assert!((none - law.probability_of_none()).abs() < 1e-5, "{none}");
        }
    }

    /// Values drawn from the law pass; the law of 5 % more flakes, and values between whole numbers of flakes, do not.
    #[test]
    fn chi_square_accepts_the_law_and_nothing_else() {
        for flakes in [3.0, 100.0, 1e4] {
            let law = CountLaw::of(&condition(flakes)).expect("a law");
            let more = CountLaw::of(&condition(1.05 * flakes)).expect("a law");
            let drawn = |law: &CountLaw| -> Vec<f64> {
                (0..65536).map(|index| law.quantile(uniform(index)) * law.mean()).collect()
            };
            let fair = law.chi_square(&drawn(&law)).expect("a test").p_value;
            let worth = law.mean() / law.lit();
            let many: Vec<f64> = (0..65536).map(|index| more.quantile(uniform(index)) * more.lit() * worth).collect();
            let biased = law.chi_square(&many).expect("a test").p_value;
            println!("{flakes}: {fair} {biased}");
            assert!(fair > 1e-4 && biased < 1e-6, "{fair} {biased}");
        }
    }

    /// Values drawn from the law are at its floor; a mean 5 % too high, a variance 20 % too small and one pixel in twenty
    /// darkened are each seen.
    #[test]
    fn errors_are_seen_where_there_are_any() {
        let law = CountLaw::of(&condition(100.0)).expect("a law");
        let fair: Vec<f64> = law.quantiles(16384).iter().map(|value| value * law.mean()).collect();
        let errors = CountErrors::of(&law, &fair).expect("errors");
        assert!((errors.mean_ratio - 1.0).abs() < errors.mean_ratio_error);
        assert!((errors.variance_ratio - 1.0).abs() < errors.variance_ratio_error);
        assert!(errors.none_error.abs() < 1e-4 && errors.w1 < errors.w1_floor);
        let bright: Vec<f64> = fair.iter().map(|f| 1.05 * f).collect();
        let bright = CountErrors::of(&law, &bright).expect("errors");
        assert!((bright.mean_ratio - 1.05).abs() < 1e-3 && bright.w1 > 5.0 * bright.w1_floor);
        assert!((bright.variance_ratio - 1.0).abs() < 1e-2, "relative variance does not know the mean");
        let even: Vec<f64> = fair.iter().map(|f| law.mean() + (f - law.mean()) * 0.8_f64.sqrt()).collect();
        let even = CountErrors::of(&law, &even).expect("errors");
        assert!((even.variance_ratio - 0.8).abs() < 0.01 && even.w1 > 5.0 * even.w1_floor);
        let dark: Vec<f64> = fair.iter().enumerate().map(|(k, f)| if k % 20 == 0 { 0.0 } else { *f }).collect();
        assert!(CountErrors::of(&law, &dark).expect("errors").none_error > 0.04);
    }
}
