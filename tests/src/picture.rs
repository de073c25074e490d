//! A frame's linear radiance on the host.

/// Linear, scene-referred radiance, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels along x and y.
    pub size: [u32; 2],
    /// Red, green, blue; the fourth channel is 1 where a surface was hit and 0 where the sky shows.
    pub pixels: Vec<[f32; 4]>,
}

impl Picture {
    /// Takes the bytes of a downloaded `Rgba32Float` image.
    pub fn from_bytes(size: [u32; 2], bytes: &[u8]) -> Self {
        let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(bytes);
        assert_eq!(pixels.len(), (size[0] * size[1]) as usize, "the picture's bytes fit its size");
        Self { size, pixels }
    }

    /// Whether a surface was hit, by pixel.
    pub fn hits(&self) -> Vec<bool> {
        self.pixels.iter().map(|pixel| pixel[3] > 0.5).collect()
    }

    /// Mean radiance over the pixels for which `chosen` holds.
    pub fn mean_where(&self, chosen: impl Fn(usize) -> bool) -> [f64; 3] {
        let (mut sum, mut count) = ([0.0; 3], 0usize);
        for (_, pixel) in self.pixels.iter().enumerate().filter(|(index, _)| chosen(*index)) {
            count += 1;
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(*value);
            }
        }
        assert!(count > 0, "no pixel was chosen");
        sum.map(|sum| sum / count as f64)
    }

    /// Mean radiance over the pixels that hit a surface.
    pub fn mean_over_hits(&self) -> [f64; 3] {
        self.mean_where(|index| self.pixels[index][3] > 0.5)
    }

    /// Mean radiance over all pixels.
    pub fn mean(&self) -> [f64; 3] {
        self.mean_where(|_| true)
    }

    /// How many channels are infinite or not a number.
    pub fn nonfinite(&self) -> usize {
        self.pixels.iter().flatten().filter(|value| !value.is_finite()).count()
    }

    /// How many channels are below 0.
    pub fn negative(&self) -> usize {
        self.pixels.iter().flatten().filter(|value| **value < 0.0).count()
    }

    /// Variance of the green channel over all pixels.
    pub fn variance(&self) -> f64 {
        let mean = self.mean()[1];
        let squares = self.pixels.iter().map(|pixel| (f64::from(pixel[1]) - mean).powi(2));
        squares.sum::<f64>() / self.pixels.len() as f64
    }

    /// The pixels of which a channel differs from another picture's of the same size by more than so many times the
    /// greatest radiance of both.
    pub fn apart(&self, other: &Self, tolerance: f32) -> Vec<usize> {
        assert_eq!(self.size, other.size, "pictures of one size are compared");
        let greatest =
            self.pixels.iter().chain(&other.pixels).flat_map(|pixel| &pixel[..3]).fold(0f32, |a, b| a.max(*b));
        assert!(greatest > 0.0, "there is something to see");
        // What is not a number is apart from everything.
        let close = |(a, b): (&f32, &f32)| (a - b).abs() <= tolerance * greatest;
        let pairs = self.pixels.iter().zip(&other.pixels).enumerate();
        pairs.filter(|(_, (a, b))| !a.iter().zip(*b).all(close)).map(|(index, _)| index).collect()
    }

    /// The pixels whose bits differ from another picture's of the same size.
    pub fn differing(&self, other: &Self) -> Vec<usize> {
        assert_eq!(self.size, other.size, "pictures of one size are compared");
        let bits = |pixel: &[f32; 4]| pixel.map(f32::to_bits);
        let pairs = self.pixels.iter().zip(&other.pixels).enumerate();
        pairs.filter(|(_, (a, b))| bits(a) != bits(b)).map(|(index, _)| index).collect()
    }
}
