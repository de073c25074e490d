//! H23. Hierarchies over triangles that are hard to tell apart.

use crate::rays::{ray, soup, triangles_of};
use crate::{Check, Form, Laboratory, Random, StabilityError};
use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2Swizzles as _, Vec3, Vec3Swizzles as _};
use mica_render::scene::Mesh;
use mica_render::scene::bvh::{LEAF_TRIANGLES, MeshBvh, children, leaf_range};
use mica_render::{Ray, RayAnswer, RenderError};
use mica_shaders::constants::{BVH_MESH_LEVELS, BVH_NOTHING};
use rayon::prelude::*;
use std::f64::consts::PI;

/// How many shapes there are beside the empty one.
const SHAPES: usize = 8;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(23);
    let (mut naive, mut stable, mut inputs) = ([0.0f64; 2], [0.0f64; 2], [0; 2]);
    for triangles in shapes(&mut random) {
        let scene = soup(&triangles, DAffine3::IDENTITY);
        inputs[1] += triangles.len() as u64;
        naive[1] = naive[1].max(levels_of_bins(&triangles));
        stable[1] = stable[1].max(levels(&scene.meshes[0])?);

        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let triangles: Vec<[DVec3; 3]> =
            triangles_of(&scene).into_iter().map(|corners| corners.map(|corner| corner - center)).collect();
        // As many as f64 is done with in a moment.
        let count = laboratory.inputs(4_000_000, 400_000_000) / triangles.len().max(1000);
        let count = count.min(laboratory.inputs(1_000, 100_000));
        let rays: Vec<Ray> = (0..count).map(|_| aimed(&mut random, &triangles)).collect();
        inputs[0] += count as u64;
        let met: Vec<Met> = rays.par_iter().map(|ray| Met::new(&triangles, ray)).collect();
        let wrong = |answers: Vec<RayAnswer>| {
            let wrong = answers.iter().zip(&met).filter(|(answer, met)| !met.allows(answer)).count();
            wrong as f64 / count as f64
        };
        stable[0] = stable[0].max(wrong(laboratory.closest(&scene, &rays)?));
        if !triangles.is_empty() {
            naive[0] = naive[0].max(wrong(laboratory.closest_listed(&triangles, &rays)?));
        }
    }
    Ok(vec![
        Check {
            what: format!(
                "what rays meet of no, one, two, crowded, nested, long triangles ({SHAPES} shapes, sizes of 1e-11 to 1e11)"
            ),
            error_of: "share of rays whose nearest triangle cannot be that of f64".to_owned(),
            inputs: inputs[0],
            naive: Form::new("Moeller and Trumbore 1997 for each of a list: out of range, and out of rounds", naive[0]),
            stable: Form::new("a hierarchy, walked with a budget of steps", stable[0]),
            tolerance: 0.0,
        },
        Check {
            what: format!("hierarchies over the same {SHAPES} shapes"),
            error_of: "levels from the root to a leaf; infinite where a split separates nothing".to_owned(),
            inputs: inputs[1],
            naive: Form::new("split at the middle of 16 bins of centroids", naive[1]),
            stable: Form::new("by the heuristic of areas, in halves where that leads nowhere", stable[1]),
            // A walk's stack has an entry for each.
            tolerance: f64::from(BVH_MESH_LEVELS),
        },
    ])
}

/// Levels of the hierarchy that the renderer builds.
fn levels(mesh: &Mesh) -> Result<f64, StabilityError> {
    let bvh = MeshBvh::build(&mesh.positions, &mesh.indices).map_err(RenderError::from)?;
    let (mut deepest, mut open) = (0, vec![(bvh.root(), 0)]);
    while let Some((reference, level)) = open.pop() {
        deepest = deepest.max(level);
        if reference != BVH_NOTHING && leaf_range(reference).is_none() {
            open.extend(children(&bvh.nodes()[reference as usize]).map(|(child, _)| (child, level + 1)));
        }
    }
    Ok(f64::from(deepest))
}

