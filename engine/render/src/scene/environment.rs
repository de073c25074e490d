//! Light from everywhere: equirectangular maps of radiance.

use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Radiance by direction, linear, scene-referred.
///
/// Row 0 looks up (+Y); the centre of a row looks along -Z and its right quarter along +X. A direction `d` lies at
/// `u = 1/2 + atan2(d.x, -d.z) / 2 pi`, `v = acos(d.y) / pi`; straight up and down lie at `u = 1/2`.
#[derive(Clone, Debug, PartialEq)]
pub struct EquirectMap {
    /// Texels along the horizon.
    pub width: u32,
    /// Texels from pole to pole.
    pub height: u32,
    /// Radiance, row by row from the top.
    pub texels: Vec<[f32; 3]>,
}

/// What had to be changed to make a map usable.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EnvironmentReport {
    /// Texels with a channel that is not a number; that channel became 0.
    pub nan_texels: u64,
    /// Texels with a channel below 0; that channel became 0.
    pub negative_texels: u64,
    /// Texels with an infinite channel; it became 65504, the largest half float, from where most infinities overflowed.
    pub infinite_texels: u64,
    /// Texels with a finite channel above [`EquirectMap::GREATEST`], which it became.
    pub huge_texels: u64,
    /// Column and row of the first texel that was changed.
    pub first_changed: Option<[u32; 2]>,
    /// What else there was to say, such as a shape that is not 2:1.
    pub warnings: Vec<String>,
}

impl EnvironmentReport {
    /// Texels that were changed, one with two faults counted for each.
    pub fn bad_texels(&self) -> u64 {
        self.nan_texels + self.negative_texels + self.infinite_texels + self.huge_texels
    }
}

impl EquirectMap {
    /// The greatest radiance that is kept: sums of it stay far inside the range of a 32-bit float.
    pub const GREATEST: f32 = 1e12;

