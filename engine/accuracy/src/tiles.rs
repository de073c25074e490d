//! Intervals of figures of pictures, from their tiles: a bootstrap that knows that neighbouring pixels are not independent.
//!
//! A figure is a function of sums over the tiles of a picture. Drawing as many tiles as there are, with replacement, and
//! computing the figure again gives its distribution over other pictures of the same kind (Künsch 1989, "The jackknife and
//! the bootstrap for general stationary observations": blocks that are longer than the dependence). A tile brings both
//! pictures of a comparison along, so that what they share cancels in their ratio.

use crate::point::Estimate;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Side of a tile in pixels: wider than any filter of a method.
const TILE: usize = 16;
/// Resamplings behind an interval.
const RESAMPLINGS: usize = 200;
/// Share of the resamplings left out at either end: intervals of 95 %.
const TAIL: f64 = 0.025;

/// Where an interval lies about its figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Centre {
    /// Where the resamplings put it.
    Resampled,
    /// About the figure, as wide as the resamplings spread. For distances of samples, which are never 0: a resampling adds
    /// as much to the distance as the sampling did, so that the resamplings may all lie above the figure.
    Figure,
}

/// The tiles of a picture that hold pixels to be compared.
#[derive(Clone, Debug)]
pub(crate) struct Tiles {
    /// The tile of each pixel of the picture; none where the pixel is not compared.
    tile_of: Vec<Option<u32>>,
    count: usize,
}

impl Tiles {
    /// Parts a picture of `width` pixels a row into tiles, numbered row by row, of which those are left out that hold no
    /// compared pixel.
    pub(crate) fn new(width: usize, compared: &[bool]) -> Self {
        let width = width.max(1);
        let columns = width.div_ceil(TILE);
        let place = |pixel: usize| pixel / width / TILE * columns + pixel % width / TILE;
        let mut numbers = vec![None; compared.len().div_ceil(width).div_ceil(TILE) * columns];
        for (pixel, _) in compared.iter().enumerate().filter(|(_, compared)| **compared) {
            numbers[place(pixel)] = Some(0);
        }
        let mut count = 0;
        for number in numbers.iter_mut().flatten() {
            *number = count;
            count += 1;
        }
        let of = |(pixel, &compared): (usize, &bool)| if compared { numbers[place(pixel)] } else { None };
        Self { tile_of: compared.iter().enumerate().map(of).collect(), count: count as usize }
    }

    /// How many tiles there are.
    pub(crate) const fn count(&self) -> usize {
        self.count
    }

    /// Each compared pixel with its tile, in order.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = (usize, usize)> {
        self.tile_of.iter().enumerate().filter_map(|(pixel, tile)| tile.map(|tile| (pixel, tile as usize)))
    }

    /// Sums over the pixels of each tile.
    pub(crate) fn sums<const N: usize>(&self, of: impl Fn(usize, usize) -> [f64; N]) -> Vec<[f64; N]> {
        let mut sums = vec![[0.0; N]; self.count];
        for (pixel, tile) in self.pixels() {
            for (sum, value) in sums[tile].iter_mut().zip(of(pixel, tile)) {
                *sum += value;
            }
        }
        sums
    }

    /// The draws behind intervals, the same for every figure of the picture.
    pub(crate) fn bootstrap(&self) -> Bootstrap {
        let mut random = Pcg64Mcg::seed_from_u64(0);
        // A single tile says nothing of what another would show.
        let resamplings = if self.count < 2 { 0 } else { RESAMPLINGS };
        let draw = |_| {
            let mut times = vec![0; self.count];
            for _ in 0..self.count {
                times[(random.next_u64() % self.count as u64) as usize] += 1;
            }
            times
        };
        Bootstrap { once: vec![1; self.count], times: (0..resamplings).map(draw).collect() }
    }
}

/// How many times each tile is drawn in each resampling.
#[derive(Clone, Debug)]
pub(crate) struct Bootstrap {
    once: Vec<u32>,
    times: Vec<Vec<u32>>,
}

impl Bootstrap {
    /// A figure of the tiles, each counted so many times. It may be no number, for some draws or for all: it is then left
    /// out of the interval, or has none.
    pub(crate) fn estimate(&self, centre: Centre, figure: impl Fn(&[u32]) -> f64) -> Estimate {
        let value = figure(&self.once);
        let resampled: Vec<f64> = self.times.iter().map(|times| figure(times)).collect();
        interval(value, resampled, centre)
    }

    /// A figure of sums over tiles.
    pub(crate) fn of_sums<const N: usize>(&self, sums: &[[f64; N]], figure: impl Fn([f64; N]) -> f64) -> Estimate {
        self.estimate(Centre::Resampled, |times| figure(total(sums, times)))
    }

    /// A sum over tiles over another.
    pub(crate) fn ratio(&self, sums: &[[f64; 2]]) -> Estimate {
        self.of_sums(sums, |[over, under]| ratio(over, under))
    }

    /// The figures of all tiles, and of each resampling.
    pub(crate) fn draws(&self) -> impl Iterator<Item = &[u32]> {
        std::iter::once(&self.once).chain(&self.times).map(Vec::as_slice)
    }
}

