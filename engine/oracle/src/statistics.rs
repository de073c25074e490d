//! The statistics that judge estimates: moments, Z and chi-square tests, and distances between images and samples.

use crate::OracleError;

/// Mean and variance of a set of independent values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// How many values there were; at least 2.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// The unbiased estimate of their variance.
    pub variance: f64,
}

impl Moments {
    /// The moments of `values`, in two passes.
    ///
    /// # Errors
    /// When there are fewer than two values.
    pub fn of(values: &[f64]) -> Result<Self, OracleError> {
        let count = values.len();
        if count < 2 {
            return Err(OracleError::TooFew { what: "moments", given: count, needed: 2 });
        }
        let mean = values.iter().sum::<f64>() / count as f64;
        // The second sum is zero but for rounding; subtracting it restores the digits the mean lost.
        let (squares, rest) = values.iter().fold((0.0, 0.0), |(s, r), v| (s + (v - mean) * (v - mean), r + (v - mean)));
        let variance = (squares - rest * rest / count as f64) / (count - 1) as f64;
        Ok(Self { count, mean, variance })
    }

    /// The standard deviation of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance / self.count as f64).sqrt()
    }
}

/// The outcome of a family of tests made at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The smallest p-value of the family.
    pub least_p: f64,
    /// What that p-value must not fall below, after Sidak.
    pub threshold: f64,
    /// How many tests fell below it.
    pub rejected: usize,
    /// How many tests there were.
    pub tests: usize,
}

impl Verdict {
    /// Whether no test was rejected.
    pub fn accepted(&self) -> bool {
        self.rejected == 0
    }

    /// The verdict on a family of p-values, false with probability `significance` when every hypothesis holds
    /// (Sidak 1967). A p-value that is not a number counts as 0.
    ///
    /// # Errors
    /// When there are no p-values.
    pub fn of(p_values: &[f64], significance: f64) -> Result<Self, OracleError> {
        if p_values.is_empty() {
            return Err(OracleError::TooFew { what: "a family of tests", given: 0, needed: 1 });
        }
        let threshold = sidak(significance, p_values.len());
        let p = || p_values.iter().map(|p| if p.is_nan() { 0.0 } else { *p });
        Ok(Self {
            least_p: p().fold(1.0, f64::min),
            threshold,
            rejected: p().filter(|p| *p < threshold).count(),
            tests: p_values.len(),
        })
    }
}

/// The level of each of `tests` independent tests at which the family as a whole has level `significance`:
/// 1 - (1 - significance)^(1/tests).
pub fn sidak(significance: f64, tests: usize) -> f64 {
    -((-significance).ln_1p() / tests as f64).exp_m1()
}

/// Two-sided p-value of a standard normal deviate.
pub fn normal_p_value(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// Z test of each estimate's mean against its known expectation, judged as one family. An estimate without variance
/// is rejected unless it equals its expectation.
///
/// # Errors
/// When the lists differ in length or are empty.
pub fn z_test(estimates: &[Moments], expected: &[f64], significance: f64) -> Result<Verdict, OracleError> {
    same_length("estimates and expectations", estimates.len(), expected.len())?;
    let p_values: Vec<f64> = estimates
        .iter()
        .zip(expected)
        .map(|(estimate, expected)| {
            let deviation = estimate.mean - expected;
            if deviation == 0.0 { 1.0 } else { normal_p_value(deviation / estimate.standard_error()) }
        })
        .collect();
    Verdict::of(&p_values, significance)
}

/// Pearson's chi-square test of a histogram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquare {
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom after pooling.
    pub degrees_of_freedom: usize,
    /// The probability of a statistic at least as large; 0 when something was seen where nothing is expected.
    pub p_value: f64,
}

/// Cells expected to hold fewer than this are pooled.
const LEAST_EXPECTED: f64 = 5.0;

