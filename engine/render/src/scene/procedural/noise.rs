//! Noise from an integer hash, by sums and products alone: the same bits on every machine.

use glam::{DVec2, DVec3};

/// A well-mixed word for a lattice point: rounds of an odd product and a shift, as in PCG's output functions.
fn hash(x: i64, y: i64, z: i64) -> u32 {
    let mut word = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77).rotate_left(11);
    word ^= (z as u32).wrapping_mul(0xc2b2_ae3d).rotate_left(22);
    for _ in 0..2 {
        word = (word ^ word >> 16).wrapping_mul(0x7feb_352d);
        word = (word ^ word >> 15).wrapping_mul(0x846c_a68b);
    }
    word ^ word >> 16
}

/// A pseudo-random number in [0, 1) for two numbers.
pub fn random(of: i64, which: i64) -> f64 {
    f64::from(hash(of, which, -1)) / 4_294_967_296.0
}

/// From 0 to 1 with level ends and continuous curvature.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// Two numbers in [-1, 1) of a hash's halves.
fn halves(word: u32) -> [f64; 2] {
    [word & 0xffff, word >> 16].map(|half| f64::from(half) / 32_768.0 - 1.0)
}

/// Gradient noise over the plane (Perlin 1985, with the fade of 2002), about within [-1, 1]; another for each `layer`.
pub fn noise2(p: DVec2, layer: i64) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let (x, y) = (cell.x as i64, cell.y as i64);
    let corner = |dx: i64, dy: i64| {
        let [gx, gy] = halves(hash(x + dx, y + dy, layer));
        gx * (f.x - dx as f64) + gy * (f.y - dy as f64)
    };
    let (wx, wy) = (fade(f.x), fade(f.y));
    1.5 * mix(mix(corner(0, 0), corner(1, 0), wx), mix(corner(0, 1), corner(1, 1), wx), wy)
}

/// Gradient noise in space, about within [-1, 1].
pub fn noise3(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let (x, y, z) = (cell.x as i64, cell.y as i64, cell.z as i64);
    let corner = |dx: i64, dy: i64, dz: i64| {
        let word = hash(x + dx, y + dy, z + dz);
        let [gx, gy] = halves(word);
        let [gz, _] = halves(word.wrapping_mul(0x9e37_79b1));
        gx * (f.x - dx as f64) + gy * (f.y - dy as f64) + gz * (f.z - dz as f64)
    };
    let w = DVec3::new(fade(f.x), fade(f.y), fade(f.z));
    let along_x = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), w.x);
    let along_y = |dz| mix(along_x(0, dz), along_x(1, dz), w.y);
    1.3 * mix(along_y(0), along_y(1), w.z)
}

/// 0 up to `from`, 1 from `to` on, and a cubic with level ends between.
pub fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_varied_and_continuous_across_cells() {
        let flat: Vec<f64> = (-500..500).map(|i| noise2(DVec2::new(f64::from(i) * 0.173, 0.37), 3)).collect();
        let deep: Vec<f64> = (-500..500).map(|i| noise3(DVec3::new(f64::from(i) * 0.173, 0.37, 0.61))).collect();
        for values in [flat, deep] {
            let mean = values.iter().sum::<f64>() / 1000.0;
            assert!(values.iter().all(|value| value.abs() < 1.5) && mean.abs() < 0.1, "{mean}");
            assert!(values.iter().any(|value| *value > 0.4) && values.iter().any(|value| *value < -0.4));
        }
        let across = |x: f64| (noise2(DVec2::new(x, 0.3), 1), noise3(DVec3::new(0.3, x, 0.7)));
        let (before, after) = (across(3.0 - 1e-9), across(3.0 + 1e-9));
        assert!((before.0 - after.0).abs() < 1e-7 && (before.1 - after.1).abs() < 1e-7);
    }

    #[test]
    fn layers_and_draws_differ() {
        let at = DVec2::new(0.4, 7.7);
        assert_ne!(noise2(at, 1), noise2(at, 2));
        let draws: Vec<f64> = (0..1000).map(|k| random(5, k)).collect();
        let mean = draws.iter().sum::<f64>() / 1000.0;
        assert!(draws.iter().all(|draw| (0.0..1.0).contains(draw)) && (mean - 0.5).abs() < 0.05, "{mean}");
    }
}
