//! No ray slips out between the triangles of a closed mesh, nor through a floor that it starts close to.
//!
//! A million rays a run of the test; `MICA_SEAM_RAYS=100000000` asks for as many as one likes.

use crate::bodies::{Bodies, Said};
use crate::bvh_tracer::BvhTracer;
use crate::mesh_hierarchy::built;
use crate::meshes::{self, Mesh};
use crate::random::Random;
use crate::rays::{many, ray, within};
use crate::scenes;
use crate::truth::World;
use glam::{DAffine3, DQuat, DVec3};
use mica_render::OcclusionBackend;
use mica_render::scene::Scene;
use mica_render::scene::bvh::SceneBvh;
use mica_shaders::types::Ray;

/// Rays a frame.
const BATCH: usize = 1 << 17;

/// A closed mesh that can be seen whole from its middle, and where it is in scene space.
struct Closed {
    name: &'static str,
    scene: Scene,
    mesh: Mesh,
    middle: DVec3,
    places: Vec<DAffine3>,
    /// Whether places next to its surface are surely inside: not where f32 cannot tell them apart.
    fine: bool,
    /// The share of the rays that Mesa 25.0.7's lavapipe may lose by ray query, half as much again as it does. It tests
    /// boxes without room for rounding: rays exactly at a corner, where the boxes of all its triangles end, get lost.
    lost_by_lavapipe: f64,
}

fn closed() -> Vec<Closed> {
    let turned = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, -0.7, 1.5),
        DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0),
        DVec3::new(10.0, 20.0, -30.0),
    );
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let stretched = DAffine3::from_scale(DVec3::new(0.02, 1.0, 30.0));
    let sphere = || meshes::bumpy_icosphere(3);
    let far = |name, distance: DVec3| {
        // The same on the other side, so that scene space has its origin in between.
        let mesh = sphere().map(|point| point + distance);
        let there = DAffine3::from_translation(-2.0 * distance);
        Closed { fine: false, ..placed(name, mesh, distance, vec![DAffine3::IDENTITY, there], 0.0) }
    };
    vec![
        placed("sphere", sphere(), DVec3::ZERO, vec![DAffine3::IDENTITY], 0.0045),
        placed("cube", meshes::cube(), DVec3::ZERO, vec![DAffine3::IDENTITY], 0.017),
        placed("mirrored", sphere(), DVec3::ZERO, vec![mirrored], 0.0045),
        placed("stretched", sphere(), DVec3::ZERO, vec![stretched], 0.0015),
        placed("turned and mirrored", sphere(), DVec3::ZERO, vec![turned, turned.inverse()], 1e-5),
        far("around 1e3", DVec3::new(1e3, -2e3, 500.0)),
        far("around 1.5e5", DVec3::new(1.48e5, 1234.0, -2.23e5)),
    ]
}

fn placed(name: &'static str, mesh: Mesh, middle: DVec3, places: Vec<DAffine3>, lost_by_lavapipe: f64) -> Closed {
    let instances: Vec<(usize, DAffine3)> = places.iter().map(|&place| (0, place)).collect();
    let scene = scenes::of(name, vec![mesh.clone()], &instances);
    let to_scene = DAffine3::from_translation(-scene.bounds().expect("a box").center());
    let places = places.into_iter().map(|place| to_scene * place).collect();
    Closed { name, scene, mesh, middle, places, fine: true, lost_by_lavapipe }
}

impl Closed {
    /// Rays from inside at corners, along and across edges, at faces, from near and far. There is no way out.
    fn rays(&self, count: usize, seed: u64) -> Vec<Ray> {
        many(count, seed, |random, k| {
            let place = self.places[random.below(self.places.len())];
            let corners = self.mesh.corners(random.below(self.mesh.triangles()));
            let [a, b, c] = corners;
            let target = match k / 8 % 4 {
                0 => a,
                1 => (a + b) / 2.0,
                2 => a.lerp(b, random.unit()),
                _ => (a + b + c) / 3.0,
            };
            let (origin, target) = match k / 32 % 4 {
                // Across the whole of it, and just before the surface.
                2 if self.fine => (self.middle + 0.9 * (random_surface(self, random) - self.middle), target),
                3 if self.fine && k / 8 % 4 == 2 => (self.middle + 0.999 * (target - self.middle), target + (b - a)),
                3 if self.fine => {
                    let near = 10f64.powf(random.between(-5.0, -1.0));
                    (self.middle + (1.0 - near) * (target - self.middle), target)
                }
                _ => (self.middle + 0.3 * random.point(), target),
            };
            let [origin, target] = [origin, target].map(|point| place.transform_point3(point));
            // From where f32 puts it, towards the very corner.
            let origin = origin.as_vec3().as_dvec3();
            ray(origin, if k % 2 == 0 { target - origin } else { (target - origin).normalize() })
        })
    }
}

