//! Shapes that several scenes are put together from: turned bodies, tubes, boxes, stages.

use glam::{DVec2, DVec3};

use crate::maths::{self, PI, TAU};
use crate::surface::{Grid, Mesh, even};

/// A body turned about the Y axis. `profile(t)` gives radius and height, from the bottom up for an outer wall.
pub fn turned(profile: impl Fn(f64) -> DVec2, around: usize, along: &[f64]) -> Mesh {
    let surface = |s: f64, t: f64| {
        let p = profile(t);
        let angle = -TAU * s;
        DVec3::new(p.x * maths::cos(angle), p.y, p.x * maths::sin(angle))
    };
    Grid::sample(surface, &even(around), along).lay_out(0, 0).into_mesh()
}

/// A tube along a curve of the parameter 0 to 1; `radius(t)` may shrink to zero to close an end.
pub fn tube(curve: impl Fn(f64) -> DVec3, radius: impl Fn(f64) -> f64, around: usize, along: usize) -> Mesh {
    let samples = even(along);
    // The frame is carried along without twist: each step rotates the last one's side into the new normal plane.
    let h = 1e-4;
    let tangent = |t: f64| (curve((t + h).min(1.0)) - curve((t - h).max(0.0))).normalize_or(DVec3::Y);
    let first = tangent(0.0);
    let mut side = first.any_orthonormal_vector();
    let mut frames = Vec::new();
    for &t in &samples {
        let forward = tangent(t);
        side = (side - forward * side.dot(forward)).normalize();
        frames.push((curve(t), side, forward.cross(side), forward));
    }
    let mut grid = Grid {
        columns: around + 1,
        rows: along + 1,
        positions: Vec::new(),
        normals: Vec::new(),
        uvs: vec![DVec2::ZERO; (around + 1) * (along + 1)],
    };
    for (&t, &(centre, x, y, forward)) in samples.iter().zip(&frames) {
        let (from, to) = ((t - h).max(0.0), (t + h).min(1.0));
        let run = curve(from).distance(curve(to));
        let slope = if run > 0.0 { (radius(to) - radius(from)) / run } else { 0.0 };
        for i in 0..=around {
            let angle = TAU * i as f64 / around as f64;
            let out = x * maths::cos(angle) + y * maths::sin(angle);
            grid.positions.push(centre + out * radius(t));
            grid.normals.push((out - forward * slope).normalize());
        }
    }
    grid.lay_out(0, 0).into_mesh()
}

/// A tube round a closed curve, `curve(0) == curve(1)` with the same tangent there.
pub fn ring(curve: impl Fn(f64) -> DVec3, radius: f64, reference_up: DVec3, around: usize, along: usize) -> Mesh {
    let surface = |s: f64, t: f64| {
        let h = 1e-4;
        let forward = (curve((t + h).rem_euclid(1.0)) - curve((t - h).rem_euclid(1.0))).normalize();
        let side = forward.cross(reference_up).normalize();
        let up = side.cross(forward);
        let angle = TAU * s;
        curve(t.rem_euclid(1.0)) + (side * maths::cos(angle) + up * maths::sin(angle)) * radius
    };
    Grid::sample(surface, &even(around), &even(along)).lay_out(0, 0).into_mesh().flipped()
}

/// An upright box with its edges rounded off: a superellipsoid of exponent 2 / `softness`, `half` its half extents.
pub fn soft_box(half: DVec3, softness: f64, around: usize) -> Mesh {
    let surface = |s: f64, t: f64| {
        let (longitude, latitude) = (-TAU * s, PI * (t - 0.5));
        let ring = maths::signed_pow(maths::cos(latitude), softness);
        DVec3::new(
            half.x * ring * maths::signed_pow(maths::cos(longitude), softness),
            half.y * maths::signed_pow(maths::sin(latitude), softness),
            half.z * ring * maths::signed_pow(maths::sin(longitude), softness),
        )
    };
    Grid::sample(surface, &even(around), &even(around / 2)).lay_out(0, 0).into_mesh()
}

/// A photographer's sweep: level ground that bends up into a wall behind. The bend starts at `z = back`, has radius
/// `bend` and rises to `height`; the ground reaches forward to `front` and `half_width` to either side.
pub fn sweep(half_width: f64, front: f64, back: f64, bend: f64, height: f64) -> Mesh {
    let arc = bend * PI / 2.0;
    let rows: Vec<f64> = (0..=4)
        .map(|i| (front - back) * f64::from(i) / 4.0)
        .chain((1..=24).map(|i| front - back + arc * f64::from(i) / 24.0))
        .chain([front - back + arc + height - bend])
        .collect();
    let surface = |s: f64, run: f64| {
        let x = half_width * (2.0 * s - 1.0);
        let bent = run - (front - back);
        if bent <= 0.0 {
            DVec3::new(x, 0.0, front - run)
        } else if bent < arc {
            let angle = bent / bend;
            DVec3::new(x, bend * (1.0 - maths::cos(angle)), back - bend * maths::sin(angle))
        } else {
            DVec3::new(x, bend + bent - arc, back - bend)
        }
    };
    Grid::sample(surface, &even(4), &rows).lay_out(0, 0).into_mesh()
}
