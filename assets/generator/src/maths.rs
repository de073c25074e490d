//! Functions of numbers: the same bits on every machine, smooth curves through given points, and noise from a hash.

use glam::{DVec2, DVec3};

pub use libm::{atan2, cos, exp, hypot, pow, sin};

/// A circle's worth of radians.
pub const TAU: f64 = std::f64::consts::TAU;
/// Half a circle's worth of radians.
pub const PI: f64 = std::f64::consts::PI;

/// `a` at 0, `b` at 1.
pub fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// 0 up to `from`, 1 from `to` on, and a cubic with level ends between.
pub fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A bell of height 1 and standard deviation `width` about `centre`.
pub fn bell(x: f64, centre: f64, width: f64) -> f64 {
    let d = (x - centre) / width;
    exp(-0.5 * d * d)
}

/// `|x|` to a power, with the sign of `x`.
pub fn signed_pow(x: f64, power: f64) -> f64 {
    if x < 0.0 { -pow(-x, power) } else { pow(x, power) }
}

/// A natural cubic spline: passes through its points, with continuous curvature, and goes on straight beyond its ends.
pub struct Spline {
    x: Vec<f64>,
    y: Vec<f64>,
    second: Vec<f64>,
}

impl Spline {
    /// Through `(x, y)` points given in increasing `x`; at least two.
    pub fn new(points: &[(f64, f64)]) -> Self {
        let n = points.len();
        let x: Vec<f64> = points.iter().map(|p| p.0).collect();
        let y: Vec<f64> = points.iter().map(|p| p.1).collect();
        // The tridiagonal system for the second derivatives, solved by elimination; both ends are zero.
        let mut second = vec![0.0; n];
        let mut upper = vec![0.0; n];
        for i in 1..n - 1 {
            let fraction = (x[i] - x[i - 1]) / (x[i + 1] - x[i - 1]);
            let pivot = fraction * upper[i - 1] + 2.0;
            upper[i] = (fraction - 1.0) / pivot;
            let bend = (y[i + 1] - y[i]) / (x[i + 1] - x[i]) - (y[i] - y[i - 1]) / (x[i] - x[i - 1]);
            second[i] = (6.0 * bend / (x[i + 1] - x[i - 1]) - fraction * second[i - 1]) / pivot;
        }
        for i in (1..n - 1).rev() {
            second[i] += upper[i] * second[i + 1];
        }
        Self { x, y, second }
    }

    /// The curve's height at `x`.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        let inside = x.clamp(self.x[0], self.x[last]);
        let i = self.x.partition_point(|&knot| knot <= inside).clamp(1, last);
        let width = self.x[i] - self.x[i - 1];
        let (a, b) = ((self.x[i] - inside) / width, (inside - self.x[i - 1]) / width);
        let (p, q) = (self.second[i - 1], self.second[i]);
        let value =
            a * self.y[i - 1] + b * self.y[i] + ((a * a * a - a) * p + (b * b * b - b) * q) * width * width / 6.0;
        let slope =
            (self.y[i] - self.y[i - 1]) / width + width / 6.0 * ((3.0 * b * b - 1.0) * q - (3.0 * a * a - 1.0) * p);
        value + slope * (x - inside)
    }
}

/// A pseudo-random number in [0, 1) of a lattice point (Jarzynski and Olano's PCG3D, first output).
pub fn hash(x: i64, y: i64, z: i64) -> f64 {
    let mut v = [x, y, z].map(|c| (c as u32).wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        if round == 0 {
            v = v.map(|c| c ^ (c >> 16));
        }
    }
    f64::from(v[0]) / 4_294_967_296.0
}

/// Noise in [-1, 1] with continuous curvature: hashed lattice values, blended by quintics.
pub fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let (x, y, z) = (cell.x as i64, cell.y as i64, cell.z as i64);
    let along_x = |dy, dz| mix(hash(x, y + dy, z + dz), hash(x + 1, y + dy, z + dz), w.x);
    let along_y = |dz| mix(along_x(0, dz), along_x(1, dz), w.y);
    2.0 * mix(along_y(0), along_y(1), w.z) - 1.0
}

/// Noise over the plane, a different one for each `layer`.
pub fn noise2(p: DVec2, layer: i64) -> f64 {
    noise(DVec3::new(p.x, p.y, layer as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spline_passes_through_its_points_with_continuous_slope() {
        let points = [(0.0, 1.0), (0.5, -2.0), (2.0, 4.0), (2.5, 4.0)];
        let spline = Spline::new(&points);
        for (x, y) in points {
            assert!((spline.at(x) - y).abs() < 1e-12);
        }
        let h = 1e-6;
        for x in [0.0, 0.5, 2.0, 2.5] {
            let (before, after) = ((spline.at(x) - spline.at(x - h)) / h, (spline.at(x + h) - spline.at(x)) / h);
            assert!((before - after).abs() < 1e-3, "slope {before} before {x}, {after} after");
        }
    }

    #[test]
    fn noise_is_bounded_varied_and_continuous_across_cells() {
        let sample = |i: i32| noise(DVec3::new(f64::from(i) * 0.173, f64::from(i) * 0.031, 0.5));
        let values: Vec<f64> = (-500..500).map(sample).collect();
        let mean = values.iter().sum::<f64>() / 1000.0;
        assert!(values.iter().all(|v| v.abs() <= 1.0) && mean.abs() < 0.15);
        assert!(values.iter().any(|v| *v > 0.5) && values.iter().any(|v| *v < -0.5));
        let (left, right) = (noise(DVec3::new(3.0 - 1e-9, 0.3, 0.3)), noise(DVec3::new(3.0, 0.3, 0.3)));
        assert!((left - right).abs() < 1e-6);
    }
}