    /// The same radiance from everywhere.
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self { width: 1, height: 1, texels: vec![radiance] }
    }

    /// Where a direction (not zero, of any length) lies, in units of the map's width and height.
    pub fn uv_from_direction(direction: DVec3) -> [f64; 2] {
        let horizontal = direction.x.hypot(direction.z);
        let u = if horizontal == 0.0 { 0.5 } else { 0.5 + direction.x.atan2(-direction.z) / TAU };
        // Near the poles this keeps the digits that acos(y) would lose.
        [u, horizontal.atan2(direction.y) / PI]
    }

    /// The unit direction of a place on the map: the inverse of [`uv_from_direction`](Self::uv_from_direction).
    pub fn direction_from_uv([u, v]: [f64; 2]) -> DVec3 {
        let (sin_azimuth, cos_azimuth) = ((u - 0.5) * TAU).sin_cos();
        let (sin_polar, cos_polar) = (v * PI).sin_cos();
        DVec3::new(sin_polar * sin_azimuth, cos_polar, -sin_polar * cos_azimuth)
    }

    /// Radiance from a direction, interpolated between the four nearest texels: around the horizon without end, at the
    /// poles up to the last row.
    pub fn radiance(&self, direction: DVec3) -> [f32; 3] {
        let [u, v] = Self::uv_from_direction(direction);
        let (x, y) = (u * f64::from(self.width) - 0.5, v * f64::from(self.height) - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - top);
        let texel = |dx: f64, dy: f64| {
            let column = (left + dx).rem_euclid(f64::from(self.width)) as u32;
            let row = (top + dy).clamp(0.0, f64::from(self.height - 1)) as u32;
            self.texel(column.min(self.width - 1), row)
        };
        let corners = [
            (texel(0.0, 0.0), (1.0 - fx) * (1.0 - fy)),
            (texel(1.0, 0.0), fx * (1.0 - fy)),
            (texel(0.0, 1.0), (1.0 - fx) * fy),
            (texel(1.0, 1.0), fx * fy),
        ];
        std::array::from_fn(|c| corners.iter().map(|(texel, weight)| f64::from(texel[c]) * weight).sum::<f64>() as f32)
    }

    /// The integral of radiance over the whole sphere, texels taken as constant: W/m2 for radiance in W/(m2 sr).
    pub fn integral(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (row, texels) in self.texels.chunks_exact(self.width as usize).enumerate() {
            let solid_angle = self.solid_angle(row as u32);
            for texel in texels {
                for c in 0..3 {
                    sum[c] += f64::from(texel[c]) * solid_angle;
                }
            }
        }
        sum
    }

    /// The solid angle of a texel of a row, steradians.
    pub(super) fn solid_angle(&self, row: u32) -> f64 {
        TAU / f64::from(self.width)
            * band(f64::from(row) / f64::from(self.height), f64::from(row + 1) / f64::from(self.height))
    }

    /// The next level of a mip chain: half of each side, rounded down, at least 1.
    ///
    /// Each texel is the mean over its share of the sphere, so that [`integral`](Self::integral) stays what it is
    /// whatever the sizes.
    pub fn half(&self) -> EquirectMap {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut texels = vec![[0.0; 3]; width as usize * height as usize];
        texels.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
            let rows = overlaps(y as u32, self.height, height);
            let bands: Vec<(u32, f64)> = rows.map(|(index, start, end)| (index, band(start, end))).collect();
            let whole: f64 = bands.iter().map(|(_, band)| band).sum();
            for (x, out) in row.iter_mut().enumerate() {
                let mut mean = [0.0; 3];
                for (column, start, end) in overlaps(x as u32, self.width, width) {
                    let across = (end - start) * f64::from(width);
                    for &(row, band) in &bands {
                        let texel = self.texel(column, row);
                        for c in 0..3 {
                            mean[c] += f64::from(texel[c]) * across * band / whole;
                        }
                    }
                }
                *out = mean.map(|c| c as f32);
            }
        });
        EquirectMap { width, height, texels }
    }

    fn texel(&self, column: u32, row: u32) -> [f32; 3] {
        self.texels[row as usize * self.width as usize + column as usize]
    }

    /// Makes every channel finite and not negative, and counts.
    pub(crate) fn repair(&mut self) -> EnvironmentReport {
        let mut report = EnvironmentReport::default();
        for (index, texel) in self.texels.iter_mut().enumerate() {
            let before = *texel;
            report.nan_texels += u64::from(texel.iter().any(|c| c.is_nan()));
            report.negative_texels += u64::from(texel.iter().any(|&c| c < 0.0));
            report.infinite_texels += u64::from(texel.contains(&f32::INFINITY));
            report.huge_texels += u64::from(texel.iter().any(|c| c.is_finite() && *c > Self::GREATEST));
            *texel = texel.map(|channel| match channel {
                c if c.is_nan() => 0.0,
                f32::INFINITY => 65504.0,
                c => c.clamp(0.0, Self::GREATEST),
            });
            // A zero that has a sign is no light and no fault.
            let changed = texel.iter().zip(before).any(|(after, before)| *after != before);
            if changed && report.first_changed.is_none() {
                report.first_changed = Some([index as u32 % self.width, index as u32 / self.width]);
            }
        }
        report
    }
}

/// The solid angle of a band between two heights of the map, per radian of azimuth: `cos(pi v0) - cos(pi v1)`, in the
/// form that keeps its digits at the poles.
fn band(v0: f64, v1: f64) -> f64 {
    2.0 * (0.5 * PI * (v0 + v1)).sin() * (0.5 * PI * (v1 - v0)).sin()
}

/// What texel `to` of `to_count` covers of `from_count` texels: their indices, and where the overlap starts and ends as
/// a part of the whole side.
fn overlaps(to: u32, from_count: u32, to_count: u32) -> impl Iterator<Item = (u32, f64, f64)> {
    let (from, units, to) = (u64::from(from_count), u64::from(to_count), u64::from(to));
    // In units of 1 / to_count source texels everything is an integer.
    let (start, end) = (to * from, (to + 1) * from);
    let whole = (from * units) as f64;
    (start / units..end.div_ceil(units)).map(move |index| {
        let (first, last) = (start.max(index * units), end.min((index + 1) * units));
        (index as u32, first as f64 / whole, last as f64 / whole)
    })
}
