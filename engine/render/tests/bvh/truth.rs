//! Every ray against every triangle in f64, with what rounding in f32 may change.

use crate::shapes::Mesh;
use crate::trace::Ray;
use glam::{DAffine3, DVec3};

/// Roundings of f32 in the position of an edge as seen along a ray: two of each corner against the origin, three in the
/// shear, as many again for the ray's transform, two in the edge function, and about as much in reserve.
const ROUNDINGS: f64 = 16.0;

/// One triangle along one ray.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Along the ray's direction, to the triangle's plane.
    pub t: f64,
    /// What rounding may move it by.
    pub t_error: f64,
    /// Distance inside the nearest edge, seen along the ray, over what rounding may move that edge by: above 1 surely
    /// inside, below -1 surely outside.
    pub margin: f64,
    /// What rounding may move the crossing by, within the triangle.
    pub place_error: f64,
    /// Weights of the second and the third corner.
    pub barycentrics: [f64; 2],
}

/// Where a ray crosses the plane of a triangle; `None` for one seen edge-on or without area. Moeller and Trumbore 1997.
pub fn crossing(corners: [DVec3; 3], ray: &Ray) -> Option<Crossing> {
    let origin = DVec3::from(ray.origin.map(f64::from));
    let direction = DVec3::from(ray.direction.map(f64::from));
    let [a, b, c] = corners;
    let across = direction.cross(c - a);
    let determinant = (b - a).dot(across);
    if determinant == 0.0 {
        return None;
    }
    let from_a = origin - a;
    let second = from_a.dot(across) / determinant;
    let turned = from_a.cross(b - a);
    let third = direction.dot(turned) / determinant;
    let t = (c - a).dot(turned) / determinant;

    let unit = direction.normalize();
    let seen = |offset: DVec3| offset.reject_from_normalized(unit).length();
    let doubled_area = (determinant / direction.length()).abs();
    let rounding = ROUNDINGS * 0.5 * f64::from(f32::EPSILON);
    let far = corners.iter().map(|corner| (corner.abs() + origin.abs()).max_element()).fold(0.0, f64::max);
    let place = a + second * (b - a) + third * (c - a);
    let mut crossing = Crossing {
        t,
        t_error: 1e-6 * t.abs(),
        margin: f64::INFINITY,
        place_error: rounding * far,
        barycentrics: [second, third],
    };
    let opposite = [(1.0 - second - third, a, b, c), (second, b, c, a), (third, c, a, b)];
    for (weight, corner, from, to) in opposite {
        // Seen along the ray, a corner's weight is the distance to the edge opposite over the corner's height above it.
        // Coordinates that are off move that edge; so do the two products of its function, the more the shorter it is.
        let length = seen(to - from);
        let height = doubled_area / length;
        let error = rounding * (far + seen(from - origin) * seen(to - origin) / length);
        crossing.margin = crossing.margin.min(weight * height / error);
        // With its weight, a corner's pull on the crossing changes; t is read off one axis, at best 1/sqrt(3) of the way.
        let pull = error / height * (corner - place);
        crossing.place_error += pull.length();
        crossing.t_error += 3.0f64.sqrt() * pull.length() / direction.length();
    }
    Some(crossing)
}

/// What is certain about a ray whatever f32 rounds.
#[derive(Debug)]
pub struct Truth {
    /// The ray must meet something.
    pub hit: bool,
    /// The ray must meet nothing.
    pub miss: bool,
    /// No hit is nearer than this.
    pub first_possible: f64,
    /// A hit is at least as near as this.
    pub first_certain: f64,
}

/// All triangles of placements of one mesh, in scene space.
pub struct World {
    triangles: Vec<[DVec3; 3]>,
    /// Around each triangle: a centre and a radius, with room for every error.
    spheres: Vec<(DVec3, f64)>,
    per_instance: usize,
}

impl World {
    pub fn new(mesh: &Mesh, instances: &[(usize, DAffine3)]) -> Self {
        let triangles: Vec<[DVec3; 3]> = instances
            .iter()
            .flat_map(|(_, scene_from_local)| {
                let place = |triangle| mesh.corners(triangle).map(|corner| scene_from_local.transform_point3(corner));
                (0..mesh.triangles()).map(place)
            })
            .collect();
        let sphere = |corners: &[DVec3; 3]| {
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            (centre, 0.05 + corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max))
        };
        let spheres = triangles.iter().map(sphere).collect();
        Self { triangles, spheres, per_instance: mesh.triangles() }
    }

    pub fn corners(&self, instance: u32, triangle: u32) -> [DVec3; 3] {
        self.triangles[instance as usize * self.per_instance + triangle as usize]
    }

    /// What all triangles together say of a ray.
    pub fn truth(&self, ray: &Ray) -> Truth {
        let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
        let mut truth = Truth { hit: false, miss: true, first_possible: f64::INFINITY, first_certain: f64::INFINITY };
        let origin = DVec3::from(ray.origin.map(f64::from));
        let unit = DVec3::from(ray.direction.map(f64::from)).normalize();
        for (&corners, (centre, radius)) in self.triangles.iter().zip(&self.spheres) {
            if (centre - origin).cross(unit).length_squared() > radius * radius {
                continue;
            }
            let Some(found) = crossing(corners, ray) else { continue };
            let (early, late) = (found.t - found.t_error, found.t + found.t_error);
            if found.margin >= -1.0 && late > t_min && early < t_max {
                truth.miss = false;
                truth.first_possible = truth.first_possible.min(early);
            }
            if found.margin > 1.0 && early > t_min && late < t_max {
                truth.hit = true;
                truth.first_certain = truth.first_certain.min(late);
            }
        }
        truth
    }
}
