//! Where a ray crosses a triangle, in f64.

use crate::trace::Ray;
use glam::DVec3;

/// Where a ray crosses the plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Along the ray's direction.
    pub t: f64,
    /// Weights of the second and the third corner.
    pub barycentrics: [f64; 2],
    /// The least of all three weights: negative outside.
    pub inside: f64,
}

/// Moeller and Trumbore 1997; `None` for a triangle seen edge-on or without area.
pub fn crossing([a, b, c]: [DVec3; 3], ray: &Ray) -> Option<Crossing> {
    let [origin, direction] = [ray.origin, ray.direction].map(|vector| DVec3::from(vector.map(f64::from)));
    let across = direction.cross(c - a);
    let determinant = (b - a).dot(across);
    let from_a = origin - a;
    let turned = from_a.cross(b - a);
    let [second, third] = [from_a.dot(across) / determinant, direction.dot(turned) / determinant];
    let t = (c - a).dot(turned) / determinant;
    let inside = second.min(third).min(1.0 - second - third);
    (determinant != 0.0).then_some(Crossing { t, barycentrics: [second, third], inside })
}
