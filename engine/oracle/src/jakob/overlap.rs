//! How a node of the tree lies to a query: outside, inside or across it, and how much of it is inside.

use glam::{DVec2, DVec3};

use super::triangles::Triangle;
use crate::flake_set::{Footprint, is_lit};

/// How a set lies to a query. Either of the outer two is certain; `Partial` is everything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overlap {
    /// No member answers the query.
    Disjoint,
    /// Some may.
    Partial,
    /// All do.
    Inside,
}

/// The normals that reflect `i` to within gamma of `o`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// Unit direction of the light.
    pub i: DVec3,
    /// Unit direction of the view.
    pub o: DVec3,
    /// sin(gamma/2).
    pub sin_half: f64,
    /// cos(gamma/2).
    pub cos_half: f64,
}

/// What may be missing from i.m through rounding, with much to spare.
const SLACK: f64 = 1e-6;

impl Cone {
    /// The cone of half-angle `gamma_radians`.
    pub fn new(i: DVec3, o: DVec3, gamma_radians: f64) -> Self {
        let (sin_half, cos_half) = (gamma_radians / 2.0).sin_cos();
        Self { i, o, sin_half, cos_half }
    }

    /// Whether a normal, of any length, is in the set.
    pub fn lights(&self, normal: DVec3) -> bool {
        is_lit(normal, self.i, self.o, self.sin_half * self.sin_half)
    }

    /// Where the normals of a triangle lie. Turning a normal by b turns the reflection by at most 2 b, so those within
    /// b of the axis a reflect to within 2 b of r = 2 (i.a) a - i; angles are compared by their chords, which are 2
    /// sin(angle / 2). A normal must face the light besides, as its opposite reflects alike.
    pub fn overlap(&self, triangle: &Triangle) -> Overlap {
        let axis = vector(triangle.axis);
        let chord_radius = f64::from(triangle.chord_radius);
        let sin_b = chord_radius * (1.0 - chord_radius * chord_radius / 4.0).max(0.0).sqrt();
        let cos_b = 1.0 - chord_radius * chord_radius / 2.0;
        let facing = self.i.dot(axis);
        let chord = (2.0 * facing * axis - self.i).distance(self.o);
        // gamma/2 + b and gamma/2 - b; beyond a right angle the first reaches every direction.
        let bounded = self.cos_half * cos_b - self.sin_half * sin_b > 0.0;
        let outer = 2.0 * (self.sin_half * cos_b + self.cos_half * sin_b);
        let inner = 2.0 * (self.sin_half * cos_b - self.cos_half * sin_b);
        let away = cos_b > 0.0 && facing < -sin_b - SLACK;
        if away || bounded && chord > outer {
            Overlap::Disjoint
        } else if chord < inner && facing > sin_b + SLACK && cos_b > 0.0 {
            Overlap::Inside
        } else {
            Overlap::Partial
        }
    }