/// Tests `observed` counts against `expected` ones, cell by cell. Cells expected to hold fewer than 5 are pooled, in
/// ascending order, into cells that do. The totals are taken to be equal, which costs one degree of freedom.
///
/// # Errors
/// When the lists differ in length, or fewer than two cells are left after pooling.
pub fn chi_square(observed: &[f64], expected: &[f64]) -> Result<ChiSquare, OracleError> {
    same_length("observed and expected cells", observed.len(), expected.len())?;
    let mut cells: Vec<(f64, f64)> = observed.iter().copied().zip(expected.iter().copied()).collect();
    cells.sort_by(|a, b| a.1.total_cmp(&b.1));
    let impossible = cells.iter().any(|(observed, expected)| *expected <= 0.0 && *observed > 0.0);
    let (mut pooled, mut open): (Vec<(f64, f64)>, (f64, f64)) = (Vec::new(), (0.0, 0.0));
    for (observed, expected) in cells {
        open = (open.0 + observed, open.1 + expected);
        if open.1 >= LEAST_EXPECTED {
            pooled.push(std::mem::take(&mut open));
        }
    }
    // What is left over is too small for a cell of its own.
    if let Some(last) = pooled.last_mut() {
        *last = (last.0 + open.0, last.1 + open.1);
    }
    if pooled.len() < 2 {
        return Err(OracleError::TooFew { what: "chi-square cells after pooling", given: pooled.len(), needed: 2 });
    }
    let statistic = pooled.iter().map(|(o, e)| (o - e) * (o - e) / e).sum::<f64>();
    let degrees_of_freedom = pooled.len() - 1;
    let p_value = if impossible { 0.0 } else { upper_gamma(degrees_of_freedom as f64 / 2.0, statistic / 2.0) };
    Ok(ChiSquare { statistic, degrees_of_freedom, p_value })
}

/// The regularised upper incomplete gamma function Q(a, x), for a > 0 and x >= 0, to about 1e-12: by series below the
/// mean, by Lentz's continued fraction above (Press et al., Numerical Recipes, 6.2). Not a number outside.
pub fn upper_gamma(a: f64, x: f64) -> f64 {
    if a.is_nan() || a <= 0.0 || x.is_nan() || x < 0.0 {
        return f64::NAN;
    }
    if x == 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - libm::lgamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-17 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - front * sum
    } else {
        let mut b = x + 1.0 - a;
        let mut c = f64::INFINITY;
        let mut d = 1.0 / b;
        let mut fraction = d;
        for n in 1..100_000 {
            let n = f64::from(n);
            let numerator = -n * (n - a);
            b += 2.0;
            d = 1.0 / (numerator * d + b);
            c = b + numerator / c;
            fraction *= d * c;
            if (d * c - 1.0).abs() < 1e-16 {
                break;
            }
        }
        front * fraction
    }
}

/// Relative mean squared error, the mean of (estimate - reference)^2 / (reference^2 + `epsilon`).
///
/// # Errors
/// When the lists differ in length or are empty.
pub fn relative_mse(estimate: &[f64], reference: &[f64], epsilon: f64) -> Result<f64, OracleError> {
    same_length("estimate and reference", estimate.len(), reference.len())?;
    if estimate.is_empty() {
        return Err(OracleError::TooFew { what: "relative mean squared error", given: 0, needed: 1 });
    }
    let sum: f64 = estimate.iter().zip(reference).map(|(e, r)| (e - r) * (e - r) / (r * r + epsilon)).sum();
    Ok(sum / estimate.len() as f64)
}

/// Wasserstein-1 distance of two samples: the area between their empirical distribution functions, in the values'
/// unit. The samples may differ in size.
///
/// # Errors
/// When either sample is empty.
pub fn wasserstein_1(a: &[f64], b: &[f64]) -> Result<f64, OracleError> {
    if a.is_empty() || b.is_empty() {
        return Err(OracleError::TooFew { what: "Wasserstein distance", given: 0, needed: 1 });
    }
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let (mut i, mut j, mut distance) = (0, 0, 0.0);
    let mut at = a[0].min(b[0]);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) => x.min(*y),
            (Some(x), None) => *x,
            (None, Some(y)) => *y,
            (None, None) => break,
        };
        distance += (i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs() * (next - at);
        at = next;
        while a.get(i).is_some_and(|x| x.total_cmp(&next).is_le()) {
            i += 1;
        }
        while b.get(j).is_some_and(|y| y.total_cmp(&next).is_le()) {
            j += 1;
        }
    }
    Ok(distance)
}

