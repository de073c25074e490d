//! The mean of an environment over the cone about each direction, as its texels' exact share of the cone.

use super::environment::EquirectMap;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Rows of a map that a cone reaches over at most, about: of a finer map a coarser level is taken.
const MOST_ROWS: f64 = 96.0;
/// Where a cone's edge is steep, strips are no higher than this: a cone's height is pi.
const COARSEST_STRIP: f64 = PI / 32.0;

/// A part of a cone along a line of latitude.
struct Strip {
    /// Of the map.
    row: usize,
    /// To either side of the axis, in columns of the map.
    half_columns: f64,
    /// Solid angle, over the number of columns.
    weight: f64,
}

/// Sums of a row of a map from its first column on.
struct RowSums<'a>(&'a [[f64; 3]]);

impl RowSums<'_> {
    /// From column 0 to a place, which may lie any number of turns away.
    fn up_to(&self, column: f64) -> [f64; 3] {
        let width = self.0.len() - 1;
        let turns = (column / width as f64).floor();
        let within = column - turns * width as f64;
        let index = (within as usize).min(width - 1);
        let part = within - index as f64;
        let (before, after, turn) = (self.0[index], self.0[index + 1], self.0[width]);
        std::array::from_fn(|c| turns * turn[c] + before[c] + part * (after[c] - before[c]))
    }
}

impl EquirectMap {
    /// The mean over the cone of this half-angle about each direction, texels taken as constant, as a map of `width` x `width / 2`.
    ///
    /// A cone's share of each row, and of each texel along it, is exact but for the curve of its edge within a strip of a row.
    pub fn cone_means(&self, half_angle_radians: f64, width: u32) -> EquirectMap {
        if 2.0 * half_angle_radians / PI * f64::from(self.height) > MOST_ROWS {
            return self.half().cone_means(half_angle_radians, width);
        }
        let columns = self.width as usize;
        let mut sums = vec![[0.0; 3]; (columns + 1) * self.height as usize];
        sums.par_chunks_mut(columns + 1).zip(self.texels.par_chunks(columns)).for_each(|(sums, texels)| {
            for (column, texel) in texels.iter().enumerate() {
                sums[column + 1] = std::array::from_fn(|c| sums[column][c] + f64::from(texel[c]));
            }
        });
        let height = (width / 2).max(1);
        let mut means = vec![[0.0; 3]; (width * height) as usize];
        means.par_chunks_mut(width as usize).enumerate().for_each(|(row, means)| {
            let strips = self.strips((row as f64 + 0.5) / f64::from(height) * PI, half_angle_radians);
            let total: f64 = strips.iter().map(|strip| strip.weight * 2.0 * strip.half_columns).sum();
            for (column, mean) in means.iter_mut().enumerate() {
                let centre = (column as f64 + 0.5) / f64::from(width) * f64::from(self.width);
                let mut sum = [0.0; 3];
                for strip in &strips {
                    let row = RowSums(&sums[strip.row * (columns + 1)..(strip.row + 1) * (columns + 1)]);
                    let from = row.up_to(centre - strip.half_columns);
                    let to = row.up_to(centre + strip.half_columns);
                    sum = std::array::from_fn(|c| sum[c] + strip.weight * (to[c] - from[c]));
                }
                *mean = sum.map(|c| (c / total).max(0.0) as f32);
            }
        });
        EquirectMap { width, height, texels: means }
    }

