//! The dictionary of Chermain et al. 2020: even distributions of one slope, each at sixteen levels of detail.
//!
//! The authors' own is not at hand; this one has its sizes and statistics. A distribution of level l is the mean of 2^l
//! pairs of Gaussian lobes about +m and -m, with m drawn from the Gaussian that the distributions tend to, and each
//! level holds the lobes of the level before, so that a cell keeps its lobes when it is seen from twice as far.
//!
//! What the paper leaves open is decided so: means are stratified over the distributions of the dictionary, one in each
//! of 192 equally likely ranges, as otherwise their mean differs from the limit by tens of percent on the lowest level;
//! means end where the support ends, at four standard deviations; they are rounded to sixteenths of a texel.

use mica_shaders::constants as c;
use rayon::prelude::*;
use std::f64::consts::SQRT_2;
use std::sync::{Arc, LazyLock};

/// Standard deviation of a lobe as published, in slopes of the dictionary.
pub(super) const PRINTED_LOBE: f64 = 0.02;
/// The narrowest and the widest lobes that a dictionary can have: its samples barely resolve the first, and the second
/// leaves the means half of their spread.
pub(super) const LOBES: [f64; 2] = [PRINTED_LOBE, 0.3];
/// Roughness that the dictionary is made for.
pub(super) const ALPHA: f64 = c::CHERMAIN_ALPHA as f64;
/// Bytes of a dictionary.
pub(super) const BYTES: u64 = (c::CHERMAIN_MARGINALS * c::CHERMAIN_LEVELS * c::CHERMAIN_TEXELS) as u64 * 4;

const MARGINALS: usize = c::CHERMAIN_MARGINALS as usize;
const LEVELS: usize = c::CHERMAIN_LEVELS as usize;
const TEXELS: usize = c::CHERMAIN_TEXELS as usize;
/// Standard deviation of the distribution that all tend to.
const DEVIATION: f64 = ALPHA / SQRT_2;
/// Slope at which a distribution ends.
const SUPPORT: f64 = 4.0 * DEVIATION;
/// Places that a lobe's mean can be at.
const BINS: usize = 16 * TEXELS;
/// Bins to a texel, and slope from one to the next.
const BINS_A_TEXEL: usize = BINS / TEXELS;
const BIN: f64 = SUPPORT / BINS as f64;

/// A dictionary whose lobes have this standard deviation, in the order of `shared/chermain_dictionary.glsl`. Wider
/// lobes than published lie closer to 0, so that the whole keeps its variance.
pub(super) fn with_lobe(lobe: f64) -> Arc<[u8]> {
    static PRINTED: LazyLock<Arc<[u8]>> = LazyLock::new(|| as_bytes(&made(PRINTED_LOBE)));
    if lobe == PRINTED_LOBE { PRINTED.clone() } else { as_bytes(&made(lobe)) }
}

fn as_bytes(densities: &[f32]) -> Arc<[u8]> {
    Arc::from(bytemuck::cast_slice::<f32, u8>(densities))
}

/// Standard deviation of the lobes' means.
fn mean_deviation(lobe: f64) -> f64 {
    if lobe == PRINTED_LOBE { DEVIATION } else { (DEVIATION * DEVIATION - lobe * lobe).sqrt() }
}

fn made(lobe: f64) -> Vec<f32> {
    let edges = cumulative(mean_deviation(lobe));
    let gaussian = |bins: f64| (-0.5 * (bins * BIN / lobe).powi(2)).exp();
    // The middle of a texel is the edge between two bins.
    let profile: Vec<f64> = (0..2 * BINS).map(|bins| gaussian(bins as f64 + 0.5)).take_while(|g| *g > 1e-14).collect();
    let marginals: Vec<Vec<f32>> =
        (0..MARGINALS).into_par_iter().map(|marginal| levels(marginal, &edges, &profile)).collect();
    let row = |level: usize| level * TEXELS..(level + 1) * TEXELS;
    (0..LEVELS).flat_map(|level| marginals.iter().flat_map(move |levels| &levels[row(level)])).copied().collect()
}

