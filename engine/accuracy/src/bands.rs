//! Errors by scale: pixels whose footprints hold few flakes sparkle, and those with many are smooth.
//!
//! The distribution of pixel luminance is compared by its Wasserstein-1 distance: the area between the two distribution
//! functions, which is what the least rearrangement of light among pixels would have to move. It is the sum, along the
//! pooled luminances in order, of the gap to the next times the difference of how many pixels of either picture lie
//! below: resamplings of tiles change the counts only, so the order is found once.

use crate::point::{BandErrors, Estimate};
use crate::tiles::{Bootstrap, Centre, Tiles, interval, ratio, total};
use crate::{errors, luminance::Luminance};

/// Flakes a pixel: at least the first, below the second.
pub(crate) const BANDS: [(f64, Option<f64>); 4] =
    [(0.1, Some(1.0)), (1.0, Some(10.0)), (10.0, Some(100.0)), (100.0, None)];
/// Fewer pixels than a tile has say nothing of a distribution.
const LEAST_PIXELS: usize = 256;

/// The errors of the bands that hold enough pixels, and the distance of the distributions over all of these.
pub(crate) fn bands(
    tiles: &Tiles,
    bootstrap: &Bootstrap,
    flakes: &[f32],
    luminance: &Luminance,
) -> (Vec<BandErrors>, Estimate) {
    let mut bands = Vec::new();
    let mut pooled: Vec<f64> = Vec::new();
    let mut pixels_of_all = 0.0;
    for (low, high) in BANDS {
        let holds = |flakes: f32| f64::from(flakes) >= low && high.is_none_or(|high| f64::from(flakes) < high);
        let inside: Vec<(usize, usize)> = tiles.pixels().filter(|(pixel, _)| holds(flakes[*pixel])).collect();
        if inside.len() < LEAST_PIXELS {
            continue;
        }
        let moments = errors::moments(tiles.count(), &inside, luminance);
        let order = Order::new(&inside, luminance);
        let distance = |times: &[u32]| ratio(order.distance(times), total(&moments, times)[errors::REFERENCE_MEAN]);
        let distances: Vec<f64> = bootstrap.draws().map(distance).collect();
        let pixels = inside.len();
        // Where the reference is black there is no distance, and the other bands have theirs.
        if distances.first().is_some_and(|distance| distance.is_finite()) {
            pooled.resize(distances.len(), 0.0);
            for (sum, distance) in pooled.iter_mut().zip(&distances) {
                *sum += pixels as f64 * distance;
            }
            pixels_of_all += pixels as f64;
        }
        bands.push(BandErrors {
            flakes: (low, high),
            pixels,
            mean_ratio: bootstrap.of_sums(&moments, errors::mean_ratio),
            variance_ratio: bootstrap.of_sums(&moments, errors::variance_ratio),
            w1: distance_of(distances),
        });
    }
    let pooled = pooled.into_iter().map(|sum| sum / pixels_of_all).collect();
    (bands, distance_of(pooled))
}

/// The first is the distance; the others are those of resamplings. Distances are not below 0.
fn distance_of(mut distances: Vec<f64>) -> Estimate {
    if distances.is_empty() {
        return Estimate::UNKNOWN;
    }
    let resampled = distances.split_off(1);
    let Estimate { value, low, high } = interval(distances[0], resampled, Centre::Figure);
    Estimate { value, low: if low < 0.0 { 0.0 } else { low }, high }
}

/// The luminances of both pictures in order.
struct Order {
    /// The tile of each, whether it is the reference's, and the gap to the next.
    steps: Vec<(u32, bool, f64)>,
}

impl Order {
    fn new(inside: &[(usize, usize)], luminance: &Luminance) -> Self {
        let both = [(&luminance.picture, false), (&luminance.reference, true)];
        let of = |(values, is_reference)| {
            inside.iter().map(move |&(pixel, tile): &(usize, usize)| {
                let values: &Vec<f64> = values;
                (values[pixel], tile as u32, is_reference)
            })
        };
        let mut values: Vec<(f64, u32, bool)> = both.into_iter().flat_map(of).collect();
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let next = values.iter().skip(1).map(|value| value.0).chain(values.last().map(|value| value.0));
        let steps = values.iter().zip(next).map(|(&(value, tile, which), next)| (tile, which, next - value)).collect();
        Self { steps }
    }

