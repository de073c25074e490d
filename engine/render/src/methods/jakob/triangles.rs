//! The table of spherical triangles that the hierarchy of Jakob et al. 2014 divides directions by: where each lies, its
//! children, and the chance that a flake of a triangle is in each of them (engine/design/0008-tree-of-jakob.md).

use bytemuck::Zeroable;
use glam::DVec3;
use mica_shaders::types::JakobTriangle;
use std::f64::consts::{FRAC_PI_2, PI};

/// Level of the smallest triangles there may be; octants are on level 1.
const LAST_LEVEL: u32 = 15;
/// How far the density may be from linear along an edge, relative to the geometric mean of the density there and at +Z.
const TOLERANCE: f64 = 0.005;
/// Room in the cone of a triangle for corners rounded to f32 and for normals computed from them.
const CHORD_MARGIN: f64 = 1e-6;
/// Nodes of a quadrature along an axis.
const NODES: usize = 6;
/// Relative error at which a quadrature is not refined any more, and the mass that is nothing.
const PRECISION: (f64, f64) = (1e-10, 1e-24);
/// Refinements of a quadrature at most.
const REFINEMENTS: u32 = 12;

/// The table of one roughness, as it lies in the GPU's memory.
pub struct JakobTable {
    /// The hemisphere, its octants, and the children of all that are divided, four by four, in the order of their parents.
    pub triangles: Vec<JakobTriangle>,
    /// The integral of D over the hemisphere, D normalised by that of D(m) (m.n).
    pub density_integral: f64,
}

/// A triangle while the table is made.
struct Draft {
    corners: [DVec3; 3],
    id: u32,
    level: u32,
    /// Index of the first of its four children; 0 for a leaf.
    first_child: usize,
    /// The integral of D over it.
    mass: f64,
}

impl JakobTable {
    /// The table for Beckmann normals of roughness `alpha`.
    pub fn new(alpha: f64) -> Self {
        let density = Density { alpha };
        let mut drafts = vec![Draft { corners: [DVec3::ZERO; 3], id: 1, level: 0, first_child: 1, mass: 0.0 }];
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
        for octant in 0..4 {
            let corners = [DVec3::Z, axes[octant], axes[(octant + 1) % 4]];
            drafts.push(Draft { corners, id: 2 + octant as u32, level: 1, first_child: 0, mass: 0.0 });
        }
        let mut at = 1;
        while at < drafts.len() {
            let Draft { corners, id, level, .. } = drafts[at];
            if level < LAST_LEVEL && !density.is_nearly_linear(corners) {
                drafts[at].first_child = drafts.len();
                for (child, corners) in children(corners).into_iter().enumerate() {
                    let id = 4 * id + child as u32 - 2;
                    drafts.push(Draft { corners, id, level: level + 1, first_child: 0, mass: 0.0 });
                }
            } else {
                drafts[at].mass = density.over(corners);
            }
            at += 1;
        }
        // Children lie behind their parents.
        for at in (0..drafts.len()).rev() {
            let first = drafts[at].first_child;
            if first != 0 {
                drafts[at].mass = drafts[first..first + 4].iter().map(|child| child.mass).sum();
            }
        }
        let triangles = drafts.iter().map(|draft| entry(draft, &drafts, &density)).collect();
        Self { triangles, density_integral: drafts[0].mass }
    }
}

