//! Boulders: a cube blown up to a ball, pushed in and out by noise, and the snow that lies on it.

use super::noise::{noise3, smoothstep};
use crate::scene::Mesh;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Flakes lie in a texture space of metres, seen from above.
const UV_PER_UNIT: f64 = 1.0;

/// Distance of the stone's surface from its middle along a unit direction.
fn stone(shape: u32, direction: DVec3) -> f64 {
    let offset = DVec3::splat(17.3 * f64::from(shape) + 0.5);
    let coarse = noise3(direction * 0.9 + offset);
    // Facets: where folds of slow noise meet, the stone broke.
    let ridged = 1.0 - noise3(direction * 1.7 + offset).abs();
    let cracks = noise3(direction * 4.3 + offset).abs().min(0.25);
    let rough = noise3(direction * 11.0 + offset);
    0.78 + 0.36 * coarse + 0.26 * ridged * ridged + 0.2 * cracks + 0.02 * rough
}

/// A point of the stone: wider than high.
fn on_stone(shape: u32, direction: DVec3) -> DVec3 {
    direction * stone(shape, direction) * DVec3::new(1.2, 0.8, 1.0)
}

/// A point of the snow that lies on the stone; where none would lie, inside the stone.
fn on_cap(shape: u32, direction: DVec3) -> DVec3 {
    let edge = 0.5 + 0.4 * noise3(direction * 1.9 + DVec3::splat(3.5 + f64::from(shape)));
    let lies = smoothstep(edge, edge + 0.45, direction.y);
    on_stone(shape, direction) * (0.94 + 0.06 * lies) + DVec3::Y * direction.y * 0.13 * lies
}

/// A stone of about unit radius about the origin, its cube `cells` wide.
pub fn boulder(shape: u32, cells: usize, material: usize) -> Mesh {
    let surface = |direction| on_stone(shape, direction);
    ball("boulder", cells, material, surface, |_| true)
}

/// The snow on [`boulder`] of the same shape.
pub fn cap(shape: u32, cells: usize, material: usize) -> Mesh {
    // What would lie inside the stone is left away, but for a rim.
    let surface = |direction| on_cap(shape, direction);
    ball("cap", cells, material, surface, |direction| direction.y > 0.0)
}

/// The triangles of a ball of which `keeps` is true at all corners. Vertices are shared along the cube's edges.
fn ball(
    name: &str,
    cells: usize,
    material: usize,
    surface: impl Fn(DVec3) -> DVec3,
    keeps: impl Fn(DVec3) -> bool,
) -> Mesh {
    let mut mesh = Mesh { name: name.to_owned(), material, has_uv: true, ..Mesh::default() };
    let mut known: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    let direction = |point: [usize; 3]| {
        let [x, y, z] = point.map(|at| 2.0 * at as f64 / cells as f64 - 1.0);
        // Evens out the cells: a cube's corners are farther away than the middles of its faces.
        let even = |a: f64| a * (1.24 - 0.24 * a * a);
        DVec3::new(even(x), even(y), even(z)).normalize()
    };
    let mut points: Vec<DVec3> = Vec::new();
    let mut vertex = |mesh: &mut Mesh, point: [usize; 3]| {
        *known.entry(point).or_insert_with(|| {
            let position = surface(direction(point));
            let uv = DVec2::new(position.x, -position.z) * UV_PER_UNIT;
            mesh.positions.push(position.as_vec3().to_array());
            points.push(position);
            mesh.uv[0].push(uv.as_vec2().to_array());
            mesh.positions.len() as u32 - 1
        })
    };
    for face in 0..6 {
        let (axis, far) = (face / 2, face % 2 == 1);
        for j in 0..cells {
            for i in 0..cells {
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| {
                    let mut point = [0; 3];
                    point[axis] = if far { cells } else { 0 };
                    point[(axis + 1) % 3] = i + di;
                    point[(axis + 2) % 3] = j + dj;
                    point
                });
                if !corners.iter().all(|corner| keeps(direction(*corner))) {
                    continue;
                }
                let [a, b, c, d] = corners.map(|corner| vertex(&mut mesh, corner));
                mesh.indices.extend(if far { [a, b, c, a, c, d] } else { [a, c, b, a, d, c] });
            }
        }
    }
    mesh.normals = normals(&points, &mesh.indices);
    mesh
}

/// Of each vertex, the mean of its triangles' by their areas: of the triangles, as cracks are finer than these.
fn normals(points: &[DVec3], indices: &[u32]) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; points.len()];
    for corners in indices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|corner| points[corner as usize]);
        for corner in corners {
            sums[*corner as usize] += (b - a).cross(c - a);
        }
    }
    sums.into_iter().map(|sum| sum.normalize().as_vec3().to_array()).collect()
}