    /// The area between the distribution functions, each counting pixels.
    fn distance(&self, times: &[u32]) -> f64 {
        let (mut ahead, mut area) = (0_i64, 0.0);
        for &(tile, is_reference, gap) in &self.steps {
            let pixels = i64::from(times[tile as usize]);
            ahead += if is_reference { -pixels } else { pixels };
            area += ahead.unsigned_abs() as f64 * gap;
        }
        area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparkle::{exponential, uniform};

    const WIDTH: usize = 96;

    fn luminance_of(picture: Vec<f64>, reference: Vec<f64>) -> Luminance {
        Luminance { noise: vec![0.0; picture.len()], picture, reference }
    }

    fn of(flakes: &[f32], luminance: &Luminance) -> (Vec<BandErrors>, Estimate) {
        let tiles = Tiles::new(WIDTH, &vec![true; flakes.len()]);
        bands(&tiles, &tiles.bootstrap(), flakes, luminance)
    }

    /// E |X - 1| of an exponential X of mean 1 is 2 / e.
    #[test]
    fn the_distance_of_an_exponential_from_its_mean_is_two_over_e() {
        let pixels = WIDTH * 640;
        let luminance = luminance_of(vec![1.0; pixels], exponential(1, pixels));
        let (bands, pooled) = of(&vec![3.0; pixels], &luminance);
        let expected = 2.0 / std::f64::consts::E;
        assert!((pooled.value - expected).abs() < 0.01, "{pooled:?} is not {expected}");
        assert!(pooled.low < expected && pooled.high > expected && pooled.high - pooled.low < 0.02, "{pooled:?}");
        assert_eq!((bands.len(), bands[0].w1), (1, pooled));
    }

    /// Any order gives the same distance but for rounding; the pixels are not the same at all.
    #[test]
    fn rearranged_pixels_have_no_distance() {
        let reference = exponential(1, WIDTH * 64);
        let picture = reference.iter().rev().copied().collect();
        let (_, pooled) = of(&vec![3.0; WIDTH * 64], &luminance_of(picture, reference));
        assert!(pooled.value == 0.0 && pooled.low == 0.0 && pooled.high < 0.1, "{pooled:?}");
    }

    #[test]
    fn a_resampling_is_what_sorting_the_drawn_pixels_gives() {
        let (picture, reference) = (exponential(3, WIDTH * 64), uniform(4, WIDTH * 64));
        let luminance = luminance_of(picture, reference);
        let tiles = Tiles::new(WIDTH, &vec![true; WIDTH * 64]);
        let inside: Vec<_> = tiles.pixels().collect();
        let order = Order::new(&inside, &luminance);
        for times in tiles.bootstrap().draws().take(4) {
            let drawn = |values: &[f64]| {
                let of = |&(pixel, tile): &(usize, usize)| vec![values[pixel]; times[tile] as usize];
                let mut drawn: Vec<f64> = inside.iter().flat_map(of).collect();
                drawn.sort_unstable_by(f64::total_cmp);
                drawn
            };
            let [x, r] = [drawn(&luminance.picture), drawn(&luminance.reference)];
            let expected: f64 = x.iter().zip(&r).map(|(x, r)| (x - r).abs()).sum();
            let distance = order.distance(times);
            assert!((distance - expected).abs() < 1e-9 * expected, "{distance} is not {expected}");
        }
    }

    #[test]
    fn each_pixel_is_in_the_band_of_its_flakes_and_few_pixels_are_no_band() {
        let rows = [0.05_f32, 0.1, 0.99, 1.0, 9.99, 10.0, 99.9, 100.0, 1e9, f32::INFINITY, f32::NAN];
        let mut flakes: Vec<f32> = rows.iter().flat_map(|flakes| vec![*flakes; 2 * WIDTH]).collect();
        // One pixel less than a band needs of 10 to 100 flakes, and as many as one needs of 1 to 10.
        for (values, pixels) in [([10.0, 99.9], 255), ([1.0, 9.99], 256)] {
            flakes.iter_mut().filter(|flakes| values.contains(flakes)).skip(pixels).for_each(|flakes| *flakes = 0.0);
        }
        let luminance = luminance_of(vec![1.0; flakes.len()], vec![1.0; flakes.len()]);
        let (bands, _) = of(&flakes, &luminance);
        let found: Vec<(f64, usize)> = bands.iter().map(|band| (band.flakes.0, band.pixels)).collect();
        assert_eq!(found, [(0.1, 4 * WIDTH), (1.0, 256), (100.0, 6 * WIDTH)]);
    }

    #[test]
    fn the_distance_of_all_bands_is_their_mean_by_pixels() {
        let rows = |first: f64, second: f64| [vec![first; WIDTH * 16], vec![second; WIDTH * 48]].concat();
        let flakes: Vec<f32> = rows(0.5, 50.0).into_iter().map(|flakes| flakes as f32).collect();
        // Twice as bright as it should be where flakes are few, 1.2 times elsewhere; the reference is four times as bright.
        let (bands, pooled) = of(&flakes, &luminance_of(rows(8.0, 1.2), rows(4.0, 1.0)));
        let found: Vec<f64> = bands.iter().map(|band| band.w1.value).collect();
        assert!((found[0] - 1.0).abs() < 1e-9 && (found[1] - 0.2).abs() < 1e-9, "{found:?}");
        assert!((pooled.value - (0.25 + 0.75 * 0.2)).abs() < 1e-9, "{pooled:?}");
        let ratios: Vec<f64> = bands.iter().map(|band| band.mean_ratio.value).collect();
        assert!((ratios[0] - 2.0).abs() < 1e-9 && (ratios[1] - 1.2).abs() < 1e-9, "{ratios:?}");
    }

    #[test]
    fn a_band_without_light_has_no_distance_and_the_others_keep_theirs() {
        let rows = |first: f64, second: f64| [vec![first; WIDTH * 32], vec![second; WIDTH * 32]].concat();
        let flakes: Vec<f32> = rows(0.5, 50.0).into_iter().map(|flakes| flakes as f32).collect();
        let (bands, pooled) = of(&flakes, &luminance_of(rows(1.0, 1.5), rows(0.0, 1.0)));
        assert!(bands[0].w1.value.is_nan() && bands[0].mean_ratio.value.is_nan(), "{bands:?}");
        assert_eq!((bands[1].w1, pooled), (Estimate::exact(0.5), Estimate::exact(0.5)));
    }

    /// Two samples of one distribution are never the same. Over 60 pairs, intervals reach as far to either side as distances
    /// spread (1.96 standard deviations), and not much farther: up to twice as far above, as a resampling is a second
    /// sampling of a distance that cannot be below 0.
    #[test]
    fn intervals_of_distances_reach_as_far_as_distances_spread() {
        let pixels = WIDTH * 64;
        let of_pair = |pair: u64| {
            of(&vec![3.0; pixels], &luminance_of(exponential(2 * pair, pixels), exponential(2 * pair + 1, pixels))).1
        };
        let pairs: Vec<Estimate> = (0..60).map(of_pair).collect();
        assert!(pairs.iter().all(|w1| w1.low >= 0.0 && w1.low <= w1.value && w1.value <= w1.high), "{pairs:?}");
        let mean = |of: &dyn Fn(&Estimate) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        let middle = mean(&|w1| w1.value);
        let spread = mean(&|w1| (w1.value - middle).powi(2)).sqrt();
        let [below, above] = [mean(&|w1| middle - w1.low), mean(&|w1| w1.high - middle)].map(|reach| reach / spread);
        assert!((1.5..2.5).contains(&below) && (1.9..4.0).contains(&above), "{below}, {above} standard deviations");
    }
}
