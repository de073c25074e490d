//! How far a picture is from its reference, in linear radiance, with the uncertainty of each figure.
//!
//! Glints are what radiance gains by them; pixels are those that see glinting material and nothing else. Sums are over these
//! pixels, L is the luminance of their glints, r stands for the reference and T for a tile of 16 x 16 pixels.
//!
//! - **mean ratio**: sum L / sum L_r; 1 where energy is right.
//! - **variance ratio**: sum over tiles of sum (L - mean of L in T)^2, over the same of the reference less its noise; below 1
//!   sparkle is missing. About the tile's own mean, as the variance over the whole picture would be that of its shading.
//! - **W1**: the Wasserstein-1 distance between the distributions of L and L_r over the mean of L_r, by flakes a pixel
//!   (`bands.rs`): what no rearrangement of the pixels can repair. For methods that promise the distribution.
//! - **relMSE**: mean over pixels and channels of ((x - x_r)^2 - noise) / (x_r^2 + e^2), e a tenth of the mean of L_r, so that a
//!   factor on both pictures changes nothing. For methods that promise the very pixels.
//! - **energy per glint**: mean L of the pixels that glint over the reference's. A pixel glints if L is above twice the mean of
//!   its tile in its own picture.
//! - **FLIP, HDR-FLIP**: of the whole pictures (`flip.rs`); none where there are no glints on either side, as 0 would be praise.
//!
//! Intervals are those of a bootstrap over tiles (`tiles.rs`). What is not defined, as a ratio to a black reference, is not
//! a number, and `null` in JSON.

use crate::bands::bands;
use crate::flip::{ErrorMap, displayed};
use crate::luminance::{Luminance, luminance, luminance_variance};
use crate::point::{Errors, Estimate};
use crate::tiles::{Tiles, ratio};

/// Share of the reference's mean luminance below which relMSE counts differences as absolute.
const FLOOR: f64 = 0.1;
/// A pixel glints if it is so many times as bright as its tile.
const GLINTING: f64 = 2.0;

/// What two pictures of one view have in common. Pixels are row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a> {
    /// Along x and y.
    pub size: [u32; 2],
    /// Whether the pixel sees glinting material and nothing else, in all samples of the reference too.
    pub glinting: &'a [bool],
    /// Flakes expected in the footprint, lit or not; whatever it likes where the pixel is not glinting.
    pub flakes: &'a [f32],
    /// Factor of the radiance before tone mapping, for FLIP, which takes longer than all else; none leaves it out.
    pub exposure: Option<f32>,
}

/// What is seen in each pixel, linear and scene-referred.
#[derive(Clone, Copy, Debug)]
pub struct Radiance<'a> {
    /// What glints add.
    pub glints: &'a [[f32; 3]],
    /// Everything, glints included.
    pub whole: &'a [[f32; 3]],
}

/// What pictures are compared with.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// What it shows.
    pub radiance: Radiance<'a>,
    /// Variance of each channel of the glints about what they would converge to.
    pub variance: &'a [[f32; 3]],
}

/// What cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ErrorsError {
    /// The pictures differ in size.
    #[error("{what}: {found} pixels where the picture has {expected}; render both at the same --size")]
    Size {
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// Pixels of the picture.
        expected: usize,
    },
    /// FLIP counts pixels in 32 bits.
    #[error("{width}x{height} pixels are more than FLIP compares; render at a smaller --size")]
    Large {
        /// Pixels along x.
        width: u32,
        /// Pixels along y.
        height: u32,
    },
    /// The paths differ in length.
    #[error("a path of {found} frames where the reference has {expected}; render both with the same steps")]
    Frames {
        /// Frames of the path.
        found: usize,
        /// Frames of the reference.
        expected: usize,
    },
}

