//! H21. Rays that meet the surface they leave, or start beyond what covers it.

use crate::rays::{ray, soup, triangles_of};
use crate::{Check, Form, Laboratory, Random, StabilityError};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use mica_render::scene::Scene;
use mica_render::{Ray, RayAnswer};
use std::f64::consts::PI;

/// Triangles of a scene.
const TRIANGLES: usize = 1000;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![left(laboratory)?, covered(laboratory)?])
}

/// Half extents of scenes.
fn scales(laboratory: &Laboratory) -> &'static [f64] {
    if laboratory.inputs(0, 1) == 0 {
        &[1e-8, 1.0, 1e3, 1e8]
    } else {
        &[1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e3, 1e4, 1e6, 1e8]
    }
}

/// Rays away from a triangle.
fn left(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let scales = scales(laboratory);
    let count = laboratory.inputs(20_000, 2_000_000);
    let mut random = Random::new(21);
    let (mut naive, mut stable) = (0.0f64, 0.0f64);
    for &scale in scales {
        let triangles: Vec<[DVec3; 3]> = (0..TRIANGLES)
            .map(|_| {
                let place = point(&mut random);
                [(); 3].map(|()| scale * (place + 0.1 * point(&mut random)))
            })
            .collect();
        let scene = soup(&triangles, turned());
        let surface = Surface::new(&scene);
        let left: Vec<(usize, Ray)> =
            (0..count).map(|k| (k % TRIANGLES, surface.leave(&mut random, k % TRIANGLES, 0.5 * PI))).collect();
        let share = |laboratory: &mut Laboratory, moved: &dyn Fn(&Ray) -> Ray| -> Result<f64, StabilityError> {
            let rays: Vec<Ray> = left.iter().map(|(_, ray)| moved(ray)).collect();
            let answers = laboratory.closest(&scene, &rays)?;
            let met = left
                .iter()
                .zip(&answers)
                .filter(|((of, _), answer)| answer.blocked != 0 && answer.triangle as usize == *of);
            Ok(met.count() as f64 / count as f64)
        };
        stable = stable.max(share(laboratory, &|ray| *ray)?);
        naive = naive.max(share(laboratory, &moved_by_a_length)?);
    }
    Ok(Check {
        what: format!("rays that leave triangles of {TRIANGLES}, with coordinates up to 1e-8 to 1e8"),
        error_of: "share of them that meet the triangle they leave".to_owned(),
        inputs: (scales.len() * count) as u64,
        naive: Form::new("moved by 1e-4 along the normal", naive),
        stable: Form::new("by 256 units in the last place of what the triangle's points are made of", stable),
        tolerance: 0.0,
    })
}

/// Rays from triangles that have one just above and one just below them: a way of 1e-4 of the scene's half extent, of
/// which 256 units in the last place are half at most.
fn covered(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const GAP: f64 = 1e-4;
    let scales = scales(laboratory);
    let count = laboratory.inputs(10_000, 1_000_000);
    let mut random = Random::new(2121);
    let (mut naive, mut stable) = (0.0f64, 0.0f64);
    for &scale in scales {
        let mut triangles = Vec::new();
        while triangles.len() < 3 * TRIANGLES {
            let place = point(&mut random);
            let [a, b, c] = [(); 3].map(|()| place + 0.1 * point(&mut random));
            let middle = (a + b + c) / 3.0;
            let normal = (b - a).cross(c - a);
            // No needles: covers three times as large reach beyond them farther than any ray goes aside.
            if normal.length() > 1e-3 {
                let covers = [0.0, GAP, -GAP].map(|height| {
                    let size = if height == 0.0 { 1.0 } else { 3.0 };
                    [a, b, c].map(|corner| scale * (middle + size * (corner - middle) + height * normal.normalize()))
                });
                triangles.extend(covers);
            }
        }
        let scene = soup(&triangles, turned());
        let surface = Surface::new(&scene);
        let rays: Vec<Ray> = (0..count).map(|k| surface.leave(&mut random, 3 * (k % TRIANGLES), 0.25 * PI)).collect();
        let share = |laboratory: &mut Laboratory, rays: &[Ray]| -> Result<f64, StabilityError> {
            // Nothing within three times the gap, of which a ray at 45 degrees goes 1.4.
            let leaks = |answer: &RayAnswer| answer.blocked == 0 || f64::from(answer.t) > 3.0 * GAP * scale;
            let answers = laboratory.closest(&scene, rays)?;
            Ok(answers.iter().filter(|answer| leaks(answer)).count() as f64 / count as f64)
        };
        stable = stable.max(share(laboratory, &rays)?);
        let moved: Vec<Ray> = rays.iter().map(moved_by_a_length).collect();
        naive = naive.max(share(laboratory, &moved)?);
    }
    Ok(Check {
        what: "rays from triangles under covers, 1e-4 of the scene's half extent of 1e-8 to 1e8 above them".to_owned(),
        error_of: "share of them that start beyond the cover".to_owned(),
        inputs: (scales.len() * count) as u64,
        naive: Form::new("moved by 1e-4 along the normal", naive),
        stable: Form::new("by 256 units in the last place of what the triangle's points are made of", stable),
        tolerance: 0.0,
    })
}

fn turned() -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0))
}

/// The ray moved along its normal by a length that knows nothing of the scene.
fn moved_by_a_length(ray: &Ray) -> Ray {
    let origin = (Vec3::from(ray.origin) + 1e-4 * Vec3::from(ray.normal)).to_array();
    Ray { origin, normal: [0.0; 3], ..*ray }
}

/// Inside the cube of half extent 1.
fn point(random: &mut Random) -> DVec3 {
    DVec3::from([(); 3].map(|()| random.between(-1.0, 1.0)))
}

/// A scene's triangles as shaders have them.
struct Surface {
    /// Of the map to scene space.
    columns: [Vec3; 4],
    corners: Vec<[Vec3; 3]>,
}

impl Surface {
    fn new(scene: &Scene) -> Self {
        let center = scene.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let DAffine3 { matrix3, translation } =
            DAffine3::from_translation(-center) * scene.instances[0].world_from_local;
        let columns = [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis, translation].map(|column| column.as_vec3());
        let corners = triangles_of(scene).into_iter().map(|corners| corners.map(|corner| corner.as_vec3())).collect();
        Self { columns, corners }
    }

    /// A ray from a point of a triangle that is put together as the surface pass does (`shared/scene.glsl`), at most so far from
    /// either normal.
    fn leave(&self, random: &mut Random, triangle: usize, most: f64) -> Ray {
        let corners = self.corners[triangle];
        let [x, y, z, at] = self.columns;
        let [a, b, c] = corners.map(|corner| ((x * corner.x + y * corner.y) + z * corner.z) + at);
        let (root, share) = (random.between(0.0, 1.0).sqrt(), random.between(0.0, 1.0));
        let origin = a + (root * (1.0 - share)) as f32 * (b - a) + (root * share) as f32 * (c - a);
        let [edge_1, edge_2] = [b - a, c - a].map(|edge| edge.as_dvec3());
        let side = if random.between(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
        let normal = side * edge_1.cross(edge_2).normalize();
        let reach = corners.map(Vec3::abs).into_iter().reduce(Vec3::max).map_or(0.0, |farthest| {
            let sums = x.abs() * farthest.x + y.abs() * farthest.y + z.abs() * farthest.z + at.abs();
            sums.max_element()
        });
        let mut made = ray(DVec3::ZERO, random.direction_about(normal, most));
        made.origin = origin.to_array();
        made.normal = normal.as_vec3().to_array();
        Ray { reach, ..made }
    }
}
