//! How sparkle changes while the camera moves by fractions of a pixel.
//!
//! - **energy ratio**: the mean of (L(t + 1) - L(t))^2 over pixels and steps, over the reference's.
//! - **flicker**: the same, each first taken over the variance of its own frames within tiles: a picture of twice the
//!   contrast changes by four times the energy and flickers no more for it. Above 1, glints come and go faster than flakes
//!   do; below 1, they linger.

use crate::errors::ErrorsError;
use crate::point::PathErrors;
use crate::tiles::{Tiles, ratio};

impl PathErrors {
    /// Compares the frames of a path with the reference's. Each frame is the luminance of its glints, row by row;
    /// `glinting` says which pixels see glinting material and nothing else in all frames. At least two frames make a path.
    ///
    /// # Errors
    /// [`ErrorsError`] if a frame has another number of pixels, or there are as many frames as not of the reference.
    pub fn between(
        size: [u32; 2],
        glinting: &[bool],
        frames: &[Vec<f32>],
        reference: &[Vec<f32>],
    ) -> Result<Self, ErrorsError> {
        let expected = size[0] as usize * size[1] as usize;
        let wrong = frames.iter().chain(reference).map(Vec::len).chain([glinting.len()]).find(|len| *len != expected);
        if let Some(found) = wrong {
            return Err(ErrorsError::Size { what: "a frame of a path", found, expected });
        }
        if frames.len() != reference.len() {
            return Err(ErrorsError::Frames { found: frames.len(), expected: reference.len() });
        }
        let is_finite = |pixel: usize| frames.iter().chain(reference).all(|frame| frame[pixel].is_finite());
        let compared: Vec<bool> =
            glinting.iter().enumerate().map(|(pixel, &glinting)| glinting && is_finite(pixel)).collect();
        let tiles = Tiles::new(size[0] as usize, &compared);
        let [energy, variance] = energy_and_variance(&tiles, frames);
        let [energy_r, variance_r] = energy_and_variance(&tiles, reference);
        let sums: Vec<[f64; 4]> =
            (0..tiles.count()).map(|tile| [energy[tile], variance[tile], energy_r[tile], variance_r[tile]]).collect();
        let bootstrap = tiles.bootstrap();
        Ok(Self {
            energy_ratio: bootstrap.of_sums(&sums, |[energy, _, energy_r, _]| ratio(energy, energy_r)),
            flicker: bootstrap.of_sums(&sums, |[energy, variance, energy_r, variance_r]| {
                ratio(ratio(energy, variance), ratio(energy_r, variance_r))
            }),
        })
    }
}

/// Of each tile: squares of the differences between frames, and squares about the tile's mean, over all frames.
fn energy_and_variance(tiles: &Tiles, frames: &[Vec<f32>]) -> [Vec<f64>; 2] {
    let mut of_tiles = [vec![0.0; tiles.count()], vec![0.0; tiles.count()]];
    let [energy, variance] = &mut of_tiles;
    for (index, frame) in frames.iter().enumerate() {
        let sums = tiles.sums(|pixel, _| [f64::from(frame[pixel]), 1.0]);
        for (pixel, tile) in tiles.pixels() {
            let value = f64::from(frame[pixel]);
            let [sum, pixels] = sums[tile];
            variance[tile] += (value - sum / pixels).powi(2);
            if let Some(next) = frames.get(index + 1) {
                energy[tile] += (f64::from(next[pixel]) - value).powi(2);
            }
        }
    }
    of_tiles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::point::Estimate;
    use crate::sparkle::symmetric;

    const SIZE: [u32; 2] = [96, 64];
    const COUNT: usize = 96 * 64;
    const FRAMES: usize = 9;

    /// Frames of mean 3, each pixel correlated with itself a frame before.
    fn path(seed: u64, contrast: f64, correlation: f64) -> Vec<Vec<f32>> {
        let mut state = symmetric(seed, COUNT);
        let mut frames = Vec::new();
        for step in 0..FRAMES {
            frames.push(state.iter().map(|z| (3.0 + contrast * z) as f32).collect());
            let fresh = symmetric(seed + 1000 * (step as u64 + 1), COUNT);
            let next = |(z, fresh): (&f64, f64)| correlation * z + (1.0 - correlation * correlation).sqrt() * fresh;
            state = state.iter().zip(fresh).map(next).collect();
        }
        frames
    }

    fn compare(frames: &[Vec<f32>], reference: &[Vec<f32>]) -> PathErrors {
        PathErrors::between(SIZE, &[true; COUNT], frames, reference).expect("the sizes agree")
    }

    fn is_near(estimate: Estimate, expected: f64, tolerance: f64) {
        assert!((estimate.value - expected).abs() < tolerance, "{estimate:?} is not {expected}");
        assert!(estimate.low <= expected && expected <= estimate.high, "{estimate:?} is without {expected}");
    }

    /// A step changes pixels of variance v and correlation c by 2 v (1 - c).
    #[test]
    fn flicker_is_how_much_less_frames_are_alike_than_the_references() {
        let errors = compare(&path(20_001, 1.0, 0.6), &path(20_002, 1.0, 0.8));
        is_near(errors.energy_ratio, 2.0, 0.06);
        is_near(errors.flicker, 2.0, 0.06);
    }

    #[test]
    fn twice_the_contrast_is_four_times_the_energy_and_no_flicker() {
        let errors = compare(&path(1, 2.0, 0.8), &path(1, 1.0, 0.8));
        is_near(errors.energy_ratio, 4.0, 1e-4);
        assert!((errors.flicker.value - 1.0).abs() < 1e-5, "{errors:?}");
    }

    #[test]
    fn what_does_not_move_has_no_energy_and_a_path_of_one_frame_no_figures() {
        let (still, moving) = (vec![path(1, 1.0, 0.8).remove(0); FRAMES], path(2, 1.0, 0.8));
        let errors = compare(&still, &moving);
        assert_eq!([errors.energy_ratio, errors.flicker], [Estimate::exact(0.0); 2]);
        for errors in [compare(&moving, &still), compare(&moving[..1], &moving[1..2]), compare(&[], &[])] {
            assert!(errors.energy_ratio.value.is_nan() && errors.flicker.value.is_nan(), "{errors:?}");
        }
    }

    #[test]
    fn a_pixel_that_is_no_number_in_any_frame_is_left_out() {
        let reference = path(2, 1.0, 0.8);
        let mut frames = reference.clone();
        (frames[4][70], frames[5][71]) = (f32::NAN, 1e20);
        let mut glinting = vec![true; COUNT];
        glinting[71] = false;
        let errors = PathErrors::between(SIZE, &glinting, &frames, &reference).expect("the sizes agree");
        assert_eq!([errors.energy_ratio, errors.flicker], [Estimate::exact(1.0); 2]);
    }

    #[test]
    fn paths_of_other_sizes_and_lengths_are_refused() {
        let path = path(1, 1.0, 0.5);
        let error = PathErrors::between([96, 32], &[true; COUNT / 2], &path, &path);
        let size = ErrorsError::Size { what: "a frame of a path", found: COUNT, expected: COUNT / 2 };
        assert_eq!(error, Err(size));
        let error = PathErrors::between(SIZE, &[true; COUNT], &path[1..], &path);
        assert_eq!(error, Err(ErrorsError::Frames { found: FRAMES - 1, expected: FRAMES }));
    }
}
