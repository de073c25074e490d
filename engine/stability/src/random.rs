//! Seeded operands.

use glam::DVec3;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Numbers that are the same in every run.
pub struct Random(Pcg64);

impl Random {
    /// Those of a seed.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform, the upper end excluded.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in the logarithm.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// A unit vector, uniform by solid angle, at most so many radians from the axis.
    pub fn direction_about(&mut self, axis: DVec3, most: f64) -> DVec3 {
        let angle = (1.0 - self.between(0.0, 1.0) * (1.0 - most.cos())).acos();
        turned(axis, angle, self.between(0.0, TAU))
    }
}

/// The direction at an angle from a unit axis, turned about it; both in radians.
pub fn turned(axis: DVec3, angle: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    angle.cos() * axis + angle.sin() * (turn.cos() * x + turn.sin() * y)
}

/// A direction as a device gets it, and a number beside it.
pub fn rounded(v: DVec3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

/// The direction that a device got, in f64, of length 1 as it should be.
pub fn unit(v: [f32; 4]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into()).normalize()
}