impl Errors {
    /// Compares a picture with its reference. `path` is left empty.
    ///
    /// # Errors
    /// [`ErrorsError`] if a list is not as long as the picture has pixels.
    pub fn between(
        pixels: &Pixels<'_>,
        picture: &Radiance<'_>,
        reference: &Reference<'_>,
    ) -> Result<Self, ErrorsError> {
        let expected = pixels.size[0] as usize * pixels.size[1] as usize;
        for (what, found) in [
            ("mask of glinting pixels", pixels.glinting.len()),
            ("flakes a pixel", pixels.flakes.len()),
            ("glints", picture.glints.len()),
            ("radiance", picture.whole.len()),
            ("glints of the reference", reference.radiance.glints.len()),
            ("radiance of the reference", reference.radiance.whole.len()),
            ("variance of the reference", reference.variance.len()),
        ] {
            if found != expected {
                return Err(ErrorsError::Size { what, found, expected });
            }
        }
        let (x, r) = (picture.glints, reference.radiance.glints);
        let is_finite = |pixel: usize| {
            [x[pixel], r[pixel], reference.variance[pixel]].as_flattened().iter().all(|channel| channel.is_finite())
        };
        let asked = pixels.glinting.iter().filter(|glinting| **glinting).count();
        let compared: Vec<bool> =
            pixels.glinting.iter().enumerate().map(|(pixel, &glinting)| glinting && is_finite(pixel)).collect();
        let tiles = Tiles::new(pixels.size[0] as usize, &compared);
        let bootstrap = tiles.bootstrap();
        let inside: Vec<(usize, usize)> = tiles.pixels().collect();
        let luminance = Luminance {
            picture: x.iter().copied().map(luminance).collect(),
            reference: r.iter().copied().map(luminance).collect(),
            noise: reference.variance.iter().copied().map(luminance_variance).collect(),
        };
        let moments = moments(tiles.count(), &inside, &luminance);

        let mean = ratio(moments.iter().map(|sums| sums[REFERENCE_MEAN]).sum(), inside.len() as f64);
        let relative =
            tiles.sums(|pixel, _| [relative_squares(x[pixel], r[pixel], reference.variance[pixel], FLOOR * mean), 1.0]);
        let rel_mse = bootstrap.ratio(&relative);

        let [flip, hdr_flip] = flips(pixels, picture, &reference.radiance)?;
        let (bands, w1) = bands(&tiles, &bootstrap, pixels.flakes, &luminance);
        Ok(Self {
            pixels: inside.len(),
            left_out: asked - inside.len(),
            mean_ratio: bootstrap.of_sums(&moments, mean_ratio),
            variance_ratio: bootstrap.of_sums(&moments, variance_ratio),
            w1,
            rel_mse: rel_mse.at_least_zero(),
            flip,
            hdr_flip,
            energy_per_glint: bootstrap.of_sums(&glints(&tiles, &luminance), |[light, pixels, light_r, pixels_r]| {
                ratio(ratio(light, pixels), ratio(light_r, pixels_r))
            }),
            bands,
            path: None,
        })
    }
}

/// FLIP and HDR-FLIP of two pictures; unknown where neither has glints, and where they are not asked for.
fn flips(pixels: &Pixels<'_>, picture: &Radiance<'_>, reference: &Radiance<'_>) -> Result<[Estimate; 2], ErrorsError> {
    let is_dark = |seen: &Radiance<'_>| seen.glints.as_flattened().iter().all(|channel| *channel == 0.0);
    let Some(exposure) = pixels.exposure.filter(|_| !(is_dark(picture) && is_dark(reference))) else {
        return Ok([Estimate::UNKNOWN; 2]);
    };
    let [shown, shown_r] = [picture, reference].map(|seen| displayed(seen.whole, exposure));
    let flip = ErrorMap::of_displayed(pixels.size, &shown, &shown_r)?;
    let hdr_flip = ErrorMap::of_radiance(pixels.size, picture.whole, reference.whole)?;
    Ok([flip.mean(), hdr_flip.map_or(Estimate::UNKNOWN, |map| map.mean())])
}

/// Of each tile: sums of luminance, and of its squares about the tile's mean, of the picture and of the reference.
pub(crate) type Moments = [f64; 4];
/// Which of the moments is the reference's luminance.
pub(crate) const REFERENCE_MEAN: usize = 1;

/// The moments of some pixels, each with its tile.
pub(crate) fn moments(tiles: usize, inside: &[(usize, usize)], luminance: &Luminance) -> Vec<Moments> {
    let mut pixels = vec![0.0; tiles];
    let mut moments = vec![[0.0; 4]; tiles];
    for &(pixel, tile) in inside {
        pixels[tile] += 1.0;
        moments[tile][0] += luminance.picture[pixel];
        moments[tile][REFERENCE_MEAN] += luminance.reference[pixel];
    }
    for &(pixel, tile) in inside {
        let [sum, sum_r, squares, squares_r] = &mut moments[tile];
        *squares += (luminance.picture[pixel] - *sum / pixels[tile]).powi(2);
        // A part of the noise is in the mean already.
        let noise = luminance.noise[pixel] * (1.0 - 1.0 / pixels[tile]);
        *squares_r += (luminance.reference[pixel] - *sum_r / pixels[tile]).powi(2) - noise;
    }
    moments
}

