//! A ray that leaves a surface by the offset of every pass does not meet what it left.

use crate::bodies::{Bodies, Said};
use crate::bvh_tracer::BvhTracer;
use crate::rays::{many, ray, weights};
use crate::truth::World;
use crate::{meshes, scenes};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use mica_render::scene::Scene;
use mica_shaders::types::Ray;
use std::sync::atomic::{AtomicU32, Ordering};

/// Rays a scene.
const RAYS: usize = 40_000;

/// Where on its triangle a ray starts.
#[derive(Clone, Copy)]
enum Start {
    /// Where the surface pass finds a point: each corner moved to scene space by an f32 map, then weighted.
    Seen,
    /// At the nearest place that f32 has.
    Nearest,
}

/// How far a ray's origin is moved off its triangle.
#[derive(Clone, Copy, PartialEq)]
enum Offset {
    /// Not at all.
    None,
    /// By the triangle's own reach, as in every pass.
    OfTriangle,
    /// By the size of the scene, for a caller who knows no more.
    OfScene,
}

/// Rays from points of triangles into the hemisphere of their normal, with the triangle each left.
fn leaving(scene: &Scene, world: &World, center: DVec3, start: Start, offset: Offset) -> (Vec<Ray>, Vec<u32>) {
    let left: Vec<AtomicU32> = (0..RAYS).map(|_| AtomicU32::new(0)).collect();
    let rays = many(RAYS, 13, |random, k| {
        let triangle = random.below(world.triangles());
        left[k].store(triangle as u32, Ordering::Relaxed);
        let [a, b, c] = world.triangle(triangle);
        let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
        let normal = side * (b - a).cross(c - a).normalize();
        let mut direction = random.direction();
        if direction.dot(normal) < 0.0 {
            direction = -direction;
        }
        let weights @ [second, third] = weights(random);
        let mut made = ray(a + second * (b - a) + third * (c - a), direction);
        if let Start::Seen = start {
            made.origin = seen(scene, center, world.in_mesh(triangle as u32), weights.map(|weight| weight as f32));
        }
        if offset != Offset::None {
            made.normal = normal.as_vec3().to_array();
        }
        if offset == Offset::OfTriangle {
            made.reach = reach(scene, center, world.in_mesh(triangle as u32));
        }
        made
    });
    (rays, left.into_iter().map(AtomicU32::into_inner).collect())
}

/// The map to scene space, by columns, and the corners in the mesh, of a triangle of an instance, as shaders have them.
fn in_f32(scene: &Scene, center: DVec3, (instance, triangle): (usize, usize)) -> ([Vec3; 4], [Vec3; 3]) {
    let instance = &scene.instances[instance];
    let mesh = &scene.meshes[instance.mesh];
    let map = DAffine3::from_translation(-center) * instance.world_from_local;
    let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation];
    let corner = |k: usize| Vec3::from(mesh.positions[mesh.indices[3 * triangle + k] as usize]);
    (columns.map(|column| column.as_vec3()), [corner(0), corner(1), corner(2)])
}

/// A point of a triangle of an instance as the surface pass finds it.
fn seen(scene: &Scene, center: DVec3, of: (usize, usize), [second, third]: [f32; 2]) -> [f32; 3] {
    let (columns, corners) = in_f32(scene, center, of);
    let [a, b, c] = corners.map(|Vec3 { x, y, z }| ((columns[0] * x + columns[1] * y) + columns[2] * z) + columns[3]);
    ((a + second * (b - a)) + third * (c - a)).to_array()
}

/// What `triangle_reach` (`shared/scene.glsl`) makes of a triangle.
fn reach(scene: &Scene, center: DVec3, of: (usize, usize)) -> f32 {
    let (columns, [a, b, c]) = in_f32(scene, center, of);
    let Vec3 { x, y, z } = a.abs().max(b.abs()).max(c.abs());
    let [first, second, third, translation] = columns.map(Vec3::abs);
    (first * x + second * y + third * z + translation).max_element()
}

/// How many of the rays meet, first of all, the triangle they left.
fn returned(world: &World, said: &[Said], left: &[u32]) -> usize {
    let again = |(said, &left): (&Said, &u32)| {
        said.closest.blocked != 0 && world.named(&said.closest) == Some(world.twin(left))
    };
    said.iter().zip(left).filter(|&pair| again(pair)).count()
}

/// The same of each body that a device has, of rays that were moved off their surface so.
fn returned_of<const N: usize>(
    bodies: &mut Bodies,
    scene: &Scene,
    start: Start,
    offsets: [Offset; N],
) -> [Vec<usize>; N] {
    let mut renderers = bodies.open(scene);
    let center = renderers[0].scene_center();
    let world = World::new(scene, center);
    offsets.map(|offset| {
        let (rays, left) = leaving(scene, &world, center, start, offset);
        bodies.ask(&mut renderers, &rays, 0).iter().map(|asked| returned(&world, &asked.said, &left)).collect()
    })
}

