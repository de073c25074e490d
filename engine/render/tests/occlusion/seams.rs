//! No ray slips out between the triangles of a closed mesh.
//!
//! A million rays a run of the test; `MICA_SEAM_RAYS=100000000` asks for as many as one likes.

use crate::changed::Changed;
use crate::device::{Bodies, Said};
use crate::rays::{many, ray, within};
use crate::shapes::{self, Mesh, Random};
use crate::truth::World;
use crate::{meshes, scenes};
use glam::{DAffine3, DQuat, DVec3};
use mica_render::OcclusionBackend;
use mica_render::scene::Scene;
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
}

fn closed() -> Vec<Closed> {
    let turned = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, -0.7, 1.5),
        DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0),
        DVec3::new(10.0, 20.0, -30.0),
    );
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let stretched = DAffine3::from_scale(DVec3::new(0.02, 1.0, 30.0));
    let sphere = || shapes::bumpy_icosphere(3);
    let far = |name, distance: DVec3| {
        // The same on the other side, so that scene space has its origin in between.
        let mesh = sphere().map(|point| point + distance);
        let there = DAffine3::from_translation(-2.0 * distance);
        placed(name, mesh, distance, vec![DAffine3::IDENTITY, there], false)
    };
    vec![
        placed("sphere", sphere(), DVec3::ZERO, vec![DAffine3::IDENTITY], true),
        placed("cube", meshes::cube(), DVec3::ZERO, vec![DAffine3::IDENTITY], true),
        placed("mirrored", sphere(), DVec3::ZERO, vec![mirrored], true),
        placed("stretched", sphere(), DVec3::ZERO, vec![stretched], true),
        placed("turned and mirrored", sphere(), DVec3::ZERO, vec![turned, turned.inverse()], true),
        far("around 1e3", DVec3::new(1e3, -2e3, 500.0)),
        far("around 1.5e5", DVec3::new(1.48e5, 1234.0, -2.23e5)),
    ]
}

fn placed(name: &'static str, mesh: Mesh, middle: DVec3, places: Vec<DAffine3>, fine: bool) -> Closed {
    let instances: Vec<(usize, DAffine3)> = places.iter().map(|&place| (0, place)).collect();
    let scene = scenes::of(name, vec![mesh.clone()], &instances);
    let to_scene = DAffine3::from_translation(-scene.bounds().expect("a box").center());
    Closed { name, scene, mesh, middle, places: places.into_iter().map(|place| to_scene * place).collect(), fine }
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

/// The share of such rays that a driver may lose, though none that surely meets something. Mesa 25.0.7's lavapipe tests
/// boxes without room for rounding: of rays exactly at a corner, where the boxes of all its triangles end, it loses 1.4 %
/// in the sphere and 5 % in the cube, and hardly any at edges. Other drivers are expected to lose none.
fn forgiven(device: &str) -> f64 {
    if device.contains("llvmpipe") { 0.02 } else { 0.0 }
}

#[test]
fn no_ray_slips_through_the_seams_of_a_closed_mesh() {
    let asked = std::env::var("MICA_SEAM_RAYS").ok();
    let all = asked.map_or(1_000_000, |count| count.parse::<usize>().expect("MICA_SEAM_RAYS is a number of rays"));
    let mut bodies = Bodies::new();
    let forgiven = forgiven(&bodies.device_name());
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
        println!("{:20} {count} rays, lost by {:?}: {lost:?}", case.name, bodies.backends());
        for (&of, &lost) in bodies.backends().iter().zip(&lost) {
            let most = if of == OcclusionBackend::Bvh { 0.0 } else { forgiven * count as f64 };
            if lost as f64 > most {
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
    let open = missed(&Changed::new(edges, &edges.replace('=', "")).ask(&case.scene, &rays));
    assert!(open > 100, "{open} rays slipped through");
    let tight = missed(&Changed::new("* 1.000002", "* 0.999998").ask(&case.scene, &rays));
    assert!(tight > 0, "no ray slipped through");
}