/// Levels of one whose nodes are split between the eighth and the ninth bin of their longest axis.
fn levels_of_bins(triangles: &[[DVec3; 3]]) -> f64 {
    let centroids: Vec<Vec3> = triangles.iter().map(|[a, b, c]| ((*a + *b + *c) / 3.0).as_vec3()).collect();
    let (mut deepest, mut open) = (0.0f64, vec![(centroids, 0.0)]);
    while let Some((centroids, level)) = open.pop() {
        deepest = deepest.max(level);
        if centroids.len() <= LEAF_TRIANGLES {
            continue;
        }
        let low = centroids.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let size = centroids.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) - low;
        let axis = size.max_position();
        let bin = |centroid: &Vec3| 16.0 * (centroid[axis] - low[axis]) / size[axis];
        let (left, right): (Vec<_>, Vec<_>) = centroids.into_iter().partition(|centroid| bin(centroid) < 8.0);
        if left.is_empty() || right.is_empty() {
            return f64::INFINITY;
        }
        open.extend([(left, level + 1.0), (right, level + 1.0)]);
    }
    deepest
}

/// Lists of triangles. A plain search of the crowd ends early on a driver that ends loops after 65,535 rounds.
fn shapes(random: &mut Random) -> [Vec<[DVec3; 3]>; SHAPES + 1] {
    let tilted = [DVec3::new(-0.6, -0.5, 0.1), DVec3::new(0.7, -0.4, 0.3), DVec3::new(0.1, 0.8, -0.6)];
    let mut crowd = vec![tilted; 100_000];
    crowd.extend([-1.0, 1.0].map(|side| tilted.map(|corner| corner + side * DVec3::new(0.1, 0.2, 0.7))));
    // About one centroid, to the bit.
    let knot = (0..1000).map(|_| {
        let [a, b] = [(); 2].map(|()| (1024.0 * point(random)).round() / 1024.0);
        [a, b, -a - b]
    });
    let knot = knot.collect();
    let string: Vec<[DVec3; 3]> = (0..1000)
        .map(|k| {
            let size = 0.1 + 0.05 * f64::from(k % 7);
            [DVec3::Y, DVec3::new(0.0, -0.5, 1.0), DVec3::new(0.0, -0.5, -1.0)]
                .map(|corner| DVec3::X * (f64::from(k) / 500.0 - 1.0) + size * corner)
        })
        .collect();
    let small = (0..300).map(|k| {
        let place = DVec3::new(5e5 * f64::from(k % 3 - 1), 40.0, 0.0);
        [(); 3].map(|()| place + 20.0 * point(random))
    });
    let stick = [DVec3::new(-5e5, 0.0, 0.0), DVec3::new(5e5, 0.0, 0.0), DVec3::new(5e5, 1.0, 0.0)];
    let stick = small.chain([stick; 20]).collect();
    let nested = (0..60).flat_map(|depth| {
        let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.1 * f64::from(depth % 2));
        cube().map(|corners| corners.map(|corner| 0.8f64.powi(depth) * (turn * corner)))
    });
    let nested = nested.collect();
    let scaled = |by: f64| string.iter().map(|corners| corners.map(|corner| by * corner)).collect();
    let [tiny, huge] = [scaled(1e-11), scaled(1e11)];
    let two = vec![tilted, tilted.map(|corner| corner + DVec3::Z)];
    [Vec::new(), vec![tilted], two, crowd, knot, stick, nested, tiny, huge]
}

/// The cube of half extent 1.
fn cube() -> [[DVec3; 3]; 12] {
    const FACES: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner = |k: usize| DVec3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -1.0 } else { 1.0 }));
    std::array::from_fn(|k| {
        let [a, b, c, d] = FACES[k / 2].map(corner);
        if k.is_multiple_of(2) { [a, b, c] } else { [a, c, d] }
    })
}

/// Inside the cube of half extent 1.
fn point(random: &mut Random) -> DVec3 {
    DVec3::from([(); 3].map(|()| random.between(-1.0, 1.0)))
}

