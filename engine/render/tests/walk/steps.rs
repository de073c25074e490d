//! Rays that run out of steps, and what keeps them from it.

use crate::shapes;
use crate::trace::{Ray, Tracer, alone};
use glam::{DAffine3, DVec3};
use mica_render::scene::bvh::{BuildOptions, MeshBvh, SceneBvh};

/// A hundred thousand triangles in one place, all of them kept, are more than an invocation may test.
fn crowd() -> (SceneBvh, [Ray; 2]) {
    let mesh = shapes::identical(100_000);
    let options = BuildOptions { masked: true, ..BuildOptions::default() };
    let bvh = MeshBvh::build_with(&mesh.positions, &mesh.indices, options).expect("a usable mesh");
    let scene = SceneBvh::build(&[(0, DAffine3::IDENTITY)], &[bvh]).expect("a usable scene");
    let triangle = mesh.corners(0);
    let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    let beside = DVec3::new(0.6, 0.7, -0.5);
    (scene, [middle, beside].map(|target| Ray::new(target + DVec3::Z, -DVec3::Z)))
}

/// The answers come all the same: hits where there are some, since the first copy tested is as near as any, and free sight
/// beside them. What is left is for the rays after it.
#[test]
fn a_ray_that_runs_out_of_steps_keeps_what_it_found_and_leaves_half() {
    let (scene, rays) = crowd();
    let answers = Tracer::new().trace(&scene, &rays);
    assert!(answers[0].hit() && answers[0].any != 0 && answers[0].cut_short == 1, "{:?}", answers[0]);
    assert!((answers[0].t - 1.0).abs() < 1e-5, "{:?}", answers[0]);
    assert!(!answers[1].hit() && answers[1].any == 0 && answers[1].cut_short == 2, "{:?}", answers[1]);
    assert_eq!(answers[1].steps_left, 12_500, "a half of a half of 50,000");
}

/// A driver that ends loops of its own accord, as lavapipe does after 65,535 rounds, is noticed.
#[test]
fn a_ray_whose_loop_the_driver_ends_is_counted() {
    let (scene, rays) = crowd();
    let answers = Tracer::with_change("50000u", "4000000u").trace(&scene, &rays);
    for answer in &answers[1..] {
        let whole = 4_000_000 - answer.steps_left >= 2 * 100_000;
        assert!(whole != (answer.cut_short > 0), "{answer:?}");
    }
}

#[test]
fn of_a_hundred_thousand_copies_one_is_kept() {
    let mesh = shapes::identical(100_000);
    let (_, rays) = crowd();
    let answers = Tracer::new().trace(&alone(&mesh), &rays);
    assert!(answers[0].hit() && answers[0].triangle == 0 && answers[0].any != 0, "{:?}", answers[0]);
    assert!(!answers[1].hit() && answers[1].any == 0, "{:?}", answers[1]);
    assert!(answers.iter().all(|answer| answer.cut_short == 0 && answer.steps_left > 49_900), "{answers:?}");
}
