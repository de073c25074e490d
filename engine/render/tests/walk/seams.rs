//! Rays that start close to the seam they are aimed at, where rounding is large beside the way they go.

use crate::shapes::{Mesh, Random};
use crate::trace::{Ray, Tracer, alone};
use glam::DVec3;

/// A floor of large tiles, its lines at coordinates with all their bits in use, turned so that `up` is the axis of its
/// normal. Its boxes end where its seams are.
fn tiles(up: usize) -> Mesh {
    let mut random = Random::new(4);
    let mut lines = [0.0; 9];
    for (k, line) in lines.iter_mut().enumerate() {
        *line = f64::from((k as f64 - 4.0 + random.between(-0.3, 0.3)) as f32);
    }
    let turned = |x, y| [DVec3::new(0.0, x, y), DVec3::new(y, 0.0, x), DVec3::new(x, y, 0.0)][up];
    Mesh::soup((0..128).map(|k| {
        let (x, y, upper) = (k / 2 % 8, k / 16, k % 2 == 1);
        let corner = |i: usize, j: usize| turned(lines[x + i], lines[y + j]);
        if upper { [corner(1, 0), corner(1, 1), corner(0, 1)] } else { [corner(0, 0), corner(1, 0), corner(0, 1)] }
    }))
}

/// Rays from one side of the floor through points of its seams to the other.
fn rays_through_floor(mesh: &Mesh, up: usize, count: usize) -> Vec<Ray> {
    let mut random = Random::new(22);
    let mut rays = Vec::new();
    while rays.len() < count {
        let [a, b, c] = mesh.corners(random.below(mesh.triangles()));
        let (from, to) = [(a, b), (b, c), (c, a)][random.below(3)];
        let seam = from.lerp(to, random.unit());
        let distance = 10.0f64.powf(random.between(-5.0, 0.0));
        let side = random.direction();
        let ray = Ray::new(seam + distance * side, -side);
        // Not along the floor, and not through its rim.
        let in_floor = seam - seam[up] * DVec3::AXES[up];
        if side[up].abs() > 0.2 && in_floor.abs().max_element() < 3.5 {
            rays.push(ray);
        }
    }
    rays
}

fn misses(tracer: &mut Tracer, up: usize) -> usize {
    let mesh = tiles(up);
    let answers = tracer.trace(&alone(&mesh), &rays_through_floor(&mesh, up, 100_000));
    answers.iter().filter(|answer| !answer.hit() || answer.any == 0).count()
}

#[test]
fn no_ray_slips_through_a_seam_it_starts_close_to() {
    let mut tracer = Tracer::new();
    for up in 0..3 {
        assert_eq!(misses(&mut tracer, up), 0, "across axis {up}");
    }
    let mut tight = Tracer::with_change("* 1.000002", "* 0.99999");
    assert!(misses(&mut tight, 0) > 0, "boxes without room let rays through");
}