/// From anywhere about a point well inside a triangle, towards it, the direction of any length; anywhere at all if there is
/// none.
fn aimed(random: &mut Random, triangles: &[[DVec3; 3]]) -> Ray {
    // As the walk allows, and so that t is a float.
    let length = random.log_between(1e-17, 1e20);
    if triangles.is_empty() {
        return ray(point(random), length * random.direction_about(DVec3::Z, PI));
    }
    let [a, b, c] = triangles[(random.bits() % triangles.len() as u64) as usize];
    let [second, third] = [(); 2].map(|()| random.between(0.2, 0.4));
    let target = a + second * (b - a) + third * (c - a);
    // Not along the triangle.
    let across = (b - a).cross(c - a);
    let normal = across.normalize();
    let side = if random.bits().is_multiple_of(2) { normal } else { -normal };
    let away = random.direction_about(side, 1.2);
    ray(target + random.log_between(0.01, 10.0) * across.length().sqrt() * away, -length * away)
}

/// What f64 says of a ray.
struct Met {
    /// Before this it surely meets something.
    surely_by: f64,
    /// The triangles that it may meet, each where, give or take.
    possible: Vec<(u32, f64, f64)>,
}

impl Met {
    /// Of triangles in scene space: by three edge functions of corners seen along the ray (Woop, Benthin and Wald 2013), each of
    /// which f32 has to within 8 units in the last place of its products.
    fn new(triangles: &[[DVec3; 3]], ray: &Ray) -> Self {
        const UNITS: f64 = 8.0 * f32::EPSILON as f64;
        let [origin, direction] = [ray.origin, ray.direction].map(|of| DVec3::from(of.map(f64::from)));
        let axis = direction.abs().max_position();
        let turned = |v: DVec3| [v.yzx(), v.zxy(), v][axis];
        let along = turned(direction);
        let slope = along.truncate() / along.z;
        let mut met = Self { surely_by: f64::INFINITY, possible: Vec::new() };
        for (index, corners) in (0..).zip(triangles) {
            let from = corners.map(|corner| turned(corner - origin));
            let [a, b, c] = from.map(|v| v.truncate() - slope * v.z);
            // What each is made of, of which it keeps as little as it happens to.
            let [a_of, b_of, c_of] = corners.map(|corner| {
                let of = turned(corner.abs() + origin.abs());
                of.truncate() + slope.abs() * of.z
            });
            let edges = DVec3::new(b.perp_dot(c), c.perp_dot(a), a.perp_dot(b));
            let area = edges.element_sum();
            let product = |p: DVec2, p_of: DVec2, q: DVec2, q_of: DVec2| {
                (p.abs() * q_of.yx() + p_of * q.yx().abs()).element_sum()
            };
            let doubts = DVec3::new(product(b, b_of, c, c_of), product(c, c_of, a, a_of), product(a, a_of, b, b_of));
            let doubts = UNITS * doubts / area.abs();
            let weights = edges / area;
            let depths = DVec3::from(from.map(|v| v.z));
            let t = weights.dot(depths) / along.z;
            let largest = corners.iter().fold(origin.abs(), |most, corner| most.max(corner.abs())).max_element();
            let t_error = (doubts.dot(depths.abs()) + UNITS * largest) / along.z.abs();
            if (weights + doubts).min_element() >= 0.0 && t > -t_error {
                met.possible.push((index, t, t_error));
                if (weights - doubts).min_element() > 0.0 && t > t_error {
                    met.surely_by = met.surely_by.min(t + t_error);
                }
            }
        }
        met
    }

    /// Whether an answer may be right.
    fn allows(&self, answer: &RayAnswer) -> bool {
        let t = f64::from(answer.t);
        let is_there = |(index, at, error): &(u32, f64, f64)| *index == answer.triangle && (t - at).abs() <= *error;
        match answer.blocked {
            0 => self.surely_by == f64::INFINITY,
            _ => t <= self.surely_by && self.possible.iter().any(is_there),
        }
    }
}
