//! A square of glinting cloth, thrown over a round-headed post, beside two gilded balls.

use glam::{DVec2, DVec3};

use crate::drape::{Cloth, Post};
use crate::glb::{Document, Glint, Material};
use crate::maths::{self, PI};
use crate::parts;
use crate::surface::{Grid, even};

/// UV squares per metre: a few flakes a pixel from the camera's place.
const UV_PER_METRE: f64 = 4.0;
/// Side of the cloth, metres.
const LENGTH: f64 = 1.9;

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("cloth", "studio");
    let fabric = Material::dielectric("lame", [0.010, 0.045, 0.060], 0.0).double_sided();
    let fabric = scene.material(fabric.with_glint(Glint {
        count: 1e5,
        alpha: 0.5,
        gamma_deg: 2.0,
        seed: 5,
        color: [0.13, 0.34, 0.40],
    }));
    let gilt = scene.material(Material::metal("gilt", [0.95, 0.68, 0.36], 0.22));
    let stage = scene.material(Material::dielectric("stage", [0.22, 0.20, 0.19], 0.8));

    let post = Post { foot: DVec2::ZERO, radius: 0.21, shoulder: 0.60 };
    let cloth = Cloth::fallen(91, LENGTH, DVec2::new(0.8, 0.6), &[post], 2.8);
    // Rows run along z, so that counter-clockwise is up.
    let grid = Grid::sample(|s, t| cloth.surface(t, s), &even(140), &even(140));
    let grid = grid.lay_out_by(|column, row| DVec2::new(column as f64, row as f64) * (LENGTH * UV_PER_METRE / 140.0));
    scene.add("cloth", &[(&grid.into_mesh(), fabric)]);
    for (name, place, radius) in
        [("large ball", DVec3::new(-0.66, 0.0, 0.22), 0.135), ("small ball", DVec3::new(-0.43, 0.0, 0.47), 0.065)]
    {
        let profile = |t: f64| DVec2::new(radius * maths::sin(PI * t), radius * (1.0 - maths::cos(PI * t)));
        scene.add(name, &[(&parts::turned(profile, 48, &even(24)).moved(place), gilt)]);
    }
    scene.add("stage", &[(&parts::sweep(6.0, 4.0, -1.5, 1.0, 3.5), stage)]);
    scene.point_light("key", DVec3::new(-1.4, 2.0, 1.4), [3.0, 2.8, 2.5]);
    scene.camera(DVec3::new(-0.35, 0.80, 2.8), DVec3::new(-0.04, 0.34, 0.0), 24.5);
    scene
}
