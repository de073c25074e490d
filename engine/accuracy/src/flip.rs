//! How different two pictures look: FLIP on the tone-mapped pair, and HDR-FLIP on all exposures at which something is seen.
//!
//! FLIP (Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images") answers how much flipping between two
//! displayed pictures would show, from 0 to 1 in each pixel; it is computed by its authors' own code. HDR-FLIP (Andersson et
//! al. 2021, "Visualizing Errors in Rendered High Dynamic Range Images") is its greatest value over exposures, from the
//! one at which the reference's brightest pixel is 85 % of white to the one at which its median is, under a filmic tone
//! curve. Both here take pictures of 8 bits a channel, as a display would.
//!
//! Departures from the paper: the median is that of the pixels that are not black, since no exposure shows the others; and
//! there are at most [`MOST_EXPOSURES`], spread over the same range, where the paper has one a stop.

use crate::errors::ErrorsError;
use crate::luminance::luminance;
use crate::point::Estimate;
use crate::tiles::Tiles;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageFloat, FlipImageRgb8, flip, magma_lut};

/// Exposures of HDR-FLIP.
const MOST_EXPOSURES: u32 = 6;
/// What the tone curve of HDR-FLIP makes of the brightest pixel at the first exposure, and of the median at the last.
const NEARLY_WHITE: f64 = 0.85;
/// The tone curve (a x^2 + b x) / (c x^2 + d x + e): Narkowicz 2016, "ACES Filmic Tone Mapping Curve", its argument times 0.6.
const FILMIC: [f64; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// Above this, radiance is white at all exposures: infinities take no part in arithmetic.
const MOST_RADIANCE: f32 = 1e30;

/// How different two pictures look in each pixel, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// Pixels along x and y.
    pub size: [u32; 2],
    /// Row by row from the top.
    pub values: Vec<f32>,
}

impl ErrorMap {
    /// FLIP of two pictures: red, green and blue of each pixel, sRGB-encoded.
    ///
    /// # Errors
    /// [`ErrorsError`] if a picture has not as many pixels as the size says.
    pub fn of_displayed(size: [u32; 2], picture: &[u8], reference: &[u8]) -> Result<Self, ErrorsError> {
        let expected = pixels(size)?;
        for (what, picture) in [("displayed picture", picture), ("displayed reference", reference)] {
            if picture.len() != 3 * expected {
                return Err(ErrorsError::Size { what, found: picture.len() / 3, expected });
            }
        }
        if expected == 0 {
            return Ok(Self { size, values: Vec::new() });
        }
        let [width, height] = size;
        let [reference, picture] = [reference, picture].map(|picture| FlipImageRgb8::with_data(width, height, picture));
        Ok(Self { size, values: flip(reference, picture, DEFAULT_PIXELS_PER_DEGREE).to_vec() })
    }

    /// HDR-FLIP of two pictures of linear radiance; none where nothing of the reference is seen at any exposure.
    ///
    /// # Errors
    /// [`ErrorsError`] if a picture has not as many pixels as the size says.
    pub fn of_radiance(
        size: [u32; 2],
        picture: &[[f32; 3]],
        reference: &[[f32; 3]],
    ) -> Result<Option<Self>, ErrorsError> {
        let Some(exposures) = exposures(reference) else { return Ok(None) };
        let mut greatest = vec![0.0_f32; pixels(size)?];
        for stops in exposures {
            let [picture, reference] = [picture, reference].map(|picture| exposed(picture, stops));
            let of_exposure = Self::of_displayed(size, &picture, &reference)?;
            for (greatest, value) in greatest.iter_mut().zip(of_exposure.values) {
                *greatest = greatest.max(value);
            }
        }
        Ok(Some(Self { size, values: greatest }))
    }

    /// The mean over all pixels.
    pub(crate) fn mean(&self) -> Estimate {
        let tiles = Tiles::new(self.size[0] as usize, &vec![true; self.values.len()]);
        tiles.bootstrap().ratio(&tiles.sums(|pixel, _| [f64::from(self.values[pixel]), 1.0]))
    }

    /// As colours from black over violet and orange to pale yellow: red, green and blue of each pixel, sRGB-encoded.
    pub fn magma(&self) -> Vec<u8> {
        let [width, height] = self.size;
        FlipImageFloat::with_data(width, height, &self.values).apply_color_lut(&magma_lut()).to_vec()
    }
}

