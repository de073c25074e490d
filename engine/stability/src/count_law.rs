//! The laws by which counts of lit flakes are drawn, as a device draws them.

use crate::{Laboratory, StabilityError, bits};
use mica_oracle::statistics::{self, normal_p_value};
use mica_shaders::types::Words;

/// In a square of texture.
const FLAKES: f32 = 1e9;
/// The probability that a flake is lit: as of alpha .1 and a cone of 6 degrees.
const LIT: f64 = 0.03;
/// Means below this are taken from the device's own distribution function, others by quadrature.
const LISTED_BELOW: f64 = 64.0;
/// Nodes of the quadrature, evenly spaced in the normal number.
const NODES: usize = 512;
/// The greatest of the normal numbers: the last of 2^32 words are beyond it.
const FARTHEST: f64 = 6.2;

/// Draws from each law whose moments are sampled.
const DRAWS: u32 = 1 << 11;

/// A mean and a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// The mean.
    pub mean: f64,
    /// The standard deviation.
    pub deviation: f64,
}

/// n tries, and the probability of success.
pub type Law = [f32; 2];

/// The law of the lit flakes in a footprint where so many, lit or not, are expected.
pub fn law_of(expected: f64) -> Law {
    [FLAKES, (expected * LIT / f64::from(FLAKES)) as f32]
}

/// Those of the law itself.
pub fn exact_moments([n, p]: Law) -> Moments {
    let (n, p) = (f64::from(n), f64::from(p));
    Moments { mean: n * p, deviation: (n * p * (1.0 - p)).sqrt() }
}

/// Those of `binomial` in `shared/binomial.glsl`, over all 2^32 words. Of small means without an error of their own:
/// that of P(K >= k), how many words give so many, is looked for by bisection on the device. Of others within 1e-5, by words
/// that are spread as normal numbers are.
///
/// # Errors
/// Those of the device.
pub fn binomial_moments(laboratory: &mut Laboratory, laws: &[Law]) -> Result<Vec<Moments>, StabilityError> {
    let listed: Vec<bool> = laws.iter().map(|law| exact_moments(*law).mean < LISTED_BELOW).collect();
    let reach = |law: Law| {
        let Moments { mean, deviation } = exact_moments(law);
        let below = (mean - 10.0 * deviation - 12.0).floor().max(0.0);
        (below as u32, ((mean + 10.0 * deviation + 12.0).ceil() as u32).min(law[0] as u32))
    };
    let strata = strata();
    let (mut thresholds, mut draws) = (Vec::new(), Vec::new());
    for (law, listed) in laws.iter().zip(&listed) {
        let [n, p] = law.map(f32::to_bits);
        if *listed {
            let (below, most) = reach(*law);
            thresholds.extend((below + 1..=most).map(|k| Words { a: [n, p, (k as f32).to_bits(), 0], b: [0; 4] }));
        } else {
            draws.extend(strata.iter().map(|(word, _)| Words { a: [*word, n, p, 0], b: [0; 4] }));
        }
    }
    let words = laboratory.words(&thresholds, bits!(binomial_words))?;
    let counts = laboratory.words(&draws, bits!(count_inverted))?;
    let (mut words, mut counts) = (words.into_iter(), counts.into_iter());
    Ok(laws
        .iter()
        .zip(&listed)
        .map(|(law, listed)| {
            if *listed {
                // About a number that is always reached: E[K] is the sum of P(K >= k), E[K^2] that of (2k - 1) P(K >= k).
                let (below, most) = reach(*law);
                let (mut first, mut second) = (0.0, 0.0);
                for k in 1..=most - below {
                    let chance = words.next().map_or(0.0, |[words, ..]| f64::from(words)) / 4_294_967_296.0;
                    first += chance;
                    second += (2.0 * f64::from(k) - 1.0) * chance;
                }
                Moments { mean: f64::from(below) + first, deviation: (second - first * first).max(0.0).sqrt() }
            } else {
                let middle = exact_moments(*law).mean;
                let (mut first, mut second) = (0.0, 0.0);
                for (_, share) in &strata {
                    let away = counts.next().map_or(0.0, |[count, ..]| f64::from(f32::from_bits(count))) - middle;
                    first += share * away;
                    second += share * away * away;
                }
                Moments { mean: middle + first, deviation: (second - first * first).max(0.0).sqrt() }
            }
        })
        .collect())
}

