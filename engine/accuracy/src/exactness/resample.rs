//! How sure an error is: the same figure of samples drawn anew from those there are (Efron 1979).

use crate::Estimate;

/// Times that the samples are drawn anew.
const DRAWS: usize = 48;

/// Random words that are the same every time (SplitMix64, Steele et al. 2014).
#[derive(Clone, Debug)]
pub struct Words(pub u64);

impl Words {
    /// The next.
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        word ^ word >> 31
    }

    /// The next number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A figure of so many samples with its interval of 95 %: `figure` is given which samples to take, by index, with repetition.
/// A distance from 0 grows when samples are repeated; that much is taken off again.
pub fn resampled(samples: usize, figure: impl Fn(&[usize]) -> f64) -> Estimate {
    let all: Vec<usize> = (0..samples).collect();
    let value = figure(&all);
    let mut words = Words(samples as u64);
    let mut drawn: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let picks: Vec<usize> = (0..samples).map(|_| (words.unit() * samples as f64) as usize).collect();
            figure(&picks)
        })
        .collect();
    drawn.sort_unstable_by(f64::total_cmp);
    let shift = 0.5 * (drawn[(DRAWS - 1) / 2] + drawn[DRAWS / 2]) - value;
    let ends = [drawn[DRAWS / 40], drawn[DRAWS - 1 - DRAWS / 40]].map(|end| (end - shift).max(0.0));
    Estimate { value, low: ends[0].min(value), high: ends[1].max(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of numbers between 0 and 1: its interval is 2 x 1.96 standard errors wide.
    #[test]
    fn intervals_are_as_wide_as_the_figure_spreads() {
        let mut words = Words(3);
        let values: Vec<f64> = (0..2000).map(|_| words.unit()).collect();
        let mean = |picks: &[usize]| picks.iter().map(|pick| values[*pick]).sum::<f64>() / picks.len() as f64;
        let Estimate { value, low, high } = resampled(values.len(), mean);
        let expected = 2.0 * 1.96 * (1.0f64 / 12.0 / 2000.0).sqrt();
        assert!(low < value && value < high);
        assert!(((high - low) / expected - 1.0).abs() < 0.3, "{} {expected}", high - low);
        assert_eq!(resampled(values.len(), mean), Estimate { value, low, high }, "the same every time");
    }
}
