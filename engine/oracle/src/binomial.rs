//! The binomial law in f64: how many of n flakes are lit, each with probability p.

use crate::OracleError;
use crate::error::in_range;

/// Binomial(n, p).
#[derive(Clone, Debug)]
pub struct Binomial {
    n: u64,
    p: f64,
    /// The first number that is not out of reach.
    first: u64,
    /// P(K = first), P(K = first + 1) and so on; what is left out is less than 1e-20.
    masses: Vec<f64>,
}

impl Binomial {
    /// The law of `n` flakes that are lit with probability `p` each.
    ///
    /// # Errors
    /// When `p` is no probability, or `n` is above 2^52.
    pub fn new(n: u64, p: f64) -> Result<Self, OracleError> {
        in_range("p", p, (0.0..=1.0).contains(&p), "in [0, 1]")?;
        in_range("n", n as f64, n <= 1 << 52, "at most 2^52")?;
        let (count, mean) = (n as f64, n as f64 * p);
        let reach = 10.0 * (mean * (1.0 - p)).sqrt() + 40.0;
        let (first, last) = ((mean - reach).max(0.0).floor(), (mean + reach).min(count).ceil());
        let mode = ((count + 1.0) * p).floor().min(count);
        // Outwards from the mode by ratios of neighbours, then scaled to a sum of 1: no factorial is needed.
        let ratio = |k: f64| if p < 1.0 { (count - k) / (k + 1.0) * (p / (1.0 - p)) } else { f64::INFINITY };
        let mut masses = vec![0.0; (last - first) as usize + 1];
        let middle = (mode - first) as usize;
        masses[middle] = 1.0;
        for at in middle + 1..masses.len() {
            masses[at] = masses[at - 1] * ratio(first + at as f64 - 1.0);
        }
        for at in (0..middle).rev() {
            masses[at] = masses[at + 1] / ratio(first + at as f64);
        }
        let total: f64 = masses.iter().sum();
        masses.iter_mut().for_each(|mass| *mass /= total);
        Ok(Self { n, p, first: first as u64, masses })
    }

    /// n p.
    pub fn mean(&self) -> f64 {
        self.n as f64 * self.p
    }

    /// n p (1 - p).
    pub fn variance(&self) -> f64 {
        self.mean() * (1.0 - self.p)
    }

    /// The probability that none is lit, (1 - p)^n.
    pub fn probability_of_none(&self) -> f64 {
        (self.n as f64 * (-self.p).ln_1p()).exp()
    }

    /// The least number that is exceeded with probability `v` or less.
    pub fn exceeded_with(&self, v: f64) -> u64 {
        // From the top, so that small tails keep their digits.
        let mut beyond = 0.0;
        for (at, mass) in self.masses.iter().enumerate().rev() {
            beyond += mass;
            if beyond > v {
                return self.first + at as u64;
            }
        }
        self.first
    }

    /// Wasserstein-1 distance of values from the law: the area between the two distribution functions, each value having the
    /// same weight. They need not be whole.
    ///
    /// # Errors
    /// When there are no values.
    pub fn distance(&self, values: &[f64]) -> Result<f64, OracleError> {
        if values.is_empty() {
            return Err(OracleError::TooFew { what: "distance from a law", given: 0, needed: 1 });
        }
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        // Both quantile functions are steps: the next step of either ends a piece on which both are constant.
        let (mut distance, mut from, mut at, mut reached) = (0.0, 0.0, 0, self.masses[0]);
        for (index, value) in sorted.iter().enumerate() {
            let end = (index + 1) as f64 / sorted.len() as f64;
            while from < end {
                let last = at + 1 == self.masses.len();
                let to = if last { end } else { end.min(reached) };
                distance += (to - from).max(0.0) * ((self.first + at as u64) as f64 - value).abs();
                from = to;
                if from < end {
                    at += 1;
                    reached += self.masses[at];
                }
            }
        }
        Ok(distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, for a few flakes.
    #[test]
    fn a_few_flakes_are_lit_as_sets_of_them_are_counted() {
        for p in [0.0, 0.1, 0.5, 0.93, 1.0] {
            let law = Binomial::new(6, p).expect("a law");
            let mut counted = [0.0; 7];
            for set in 0_u32..64 {
                let lit = set.count_ones() as i32;
                counted[lit as usize] += f64::powi(p, lit) * (1.0 - p).powi(6 - lit);
            }
            for (k, expected) in counted.iter().enumerate() {
                let mass = law.masses.get(k - law.first as usize).copied().unwrap_or(0.0);
                assert!((mass - expected).abs() < 1e-15, "{p}: P({k}) = {mass}, counted {expected}");
            }
            assert!((law.probability_of_none() - counted[0]).abs() < 1e-15);
        }
    }

    #[test]
    fn masses_have_the_moments_of_the_law() {
        for (n, p) in [(1, 0.3), (50, 0.02), (1000, 0.5), (1_000_000, 1e-6), (1_000_000, 0.31), (1 << 40, 1e-9)] {
            let law = Binomial::new(n, p).expect("a law");
            let moment = |power: i32| -> f64 {
                let terms = (0..).zip(&law.masses);
                terms.map(|(at, mass)| ((law.first + at) as f64 - law.mean()).powi(power) * mass).sum()
            };
            assert!(moment(1).abs() < 1e-9 * (1.0 + law.mean()), "{n} {p}: {}", moment(1));
            assert!((moment(2) / law.variance() - 1.0).abs() < 1e-9, "{n} {p}: {}", moment(2));
            if law.first == 0 {
                assert!((law.masses[0] / law.probability_of_none() - 1.0).abs() < 1e-9, "{n} {p}");
            }
        }
    }

    #[test]
    fn as_many_exceed_a_number_as_it_says() {
        for (n, p) in [(6, 0.3), (1000, 0.01), (1 << 40, 1e-11)] {
            let law = Binomial::new(n, p).expect("a law");
            for v in [1.0, 0.999, 0.5, 0.1, 1e-6] {
                let number = law.exceeded_with(v);
                let beyond = |number: u64| -> f64 { law.masses[(number - law.first) as usize + 1..].iter().sum() };
                assert!(beyond(number) <= v, "{n} {p}: {number} is exceeded with {}", beyond(number));
                assert!(number == law.first || beyond(number - 1) > v, "{n} {p}: {number} is not the least for {v}");
            }
        }
    }

    #[test]
    fn distance_is_the_area_between_the_distribution_functions() {
        let coin = Binomial::new(1, 0.25).expect("a law");
        let near = |values: &[f64], expected: f64| {
            let distance = coin.distance(values).expect("a distance");
            assert!((distance - expected).abs() < 1e-15, "{values:?}: {distance}");
        };
        near(&[0.0, 1.0, 0.0, 0.0], 0.0);
        near(&[0.0], 0.25);
        near(&[1.0], 0.75);
        near(&[0.0, 3.0], 0.25 * 3.0 + 0.25 * 2.0);
        near(&[0.25], 0.75 * 0.25 + 0.25 * 0.75);
        assert!(coin.distance(&[]).is_err());
        let many = Binomial::new(1000, 0.1).expect("a law");
        assert!((many.distance(&[300.0]).expect("a distance") - 200.0).abs() < 1e-9, "all of it is below");
    }

    #[test]
    fn what_is_no_law_is_refused() {
        assert!(
            Binomial::new(3, 1.5).is_err()
                && Binomial::new(3, f64::NAN).is_err()
                && Binomial::new(1 << 60, 0.1).is_err()
        );
    }
}