/// The interval of a figure and of what became of it in resamplings.
pub(crate) fn interval(value: f64, mut resampled: Vec<f64>, centre: Centre) -> Estimate {
    resampled.retain(|value| value.is_finite());
    resampled.sort_unstable_by(f64::total_cmp);
    let (true, Some(last)) = (value.is_finite(), resampled.len().checked_sub(1)) else {
        return Estimate { value: finite(value), low: f64::NAN, high: f64::NAN };
    };
    let at = |share: f64| resampled[(share * last as f64).round() as usize];
    let (low, high) = match centre {
        Centre::Resampled => (at(TAIL), at(1.0 - TAIL)),
        Centre::Figure => (value + at(TAIL) - at(0.5), value + at(1.0 - TAIL) - at(0.5)),
    };
    Estimate { value, low: low.min(value), high: high.max(value) }
}

/// Sums over tiles, each counted so many times.
pub(crate) fn total<const N: usize>(sums: &[[f64; N]], times: &[u32]) -> [f64; N] {
    let mut total = [0.0; N];
    for (sums, &times) in sums.iter().zip(times).filter(|(_, times)| **times > 0) {
        for (total, sum) in total.iter_mut().zip(sums) {
            *total += f64::from(times) * sum;
        }
    }
    total
}

/// A number over another; no number where there is nothing to compare with.
pub(crate) fn ratio(over: f64, under: f64) -> f64 {
    if under > 0.0 { finite(over / under) } else { f64::NAN }
}

/// A number, or what is none.
fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparkle::exponential;

    const SIZE: [usize; 2] = [100, 70];

    #[test]
    fn tiles_are_numbered_row_by_row_and_those_without_compared_pixels_are_none() {
        let mut compared = vec![false; SIZE[0] * SIZE[1]];
        for [x, y] in [[0, 0], [15, 15], [16, 0], [99, 0], [3, 69], [99, 69]] {
            compared[y * SIZE[0] + x] = true;
        }
        let tiles = Tiles::new(SIZE[0], &compared);
        let found: Vec<(usize, usize)> = tiles.pixels().collect();
        assert_eq!(found, [(0, 0), (16, 1), (99, 2), (1515, 0), (6903, 3), (6999, 4)]);
        assert_eq!(tiles.count(), 5);
        assert_eq!(tiles.sums(|_, _| [1.0])[0], [2.0]);
    }

    /// The share of 400 ratios of pictures of exponential pixels, constant over 4 x 4, whose interval holds 1. Tiles know
    /// of the blocks; intervals of single pixels hold it in 35 % instead of 95 %. With 35 tiles, an interval of percentiles
    /// is a little too short.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say_though_neighbours_are_alike() {
        let tiles = Tiles::new(SIZE[0], &vec![true; SIZE[0] * SIZE[1]]);
        let bootstrap = tiles.bootstrap();
        let holds = |seed: u64| {
            let [x, r] = [0, 1].map(|which| exponential(2 * seed + which, 25 * 18));
            let block = |pixel: usize| pixel / SIZE[0] / 4 * 25 + pixel % SIZE[0] / 4;
            let ratio = bootstrap.ratio(&tiles.sums(|pixel, _| [x[block(pixel)], r[block(pixel)]]));
            (ratio.low..=ratio.high).contains(&1.0)
        };
        let share = (0..400).filter(|seed| holds(*seed)).count() as f64 / 400.0;
        assert!((0.90..0.98).contains(&share), "{share}");
    }

    #[test]
    fn what_is_not_defined_is_no_number_and_one_tile_has_no_interval() {
        let one = Tiles::new(4, &[true; 16]);
        let estimate = one.bootstrap().ratio(&one.sums(|pixel, _| [pixel as f64, 1.0]));
        assert!(estimate.value == 7.5 && estimate.low.is_nan() && estimate.high.is_nan(), "{estimate:?}");
        let none = Tiles::new(4, &[false; 16]);
        let estimate = none.bootstrap().ratio(&none.sums(|_, _| [1.0, 1.0]));
        assert!(none.count() == 0 && estimate.value.is_nan(), "{estimate:?}");
        assert_eq!(Tiles::new(0, &[]).count(), 0);
        let all = Tiles::new(SIZE[0], &vec![true; SIZE[0] * SIZE[1]]);
        // The first tile over the last: a third of the draws is without the last, and the others have their interval.
        let is = |tile: usize, which: usize| f64::from(u32::from(tile == which));
        let ends = all.sums(|_, tile| [is(tile, 0) / 256.0, is(tile, 34) / 24.0]);
        let estimate = all.bootstrap().ratio(&ends);
        assert!(
            (estimate.value - 1.0).abs() < 1e-9 && estimate.low == 0.0 && (2.0..5.0).contains(&estimate.high),
            "{estimate:?}"
        );
    }

    #[test]
    fn every_resampling_draws_as_many_tiles_as_there_are_and_the_same_each_time() {
        let tiles = Tiles::new(SIZE[0], &vec![true; SIZE[0] * SIZE[1]]);
        let (first, second) = (tiles.bootstrap(), tiles.bootstrap());
        assert!(first.draws().eq(second.draws()) && first.draws().count() == 1 + RESAMPLINGS);
        assert!(first.draws().all(|times| times.iter().sum::<u32>() == 35));
        assert!(first.draws().skip(1).all(|times| times.contains(&0)));
    }
}