    /// The strips of the cone about an axis of this polar angle: none reaches over a row's edge.
    fn strips(&self, polar: f64, half_angle: f64) -> Vec<Strip> {
        let height = f64::from(self.height);
        let sin_half = (0.5 * half_angle).sin();
        // The polar angle differs from the axis' by delta: sin(delta/2) = sin(t) sin(gamma/2), in which t the ends of a circle's
        // chords are smooth.
        let t_at = |here: f64| ((0.5 * (here - polar)).sin() / sin_half).clamp(-1.0, 1.0).asin();
        let row_at = |here: f64| ((here / PI * height).max(0.0) as u32).min(self.height - 1);
        let mut strips = Vec::new();
        for row in row_at(polar - half_angle)..=row_at(polar + half_angle) {
            let [from, to] = [0, 1].map(|edge| t_at(f64::from(row + edge) / height * PI));
            let count = ((to - from) / COARSEST_STRIP).ceil();
            for index in 0..count as u32 {
                let step = (to - from) / count;
                let (sine, cosine) = (from + (f64::from(index) + 0.5) * step).sin_cos();
                let delta = 2.0 * (sine * sin_half).asin();
                let here = polar + delta;
                // The spherical law of cosines in halved angles, which keeps its digits: half of the strip's width in azimuth.
                let sine2 = (sin_half * cosine).powi(2) / (polar.sin() * here.sin());
                let half_azimuth = 2.0 * sine2.sqrt().min(1.0).asin();
                let across = 2.0 * sin_half * cosine / (0.5 * delta).cos() * step;
                let half_columns = half_azimuth / TAU * f64::from(self.width);
                strips.push(Strip { row: row as usize, half_columns, weight: here.sin() * across });
            }
        }
        strips
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural;

    /// The mean over the cone by its definition: points of texels, counted.
    fn counted(map: &EquirectMap, axis: glam::DVec3, half_angle: f64) -> [f64; 3] {
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        // So many along a texel's side that there are at least 24 from the axis to the edge.
        let points = (24.0 * PI / f64::from(map.height) / half_angle).ceil() as u32;
        let polar = axis.y.acos();
        for row in 0..map.height * points {
            let v = (f64::from(row) + 0.5) / f64::from(map.height * points);
            if (v * PI - polar).abs() > half_angle {
                continue;
            }
            for column in 0..map.width * points {
                let u = (f64::from(column) + 0.5) / f64::from(map.width * points);
                if EquirectMap::direction_from_uv([u, v]).dot(axis) >= half_angle.cos() {
                    let texel = map.texels[(row / points * map.width + column / points) as usize];
                    sum = std::array::from_fn(|c| sum[c] + (v * PI).sin() * f64::from(texel[c]));
                    total += (v * PI).sin();
                }
            }
        }
        sum.map(|c| c / total)
    }

    #[test]
    fn means_are_those_of_points_counted_in_the_cone() {
        for (name, _) in procedural::NAMES {
            let rest = procedural::environment(name).expect("listed").part_small_lights().1;
            for half_angle_deg in [1.0, 6.0, 20.0] {
                let half_angle = f64::to_radians(half_angle_deg);
                let means = rest.cone_means(half_angle, 256);
                let mut worst: f64 = 0.0;
                // Soft boxes' insides and edges, the horizon, the seam and both poles.
                for [column, row] in
                    [[60, 40], [68, 46], [95, 47], [200, 50], [0, 63], [255, 64], [17, 0], [130, 127], [140, 1]]
                {
                    let uv = [(f64::from(column) + 0.5) / 256.0, (f64::from(row) + 0.5) / 128.0];
                    let expected = counted(&rest, EquirectMap::direction_from_uv(uv), half_angle);
                    let shown = means.texels[(row * 256 + column) as usize];
                    for c in 0..3 {
                        worst = worst.max((f64::from(shown[c]) / expected[c] - 1.0).abs());
                    }
                }
                println!("{name}, {half_angle_deg} degrees: off by {worst:.5} at most");
                assert!(worst < 0.01, "{name}, {half_angle_deg} degrees: {worst}");
            }
        }
    }

    #[test]
    fn a_constant_map_stays_constant_and_light_is_kept() {
        for half_angle in [1e-4, 0.1, 0.5] {
            let constant = EquirectMap::constant([0.1, 1.0, 70.0]).cone_means(half_angle, 64);
            for texel in constant.texels {
                assert!((texel[0] / 0.1 - 1.0).abs().max((texel[2] / 70.0 - 1.0).abs()) < 1e-6, "{texel:?}");
            }
            let studio = procedural::environment("studio").expect("listed").half();
            let (before, after) = (studio.integral(), studio.cone_means(half_angle, 512).integral());
            for c in 0..3 {
                assert!((after[c] / before[c] - 1.0).abs() < 2e-3, "{half_angle}: {} {}", after[c], before[c]);
            }
        }
    }

    /// Rows wrap: whole texels of turning turn the means, to what sums that start elsewhere are rounded to.
    #[test]
    fn turning_the_map_by_a_texel_turns_its_means() {
        let studio = procedural::environment("studio").expect("listed").half().half();
        let mut turned = studio.clone();
        turned.texels.chunks_exact_mut(256).for_each(|row| row.rotate_right(1));
        let (mut means, turned) = (studio.cone_means(0.1, 256), turned.cone_means(0.1, 256));
        means.texels.chunks_exact_mut(256).for_each(|row| row.rotate_right(1));
        for (a, b) in means.texels.iter().flatten().zip(turned.texels.iter().flatten()) {
            assert!((a / b - 1.0).abs() < 2e-7, "{a} {b}");
        }
    }
}