/// Probability that a mean lies before the end of each bin, given that it lies in one.
fn cumulative(deviation: f64) -> Vec<f64> {
    let density = (0..BINS).map(|bin| (-0.5 * ((bin as f64 + 0.5) * BIN / deviation).powi(2)).exp());
    let sums: Vec<f64> = density
        .scan(0.0, |sum, density| {
            *sum += density;
            Some(*sum)
        })
        .collect();
    sums.iter().map(|sum| sum / sums[BINS - 1]).collect()
}

/// One distribution at all levels, from the finest detail's means counted by bin as they are drawn.
fn levels(marginal: usize, edges: &[f64], profile: &[f64]) -> Vec<f32> {
    let mut counts = vec![0u32; BINS];
    let mut densities = Vec::with_capacity(LEVELS * TEXELS);
    let mut drawn = 0;
    for level in 0..LEVELS {
        for pair in drawn..1 << level {
            counts[mean_bin(marginal, pair, edges)] += 1;
        }
        drawn = 1 << level;
        densities.extend(blurred(&counts, profile));
    }
    densities
}

/// Where the lobes of a pair lie, as the bin of the positive one.
fn mean_bin(marginal: usize, pair: usize, edges: &[f64]) -> usize {
    // A step that has no divisor in common with 192 takes the distributions to different ranges.
    let step = 6 * word(pair, 0) as usize + [1, 5][word(pair, 1) as usize % 2];
    let range = (marginal * step + word(pair, 2) as usize) % MARGINALS;
    let inside = (f64::from(word(pair, 3 + marginal as u32)) + 0.5) / 4_294_967_296.0;
    let probability = (range as f64 + inside) / MARGINALS as f64;
    edges.partition_point(|edge| *edge <= probability).min(BINS - 1)
}

/// The lobes' sum at the texels' centres, such that the density as it is looked up, linearly and with both signs,
/// integrates to 1.
fn blurred(counts: &[u32], profile: &[f64]) -> impl Iterator<Item = f32> {
    let occupied: Vec<(usize, f64)> = counts
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(bin, count)| (bin, f64::from(*count)))
        .collect();
    let lobe = |bins: usize| profile.get(bins).copied().unwrap_or(0.0);
    let sums: Vec<f64> = (0..TEXELS)
        .map(|texel| {
            // The centre lies between this bin and the one before.
            let centre = texel * BINS_A_TEXEL + BINS_A_TEXEL / 2;
            let near = |bin: usize| if bin >= centre { bin - centre } else { centre - 1 - bin };
            occupied.iter().map(|(bin, count)| count * (lobe(near(*bin)) + lobe(centre + bin))).sum()
        })
        .collect();
    let integral = 2.0 * sums.iter().sum::<f64>() * SUPPORT / TEXELS as f64;
    sums.into_iter().map(move |sum| (sum / integral) as f32)
}

/// Random word `index` of a pair of lobes: two mixers (Wellons's lowbias32) in a chain.
fn word(pair: usize, index: u32) -> u32 {
    mixed((pair as u32).wrapping_add(mixed(index)))
}

