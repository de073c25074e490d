//! Rays that run out of steps, and what keeps them from it.

use crate::bvh_tracer::BvhTracer;
use crate::meshes;
use crate::rays::ray;
use glam::{DAffine3, DVec3};
use mica_render::scene::bvh::{BuildOptions, MeshBvh, SceneBvh};
use mica_shaders::types::Ray;

/// A hundred thousand triangles in one place, which are more than an invocation may test where masks keep them all. The
/// first ray goes through them, the second beside them but within their box.
fn crowd(masked: bool) -> (SceneBvh, [Ray; 2]) {
    let mesh = meshes::identical(100_000);
    let options = BuildOptions { masked, ..BuildOptions::default() };
    let bvh = MeshBvh::build_with(&mesh.positions, &mesh.indices, options).expect("a usable mesh");
    let scene = SceneBvh::build(&[(0, DAffine3::IDENTITY)], &[bvh]).expect("a usable scene");
    let [a, b, c] = mesh.corners(0);
    let targets = [(a + b + c) / 3.0, DVec3::new(0.6, 0.7, -0.5)];
    (scene, targets.map(|target| ray(target + DVec3::Z, -DVec3::Z)))
}

/// The answers come all the same: hits where there are some, since the first copy tested is as near as any, and free sight
/// beside them. What is left is for the rays after it.
#[test]
fn a_ray_that_runs_out_of_steps_keeps_what_it_found_and_leaves_half() {
    let (scene, rays) = crowd(true);
    let [through, beside] = BvhTracer::of_steps("", "").count_steps(&scene, &rays)[..] else { panic!("two rays") };
    assert_eq!((through.closest, through.any, through.cut_short), (1, 1, 1), "{through:?}");
    assert!((through.t - 1.0).abs() < 1e-5, "{through:?}");
    assert_eq!((beside.closest, beside.any, beside.cut_short), (0, 0, 2), "{beside:?}");
    assert_eq!(beside.left, 12_500, "a half of a half of 50,000");
}

/// A driver that ends loops of its own accord, as lavapipe does after 65,535 rounds, is noticed.
#[test]
fn a_ray_whose_loop_the_driver_ends_is_counted() {
    let (scene, rays) = crowd(true);
    let steps = BvhTracer::of_steps("50000u", "4000000u").count_steps(&scene, &rays)[1];
    let whole = 4_000_000 - steps.left >= 2 * 100_000;
    assert!(whole != (steps.cut_short > 0), "{steps:?}");
}

#[test]
fn of_a_hundred_thousand_copies_one_is_kept() {
    let (scene, rays) = crowd(false);
    let [through, beside] = BvhTracer::of_steps("", "").count_steps(&scene, &rays)[..] else { panic!("two rays") };
    assert_eq!((through.closest, through.any, through.triangle), (1, 1, 0), "{through:?}");
    assert_eq!((beside.closest, beside.any), (0, 0), "{beside:?}");
    for steps in [through, beside] {
        assert!(steps.cut_short == 0 && steps.left > 49_900, "{steps:?}");
    }
}