/// How many pixels a picture has, which FLIP counts in 32 bits.
fn pixels([width, height]: [u32; 2]) -> Result<usize, ErrorsError> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels * 3 > u64::from(i32::MAX as u32) {
        Err(ErrorsError::Large { width, height })
    } else {
        Ok(pixels as usize)
    }
}

/// What the renderer's tone mapping makes of linear radiance (`passes/tonemap.comp`): red, green and blue of each pixel,
/// sRGB-encoded.
pub fn displayed(radiance: &[[f32; 3]], exposure: f32) -> Vec<u8> {
    const START: f32 = 0.76;
    const ROOM: f32 = 1.0 - START;
    let compressed = |pixel: [f32; 3]| {
        let color = pixel.map(|channel| (channel * exposure).clamp(0.0, 1e6)).map(number);
        let peak = color.into_iter().fold(0.0, f32::max);
        if peak < START {
            return color;
        }
        let new_peak = 1.0 - ROOM * ROOM / (peak + ROOM - START);
        let whiteness = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
        color.map(|channel| channel * (new_peak / peak)).map(|channel| channel + (new_peak - channel) * whiteness)
    };
    radiance.iter().flat_map(|pixel| compressed(*pixel).map(encoded)).collect()
}

/// What is not a number is black.
fn number(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value }
}

/// A linear channel from 0 to 1, sRGB-encoded.
fn encoded(linear: f32) -> u8 {
    let value = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (value * 255.0).round() as u8
}

/// The exposures of HDR-FLIP in stops; none for a reference without light.
fn exposures(reference: &[[f32; 3]]) -> Option<Vec<f64>> {
    let [a, b, c, d, e] = FILMIC;
    // Where the curve is NEARLY_WHITE.
    let [a, b, c] = [a - NEARLY_WHITE * c, b - NEARLY_WHITE * d, -NEARLY_WHITE * e];
    let white = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let mut light: Vec<f64> = reference.iter().map(|pixel| luminance(pixel.map(limited))).collect();
    light.retain(|luminance| *luminance > 0.0);
    light.sort_unstable_by(f64::total_cmp);
    let brightest = *light.last()?;
    let median = light[light.len() / 2];
    let [start, stop] = [brightest, median].map(|luminance| (white / luminance).log2());
    let count = ((stop - start).ceil() as u32).clamp(2, MOST_EXPOSURES);
    Some((0..count).map(|k| start + (stop - start) * f64::from(k) / f64::from(count - 1)).collect())
}

/// A channel that arithmetic can be done with.
fn limited(channel: f32) -> f32 {
    number(channel).clamp(0.0, MOST_RADIANCE)
}

