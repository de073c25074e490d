//! Shapes that hierarchies are known to fail at, with the answers that anybody can tell. `agreement` asks much more of
//! each, and `mesh_hierarchy` looks at their trees.

use crate::bodies::{Bodies, Said};
use crate::mesh_hierarchy::{built, depth};
use crate::meshes::{self, Mesh};
use crate::random::Random;
use crate::rays::ray;
use crate::scenes;
use glam::DVec3;
use mica_render::OcclusionBackend;
use mica_shaders::types::Ray;

/// What each body says of the rays through a mesh, which are taken to scene space.
fn said(mesh: Mesh, rays: &[Ray]) -> Vec<(OcclusionBackend, Vec<Said>)> {
    let mut bodies = Bodies::new();
    let mut renderers = bodies.open(&scenes::alone("a hard shape", mesh));
    let center = renderers[0].scene_center();
    let from_center = |ray: &Ray| {
        let origin = (DVec3::from(ray.origin.map(f64::from)) - center).as_vec3().to_array();
        Ray { origin, ..*ray }
    };
    let rays: Vec<Ray> = rays.iter().map(from_center).collect();
    bodies.ask(&mut renderers, &rays, rays.len()).into_iter().map(|asked| (asked.of, asked.said)).collect()
}

/// From between two of sixty boxes a ray outwards meets the outer one, and a ray inwards the inner one.
#[test]
fn between_nested_boxes_rays_meet_the_next_one() {
    const BOXES: u32 = 60;
    let between: Vec<DVec3> = (0..BOXES - 1).map(|k| 0.9 * 0.8f64.powi(k as i32) * DVec3::X).collect();
    let rays: Vec<Ray> = between.iter().flat_map(|&place| [ray(place, DVec3::X), ray(place, -DVec3::X)]).collect();
    let next: Vec<u32> = (0..BOXES - 1).flat_map(|k| [k, k + 1]).collect();
    for (of, said) in said(meshes::nested_boxes(BOXES), &rays) {
        let met: Vec<u32> = said.iter().map(|said| said.closest.triangle / 12).collect();
        assert_eq!(met, next, "{of:?}");
        assert!(said.iter().all(|said| said.any.is_some_and(|any| any.blocked != 0)), "{of:?}");
    }
}

/// Rays across the stick meet it wherever they are aimed at its middle line, and none that pass beside it.
#[test]
fn a_stick_of_1e6_is_met_along_all_of_it_and_nowhere_else() {
    let mesh = meshes::stick_of_1e6();
    let [start, end, beside] = mesh.corners(0);
    let (along, width) = (end - start, beside - end);
    let normal = along.cross(width).normalize();
    let mut random = Random::new(71);
    let mut rays = Vec::new();
    for k in 0..1_000 {
        let at = random.between(0.5, 0.99);
        // At half of its width there, and at a third beyond.
        let across = if k % 2 == 0 { 0.5 } else { 1.33 };
        let side = if random.unit() < 0.5 { 8.0 } else { -8.0 };
        let across = ray(start + at * (along + across * width) + side * normal, -side * normal);
        rays.push(Ray { t_max: 2.0, ..across });
    }
    for (of, said) in said(mesh, &rays) {
        for (k, Said { closest, any }) in said.iter().enumerate() {
            let expected = u32::from(k % 2 == 0);
            assert_eq!((closest.blocked, any.map(|any| any.blocked)), (expected, Some(expected)), "{of:?}: ray {k}");
            assert!(closest.blocked == 0 || (closest.triangle == 0 && (closest.t - 1.0).abs() < 0.02), "{closest:?}");
        }
    }
}

/// Triangles on a string: a ray along it meets them one after the other.
#[test]
fn collinear_centroids_are_met_in_turn() {
    const COUNT: usize = 1_000;
    let mesh = meshes::collinear_centroids(COUNT);
    assert!(depth(&built(&mesh)) <= 12, "{} levels over a thousand triangles", depth(&built(&mesh)));
    let before = |k: usize| DVec3::new(2.0 * (k as f64 - 0.5) / COUNT as f64 - 1.0, 1e-3, 2e-3);
    let rays: Vec<Ray> = (0..COUNT).map(|k| ray(before(k), DVec3::X)).collect();
    for (of, said) in said(mesh, &rays) {
        let met: Vec<usize> = said.iter().map(|said| said.closest.triangle as usize).collect();
        assert!(met.iter().copied().eq(0..COUNT), "{of:?}: {met:?}");
        assert!(said.iter().all(|said| said.any.is_some_and(|any| any.blocked != 0)), "{of:?}");
    }
}
