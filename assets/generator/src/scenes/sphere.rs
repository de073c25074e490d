//! One glinting sphere, whose interpolated normals are exact: on a sphere about the origin the normal is the position.

use glam::{DVec2, DVec3};

use crate::glb::{Document, Glint, Material};
use crate::maths::{self, PI, TAU};
use crate::surface::{Grid, even};

/// Metres.
const RADIUS: f64 = 0.1;

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("sphere", "studio");
    let flakes = [0.95, 0.79, 0.49];
    let material = scene.material(Material::metal("flakes", flakes, 0.0).with_glint(Glint {
        count: 1e6,
        alpha: 0.2,
        gamma_deg: 3.0,
        seed: 2,
        color: flakes,
    }));
    let surface = |s: f64, t: f64| {
        let (longitude, colatitude) = (-TAU * s, PI * (1.0 - t));
        let ring = maths::sin(colatitude);
        RADIUS * DVec3::new(ring * maths::cos(longitude), maths::cos(colatitude), ring * maths::sin(longitude))
    };
    let mut grid = Grid::sample(surface, &even(160), &even(80));
    // The formula's own normals instead of differences; four squares around and two from pole to pole.
    for (normal, position) in grid.normals.iter_mut().zip(&grid.positions) {
        *normal = *position / RADIUS;
    }
    let grid = grid.lay_out_by(|column, row| DVec2::new(column as f64 / 40.0, row as f64 / 40.0));
    scene.add("sphere", &[(&grid.into_mesh(), material)]);
    scene.camera(DVec3::new(0.0, 0.06, 0.52), DVec3::ZERO, 28.0);
    scene
}
