//! Rays that leave a surface do not meet the triangle they left, whatever its size, slope and place.

use crate::shapes::{self, Mesh, Random};
use crate::trace::{Ray, Tracer, scene};
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// The power of two that everything fits into, as the renderer finds it.
fn scene_unit(mesh: &Mesh, instances: &[(usize, DAffine3)]) -> f64 {
    let corners = (0..mesh.triangles()).flat_map(|triangle| mesh.corners(triangle));
    let reach = corners.flat_map(|corner| instances.iter().map(move |(_, map)| map.transform_point3(corner)));
    reach.map(|point| point.abs().max_element()).fold(0.0, f64::max).log2().ceil().exp2()
}

/// The position as the surface pass finds it: weighted corners, each moved to scene space by an f32 map.
fn seen_position(corners: [DVec3; 3], map: DAffine3, weights: [f32; 3]) -> [f32; 3] {
    let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation].map(|c| c.as_vec3());
    let [a, b, c] = corners.map(|corner| {
        let corner = corner.as_vec3();
        ((columns[0] * corner.x + columns[1] * corner.y) + columns[2] * corner.z) + columns[3]
    });
    ((a + weights[1] * (b - a)) + weights[2] * (c - a)).to_array()
}

/// Rays from points of triangles into the hemisphere of their normal; how many meet the triangle they left.
fn self_hits(tracer: &mut Tracer, mesh: &Mesh, instances: &[(usize, DAffine3)], count: usize) -> usize {
    let mut random = Random::new(13);
    let unit = scene_unit(mesh, instances) as f32;
    let mut left = Vec::new();
    let mut rays = Vec::new();
    while rays.len() < count {
        let [instance, triangle] = [instances.len(), mesh.triangles()].map(|count| random.below(count));
        let map = instances[instance].1;
        let corners = mesh.corners(triangle);
        let [a, b, c] = corners.map(|corner| map.transform_point3(corner));
        let side = if random.unit() < 0.5 { 1.0 } else { -1.0 };
        let normal = side * (b - a).cross(c - a).normalize();
        let direction = random.direction();
        let direction = if direction.dot(normal) < 0.0 { -direction } else { direction };
        let (u, v) = (random.unit().sqrt(), random.unit());
        let weights = [1.0 - u, u * (1.0 - v), u * v].map(|weight| weight as f32);
        let origin = seen_position(corners, map, weights);
        rays.push(Ray {
            origin,
            normal: normal.as_vec3().to_array(),
            scene_unit: unit,
            ..Ray::new(DVec3::ZERO, direction)
        });
        left.push([instance as u32, triangle as u32]);
    }
    let answers = tracer.trace(&scene(mesh, instances), &rays);
    let pairs = answers.iter().zip(&left);
    pairs.filter(|(answer, from)| answer.hit() && [answer.instance, answer.triangle] == **from).count()
}

fn soup() -> Mesh {
    shapes::random_triangles(2_000, 0.1, 17)
}

#[test]
fn no_ray_meets_the_triangle_it_left_at_any_scale() {
    let mut tracer = Tracer::new();
    for scale in [1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6] {
        let mesh = soup().map(|point| scale * point);
        assert_eq!(self_hits(&mut tracer, &mesh, &[(0, DAffine3::IDENTITY)], 40_000), 0, "at scale {scale}");
    }
}

/// Needles of 1 : 25,000. What is known of t on one of them is less than how far the ray was moved; without asking for
/// more than that, one ray in two hundred meets its own needle.
#[test]
fn no_ray_meets_the_needle_it_left() {
    let mut random = Random::new(5);
    let needles = Mesh::soup((0..2_000).map(|_| {
        let (at, along, across) = (random.point(), random.direction(), random.direction());
        [at, at + 0.5 * along, at + 0.25 * along + 2e-5 * across]
    }));
    let here = [(0, DAffine3::IDENTITY)];
    assert_eq!(self_hits(&mut Tracer::new(), &needles, &here, 60_000), 0);
    let mut unaware = Tracer::with_change("t > max(t_min, t_error)", "t > t_min");
    assert!(self_hits(&mut unaware, &needles, &here, 60_000) > 30);
}

#[test]
fn no_ray_meets_the_triangle_it_left_in_instances_of_any_shape() {
    let mut tracer = Tracer::new();
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
    let flat = DAffine3::from_quat(turn) * DAffine3::from_scale(DVec3::new(1e3, -1e-3, 1.0));
    let skewed =
        DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.7, 0.2, 0.1), DVec3::new(0.0, 5.0, -30.0)));
    let flung = DAffine3::from_scale_rotation_translation(DVec3::splat(0.01), turn, DVec3::new(50.0, -20.0, 70.0));
    let places =
        [vec![(0, flat)], vec![(0, skewed)], vec![(0, flung), (0, DAffine3::IDENTITY)], shapes::twelve_places()];
    for instances in places {
        assert_eq!(self_hits(&mut tracer, &soup(), &instances, 40_000), 0, "{instances:?}");
    }
}

/// A mesh twice its size from its origin, as far as loading leaves one; at a thousand times, f32 no longer knows where the
/// surface is.
#[test]
fn no_ray_meets_the_triangle_it_left_in_a_mesh_off_its_origin() {
    let mut tracer = Tracer::new();
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
    let mut at = |away: DVec3| {
        let back = DAffine3::from_quat(turn) * DAffine3::from_translation(-away);
        self_hits(&mut tracer, &soup().map(|point| point + away), &[(0, back)], 60_000)
    };
    assert_eq!(at(DVec3::new(4.0, -4.0, 4.0)), 0);
    assert!(at(DVec3::new(2e3, -2e3, 2e3)) > 1_000);
}

/// The way a point is moved, over the scene's size.
#[test]
fn the_offset_stays_small_beside_the_scene() {
    // A ray back along the normal meets what it left after exactly the offset.
    let floor = Mesh::soup([[DVec3::new(-1.0, 0.0, -1.0), DVec3::new(3.0, 0.0, -1.0), DVec3::new(-1.0, 0.0, 3.0)]]);
    let rays: Vec<Ray> = [0.0, 0.2, 0.5, 0.99]
        .map(|x| Ray { normal: [0.0, 1.0, 0.0], scene_unit: 1.0, ..Ray::new(DVec3::new(x, 0.0, 0.0), -DVec3::Y) })
        .to_vec();
    for answer in Tracer::new().trace(&scene(&floor, &[(0, DAffine3::IDENTITY)]), &rays) {
        let lift = f64::from(answer.t);
        assert!(answer.hit() && (2.0f64.powi(-17)..=2.0f64.powi(-15)).contains(&lift), "{answer:?}");
    }
}