fn mixed(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::LazyLock;

    static DENSITIES: LazyLock<Vec<f32>> = LazyLock::new(|| made(PRINTED_LOBE));

    fn distribution(level: usize, marginal: usize) -> &'static [f32] {
        let first = (level * MARGINALS + marginal) * TEXELS;
        &DENSITIES[first..first + TEXELS]
    }

    /// The density at a slope, linear between the samples, as the shader looks it up.
    fn looked_up(samples: &[f32], slope: f64) -> f64 {
        let at = slope.abs() * TEXELS as f64 / SUPPORT - 0.5;
        let below = at.floor();
        let sample = |index: f64| f64::from(samples[index.clamp(0.0, TEXELS as f64 - 1.0) as usize]);
        sample(below) + (at - below) * (sample(below + 1.0) - sample(below))
    }

    /// The integral over both signs of the density times `by`, by the midpoint rule on a thousandth of a texel.
    fn integral(samples: &[f32], by: impl Fn(f64) -> f64) -> f64 {
        let step = SUPPORT / 64_000.0;
        (0..64_000)
            .map(|k| (k as f64 + 0.5) * step)
            .map(|slope| 2.0 * step * looked_up(samples, slope) * by(slope))
            .sum()
    }

    /// Smallest bias caught: 1e-5.
    #[test]
    fn every_distribution_integrates_to_one_over_both_signs() {
        assert_eq!(DENSITIES.len() * 4, BYTES as usize);
        for level in 0..LEVELS {
            for marginal in 0..MARGINALS {
                let samples = distribution(level, marginal);
                assert!(samples.iter().all(|density| *density >= 0.0 && density.is_finite()));
                // The linear interpolant, constant in the outer halves of the outer texels, has the integral of the
                // sum.
                let sum: f64 = samples.iter().map(|density| f64::from(*density)).sum();
                assert!((2.0 * sum * SUPPORT / TEXELS as f64 - 1.0).abs() < 1e-5, "{level} {marginal}");
            }
            let (samples, all) = (distribution(level, 7 * level), |_| 1.0);
            assert!((integral(samples, all) - 1.0).abs() < 1e-5, "level {level}: {}", integral(samples, all));
        }
    }

    /// Level l is the sum of 2^l pairs of lobes, half of them those of the level before: held against that sum, written
    /// out slope by slope.
    #[test]
    fn each_level_has_twice_the_lobes_of_the_one_before() {
        let edges = cumulative(DEVIATION);
        for marginal in [0, 5, 191] {
            let mut counts = vec![0u32; BINS];
            for level in 0..LEVELS {
                let drawn: u32 = counts.iter().sum();
                (drawn as usize..1 << level).for_each(|pair| counts[mean_bin(marginal, pair, &edges)] += 1);
                assert_eq!(counts.iter().sum::<u32>(), 1 << level);
                // The lobes' sum, written out.
                let raw = |slope: f64| -> f64 {
                    let lobe = |from: f64| (-0.5 * (from / PRINTED_LOBE).powi(2)).exp();
                    let mean = |bin: usize| (bin as f64 + 0.5) * BIN;
                    counts
                        .iter()
                        .enumerate()
                        .map(|(bin, n)| f64::from(*n) * (lobe(slope - mean(bin)) + lobe(slope + mean(bin))))
                        .sum()
                };
                let centres: Vec<f64> = (0..TEXELS).map(|t| raw((t as f64 + 0.5) * SUPPORT / TEXELS as f64)).collect();
                let total = 2.0 * centres.iter().sum::<f64>() * SUPPORT / TEXELS as f64;
                for (sample, raw) in distribution(level, marginal).iter().zip(&centres) {
                    assert!((f64::from(*sample) - raw / total).abs() < 1e-5 * raw / total + 1e-6, "{level} {marginal}");
                }
            }
        }
    }

    fn mean_over_dictionary(densities: &[f32], level: usize) -> Vec<f32> {
        let sample = |marginal: usize, texel: usize| densities[(level * MARGINALS + marginal) * TEXELS + texel];
        let mean =
            |texel: usize| (0..MARGINALS).map(|marginal| sample(marginal, texel)).sum::<f32>() / MARGINALS as f32;
        (0..TEXELS).map(mean).collect()
    }

    /// Mean of what cells show at this many standard deviations from the normal, over the smooth limit: the product of
    /// two independent distributions, over all angles by which it may be turned.
    fn ring_ratio(mean: &[f32], deviations: f64) -> f64 {
        let radius = deviations * DEVIATION;
        let product = |angle: f64| looked_up(mean, radius * angle.cos()) * looked_up(mean, radius * angle.sin());
        let turns = 2000;
        let sum: f64 =
            (0..turns).map(|k| product((f64::from(k) + 0.5) / f64::from(turns) * std::f64::consts::TAU)).sum();
        let peak = 1.0 / (std::f64::consts::TAU * DEVIATION * DEVIATION);
        sum / f64::from(turns) / (peak * (-0.5 * deviations * deviations).exp())
    }

    /// Mean over all cells, level by level, against the Gaussian that they tend to: nothing random is left. Measured:
    /// within .9 % up to one standard deviation of the slopes, 1.5 % up to 1.5 and 2.5 % up to 2, worst on level 0;
    /// beyond, 192 lobes are too few (half of the limit at 3 on level 0). Lobes of .4 % of the variance cost .4 % at
    /// the peak.
    #[test]
    fn the_mean_over_the_dictionary_is_the_smooth_limit_on_every_level() {
        for level in 0..LEVELS {
            let mean = mean_over_dictionary(&DENSITIES, level);
            let variance = integral(&mean, |slope| slope * slope) / (DEVIATION * DEVIATION);
            assert!((variance - 1.0).abs() < 4e-3, "level {level}: variance {variance} of the limit's");
            for (bound, deviations) in
                [(0.009, 0.0), (0.009, 0.25), (0.009, 0.5), (0.009, 1.0), (0.018, 1.5), (0.028, 2.0)]
            {
                let ratio = ring_ratio(&mean, deviations);
                assert!((ratio - 1.0).abs() < bound, "level {level} at {deviations}: {ratio}");
            }
            let biased: Vec<f32> = mean.iter().map(|density| 1.01 * density).collect();
            assert!((ring_ratio(&biased, 0.5) - 1.0).abs() > 0.009, "1 % a distribution must show");
        }
    }

    /// The relative variance from one distribution to another, of one of 2^l pairs of lobes of standard deviation s
    /// whose means have the density phi: (1 / (4 sqrt(pi) s phi) - 1) / 2^l. Measured over that, over all levels and
    /// five slopes: .94, as the linear look-up widens lobes. Smallest bias caught: lobes a tenth too wide, or a fifth
    /// too narrow.
    #[test]
    fn fluctuations_fall_with_the_number_of_lobes() {
        let mut ratios = Vec::new();
        for level in 0..LEVELS {
            for slope in [0.1, 0.2, 0.3, 0.4, 0.5] {
                let of = |marginal: usize| looked_up(distribution(level, marginal), slope);
                let mean = (0..MARGINALS).map(of).sum::<f64>() / MARGINALS as f64;
                let squares: f64 = (0..MARGINALS).map(|marginal| (of(marginal) / mean - 1.0).powi(2)).sum();
                let phi = (-0.5 * (slope / DEVIATION).powi(2)).exp() / (DEVIATION * std::f64::consts::TAU.sqrt());
                let expected =
                    (1.0 / (4.0 * std::f64::consts::PI.sqrt() * PRINTED_LOBE * phi) - 1.0) / f64::from(1 << level);
                ratios.push(squares / MARGINALS as f64 / expected);
            }
        }
        let ratio = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((ratio - 1.0).abs() < 0.12, "{ratio}");
    }

    /// What the width that gamma asks for takes from the means' spread: the whole has the variance of the limit.
    #[test]
    fn wider_lobes_keep_the_variance_of_the_whole() {
        for lobe in [0.05, 0.15, 0.3] {
            let mean = mean_over_dictionary(&made(lobe), 12);
            let variance = integral(&mean, |slope| slope * slope) / (DEVIATION * DEVIATION);
            assert!((variance - 1.0).abs() < 4e-3, "lobes of {lobe}: variance {variance} of the limit's");
        }
    }
}
