//! A reference made of two estimates, which says how far it is from what it converges to.

use crate::luminance::{luminance, luminance_variance};
use crate::tiles::ratio;

/// The mean of two independent estimates of every pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanOfTwo {
    /// The mean.
    pub mean: Vec<[f32; 3]>,
    /// Variance of each channel of the mean: ((a - b) / 2)^2, smoothed over 3 x 3 pixels, as that of one pixel has a single
    /// degree of freedom.
    pub variance: Vec<[f32; 3]>,
    /// Root of the mean variance of luminance over the mean luminance.
    pub noise: f64,
}

impl MeanOfTwo {
    /// Joins two estimates of the same pixels, `width` to a row; `glinting` says which of them count. The two need not be of
    /// the same quality: the expectation of ((a - b) / 2)^2 is the variance of the mean whatever those of a and b are.
    pub fn new(width: usize, glinting: &[bool], a: &[[f32; 3]], b: &[[f32; 3]]) -> Self {
        let pixels = glinting.len().min(a.len()).min(b.len());
        let width = width.max(1);
        let counts =
            |pixel: usize| glinting[pixel] && [a[pixel], b[pixel]].as_flattened().iter().all(|x| x.is_finite());
        let both = |pixel: usize, of: fn(f64, f64) -> f64| {
            std::array::from_fn(|channel| of(f64::from(a[pixel][channel]), f64::from(b[pixel][channel])))
        };
        let mean: Vec<[f32; 3]> =
            (0..pixels).map(|pixel| both(pixel, |a, b| 0.5 * (a + b)).map(|mean: f64| mean as f32)).collect();
        let smoothed = |pixel: usize| {
            let [x, y] = [pixel % width, pixel / width];
            let near = |at: usize| at.saturating_sub(1)..=at + 1;
            let around = near(y).flat_map(|y| near(x).filter(move |x| *x < width).map(move |x| y * width + x));
            let (mut sums, mut number) = ([0.0; 3], 0.0);
            for pixel in around.filter(|pixel| *pixel < pixels && counts(*pixel)) {
                let squares: [f64; 3] = both(pixel, |a, b| (0.5 * (a - b)).powi(2));
                sums = std::array::from_fn(|channel| sums[channel] + squares[channel]);
                number += 1.0;
            }
            sums.map(|sum| (sum / f64::max(number, 1.0)) as f32)
        };
        let variance: Vec<[f32; 3]> = (0..pixels).map(smoothed).collect();
        let inside = || (0..pixels).filter(|pixel| counts(*pixel));
        let number = inside().count() as f64;
        let light = inside().map(|pixel| luminance(mean[pixel])).sum::<f64>();
        let squares = inside().map(|pixel| luminance_variance(variance[pixel])).sum::<f64>();
        let noise = ratio((squares * number).sqrt(), light);
        Self { mean, variance, noise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparkle::{grey, symmetric};

    const WIDTH: usize = 100;
    const COUNT: usize = 100 * 100;

    fn noisy(seed: u64, deviation: f64) -> Vec<[f32; 3]> {
        grey(&symmetric(seed, COUNT).into_iter().map(|z| 2.0 + deviation * z).collect::<Vec<_>>())
    }

    /// (.1^2 + .3^2) / 4 = .025 for the mean of two that differ in quality; over a mean of 2, .079.
    #[test]
    fn the_variance_found_is_that_of_the_mean() {
        let joined = MeanOfTwo::new(WIDTH, &[true; COUNT], &noisy(1, 0.1), &noisy(2, 0.3));
        let mean = |of: &dyn Fn(usize) -> f64| (0..COUNT).map(of).sum::<f64>() / COUNT as f64;
        let said = mean(&|pixel| f64::from(joined.variance[pixel][1]));
        let true_one = mean(&|pixel| (f64::from(joined.mean[pixel][1]) - 2.0).powi(2));
        assert!((said - 0.025).abs() < 1e-3 && (true_one - 0.025).abs() < 1e-3, "{said}, {true_one}");
        assert!((joined.noise - 0.025_f64.sqrt() / 2.0).abs() < 2e-3, "{}", joined.noise);
    }

    #[test]
    fn variance_comes_from_the_nine_pixels_about_and_only_from_those_that_count() {
        let (mut a, mut b) = (vec![[1.0; 3]; COUNT], vec![[1.0; 3]; COUNT]);
        let mut glinting = vec![true; COUNT];
        // Half of 6, squared, is 9; at the end of a row, six pixels are about.
        (a[5 * WIDTH + 5][0], b[5 * WIDTH + 5][0]) = (4.0, -2.0);
        a[20 * WIDTH + WIDTH - 1][1] = 3.0;
        glinting[30 * WIDTH + 30] = false;
        a[30 * WIDTH + 30] = [9.0; 3];
        a[40 * WIDTH + 40] = [f32::NAN; 3];
        let MeanOfTwo { mean, variance, noise } = MeanOfTwo::new(WIDTH, &glinting, &a, &b);
        let at = |x: usize, y: usize| variance[y * WIDTH + x];
        assert_eq!(
            (at(4, 4), at(6, 6), at(7, 6), mean[5 * WIDTH + 5]),
            ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3], [1.0; 3])
        );
        assert_eq!((at(WIDTH - 1, 19), at(0, 20), at(0, 21)), ([0.0, 1.0 / 6.0, 0.0], [0.0; 3], [0.0; 3]));
        assert_eq!((at(31, 31), at(41, 41), at(40, 40)), ([0.0; 3], [0.0; 3], [0.0; 3]));
        assert!(noise > 0.0 && noise < 0.1, "{noise}");
    }

    #[test]
    fn what_has_no_pixels_or_no_light_has_no_noise() {
        assert!(MeanOfTwo::new(0, &[], &[], &[]).noise.is_nan());
        assert!(MeanOfTwo::new(2, &[true; 4], &[[0.0; 3]; 4], &[[0.0; 3]; 4]).noise.is_nan());
        assert!(MeanOfTwo::new(2, &[false; 4], &[[1.0; 3]; 4], &[[1.0; 3]; 4]).noise.is_nan());
        assert_eq!(MeanOfTwo::new(2, &[true; 4], &[[1.0; 3]; 4], &[[1.0; 3]; 4]).noise, 0.0);
    }
}