/// Moments of the lit flakes where so many, lit or not, are expected, and scales are switched at 4 and 64: sampled, the
/// deviation within 3 %.
///
/// # Errors
/// Those of the device.
pub fn scale_moments(laboratory: &mut Laboratory, expected: &[f64]) -> Result<Vec<Moments>, StabilityError> {
    let draw = |expected: f64, draw: u32| {
        let [expected, lit, flakes] = [expected as f32, LIT as f32, FLAKES].map(f32::to_bits);
        Words { a: [expected, lit, even(draw), draw.reverse_bits() | 1 << 20], b: [flakes, 0, 0, 0] }
    };
    let words: Vec<Words> =
        expected.iter().flat_map(|expected| (0..DRAWS).map(|index| draw(*expected, index))).collect();
    sampled(&laboratory.words(&words, bits!(lit_by_scale))?)
}

/// The law by which a gated normal number counts: the flakes expected for the tries, whole or not.
pub fn gated_law(expected: f64) -> Law {
    [expected as f32, LIT as f32]
}

/// Moments of counts by a gate and a rounded normal number, sampled likewise.
///
/// # Errors
/// Those of the device.
pub fn gated_moments(laboratory: &mut Laboratory, laws: &[Law]) -> Result<Vec<Moments>, StabilityError> {
    let normal = |index: u32| normal_above(1.0 - (f64::from(index.reverse_bits()) + 0.5) / 4_294_967_296.0);
    let numbers: Vec<[u32; 2]> = (0..DRAWS)
        .map(|index| [f64::from(even(index)) / 4_294_967_296.0, normal(index)].map(|number| (number as f32).to_bits()))
        .collect();
    let draw = |law: Law, [uniform, normal]: [u32; 2]| {
        let [n, p] = law.map(f32::to_bits);
        Words { a: [n, p, uniform, normal], b: [0; 4] }
    };
    let words: Vec<Words> = laws.iter().flat_map(|law| numbers.iter().map(|numbers| draw(*law, *numbers))).collect();
    sampled(&laboratory.words(&words, bits!(gated_count))?)
}

/// The `index`-th of so many words that are spread evenly.
fn even(index: u32) -> u32 {
    let step = u32::MAX / DRAWS + 1;
    index * step + step / 2
}

/// Moments of each law's draws.
fn sampled(counts: &[[u32; 4]]) -> Result<Vec<Moments>, StabilityError> {
    counts
        .chunks(DRAWS as usize)
        .map(|counts| {
            let counts: Vec<f64> = counts.iter().map(|count| f64::from(f32::from_bits(count[0]))).collect();
            let of = statistics::Moments::of(&counts)?;
            Ok(Moments { mean: of.mean, deviation: of.variance.sqrt() })
        })
        .collect()
}

/// The probability that a normal number is below.
fn normal_below(z: f64) -> f64 {
    let tail = 0.5 * normal_p_value(z);
    if z < 0.0 { tail } else { 1.0 - tail }
}

/// The normal number that others are below with this probability, by bisection.
pub fn normal_above(probability: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if normal_below(middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Words in the middle of strata that are even in the normal number, and the share of all words in each.
fn strata() -> Vec<(u32, f64)> {
    let width = 2.0 * FARTHEST / NODES as f64;
    let edge = |at: usize| match at {
        0 => 0.0,
        NODES => 1.0,
        _ => normal_below(-FARTHEST + width * at as f64),
    };
    (0..NODES)
        .map(|at| {
            let word = normal_below(-FARTHEST + width * (at as f64 + 0.5)) * 4_294_967_296.0;
            (word as u32, edge(at + 1) - edge(at))
        })
        .collect()
}

/// Numbers of flakes from `least` to `most`, each larger than the last by a hundredth times `stride`.
pub fn in_steps(least: f64, most: f64, stride: u32) -> Vec<f64> {
    let factor = 1.01_f64.powi(stride as i32);
    std::iter::successors(Some(least), |x| Some(x * factor)).take_while(|x| *x <= most).collect()
}

/// The greatest change between neighbours of ln(value / truth): a step that the truth does not have. Infinite where a value is
/// not above 0.
pub fn greatest_step(values: impl Iterator<Item = f64>, truth: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = values.zip(truth).map(|(value, truth)| (value / truth).ln()).collect();
    let steps = logs.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, |worst, step| if step.is_nan() { f64::INFINITY } else { worst.max(step) })
}