fn random_surface(closed: &Closed, random: &mut Random) -> DVec3 {
    let triangle = closed.mesh.corners(random.below(closed.mesh.triangles()));
    within(random, triangle)
}

fn missed(said: &[Said]) -> usize {
    said.iter().filter(|said| said.closest.blocked == 0 || said.any.is_some_and(|any| any.blocked == 0)).count()
}

#[test]
fn no_ray_slips_through_the_seams_of_a_closed_mesh() {
    let asked = std::env::var("MICA_SEAM_RAYS").ok();
    let all = asked.map_or(1_000_000, |count| count.parse::<usize>().expect("MICA_SEAM_RAYS is a number of rays"));
    let mut bodies = Bodies::new();
    let on_lavapipe = bodies.device_name().contains("llvmpipe");
    let cases = closed();
    let mut faults = Vec::new();
    for case in &cases {
        let mut renderers = bodies.open(&case.scene);
        let world = World::new(&case.scene, renderers[0].scene_center());
        let count = all.div_ceil(cases.len());
        let mut lost = vec![0; renderers.len()];
        for batch in 0..count.div_ceil(BATCH) {
            let rays = case.rays(BATCH.min(count - batch * BATCH), batch as u64);
            for (lost, asked) in lost.iter_mut().zip(bodies.ask(&mut renderers, &rays, rays.len() / 4)) {
                *lost += missed(&asked.said);
                let sure = rays
                    .iter()
                    .zip(&asked.said)
                    .find(|(ray, said)| said.closest.blocked == 0 && world.first_certain(ray, asked.of).is_finite());
                faults.extend(sure.map(|(ray, _)| format!("{}: {} lost {ray:?}", case.name, asked.of.name())));
            }
        }
        // By any other driver, and by the hierarchy, none.
        let most = if on_lavapipe { (case.lost_by_lavapipe * count as f64).ceil() as usize } else { 0 };
        println!(
            "{:20} {count} rays, lost by {:?}: {lost:?}, by ray query {most} at most",
            case.name,
            bodies.backends()
        );
        for (&of, &lost) in bodies.backends().iter().zip(&lost) {
            if lost > if of == OcclusionBackend::Bvh { 0 } else { most } {
                faults.push(format!("{}: {} lost {lost} of {count} rays", case.name, of.name()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The test above notices a triangle without its own edges, and boxes with no room for rounding.
#[test]
fn rays_slip_through_once_edges_or_boxes_are_open() {
    let case = closed().swap_remove(0);
    let rays = case.rays(40_000, 0);
    let edges = "min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0";
    let open = missed(&BvhTracer::changed(edges, &edges.replace('=', "")).ask(&case.scene, &rays));
    assert!(open > 100, "{open} rays slipped through");
    let tight = missed(&BvhTracer::changed("* 1.000002", "* 0.999998").ask(&case.scene, &rays));
    assert!(tight > 0, "no ray slipped through");
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
        let through = ray(seam + distance * side, -side);
        // Not along the floor, and not through its rim.
        let in_floor = seam - seam[up] * DVec3::AXES[up];
        if side[up].abs() > 0.2 && in_floor.abs().max_element() < 3.5 {
            rays.push(through);
        }
    }
    rays
}

/// Of rays that start close to the seam they are aimed at rounding is large beside the way they go.
#[test]
fn no_ray_slips_through_a_seam_it_starts_close_to() {
    let missed = |tracer: &mut BvhTracer, up: usize| {
        let mesh = meshes::tiles(up);
        // Where it is, as its lines would be rounded anywhere else.
        let floor = SceneBvh::build(&[(0, DAffine3::IDENTITY)], &[built(&mesh)]).expect("a usable scene");
        missed(&tracer.ask_of(&floor, &rays_through_floor(&mesh, up, 100_000)))
    };
    let mut tracer = BvhTracer::unchanged();
    for up in 0..3 {
        assert_eq!(missed(&mut tracer, up), 0, "across axis {up}");
    }
    let mut tight = BvhTracer::changed("* 1.000002", "* 0.99999");
    assert!(missed(&mut tight, 0) > 0, "boxes without room let rays through");
}