/// Radiance on the filmic tone curve, sRGB-encoded.
fn exposed(radiance: &[[f32; 3]], stops: f64) -> Vec<u8> {
    let factor = stops.exp2();
    let [a, b, c, d, e] = FILMIC;
    let toned = |channel: f32| {
        let x = f64::from(limited(channel)) * factor;
        encoded(((a * x * x + b * x) / (c * x * x + d * x + e)).clamp(0.0, 1.0) as f32)
    };
    radiance.iter().flat_map(|pixel| pixel.map(toned)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparkle::{exponential, grey, scaled};

    const SIZE: [u32; 2] = [96, 64];
    const COUNT: usize = 96 * 64;

    fn flat(rgb: [u8; 3]) -> Vec<u8> {
        rgb.repeat(COUNT)
    }

    fn flip_of(picture: &[u8], reference: &[u8]) -> f64 {
        ErrorMap::of_displayed(SIZE, picture, reference).expect("the sizes agree").mean().value
    }

    fn hdr(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> ErrorMap {
        ErrorMap::of_radiance(SIZE, picture, reference).expect("the sizes agree").expect("there is light")
    }

    /// FLIP is scaled so that the primaries farthest apart, green and blue, differ by 1.
    #[test]
    fn green_for_blue_is_the_greatest_error_and_nothing_the_least() {
        let (green, blue) = (flat([0, 255, 0]), flat([0, 0, 255]));
        assert!((flip_of(&green, &blue) - 1.0).abs() < 1e-3, "{}", flip_of(&green, &blue));
        assert_eq!(flip_of(&green, &green), 0.0);
        let [little, more] = [flip_of(&flat([100; 3]), &flat([110; 3])), flip_of(&flat([100; 3]), &flat([140; 3]))];
        assert!(0.0 < little && little < more && more < 0.5, "{little}, {more}");
    }

    /// A pixel of 3 x 10^-4 beside one of 10^4: at any one exposure, one of the two is lost.
    #[test]
    fn hdr_flip_sees_what_one_exposure_hides() {
        let picture = |dark: f32, light: f32| {
            (0..COUNT).map(|pixel| if pixel % 96 < 60 { [dark; 3] } else { [light; 3] }).collect::<Vec<_>>()
        };
        let reference = picture(3e-4, 1e4);
        for other in [picture(6e-4, 1e4), picture(3e-4, 5e3)] {
            let displayed = flip_of(&displayed(&other, 1.0), &displayed(&reference, 1.0));
            let at_any = hdr(&other, &reference).mean().value;
            assert!(displayed < 0.02 && at_any > 0.1, "{displayed}, {at_any}");
        }
    }

    #[test]
    fn exposures_reach_from_the_brightest_to_the_median_of_what_is_not_black() {
        let mut reference = vec![[0.0; 3]; 100];
        reference[6..10].fill([0.25; 3]);
        reference[10..15].fill([0.5; 3]);
        reference[20] = [9.0; 3];
        reference[21] = [f32::NAN; 3];
        let stops = exposures(&reference).expect("there is light");
        assert_eq!(stops.len(), 5);
        let shown = |radiance: f32, stops: f64| exposed(&[[radiance; 3]], stops)[0];
        let nearly_white = encoded(0.85);
        assert_eq!([shown(9.0, stops[0]), shown(0.5, stops[4])], [nearly_white; 2]);
        assert!(stops.is_sorted() && (stops[1] - stops[0] - 18.0_f64.log2() / 4.0).abs() < 1e-6, "{stops:?}");
        // (.36 * 2.51 + .6 * .03) / (.36 * 2.43 + .6 * .59 + .14) = .6733.
        assert_eq!(shown(1.0, 0.0), encoded(0.6733));
        // One brightness: two exposures, as the paper has it. Thirty stops: no more than are paid for.
        assert_eq!(exposures(&[[1.0; 3]; 5]).map(|stops| stops.len()), Some(2));
        assert_eq!(exposures(&[[1e-4; 3], [1e-4; 3], [1e5; 3]]).map(|stops| stops.len()), Some(6));
        assert_eq!(exposures(&[[0.0; 3], [-1.0; 3], [f32::NAN; 3]]), None);
    }

    #[test]
    fn hdr_flip_does_not_depend_on_units() {
        let [picture, reference] = [1, 2].map(|seed| grey(&exponential(seed, COUNT)));
        let once = hdr(&picture, &reference);
        assert_eq!(hdr(&scaled(&picture, 1024.0), &scaled(&reference, 1024.0)), once);
        assert!(once.values.iter().all(|value| (0.0..=1.0).contains(value)));
    }

    #[test]
    fn error_maps_are_drawn_in_magma() {
        let map = ErrorMap { size: [3, 1], values: vec![0.0, 0.5, 1.0] };
        let colors = map.magma();
        let [black, middle, white] = [0, 1, 2].map(|pixel| &colors[3 * pixel..][..3]);
        assert!(black.iter().all(|channel| *channel < 8) && white[0] > 240 && white[2] < 200, "{colors:?}");
        assert!(middle[0] > middle[1] && middle[2] > middle[1], "violet: {middle:?}");
        assert!(ErrorMap { size: [0, 0], values: Vec::new() }.magma().is_empty());
    }

    #[test]
    fn pictures_of_other_sizes_are_refused() {
        let error = ErrorMap::of_displayed(SIZE, &flat([0; 3])[3..], &flat([0; 3]));
        assert_eq!(error, Err(ErrorsError::Size { what: "displayed picture", found: COUNT - 1, expected: COUNT }));
        let error = ErrorMap::of_displayed([40_000, 40_000], &[], &[]);
        assert_eq!(error, Err(ErrorsError::Large { width: 40_000, height: 40_000 }));
    }
}