    /// The share of a leaf's flakes that are in the set, on the average; `None` where its plane does not cut the cone
    /// in an ellipse.
    ///
    /// With h ~ i + o, q ~ i - o and x ~ i x o, S = sin^2(gamma/2) and k = |i+o|^2/2 - 2 S, a normal m of any length
    /// is in the set when 2 (1 - S) (m.q)^2 + k (m.x)^2 <= 2 S (m.h)^2 and m.h > 0 (the paper's conic, by its
    /// eigenvectors). In the coordinates of the triangle's plane that is a conic. As in the paper it is mapped to the
    /// unit circle, where the overlap has a closed form; the density is linear there, so the overlap's centroid tells
    /// its mean.
    pub fn share_of(&self, leaf: &Triangle) -> Option<f64> {
        let corners = leaf.corners.map(vector);
        let s = self.sin_half * self.sin_half;
        let sum = self.i + self.o;
        let k = sum.length_squared() / 2.0 - 2.0 * s;
        if k <= 0.0 {
            return None;
        }
        let h = sum.normalize();
        let across = self.i - self.o - h * h.dot(self.i - self.o);
        let q = if across.length_squared() > 1e-24 { across.normalize() } else { h.any_orthonormal_vector() };
        let axes = [(h, -2.0 * s), (q, 2.0 * (1.0 - s)), (q.cross(h), k)];
        let [origin, e1, e2] = [corners[0], corners[1] - corners[0], corners[2] - corners[0]];
        // The form at origin + u e1 + v e2: uu u^2 + 2 uv u v + vv v^2 + 2 u0 u + 2 v0 v + constant.
        let form = |a: DVec3, b: DVec3| axes.iter().map(|(axis, value)| value * axis.dot(a) * axis.dot(b)).sum::<f64>();
        let (uu, uv, vv) = (form(e1, e1), form(e1, e2), form(e2, e2));
        let (u0, v0) = (form(origin, e1), form(origin, e2));
        let determinant = uu * vv - uv * uv;
        if uu <= 0.0 || determinant <= 1e-12 * uu * vv {
            return None;
        }
        let middle = DVec2::new(uv * v0 - vv * u0, uv * u0 - uu * v0) / determinant;
        let depth = -(form(origin, origin) + u0 * middle.x + v0 * middle.y);
        if depth <= 0.0 || h.dot(origin + middle.x * e1 + middle.y * e2) <= 0.0 {
            return Some(0.0);
        }
        // uu U^2 + 2 uv U V + vv V^2 = |(a U + b V, c V)|^2.
        let a = (uu / depth).sqrt();
        let (b, c) = (uv / (a * depth), (determinant / (uu * depth)).sqrt());
        let mapped = [DVec2::ZERO, DVec2::X, DVec2::Y].map(|corner| {
            let from_middle = corner - middle;
            DVec2::new(a * from_middle.x + b * from_middle.y, c * from_middle.y)
        });
        let overlap = overlap_with_unit_circle(mapped);
        if overlap.area == 0.0 {
            return Some(0.0);
        }
        // Back to the barycentrics of the overlap's centroid.
        let centroid = overlap.moment / overlap.area;
        let v = centroid.y / c;
        let place = middle + DVec2::new((centroid.x - b * v) / a, v);
        let weights = leaf.corner_weights();
        let density = 3.0 * (weights[0] * (1.0 - place.x - place.y) + weights[1] * place.x + weights[2] * place.y);
        Some((overlap.area.abs() / (a * c / 2.0) * density).clamp(0.0, 1.0))
    }
}

/// Where the flakes of the square node from `low` to `high` lie to a footprint. They keep half of 2^-32 of its side
/// from its edges, so half-open edges that run along the node's do not cut it.
pub(crate) fn node_overlap(footprint: &Footprint, [low, high]: [DVec2; 2]) -> Overlap {
    if !footprint.may_meet([low, high]) {
        return Overlap::Disjoint;
    }
    let inset = (high - low) * 0.5_f64.powi(34);
    let (low, high) = (low + inset, high - inset);
    let corners = [low, DVec2::new(high.x, low.y), DVec2::new(low.x, high.y), high];
    // The footprint is convex.
    if corners.into_iter().all(|corner| footprint.contains(corner)) { Overlap::Inside } else { Overlap::Partial }
}

/// A vector of the table.
pub(crate) fn vector(v: [f32; 3]) -> DVec3 {
    glam::Vec3::from_array(v).as_dvec3()
}

/// A signed area and its first moment, the integral of the place over it.
#[derive(Clone, Copy, Default)]
struct Moment {
    area: f64,
    moment: DVec2,
}

impl Moment {
    /// The triangle of the origin, `a` and `b`.
    fn flat(a: DVec2, b: DVec2) -> Self {
        let area = a.perp_dot(b) / 2.0;
        Self { area, moment: area * (a + b) / 3.0 }
    }

    /// The sector of the unit circle from the direction of `a` to that of `b`.
    fn sector(a: DVec2, b: DVec2) -> Self {
        let chord = b.normalize_or_zero() - a.normalize_or_zero();
        Self { area: a.perp_dot(b).atan2(a.dot(b)) / 2.0, moment: DVec2::new(chord.y, -chord.x) / 3.0 }
    }
}

impl std::ops::Add for Moment {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { area: self.area + other.area, moment: self.moment + other.moment }
    }
}

/// What a triangle shares with the unit circle about the origin, negative for corners in clockwise order.
fn overlap_with_unit_circle(corners: [DVec2; 3]) -> Moment {
    (0..3).map(|k| edge_overlap(corners[k], corners[(k + 1) % 3])).fold(Moment::default(), |sum, edge| sum + edge)
}

