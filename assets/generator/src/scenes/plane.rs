//! A glinting plane to the horizon, one UV square a square metre: footprints from a fraction of a flake to millions.

use glam::{DVec2, DVec3};

use crate::glb::{Document, Glint, Material};
use crate::maths;
use crate::surface::{Grid, even};

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("plane", "dusk");
    let flakes = [0.62, 0.53, 0.42];
    let material = scene.material(Material::metal("flakes", flakes, 0.0).with_glint(Glint {
        count: 1e5,
        alpha: 0.3,
        gamma_deg: 3.0,
        seed: 1,
        color: flakes,
    }));
    // Rows and columns grow apart with distance: near triangles stay small, for the precision of what is interpolated
    // over them, and far ones few.
    let depths: Vec<f64> =
        (0..=24).map(|i| 8.0 - 4.0 * (maths::pow(1.6, f64::from(i)) - 1.0)).filter(|z| *z > -2000.0).collect();
    let surface = |s: f64, t: f64| {
        let row = t * (depths.len() - 1) as f64;
        let before = (row as usize).min(depths.len() - 2);
        let z = depths[before] + (depths[before + 1] - depths[before]) * (row - before as f64);
        let side = 2.0 * s - 1.0;
        DVec3::new(20.0 * side + 1980.0 * side * maths::pow(side, 4.0), 0.0, z)
    };
    let grid = Grid::sample(surface, &even(32), &even(depths.len() - 1));
    let uvs = grid.positions.iter().map(|p| DVec2::new(p.x, -p.z)).collect();
    scene.add("plane", &[(&Grid { uvs, ..grid }.into_mesh(), material)]);
    scene.directional_light("sun", DVec3::new(-0.15, 0.22, -0.96), [2.5, 1.7, 1.02]);
    scene.camera(DVec3::new(0.0, 1.2, 4.0), DVec3::new(0.0, 0.55, 0.0), 40.0);
    scene
}