/// Checks that two lists that belong together are of one length.
fn same_length(what: &'static str, left: usize, right: usize) -> Result<(), OracleError> {
    if left == right { Ok(()) } else { Err(OracleError::LengthMismatch { what, left, right }) }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;

    fn uniforms(seed: u64) -> impl FnMut() -> f64 {
        let mut random = Pcg64::seed_from_u64(seed);
        move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn moments_keep_their_digits_far_from_zero() {
        let values: Vec<f64> = (0..1000).map(|k| 1e9 + f64::from(k % 2)).collect();
        let moments = Moments::of(&values).expect("values");
        assert!((moments.mean - (1e9 + 0.5)).abs() < 1e-6);
        assert!((moments.variance - 0.25 * 1000.0 / 999.0).abs() < 1e-9, "{}", moments.variance);
        assert!((moments.standard_error() - (moments.variance / 1000.0).sqrt()).abs() < 1e-18);
        assert!(Moments::of(&[1.0]).is_err());
    }

    /// Smallest bias caught here: 2 % of the mean in every pixel of 100, 10,000 values each.
    #[test]
    fn the_z_test_accepts_the_truth_and_rejects_a_small_bias() {
        let mut uniform = uniforms(1);
        let estimates: Vec<Moments> = (0..100)
            .map(|_| Moments::of(&(0..10_000).map(|_| uniform()).collect::<Vec<_>>()).expect("values"))
            .collect();
        let verdict = z_test(&estimates, &[0.5; 100], 0.01).expect("a verdict");
        assert!(verdict.accepted() && verdict.tests == 100, "{verdict:?}");
        let verdict = z_test(&estimates, &[0.51; 100], 0.01).expect("a verdict");
        assert!(verdict.rejected > 20, "{verdict:?}");
        let mut one_wrong = [0.5; 100];
        one_wrong[37] = 0.52;
        assert_eq!(z_test(&estimates, &one_wrong, 0.01).expect("a verdict").rejected, 1);
    }

    #[test]
    fn an_estimate_without_variance_must_be_exact() {
        let constant = Moments::of(&[0.25; 8]).expect("values");
        assert!(z_test(&[constant], &[0.25], 0.01).expect("a verdict").accepted());
        assert!(!z_test(&[constant], &[0.25 + 1e-12], 0.01).expect("a verdict").accepted());
        let broken = Moments { mean: f64::NAN, ..constant };
        assert!(!z_test(&[broken], &[0.25], 0.01).expect("a verdict").accepted());
        assert!(z_test(&[constant], &[], 0.01).is_err() && z_test(&[], &[], 0.01).is_err());
    }

    #[test]
    fn sidak_keeps_the_level_of_the_family() {
        for tests in [1, 10, 1_000_000] {
            let each = sidak(0.01, tests);
            let family = -((-each).ln_1p() * tests as f64).exp_m1();
            assert!((family - 0.01).abs() < 1e-14, "{tests}: {family}");
        }
        assert!((normal_p_value(1.959_963_984_540_054) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn the_incomplete_gamma_function_has_its_known_values() {
        for x in [1e-8_f64, 0.1, 1.0, 5.0, 40.0, 300.0] {
            let exponential = upper_gamma(1.0, x) / (-x).exp();
            assert!((exponential - 1.0).abs() < 1e-12, "Q(1, {x}) is exp(-x)");
            let half = upper_gamma(0.5, x) / libm::erfc(x.sqrt());
            assert!((half - 1.0).abs() < 1e-11, "Q(1/2, {x}) is erfc(sqrt x): {half}");
            let third = upper_gamma(3.0, x) / ((-x).exp() * (1.0 + x + x * x / 2.0));
            assert!((third - 1.0).abs() < 1e-11, "Q(3, {x}) is a Poisson sum: {third}");
        }
        // Poisson sums again, either side of the switch between the two methods.
        for x in [60.0, 99.0, 100.0, 101.0, 102.0, 140.0_f64] {
            let (mut term, mut sum) = ((-x).exp(), (-x).exp());
            for k in 1..100 {
                term *= x / f64::from(k);
                sum += term;
            }
            assert!((upper_gamma(100.0, x) / sum - 1.0).abs() < 1e-11, "{x}");
        }
        assert!(upper_gamma(0.0, 1.0).is_nan() && upper_gamma(1.0, -1.0).is_nan());
        assert_eq!(upper_gamma(2.0, 0.0), 1.0);
    }

    /// Smallest bias caught here: a linear tilt of 4 % of the density, 100,000 draws in 40 cells.
    #[test]
    fn chi_square_accepts_the_law_drawn_from_and_rejects_a_tilted_one() {
        let mut uniform = uniforms(2);
        let (draws, cells) = (100_000, 40);
        let mut observed = vec![0.0; cells];
        for _ in 0..draws {
            observed[(uniform() * cells as f64) as usize] += 1.0;
        }
        let flat = vec![f64::from(draws) / cells as f64; cells];
        let test = chi_square(&observed, &flat).expect("a test");
        assert!(test.p_value > 0.01 && test.degrees_of_freedom == 39, "{test:?}");
        let tilted: Vec<f64> =
            flat.iter().enumerate().map(|(k, e)| e * (1.0 + 0.04 * (k as f64 / 19.5 - 1.0))).collect();
        assert!(chi_square(&observed, &tilted).expect("a test").p_value < 1e-6);
    }

    /// Under the true law p-values are themselves uniform: a wrong number of degrees of freedom shows at once.
    #[test]
    fn chi_square_p_values_are_uniform_with_pooled_cells_too() {
        let mut uniform = uniforms(3);
        let law: Vec<f64> = (0..20).map(|k| 0.5_f64.powi(k + 1)).collect();
        let expected: Vec<f64> = law.iter().map(|p| 2000.0 * p / (1.0 - 0.5_f64.powi(20))).collect();
        let mut p_values = Vec::new();
        for _ in 0..400 {
            let mut observed = vec![0.0; 20];
            for _ in 0..2000 {
                let cell = (-(1.0 - uniform() * (1.0 - 0.5_f64.powi(20))).log2()).floor() as usize;
                observed[cell.min(19)] += 1.0;
            }
            let test = chi_square(&observed, &expected).expect("a test");
            assert!((7..=9).contains(&test.degrees_of_freedom), "{test:?}");
            p_values.push(test.p_value);
        }
        let even: Vec<f64> = (0..400).map(|k| (f64::from(k) + 0.5) / 400.0).collect();
        let distance = wasserstein_1(&p_values, &even).expect("a distance");
        assert!(distance < 0.035, "{distance}");
    }

    #[test]
    fn what_cannot_happen_is_rejected_when_it_does() {
        let test = chi_square(&[50.0, 49.0, 1.0], &[50.0, 50.0, 0.0]).expect("a test");
        assert_eq!(test.p_value, 0.0);
        assert!(chi_square(&[1.0, 2.0], &[1.0, 2.0]).is_err(), "all pooled into one cell");
        assert!(chi_square(&[1.0], &[1.0, 2.0]).is_err());
    }

    #[test]
    fn relative_error_weighs_by_the_reference() {
        let error = relative_mse(&[1.1, 220.0], &[1.0, 200.0], 0.0).expect("an error");
        assert!((error - 0.01).abs() < 1e-15, "{error}");
        assert!(relative_mse(&[1.0], &[1.0, 2.0], 0.0).is_err() && relative_mse(&[], &[], 0.0).is_err());
    }

    #[test]
    fn wasserstein_distance_is_the_cost_of_moving_one_sample_onto_the_other() {
        let distance = |a: &[f64], b: &[f64]| wasserstein_1(a, b).expect("a distance");
        assert_eq!(distance(&[3.0, 1.0, 2.0], &[1.0, 2.0, 3.0]), 0.0);
        assert_eq!(distance(&[0.0], &[2.5]), 2.5);
        assert_eq!(distance(&[0.0, 1.0], &[5.0, 6.0]), 5.0);
        assert!((distance(&[0.0, 0.0, 0.0, 4.0], &[0.0, 4.0]) - 1.0).abs() < 1e-15, "samples of different size");
        assert_eq!(distance(&[1.0, 7.0], &[2.0]), distance(&[2.0], &[1.0, 7.0]));
        assert!(wasserstein_1(&[], &[1.0]).is_err());
    }
}