/// What the triangle of the origin and an edge shares with the unit circle: flat where the edge is within the circle,
/// a sector where it is outside.
fn edge_overlap(from: DVec2, to: DVec2) -> Moment {
    let along = to - from;
    // |from + t along| = 1.
    let (square, half) = (along.length_squared(), from.dot(along));
    let discriminant = half * half - square * (from.length_squared() - 1.0);
    if discriminant <= 0.0 || square == 0.0 {
        return Moment::sector(from, to);
    }
    let root = discriminant.sqrt();
    let (enter, leave) = ((-half - root) / square, (-half + root) / square);
    if enter >= 1.0 || leave <= 0.0 {
        return Moment::sector(from, to);
    }
    let (first, last) = (from + enter.max(0.0) * along, from + leave.min(1.0) * along);
    Moment::sector(from, first) + Moment::flat(first, last) + Moment::sector(last, to)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::jakob::TriangleTable;
    use crate::microfacet::{Microfacets, Ndf, SmithFit};

    fn uniforms(seed: u64) -> impl FnMut() -> f64 {
        let mut random = Pcg64::seed_from_u64(seed);
        move || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(theta: f64, phi: f64) -> DVec3 {
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    fn table(alpha: f64) -> TriangleTable {
        TriangleTable::new(&Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact).expect("a valid roughness"))
    }

    /// A point of the flat triangle, or one of its edges or corners now and then.
    fn place(unit: &mut impl FnMut() -> f64) -> [f64; 2] {
        let (mut u, mut v) = (unit(), unit());
        match (8.0 * unit()) as u32 {
            0 => v = 0.0,
            1 => v = 1.0 - u,
            2 => (u, v) = (u.round(), 0.0),
            _ if u + v > 1.0 => (u, v) = (1.0 - u, 1.0 - v),
            _ => {}
        }
        [u, v]
    }

    /// Cones about the triangle or beside it, many much narrower than it: the query inside the node is the case that
    /// is easily called disjoint.
    #[test]
    fn no_triangle_is_thought_inside_or_outside_when_it_is_not() {
        let (mut inside, mut disjoint, mut query_in_node, mut wrong_lit, mut wrong_dark) = (0, 0, 0, 0, 0);
        let mut unit = uniforms(11);
        for alpha in [0.02, 0.1, 0.5] {
            let table = table(alpha);
            for _ in 0..3000 {
                let at = (table.entries().len() as f64 * unit().powi(3)) as usize;
                let triangle = &table.entries()[at.max(1)];
                let [v0, v1, v2] = triangle.corners.map(vector);
                let h = {
                    let [u, v] = place(&mut unit);
                    let spread = 3.0 * f64::from(triangle.chord_radius) * unit().powi(2);
                    let aside = direction(PI * unit(), 2.0 * PI * unit()) * spread;
                    (v0 + u * (v1 - v0) + v * (v2 - v0) + aside).normalize()
                };
                let i = direction(1.6 * unit(), 2.0 * PI * unit());
                let o = 2.0 * i.dot(h) * h - i;
                let gamma = (10.0_f64.powf(-2.0 + 3.3 * unit())).to_radians();
                let cone = Cone::new(i, o, gamma);
                let overlap = cone.overlap(triangle);
                let (mut any, mut all) = (false, true);
                for _ in 0..64 {
                    let [u, v] = place(&mut unit);
                    let lit = is_lit(v0 + u * (v1 - v0) + v * (v2 - v0), i, o, (gamma / 2.0).sin().powi(2));
                    any |= lit;
                    all &= lit;
                }
                inside += i32::from(overlap == Overlap::Inside);
                disjoint += i32::from(overlap == Overlap::Disjoint);
                wrong_lit += i32::from(overlap == Overlap::Inside && !all);
                wrong_dark += i32::from(overlap == Overlap::Disjoint && any);
                if !any && cone.share_of(triangle).is_some_and(|share| share > 1e-9) {
                    query_in_node += 1;
                    assert_ne!(overlap, Overlap::Disjoint, "a query within {triangle:?}");
                }
            }
        }
        assert_eq!((wrong_lit, wrong_dark), (0, 0));
        assert!(inside > 500 && disjoint > 500 && query_in_node > 300, "{inside} {disjoint} {query_in_node}");
    }

    /// The exact test by chords against the paper's matrix: m' C m <= 0 with
    /// C = [(i.o + cos gamma) I - (i o' + o i')] / (1 - cos gamma), and m on the half vector's side.
    #[test]
    fn the_test_by_chords_is_the_conic_of_the_paper() {
        let mut unit = uniforms(12);
        let (mut lit, mut near) = (0, 0);
        for _ in 0..100_000 {
            let gamma = (0.5 + 9.5 * unit()).to_radians();
            let (i, o) = (direction(1.4 * unit(), 2.0 * PI * unit()), direction(1.4 * unit(), 2.0 * PI * unit()));
            let h = (i + o).normalize();
            let m = (h + direction(PI * unit(), 2.0 * PI * unit()) * gamma * unit()).normalize();
            let form =
                ((i.dot(o) + gamma.cos()) * m.length_squared() - 2.0 * i.dot(m) * o.dot(m)) / (1.0 - gamma.cos());
            let by_matrix = form <= 0.0 && m.dot(h) > 0.0;
            if form.abs() < 1e-9 {
                near += 1;
            } else {
                assert_eq!(is_lit(m, i, o, (gamma / 2.0).sin().powi(2)), by_matrix, "{m} {i} {o} {gamma}");
            }
            lit += i32::from(by_matrix);
        }
        assert!((20_000..80_000).contains(&lit) && near < 10, "{lit} {near}");
    }

    /// Against points drawn as flakes are: flat, by the spacings of sorted numbers, or linear towards any corner.
    #[test]
    fn the_share_of_a_leaf_is_that_of_random_flakes_in_it() {
        let mut unit = uniforms(13);
        let (mut between, mut none, mut uneven) = (0, 0, 0);
        let any = table(0.5).entries()[9];
        for _ in 0..400 {
            let corners = [0, 1, 2].map(|_| direction(0.8 * unit(), 2.0 * PI * unit()));
            let [v0, v1, v2] = corners;
            if (v1 - v0).cross(v2 - v0).length() < 0.05 {
                continue;
            }
            let i = direction(1.5 * unit(), 2.0 * PI * unit());
            let h = (v0 + v1 + v2 + direction(PI * unit(), 2.0 * PI * unit())).normalize();
            let (o, gamma) = (2.0 * i.dot(h) * h - i, 0.1 + unit());
            let splits = [(unit() * 4e9) as u32, (unit() * 4e9) as u32, 0];
            let leaf = Triangle { splits, corners: corners.map(|v| v.as_vec3().to_array()), ..any };
            let cone = Cone::new(i, o, gamma);
            let Some(share) = cone.share_of(&leaf) else {
                none += 1;
                continue;
            };
            let weights = leaf.corner_weights();
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let points = 4000;
            let (mut hits, mut even_hits) = (0.0, 0);
            for _ in 0..points {
                let (mut u, mut v) = (unit(), unit());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                if cone.lights(v0 + u * (v1 - v0) + v * (v2 - v0)) {
                    hits += 3.0 * (weights[0] * (1.0 - u - v) + weights[1] * u + weights[2] * v);
                    even_hits += 1;
                }
            }
            let (sampled, even) = (hits / f64::from(points), f64::from(even_hits) / f64::from(points));
            // A density of at most 3 about a mean of 1.
            let deviation = (1.5 * share.max(1e-3) / f64::from(points)).sqrt();
            assert!((sampled - share).abs() < 5.0 * deviation, "{share} and {sampled}");
            between += i32::from(share > 0.01 && share < 0.99);
            uneven += i32::from((even - share).abs() > 5.0 * deviation);
        }
        assert!(between > 60 && none > 0 && uneven > 15, "{between} {none} {uneven}");
    }

    #[test]
    fn circles_and_triangles_overlap_by_known_areas() {
        let triangle = |points: [[f64; 2]; 3]| overlap_with_unit_circle(points.map(DVec2::from)).area;
        let around = triangle([[-10.0, -10.0], [10.0, -10.0], [0.0, 20.0]]);
        assert!((around - PI).abs() < 1e-12, "the whole circle: {around}");
        let within = triangle([[0.1, 0.1], [0.5, 0.2], [0.2, 0.6]]);
        assert!((within - 0.095).abs() < 1e-15, "the whole triangle: {within}");
        let quarter = triangle([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]);
        assert!((quarter - PI / 4.0).abs() < 1e-12, "a quarter: {quarter}");
        let half = triangle([[-9.0, 0.0], [0.0, -9.0], [9.0, 0.0]]);
        assert!((half - PI / 2.0).abs() < 1e-12, "a half: {half}");
        assert!(triangle([[2.0, 0.0], [3.0, 0.0], [2.5, 1.0]]).abs() < 1e-12, "nothing");
        assert!((half + triangle([[9.0, 0.0], [0.0, -9.0], [-9.0, 0.0]])).abs() < 1e-12, "clockwise is negative");
        let moment = overlap_with_unit_circle([[-9.0, 0.0], [0.0, -9.0], [9.0, 0.0]].map(DVec2::from)).moment;
        assert!((moment - DVec2::new(0.0, -2.0 / 3.0)).length() < 1e-12, "the first moment of a half: {moment}");
    }
}