fn entry(draft: &Draft, drafts: &[Draft], density: &Density) -> JakobTriangle {
    let [v0, v1, v2] = draft.corners;
    let hemisphere = draft.level == 0;
    let axis = if hemisphere { DVec3::Z } else { (v0 + v1 + v2).normalize() };
    let rim = if hemisphere { DVec3::X } else { v0 };
    let radius = [rim, v1, v2].into_iter().filter(|v| *v != DVec3::ZERO).map(|v| v.distance(axis)).fold(0.0, f64::max);
    let splits = if draft.first_child == 0 {
        // The density is linear in a leaf, through its corners: how much of it each corner brings.
        let [d0, d1, d2] = draft.corners.map(|corner| density.relative(corner));
        if d0 + d1 + d2 > 0.0 {
            [fraction(d0, d0 + d1 + d2), fraction(d1, d1 + d2), 0]
        } else {
            [fraction(1.0, 3.0), fraction(1.0, 2.0), 0]
        }
    } else {
        let [m0, m1, m2, m3] = [0, 1, 2, 3].map(|child| drafts[draft.first_child + child].mass);
        [fraction(m0, draft.mass), fraction(m1, m1 + m2 + m3), fraction(m2, m2 + m3)]
    };
    JakobTriangle {
        v0: v0.as_vec3().to_array(),
        id: draft.id,
        v1: v1.as_vec3().to_array(),
        first_child: draft.first_child as u32,
        v2: v2.as_vec3().to_array(),
        solid_angle: (if hemisphere { 2.0 * PI } else { solid_angle(draft.corners) }) as f32,
        axis: axis.as_vec3().to_array(),
        chord_radius: (radius + CHORD_MARGIN) as f32,
        splits,
        ..JakobTriangle::zeroed()
    }
}

/// part / whole in units of 2^-32, the largest of which means all; nothing of nothing is 0.
fn fraction(part: f64, whole: f64) -> u32 {
    // A conversion from f64 ends at the largest number.
    if whole > 0.0 { (part / whole * 4_294_967_296.0).round() as u32 } else { 0 }
}

/// The three corner triangles and the middle one, which is the first.
fn children([v0, v1, v2]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let [s0, s1, s2] = midpoints([v0, v1, v2]);
    [[s0, s1, s2], [v0, s0, s2], [s0, v1, s1], [s2, s1, v2]]
}

fn midpoints([v0, v1, v2]: [DVec3; 3]) -> [DVec3; 3] {
    [(v0 + v1).normalize(), (v1 + v2).normalize(), (v2 + v0).normalize()]
}

/// Of a spherical triangle (Van Oosterom and Strackee 1983).
fn solid_angle([v0, v1, v2]: [DVec3; 3]) -> f64 {
    2.0 * v0.dot(v1.cross(v2)).atan2(1.0 + v0.dot(v1) + v1.dot(v2) + v2.dot(v0))
}

/// Beckmann's distribution of normals about +Z.
struct Density {
    alpha: f64,
}

impl Density {
    /// D over its value at +Z: exp(-tan^2 / alpha^2) / cos^4.
    fn relative(&self, m: DVec3) -> f64 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let cos2 = m.z * m.z;
        (-(m.x * m.x + m.y * m.y) / (cos2 * self.alpha * self.alpha)).exp() / (cos2 * cos2)
    }

    /// Whether the density at the middle of each edge is as good as the mean of its ends.
    fn is_nearly_linear(&self, corners: [DVec3; 3]) -> bool {
        let ends = corners.map(|corner| self.relative(corner));
        let middles = midpoints(corners).map(|middle| self.relative(middle));
        let greatest = ends.into_iter().chain(middles).fold(0.0, f64::max);
        let off = |edge: usize| (middles[edge] - 0.5 * (ends[edge] + ends[(edge + 1) % 3])).abs();
        (0..3).all(|edge| off(edge) <= TOLERANCE * greatest.sqrt())
    }

    /// The integral of D over a spherical triangle.
    fn over(&self, corners: [DVec3; 3]) -> f64 {
        let rule = gauss_legendre();
        self.refined(corners, self.quadrature(corners, &rule), &rule, REFINEMENTS) / (PI * self.alpha * self.alpha)
    }

    fn refined(&self, corners: [DVec3; 3], coarse: f64, rule: &[(f64, f64); NODES], left: u32) -> f64 {
        let parts = children(corners).map(|child| (child, self.quadrature(child, rule)));
        let fine: f64 = parts.iter().map(|(_, part)| part).sum();
        let (relative, nothing) = PRECISION;
        if left == 0 || (fine - coarse).abs() <= relative * fine + nothing {
            return fine;
        }
        parts.into_iter().map(|(child, part)| self.refined(child, part, rule, left - 1)).sum()
    }

    /// Over the flat triangle, a square folded to it: a point m of it stands for m.(plane's normal) / |m|^3 of its area.
    fn quadrature(&self, [v0, v1, v2]: [DVec3; 3], rule: &[(f64, f64); NODES]) -> f64 {
        let volume = v0.dot((v1 - v0).cross(v2 - v0)).abs();
        let mut sum = 0.0;
        for (x, weight_x) in rule {
            for (y, weight_y) in rule {
                let m = v0 + *x * (v1 - v0) + *y * (1.0 - x) * (v2 - v0);
                let squared = m.length_squared();
                // Slopes are the same at any length; cosines are not.
                let cos_scale = squared * squared;
                sum += weight_x * weight_y * (1.0 - x) * self.relative(m) * cos_scale / (squared * squared.sqrt());
            }
        }
        sum * volume
    }
}