fn turn() -> DQuat {
    DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0)
}

/// A mesh so far from its origin, brought back by its instance.
fn off_its_origin(away: DVec3) -> Scene {
    let mesh = meshes::soup(2_000, 0.1, 17).map(|point| point + away);
    scenes::of("off its origin", vec![mesh], &[(0, DAffine3::from_quat(turn()) * DAffine3::from_translation(-away))])
}

/// The scenes, and where rays start in each. One far from its own origin has no `Seen` places: see
/// `a_mesh_far_from_its_origin_is_lost_on_f32`.
fn cases() -> impl Iterator<Item = (Scene, Start)> {
    let soup = |scale: f64| meshes::soup(2_000, 0.1, 17).map(|point| scale * point);
    let sphere = meshes::bumpy_icosphere(3);
    let squashed = DAffine3::from_quat(turn()) * DAffine3::from_scale(DVec3::new(1e3, -1e-3, 1.0));
    let sheared =
        DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.7, 0.2, 0.1), DVec3::new(0.0, 5.0, -30.0)));
    let flung = DAffine3::from_scale_rotation_translation(DVec3::splat(0.01), turn(), DVec3::new(50.0, -20.0, 70.0));
    let named = |name: &str, mesh, places: &[(usize, DAffine3)]| scenes::of(name, vec![mesh], places);
    let mut scenes = [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6]
        .map(|scale| scenes::alone(&format!("at scale {scale:e}"), soup(scale)))
        .to_vec();
    scenes.extend([
        named("twelve instances", sphere, &scenes::twelve_places()),
        named("squashed and turned", soup(1.0), &[(0, squashed)]),
        named("sheared", soup(1.0), &[(0, sheared)]),
        named("flung", soup(1.0), &[(0, flung), (0, DAffine3::IDENTITY)]),
        off_its_origin(DVec3::new(4.0, -4.0, 4.0)),
    ]);
    // Small triangles in what is many times larger, to which their own reach is next to nothing. Some are turned, stretched
    // and moved so that f32 loses them in their mesh, though nothing beside the scene.
    let stretched = DAffine3::from_scale(DVec3::new(1e3, 1.0, 0.1)) * DAffine3::from_quat(turn());
    let unstretched = || meshes::of_all_sizes(2_000).map(|point| stretched.inverse().transform_point3(point));
    let lopsided = DAffine3::from_translation(DVec3::new(0.0, 50.0, 0.0)) * stretched;
    let near = DAffine3::from_scale_rotation_translation(DVec3::splat(0.3), turn(), DVec3::new(0.5, -2.0, 0.7));
    let large = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
    let beside_a_cube =
        |name: &str, mesh, place, large| scenes::of(name, vec![mesh, meshes::cube()], &[(0, place), (1, large)]);
    scenes.extend([
        named("all sizes, turned", meshes::of_all_sizes(2_000), &[(0, near)]),
        beside_a_cube("beside a large cube", soup(1e-2), near, large(1e6, 1e6, 1e6)),
        beside_a_cube("lopsided", unstretched(), lopsided, large(1e11, 1e8, 1e7)),
    ]);
    let of_garbage = [
        "long sticks",
        "mirrored",
        "scaled along the axes",
        "flattened",
        "far from its own origin",
        "huge and tiny",
        "a hundred instances",
    ];
    scenes.extend(scenes::garbage().into_iter().filter(|scene| of_garbage.contains(&scene.name.as_str())));
    scenes.into_iter().map(|scene| {
        let start = if scene.name == "far from its own origin" { Start::Nearest } else { Start::Seen };
        (scene, start)
    })
}