pub(crate) fn mean_ratio([picture, reference, _, _]: Moments) -> f64 {
    ratio(picture, reference)
}

pub(crate) fn variance_ratio([_, _, picture, reference]: Moments) -> f64 {
    ratio(picture, reference)
}

fn relative_squares(x: [f32; 3], r: [f32; 3], variance: [f32; 3], floor: f64) -> f64 {
    let of = |channel: usize| {
        let [x, r, noise] = [x[channel], r[channel], variance[channel]].map(f64::from);
        ((x - r).powi(2) - noise) / (r * r + floor * floor)
    };
    (0..3).map(of).sum::<f64>() / 3.0
}

/// Of each tile: luminance and number of the pixels that glint, of the picture and of the reference.
fn glints(tiles: &Tiles, luminance: &Luminance) -> Vec<[f64; 4]> {
    let sums = tiles.sums(|pixel, _| [luminance.picture[pixel], luminance.reference[pixel], 1.0]);
    tiles.sums(|pixel, tile| {
        let [picture, reference, pixels] = sums[tile];
        let glints = |value: f64, sum: f64| {
            if value > (GLINTING * sum / pixels).max(0.0) { [value, 1.0] } else { [0.0; 2] }
        };
        let [light, number] = glints(luminance.picture[pixel], picture);
        let [light_r, number_r] = glints(luminance.reference[pixel], reference);
        [light, number, light_r, number_r]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparkle::{exponential, grey, scaled, symmetric};

    const SIZE: [u32; 2] = [96, 72];
    const COUNT: usize = 96 * 72;

    /// Compares glints, seen on black.
    fn compare(size: [u32; 2], picture: &[[f32; 3]], reference: &[[f32; 3]], variance: f32) -> Errors {
        let (all, flakes) = (vec![true; picture.len()], vec![3.0; picture.len()]);
        let pixels = Pixels { size, glinting: &all, flakes: &flakes, exposure: Some(1.0) };
        let variance = vec![[variance; 3]; reference.len()];
        let seen = |glints| Radiance { glints, whole: glints };
        let reference = Reference { radiance: seen(reference), variance: &variance };
        Errors::between(&pixels, &seen(picture), &reference).expect("the sizes agree")
    }

    fn sparkle(seed: u64) -> Vec<[f32; 3]> {
        grey(&exponential(seed, COUNT))
    }

    fn is_near(estimate: Estimate, expected: f64, tolerance: f64) {
        let Estimate { value, low, high } = estimate;
        let expects = format!("{estimate:?} is not {expected} within {tolerance}");
        assert!((value - expected).abs() <= tolerance && low <= value && value <= high, "{expects}");
    }

    #[test]
    fn a_picture_is_no_way_from_itself() {
        let errors = compare(SIZE, &sparkle(1), &sparkle(1), 0.0);
        let [one, zero] = [1.0, 0.0].map(Estimate::exact);
        let Errors { mean_ratio, variance_ratio, energy_per_glint, .. } = errors;
        assert_eq!([mean_ratio, variance_ratio, energy_per_glint], [one; 3]);
        assert_eq!([errors.rel_mse, errors.w1, errors.flip, errors.hdr_flip], [zero; 4]);
        assert_eq!((errors.pixels, errors.left_out, errors.bands.len(), errors.path), (COUNT, 0, 1, None));
    }

    /// The same flakes on both sides: their chance cancels, and a mistake of 5 % is beyond all doubt.
    #[test]
    fn a_method_that_is_five_percent_too_bright_is_off_its_place() {
        let reference = sparkle(1);
        let errors = compare(SIZE, &scaled(&reference, 1.05), &reference, 0.0);
        is_near(errors.mean_ratio, 1.05, 1e-6);
        is_near(errors.variance_ratio, 1.05 * 1.05, 1e-6);
        is_near(errors.energy_per_glint, 1.05, 1e-6);
        is_near(errors.w1, 0.05, 1e-6);
        assert!(errors.mean_ratio.low > 1.04 && errors.variance_ratio.low > 1.09, "{errors:?}");
        assert!(errors.flip.value > 0.005 && errors.flip.low > 0.0, "{errors:?}");
    }

    /// With flakes of its own, it takes enough pixels: over 6912 exponential ones, the mean of either side is known to 1.2 %.
    #[test]
    fn a_method_with_flakes_of_its_own_is_off_its_place_within_what_its_interval_says() {
        let errors = compare(SIZE, &scaled(&sparkle(2), 1.05), &sparkle(1), 0.0);
        let width = errors.mean_ratio.high - errors.mean_ratio.low;
        is_near(errors.mean_ratio, 1.05, 0.04);
        // 3.92 standard deviations of a ratio of two such means.
        let expected = 3.92 * 1.05 * (2.0 / COUNT as f64).sqrt();
        assert!((0.6..1.5).contains(&(width / expected)), "{width} for {expected}");
    }

    #[test]
    fn a_factor_on_both_pictures_changes_nothing_but_how_they_are_displayed() {
        let (picture, reference) = (sparkle(2), sparkle(1));
        let once = compare(SIZE, &picture, &reference, 0.0);
        let mut both = compare(SIZE, &scaled(&picture, 64.0), &scaled(&reference, 64.0), 0.0);
        assert!(once.flip != both.flip);
        both.flip = once.flip;
        assert_eq!(both, once);
    }

    /// Sparkle of half the contrast on shading that varies 27-fold. The variance over the whole picture, most of which is
    /// shading, would be .96 of the reference's.
    #[test]
    fn the_variance_is_that_of_sparkle_and_not_that_of_shading() {
        let shade = |pixel: usize| 3.0_f64.powi((pixel % 96 / 16) as i32 % 4);
        let picture = |contrast: f64| {
            let sparkle = symmetric(5, COUNT).into_iter().enumerate();
            grey(&sparkle.map(|(pixel, z)| shade(pixel) * (1.0 + 0.2 * contrast * z)).collect::<Vec<_>>())
        };
        let errors = compare(SIZE, &picture(0.5), &picture(1.0), 0.0);
        is_near(errors.variance_ratio, 0.25, 1e-5);
        is_near(errors.mean_ratio, 1.0, 0.01);
    }

    #[test]
    fn the_noise_of_the_reference_is_taken_off() {
        let truth = exponential(1, COUNT);
        let noisy: Vec<f64> = truth.iter().zip(symmetric(2, COUNT)).map(|(value, z)| value + 0.3 * z).collect();
        let (truth, noisy) = (grey(&truth), grey(&noisy));
        let (known, unknown) = (compare(SIZE, &truth, &noisy, 0.09), compare(SIZE, &truth, &noisy, 0.0));
        is_near(known.variance_ratio, 1.0, 0.02);
        is_near(unknown.variance_ratio, 1.0 / 1.09, 0.02);
        assert!(unknown.rel_mse.value > 0.5 && known.rel_mse.value < 0.1 * unknown.rel_mse.value, "{known:?}");
    }

    /// (0 - 1)^2 + (2 - 1)^2 less the noise of two pixels, half of which is in their mean.
    #[test]
    fn a_tile_of_two_pixels_has_half_their_noise_about_its_mean() {
        let luminance = Luminance { picture: vec![1.0, 4.0], reference: vec![0.0, 2.0], noise: vec![0.5, 0.25] };
        assert_eq!(moments(1, &[(0, 0), (1, 0)], &luminance), [[5.0, 2.0, 4.5, 2.0 - 0.375]]);
    }

    /// (d^2 - noise) / (1 + .01) where the reference is 1 everywhere.
    #[test]
    fn relative_squares_are_those_of_the_definition() {
        let reference = vec![[1.0; 3]; COUNT];
        let picture = vec![[1.3, 1.0, 1.0]; COUNT];
        is_near(compare(SIZE, &picture, &reference, 0.0).rel_mse, 0.3 * 0.3 / 3.0 / 1.01, 1e-7);
        is_near(compare(SIZE, &picture, &reference, 0.01).rel_mse, (0.3 * 0.3 / 3.0 - 0.01) / 1.01, 1e-7);
        // Noise that is more than all of the difference.
        assert_eq!(compare(SIZE, &picture, &reference, 0.1).rel_mse, Estimate::exact(0.0));
        // Where nothing is lit, a tenth of the mean stands for the reference.
        let half = |dark: f32, light: f32| [vec![[dark; 3]; COUNT / 2], vec![[light; 3]; COUNT / 2]].concat();
        is_near(compare(SIZE, &half(0.2, 2.0), &half(0.0, 2.0), 0.0).rel_mse, 0.5 * 0.2 * 0.2 / 0.01, 1e-5);
    }

    /// Above twice its mean, an exponential has a mean of three.
    #[test]
    fn energy_per_glint_is_that_of_the_pixels_that_glint() {
        let reference = sparkle(1);
        // Tiles of 0 but for one pixel in eight of 24: 24 a glint. In the tiles at the left, nothing is lit.
        let few = |pixel: usize| if pixel.is_multiple_of(8) && pixel % 96 >= 16 { 24.0 } else { 0.0 };
        let few: Vec<f64> = (0..COUNT).map(few).collect();
        is_near(compare(SIZE, &grey(&few), &reference, 0.0).energy_per_glint, 24.0 / 3.0, 0.15);
        let smooth = compare(SIZE, &vec![[1.0; 3]; COUNT], &reference, 0.0).energy_per_glint;
        assert!(smooth.value.is_nan() && smooth.low.is_nan(), "nothing glints: {smooth:?}");
    }

    #[test]
    fn luminance_and_its_variance_are_those_of_grey_pixels() {
        assert!((luminance([2.0; 3]) - 2.0).abs() < 1e-6);
        assert!((luminance([0.0, 1.0, 0.0]) - 0.7152).abs() < 1e-6);
        // A grey pixel of deviation .3 in all channels at once.
        assert!((luminance_variance([0.09; 3]) - 0.09).abs() < 1e-6);
    }

    #[test]
    fn only_pixels_that_see_glinting_material_and_are_finite_count() {
        let reference = sparkle(1);
        let mut picture = reference.clone();
        picture[7][1] = f32::NAN;
        picture[500][2] = f32::INFINITY;
        picture[900] = [1e9; 3];
        let mut glinting = vec![true; COUNT];
        glinting[900] = false;
        glinting[7] = false;
        let flakes = vec![3.0; COUNT];
        let pixels = Pixels { size: SIZE, glinting: &glinting, flakes: &flakes, exposure: Some(1.0) };
        let variance = vec![[0.0; 3]; COUNT];
        let black = vec![[0.0; 3]; COUNT];
        let reference = Reference { radiance: Radiance { glints: &reference, whole: &black }, variance: &variance };
        let picture = Radiance { glints: &picture, whole: &black };
        let errors = Errors::between(&pixels, &picture, &reference).expect("the sizes agree");
        assert_eq!((errors.pixels, errors.left_out), (COUNT - 3, 1));
        assert_eq!((errors.mean_ratio, errors.rel_mse), (Estimate::exact(1.0), Estimate::exact(0.0)));
        assert_eq!((errors.flip, errors.hdr_flip.value.is_nan()), (Estimate::exact(0.0), true));
    }

    #[test]
    fn lists_of_other_lengths_are_refused_by_name() {
        let (all, flakes, four) = ([true; 4], [1.0; 4], [[1.0; 3]; 4]);
        let pixels = Pixels { size: [2, 2], glinting: &all, flakes: &flakes, exposure: Some(1.0) };
        let seen = |glints, whole| Radiance { glints, whole };
        let reference = Reference { radiance: seen(&four, &four), variance: &four };
        let error = Errors::between(&pixels, &seen(&four, &four[..3]), &reference);
        assert_eq!(error, Err(ErrorsError::Size { what: "radiance", found: 3, expected: 4 }));
        let error = Errors::between(&Pixels { size: [4, 4], ..pixels }, &seen(&four, &four), &reference);
        assert_eq!(error, Err(ErrorsError::Size { what: "mask of glinting pixels", found: 4, expected: 16 }));
    }

    /// Sizes that no tile divides, down to nothing; pixels that are black, negative or no numbers, on either side: every
    /// figure is a number or null, and comes back from its line as it went.
    #[test]
    fn whatever_the_pictures_every_figure_is_a_number_or_null() {
        let fills = [0.0, 1.0, -1.0, 1e-30, 3e38, f32::NAN, f32::INFINITY];
        for size in [[0, 0], [1, 1], [3, 1], [1, 40], [17, 16], [33, 21]] {
            let count = size[0] as usize * size[1] as usize;
            for picture in fills {
                for reference in fills {
                    let errors = compare(size, &vec![[picture; 3]; count], &vec![[reference; 3]; count], 0.1);
                    let line = serde_json::to_string(&errors).expect("a line");
                    let read: Errors = serde_json::from_str(&line).expect("errors");
                    assert_eq!(serde_json::to_string(&read).expect("a line"), line);
                    let Errors { mean_ratio, flip, .. } = read;
                    let is_defined = count > 0 && reference > 0.0 && reference.is_finite() && picture.is_finite();
                    assert_eq!(mean_ratio.value.is_finite(), is_defined, "{size:?}: {picture} on {reference}");
                    let has_glints = picture != 0.0 || reference != 0.0;
                    assert_eq!(flip.value.is_finite(), count > 0 && has_glints, "{size:?}: {picture} on {reference}");
                }
            }
        }
    }
}
