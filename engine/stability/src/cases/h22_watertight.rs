//! H22. Rays through the seams of closed meshes.

use crate::rays::{ray, soup, triangles_of};
use crate::{Check, Form, Laboratory, Random, StabilityError};
use glam::{DAffine3, DVec3};
use mica_render::{Ray, RayAnswer};
use std::f64::consts::TAU;

/// Triangles about each of the two points of the mesh.
const FAN: usize = 24;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let count = laboratory.inputs(30_000, 10_000_000);
    let mut random = Random::new(22);
    let (mut naive, mut stable) = (0.0f64, 0.0f64);
    // How far from its own origin the mesh lies, about its size; the last is the place of Embree's test of the same.
    let places = [DVec3::ZERO, DVec3::new(600.0, -500.0, 700.0), DVec3::new(148_376.0, 1234.0, -223_423.0)];
    for place in places {
        let scene = soup(&spindle(&mut random, place), DAffine3::IDENTITY);
        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        // Scene space is as fine about the middle as the mesh's own is not.
        let triangles: Vec<[DVec3; 3]> =
            triangles_of(&scene).into_iter().map(|corners| corners.map(|corner| corner - center)).collect();
        let rays: Vec<Ray> = (0..count).map(|k| aimed(&mut random, &triangles, k)).collect();
        let missed =
            |answers: Vec<RayAnswer>| answers.iter().filter(|answer| answer.blocked == 0).count() as f64 / count as f64;
        stable = stable.max(missed(laboratory.closest(&scene, &rays)?));
        naive = naive.max(missed(laboratory.closest_listed(&triangles, &rays)?));
    }
    Ok(vec![Check {
        what: "rays from inside closed meshes to their corners and edges, up to 3e5 of their sizes from the origin"
            .to_owned(),
        error_of: "share of them that meet nothing".to_owned(),
        inputs: (places.len() * count) as u64,
        naive: Form::new("Moeller and Trumbore 1997, triangle by triangle", naive),
        stable: Form::new("Woop, Benthin and Wald 2013, in boxes with room for rounding", stable),
        tolerance: 0.0,
    }])
}

/// Two points and a ragged ring between them, about a place: all of it is seen from its middle.
fn spindle(random: &mut Random, place: DVec3) -> Vec<[DVec3; 3]> {
    let f32_of = |point: DVec3| (place + point).as_vec3().as_dvec3();
    let ring: Vec<DVec3> = (0..FAN)
        .map(|k| {
            let turn = TAU * (k as f64 + random.between(-0.3, 0.3)) / FAN as f64;
            let radius = random.between(0.8, 1.2);
            f32_of(DVec3::new(radius * turn.cos(), radius * turn.sin(), random.between(-0.1, 0.1)))
        })
        .collect();
    let points = [1.1, -0.9].map(|z| f32_of(DVec3::new(0.03, -0.02, z)));
    let next = |k: usize| ring[(k + 1) % FAN];
    points
        .into_iter()
        .flat_map(|point| (0..FAN).map(move |k| (point, k)))
        .map(|(point, k)| [point, ring[k], next(k)])
        .collect()
}

/// In turn at a point of the mesh's, at a corner of its ring, and at points of edges; the directions of one in four are
/// along an axis of space, within rounding or exactly.
fn aimed(random: &mut Random, triangles: &[[DVec3; 3]], k: usize) -> Ray {
    let [a, b, c] = triangles[(random.bits() % triangles.len() as u64) as usize];
    let share = random.between(0.0, 1.0);
    let target = [a, b, a.lerp(b, share), b.lerp(c, share)][k % 4];
    let mut origin = 0.3 * DVec3::from([(); 3].map(|()| random.between(-1.0, 1.0)));
    if k % 16 < 4 {
        // Straight up or down, through a point's box planes.
        let up = if target.z < 0.0 { -DVec3::Z } else { DVec3::Z };
        origin = 0.3 * target.with_z(0.0).clamp_length_max(1.0);
        return ray(origin, up);
    }
    let origin = origin.as_vec3().as_dvec3();
    ray(origin, target - origin)
}