#[test]
fn no_ray_meets_the_triangle_it_left() {
    let mut bodies = Bodies::new();
    let mut faults = Vec::new();
    for (scene, start) in cases() {
        let name = &scene.name;
        let offsets = [Offset::OfTriangle, Offset::OfScene, Offset::None];
        let [moved, by_scene, unmoved] = returned_of(&mut bodies, &scene, start, offsets);
        println!("{name:24} {RAYS} rays met what they left: {moved:?}, {by_scene:?}, without the offset {unmoved:?}");
        if moved.iter().chain(&by_scene).any(|&returned| returned > 0) {
            faults.push(format!("{name}: {moved:?}, {by_scene:?} with offsets of the scene's size"));
        }
        if unmoved.iter().any(|&returned| returned <= RAYS / 200) {
            faults.push(format!("{name}: {unmoved:?} without the offset"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// As far as loading leaves a mesh from its origin, f32 still knows where the surface is; not so at a thousand times that.
/// Its triangles' own reach, which has the way to the origin and back in it, makes up for that.
#[test]
fn a_mesh_far_from_its_origin_is_lost_on_f32() {
    let scene = off_its_origin(DVec3::new(2e3, -2e3, 2e3));
    let offsets = [Offset::OfScene, Offset::OfTriangle];
    let [by_scene, moved] = returned_of(&mut Bodies::new(), &scene, Start::Seen, offsets);
    assert!(by_scene.iter().all(|&returned| returned > RAYS / 60), "{by_scene:?}");
    assert!(moved.iter().all(|&returned| returned == 0), "{moved:?}");
}

/// What is known of t on a needle is less than how far the ray was moved; without asking for more than that, one ray in two
/// hundred meets its own needle.
#[test]
fn no_ray_meets_the_needle_it_left() {
    let scene = scenes::alone("needles", meshes::needles(2_000));
    let center = scene.bounds().expect("a box").center();
    let world = World::new(&scene, center);
    let (rays, left) = leaving(&scene, &world, center, Start::Seen, Offset::OfTriangle);
    let returned = |mut tracer: BvhTracer| returned(&world, &tracer.ask(&scene, &rays), &left);
    assert_eq!(returned(BvhTracer::unchanged()), 0);
    let unaware = returned(BvhTracer::changed("t > max(t_min, t_error)", "t > t_min"));
    println!("{unaware} of {RAYS} rays meet their own needle");
    assert!(unaware > 30, "{unaware}");
}

/// Triangles of all sizes down to 1e-6 in one plane, around a point of it: what a ray leaves has larger neighbours, and it
/// meets none of them either.
#[test]
fn no_ray_meets_what_is_beside_the_triangle_it_left() {
    let mut bodies = Bodies::new();
    for (name, place) in [
        ("turned", DAffine3::from_quat(turn())),
        ("moved", DAffine3::from_scale_rotation_translation(DVec3::splat(0.3), turn(), DVec3::new(1e-3, 2e-3, -1e-3))),
    ] {
        let scene = scenes::of(name, vec![meshes::ever_smaller_squares(20)], &[(0, place)]);
        let mut renderers = bodies.open(&scene);
        let center = renderers[0].scene_center();
        let world = World::new(&scene, center);
        let [moved, unmoved] = [Offset::OfTriangle, Offset::None].map(|offset| {
            let (rays, _) = leaving(&scene, &world, center, Start::Seen, offset);
            let met = |said: &Vec<Said>| said.iter().filter(|said| said.closest.blocked != 0).count();
            bodies.ask(&mut renderers, &rays, 0).iter().map(|asked| met(&asked.said)).collect::<Vec<_>>()
        });
        println!("{name}: {moved:?} of {RAYS} rays met their plane, without the offset {unmoved:?}");
        assert!(moved.iter().all(|&met| met == 0), "{name}: {moved:?}");
        assert!(unmoved.iter().all(|&met| met > RAYS / 200), "{name}: {unmoved:?} without the offset");
    }
}

/// A ray back along the normal meets what it left after exactly the offset, here in a scene of half extent 1: the least for
/// a caller who knows no reach, and ever less for smaller ones.
#[test]
fn the_offset_stays_small_beside_the_scene_and_the_reach() {
    let mut bodies = Bodies::new();
    let mut renderers = bodies.open(&scenes::alone("floor", meshes::grid(1)));
    let two = |power: i32| 2.0f32.powi(power);
    let cases = [
        (0.01, 0.0, two(-17)..=two(-17)),
        (0.2, 0.0, two(-17)..=two(-17)),
        (0.5, 0.0, two(-16)..=two(-16)),
        (0.99, 0.0, two(-16)..=two(-15)),
        (0.99, 0.25, two(-16)..=two(-15)),
        (0.01, 3.0, two(-14)..=two(-14)),
        (two(-21), two(-20), two(-35)..=two(-35)),
        (1e-3, 1e-9, two(-26)..=two(-25)),
    ];
    let rays = cases.each_ref().map(|&(x, reach, _)| {
        let down = ray(f64::from(x) * DVec3::new(1.0, 0.01, 0.0), -DVec3::Z);
        Ray { normal: [0.0, 0.0, 1.0], reach, ..down }
    });
    for asked in bodies.ask(&mut renderers, &rays, 0) {
        for (Said { closest, .. }, (x, reach, lift)) in asked.said.iter().zip(&cases) {
            let met = closest.blocked != 0 && lift.contains(&closest.t);
            assert!(met, "{:?} at {x}, reach {reach}: {closest:?}", asked.of);
        }
    }
}