/// Nodes and weights of Gauss and Legendre on [0, 1], by Newton's method from Tricomi's approximation.
fn gauss_legendre() -> [(f64, f64); NODES] {
    let count = NODES as f64;
    std::array::from_fn(|k| {
        let mut x = ((k as f64 + 0.75) / (count + 0.5) * 2.0 * FRAC_PI_2).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for degree in 2..=NODES {
                let degree = degree as f64;
                (before, value) = (value, ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * before) / degree);
            }
            slope = count * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALPHAS: [f64; 7] = [0.001, 0.02, 0.1, 0.3, 0.5, 0.8, 1.0];

    /// S_D by the ring integral of exp(-t/alpha^2) (1 + t)^(1/2) / alpha^2 over t = tan^2, of the trapezium rule on
    /// t = exp(s - exp(-s)), which converges beyond f64 for such functions.
    fn density_integral(alpha: f64) -> f64 {
        let at = |s: f64| {
            let t = (s - (-s).exp()).exp();
            (-t / (alpha * alpha)).exp() * (1.0 + t).sqrt() / (alpha * alpha) * t * (1.0 + (-s).exp())
        };
        let step = 1.0 / 64.0;
        step * (-700..=700).map(|k| at(f64::from(k) * step)).sum::<f64>()
    }

    #[test]
    fn the_table_holds_the_whole_distribution() {
        for alpha in ALPHAS {
            let table = JakobTable::new(alpha);
            let expected = density_integral(alpha);
            let leaves = table.triangles.iter().filter(|triangle| triangle.first_child == 0).count();
            println!("alpha {alpha}: {} triangles, {leaves} leaves, S_D {expected}", table.triangles.len());
            assert!((table.density_integral / expected - 1.0).abs() < 1e-8, "{} {expected}", table.density_integral);
            assert!((1_000..40_000).contains(&table.triangles.len()), "{}", table.triangles.len());
        }
    }

    #[test]
    fn children_fill_their_parent_and_lie_behind_it() {
        for alpha in ALPHAS {
            let JakobTable { triangles, .. } = JakobTable::new(alpha);
            for (at, parent) in triangles.iter().enumerate().filter(|(_, triangle)| triangle.first_child != 0) {
                let first = parent.first_child as usize;
                assert!(first > at && first % 4 == 1, "children of {at} begin at {first}");
                let four = &triangles[first..first + 4];
                let sum: f64 = four.iter().map(|child| f64::from(child.solid_angle)).sum();
                assert!((sum / f64::from(parent.solid_angle) - 1.0).abs() < 1e-6, "{sum} of {parent:?}");
                for (child, triangle) in four.iter().enumerate() {
                    assert_eq!(triangle.id, 4 * parent.id + child as u32 - 2);
                }
            }
        }
    }

    #[test]
    fn every_corner_lies_in_the_cone_of_its_triangle() {
        let JakobTable { triangles, .. } = JakobTable::new(0.1);
        for triangle in &triangles[1..] {
            let axis = DVec3::from(triangle.axis.map(f64::from));
            for corner in [triangle.v0, triangle.v1, triangle.v2] {
                let chord = DVec3::from(corner.map(f64::from)).distance(axis);
                assert!(chord <= f64::from(triangle.chord_radius), "{triangle:?}");
            }
        }
    }
}
