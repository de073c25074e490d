//! A ray that leaves a surface by the offset of every pass does not meet what it left.

use crate::device::{Bodies, Said};
use crate::rays::{many, ray, within};
use crate::truth::World;
use crate::{meshes, scenes, shapes};
use glam::DAffine3;
use mica_render::scene::Scene;
use mica_shaders::types::Ray;
use std::sync::atomic::{AtomicU32, Ordering};

/// Rays a scene.
const RAYS: usize = 40_000;

/// Rays from points of triangles into the hemisphere of their normal, moved off them or not, with the triangle each left.
fn leaving(world: &World, moved: bool) -> (Vec<Ray>, Vec<u32>) {
    let left: Vec<AtomicU32> = (0..RAYS).map(|_| AtomicU32::new(0)).collect();
    let rays = many(RAYS, 13, |random, k| {
        let triangle = random.below(world.triangles());
        left[k].store(triangle as u32, Ordering::Relaxed);
        let corners @ [a, b, c] = world.triangle(triangle);
        let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
        let normal = side * (b - a).cross(c - a).normalize();
        let mut direction = random.direction();
        if direction.dot(normal) < 0.0 {
            direction = -direction;
        }
        let mut made = ray(within(random, corners), direction);
        if moved {
            made.normal = normal.as_vec3().to_array();
        }
        made
    });
    (rays, left.into_iter().map(AtomicU32::into_inner).collect())
}

/// How many of the rays meet, first of all, the triangle they left.
fn returned(world: &World, said: &[Said], left: &[u32]) -> usize {
    let again = |(said, &left): (&Said, &u32)| {
        said.closest.blocked != 0 && world.named(&said.closest) == Some(world.twin(left))
    };
    said.iter().zip(left).filter(|&pair| again(pair)).count()
}

#[test]
fn no_ray_meets_the_triangle_it_left() {
    let mut bodies = Bodies::new();
    let soup = |scale: f64| scenes::alone("soup", meshes::soup(2_000, 0.1, 17).map(|point| scale * point));
    let sphere = shapes::bumpy_icosphere(3);
    let mut cases: Vec<(String, Scene)> =
        [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6].map(|scale| (format!("at scale {scale:e}"), soup(scale))).to_vec();
    let of =
        |name: &str, places: &[(usize, DAffine3)]| (name.to_owned(), scenes::of(name, vec![sphere.clone()], places));
    cases.push(of("twelve instances", &shapes::twelve_places()));
    let named = [
        "long sticks",
        "mirrored",
        "scaled along the axes",
        "flattened",
        "far from its own origin",
        "huge and tiny",
        "a hundred instances",
    ];
    cases.extend(
        scenes::garbage()
            .into_iter()
            .filter(|scene| named.contains(&scene.name.as_str()))
            .map(|scene| (scene.name.clone(), scene)),
    );
    let mut faults = Vec::new();
    for (name, scene) in &cases {
        let mut renderers = bodies.open(scene);
        let world = World::new(scene, renderers[0].scene_center());
        let [moved, unmoved] = [true, false].map(|moved| {
            let (rays, left) = leaving(&world, moved);
            let asked = bodies.ask(&mut renderers, &rays, 0);
            asked.iter().map(|asked| returned(&world, &asked.said, &left)).collect::<Vec<_>>()
        });
        println!("{name:24} {RAYS} rays met what they left: {moved:?}, without the offset {unmoved:?}");
        if moved.iter().any(|&returned| returned > 0) {
            faults.push(format!("{name}: {moved:?}"));
        }
        assert!(unmoved.iter().all(|&returned| returned > RAYS / 200), "{name}: {unmoved:?} without the offset");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
