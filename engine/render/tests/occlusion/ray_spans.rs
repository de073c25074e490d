//! What is a ray, where it ends, and what is said of one that meets nothing.

use crate::bodies::{Asked, Bodies, Said};
use crate::meshes::{self, Mesh};
use crate::rays::ray;
use crate::scenes;
use glam::{DAffine3, DVec3};
use mica_render::scene::Scene;
use mica_shaders::types::{Ray, RayAnswer};

/// What each body says, asked both questions of all.
fn asked(scene: &Scene, rays: &[Ray]) -> Vec<Asked> {
    let mut bodies = Bodies::new();
    let mut renderers = bodies.open(scene);
    bodies.ask(&mut renderers, rays, rays.len())
}

#[test]
fn a_hit_lies_strictly_between_the_ends_and_counts_in_lengths_of_the_direction() {
    let square = Mesh::soup([[DVec3::new(-1.0, -1.0, 2.0), DVec3::new(3.0, -1.0, 2.0), DVec3::new(-1.0, 3.0, 2.0)]]);
    // A second triangle far away, so that scene space is where the mesh is.
    let mesh = square.clone().and(square.map(|point| -point));
    let span = |t_min, t_max, length| Ray { t_min, t_max, ..ray(DVec3::ZERO, length * DVec3::Z) };
    let cases = [
        (span(0.0, 1e30, 1.0), Some(2.0)),
        (span(0.0, 1e30, 4.0), Some(0.5)),
        (span(0.0, f32::INFINITY, 1.0 / 1024.0), Some(2048.0)),
        (span(0.0, 2.0, 1.0), None),
        (span(2.0, 1e30, 1.0), None),
        (span(0.0, 2.0f32.next_up(), 1.0), Some(2.0)),
        (span(2.0f32.next_down(), 3.0, 1.0), Some(2.0)),
        (span(0.0, 1e30, -1.0), Some(2.0)),
        (span(3.0, 1e30, -1.0), None),
        (span(-1e30, 1e30, 1.0), None),
        (span(3.0, 1.0, 1.0), None),
    ];
    for place in [DAffine3::IDENTITY, DAffine3::from_scale(DVec3::new(2.0, -4.0, 1.0))] {
        let scene = scenes::of("two squares", vec![mesh.clone()], &[(0, place)]);
        for Asked { of, said, .. } in asked(&scene, &cases.map(|case| case.0)) {
            for ((ray, expected), said) in cases.iter().zip(&said) {
                let t = (said.closest.blocked != 0).then_some(said.closest.t);
                assert_eq!(t, *expected, "{of:?}: {ray:?}");
                let any = said.any.expect("an answer");
                assert_eq!(any.blocked != 0, expected.is_some(), "{of:?}: {ray:?}");
            }
        }
    }
}

#[test]
fn a_miss_leaves_the_far_end_and_zeros() {
    let scene = scenes::alone("one", meshes::identical(1));
    for Asked { of, said, .. } in asked(&scene, &[ray(DVec3::splat(9.0), DVec3::X)]) {
        assert_eq!(said[0].closest, RayAnswer { t: 1e30, ..RayAnswer::default() }, "{of:?}");
    }
}

#[test]
fn rays_that_are_none_meet_nothing_and_do_not_count() {
    let numbers = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let good = DVec3::new(0.2, 0.3, -0.9);
    let mut rays = vec![ray(DVec3::ZERO, DVec3::ZERO)];
    for (axis, number) in (0..3).flat_map(|axis| numbers.map(|number| (axis, number))) {
        let with = |mut vector: DVec3| {
            vector[axis] = number;
            vector
        };
        rays.extend([ray(with(DVec3::ZERO), good), ray(DVec3::ZERO, with(good))]);
    }
    rays.extend([Ray { t_max: f32::NAN, ..ray(DVec3::ZERO, good) }, Ray { t_min: f32::NAN, ..ray(DVec3::ZERO, good) }]);
    let none = rays.len();
    rays.push(ray(DVec3::ZERO, good));
    for Asked { of, said, traced, cut_short } in asked(&scenes::alone("sphere", meshes::bumpy_icosphere(3)), &rays) {
        assert!(said[..none].iter().all(|said| said.closest.blocked == 0), "{of:?}: {said:?}");
        assert!(said[none].closest.blocked != 0, "{of:?}: a ray from inside");
        assert_eq!((traced, cut_short), (2, 0), "{of:?}: one ray, asked twice");
    }
}

/// Each ray beside the triangles, but within their box, passes a hundred thousand copies before it meets the wall. The
/// hierarchy keeps one of them. Mesa 25.0.7's lavapipe keeps all, and its ray query goes through all: 400,000 copies are right
/// too, in linear time. It does not end loops after 65,535 rounds, as 22.3.6 does.
#[test]
fn a_hundred_thousand_copies_answer_as_one_does() {
    let wall = || meshes::grid(1).map(|point| 3.0 * point - 2.0 * DVec3::Z);
    let places = [(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)];
    let [one, many] = [1, 100_000].map(|copies| scenes::of("copies", vec![meshes::identical(copies), wall()], &places));
    let triangle = meshes::identical(1).corners(0);
    let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    let center = one.bounds().expect("a box").center();
    let targets = [middle, triangle[0].lerp(middle, 0.1), DVec3::new(0.6, 0.7, -0.5), DVec3::new(-0.5, 0.7, 0.2)];
    let rays: Vec<Ray> = targets
        .into_iter()
        .flat_map(|target| [DVec3::Z, DVec3::new(0.1, 0.1, 1.0)].map(|back| ray(target - center + back, -back)))
        .collect();
    for (one, many) in asked(&one, &rays).into_iter().zip(asked(&many, &rays)) {
        assert_eq!(many.cut_short, 0, "{:?}", many.of);
        for ((ray, of_one), of_many) in rays.iter().zip(&one.said).zip(&many.said) {
            let seen = |said: &Said| {
                (
                    said.closest.blocked,
                    said.closest.instance,
                    said.closest.t,
                    said.any.is_some_and(|any| any.blocked != 0),
                )
            };
            assert_eq!(seen(of_one), seen(of_many), "{:?}: {ray:?}", one.of);
        }
        let instances: Vec<u32> = one.said.iter().map(|said| said.closest.instance).collect();
        assert_eq!(instances, [0, 0, 0, 0, 1, 1, 1, 1], "{:?}", one.of);
    }
}
