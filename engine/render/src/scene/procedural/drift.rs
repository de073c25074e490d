//! `drift`: snow that the wind has carved, with boulders in it, in a million triangles and more.

use super::noise::{noise2, random, smoothstep};
use super::{Detail, boulder};
use crate::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Where the camera stands, metres; the field fans out from under it.
const EYE: DVec3 = DVec3::new(0.0, 1.5, 0.0);
/// Where the wind goes, unit: to the right and a little towards the viewer.
const WIND: DVec2 = DVec2::new(0.96, 0.28);
/// Towards the sun: 11 degrees high, ahead on the left, so that every ridge has its shadow.
const SUN: DVec3 = DVec3::new(-0.72, 0.2, -0.68);

/// Cells of the field from left to right, and from the camera's feet to the hills: two triangles each.
const FIELD_CELLS: [usize; 2] = [640, 800];
/// Distance of the first row and the last, metres.
const FIELD_REACH: [f64; 2] = [1.1, 260.0];
/// Cells along an edge of a boulder's cube.
const BOULDER_CELLS: usize = 48;
/// Boulders of different shape.
const SHAPES: u32 = 3;

/// A boulder: where it lies, metres right of and ahead of the camera, how large it is, how far it is turned.
struct Placed {
    at: DVec2,
    size: f64,
    turn: f64,
    shape: u32,
}

/// The boulders: a few that make the picture, and scattered ones.
fn boulders() -> Vec<Placed> {
    let chosen = [
        (2.05, -6.4, 0.62, 0.3, 0),
        (3.35, -7.6, 0.95, 2.1, 1),
        (1.1, -5.5, 0.2, 4.0, 2),
        (-3.3, -9.4, 0.5, 1.2, 2),
        (-1.15, -4.3, 0.15, 5.1, 0),
        (-7.6, -19.0, 1.7, 0.8, 1),
        (0.8, -14.5, 0.55, 3.3, 0),
    ];
    let mut placed: Vec<Placed> = chosen
        .into_iter()
        .map(|(x, z, size, turn, shape)| Placed { at: DVec2::new(x, z), size, turn, shape })
        .collect();
    for k in 0..41 {
        let distance = 9.0 + 110.0 * random(k, 0) * random(k, 1);
        let across = (random(k, 2) * 2.0 - 1.0) * 0.8 * distance;
        let size = 0.18 + 0.9 * random(k, 3) * random(k, 4) + 0.012 * distance;
        let shape = (random(k, 5) * f64::from(SHAPES)) as u32;
        placed.push(Placed { at: DVec2::new(across, -distance), size, turn: 6.2 * random(k, 6), shape });
    }
    placed
}

/// One wave of a dune for each unit of `phase`: slowly up to a crest, then down in a third of the way.
fn dune(phase: f64) -> f64 {
    const CREST: f64 = 0.7;
    let along = phase - phase.floor();
    let t = if along < CREST { along / CREST } else { (1.0 - along) / (1.0 - CREST) };
    // Level in the trough, steep at the crest.
    t * t * (1.9 - 0.9 * t)
}

/// Height of the snow without what the boulders do to it, metres; `p` is x and z.
fn carved(p: DVec2) -> f64 {
    let distance = p.length();
    let (down, across) = (p.dot(WIND), p.dot(DVec2::new(-WIND.y, WIND.x)));
    // Dunes across the wind, their crests bent and broken off.
    let warp = DVec2::new(noise2(p / 6.1, 1), noise2(p / 9.7, 2));
    let broken = 0.35 + 0.65 * smoothstep(-0.45, 0.35, noise2(p / 7.3, 3));
    let dunes = 0.42 * broken * dune(down / 6.4 + 0.42 * warp.x + 0.05 * across);
    let mounds = 0.5 * noise2(p / 13.0, 4) + 0.16 * noise2(p / 4.2, 5);
    // Sastrugi: ridges along the wind, sharp where it undercut them, in fields between smooth snow.
    let swept = smoothstep(-0.15, 0.4, noise2(p / 5.2, 6) + 0.25 * warp.y);
    let bent = DVec2::new(down / 1.9, across / 0.42) + 0.35 * DVec2::new(warp.x, warp.y);
    let ridge = 1.0 - noise2(bent, 7).abs().min(1.0);
    let steps = noise2(bent * 2.3, 8).abs();
    let sastrugi = swept * (0.13 * ridge * ridge * ridge - 0.035 * steps);
    // Ripples across the wind and the grain of the crust: only where cells are small enough to hold them.
    let fine = 1.0 - smoothstep(7.0, 16.0, distance);
    let ripple = 0.010 * (1.0 - 0.6 * swept) * dune(down / 0.16 + 1.1 * noise2(p / 0.7, 9));
    let grain = 0.004 * noise2(p / 0.13, 10) + 0.006 * noise2(p / 0.31, 11);
    let hills = smoothstep(38.0, 170.0, distance) * (10.0 + 11.0 * noise2(p / 68.0, 12) + 2.5 * noise2(p / 21.0, 13));
    // The camera stands on trodden snow.
    let near = 1.0 - 0.5 * (1.0 - smoothstep(1.0, 4.5, distance));
    (dunes + mounds) * near + sastrugi + fine * (ripple + grain) + hills
}

/// Height of the snow, metres: before each boulder the wind dug, behind it, it let snow fall.
fn height(p: DVec2, boulders: &[Placed]) -> f64 {
    let mut height = carved(p);
    for boulder in boulders {
        let offset = (p - boulder.at) / boulder.size;
        if offset.length_squared() > 64.0 {
            continue;
        }
        let (down, across) = (offset.dot(WIND), offset.dot(DVec2::new(-WIND.y, WIND.x)));
        let ring = offset.length();
        let moat = smoothstep(0.6, 1.15, ring) * (1.0 - smoothstep(1.2, 2.3, ring)) * smoothstep(1.2, -0.6, down);
        let width = 0.9 - 0.09 * down;
        let beside = (across / width).abs();
        let tail =
            smoothstep(0.2, 1.1, down) * (1.0 - smoothstep(1.2, 7.0, down)) * (1.0 - smoothstep(0.0, 1.0, beside));
        height += boulder.size * (0.42 * tail - 0.26 * moat);
    }
    height
}

/// The field: a fan of rows whose spacing grows with the distance, as the picture wants it.
fn field(detail: Detail, boulders: &[Placed], material: usize) -> Mesh {
    let [columns, rows] = FIELD_CELLS.map(|cells| detail.cells(cells));
    let [near, far] = FIELD_REACH;
    // Each row as many times farther away than the last; by products, which round alike on every machine.
    let growth = growth(far / near, rows);
    let distances = std::iter::successors(Some(near), |distance| Some(distance * growth));
    let distances: Vec<f64> = distances.take(rows + 1).collect();
    let width = columns + 1;
    let points: Vec<DVec3> = distances
        .par_iter()
        .flat_map_iter(|&distance| {
            (0..width).map(move |column| {
                let across = 2.0 * column as f64 / columns as f64 - 1.0;
                let p = DVec2::new(across * (0.9 * distance + 1.4), EYE.z + 0.6 - distance);
                DVec3::new(p.x, height(p, boulders), p.y)
            })
        })
        .collect();
    let normal = |index: usize| {
        let (row, column) = (index / width, index % width);
        let at = |row: usize, column: usize| points[row * width + column];
        let along = at(row, (column + 1).min(columns)) - at(row, column.saturating_sub(1));
        let away = at((row + 1).min(rows), column) - at(row.saturating_sub(1), column);
        along.cross(away).normalize().as_vec3().to_array()
    };
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row * width + column) as u32));
    let up = width as u32;
    Mesh {
        name: "field".to_owned(),
        normals: (0..points.len()).into_par_iter().map(normal).collect(),
        uv: [points.iter().map(|p| [p.x as f32, -p.z as f32]).collect(), Vec::new()],
        indices: cells.flat_map(|a| [a, a + 1, a + 1 + up, a, a + 1 + up, a + up]).collect(),
        positions: points.iter().map(|p| p.as_vec3().to_array()).collect(),
        material,
        has_uv: true,
        ..Mesh::default()
    }
}

/// The number whose product of so many equals the ratio, by halving the interval.
fn growth(ratio: f64, steps: usize) -> f64 {
    let (mut low, mut high) = (1.0, ratio);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        // Beyond the ratio no product comes back below it: stop before it overflows.
        let reached = (0..steps).try_fold(1.0, |product: f64, _| (product < ratio).then_some(product * middle));
        if reached.is_some_and(|product| product < ratio) { low = middle } else { high = middle }
    }
    low
}

/// The scene.
pub fn drift(detail: Detail) -> Scene {
    let dielectric = |name: &str, [r, g, b]: [f32; 3], roughness: f32| Material {
        name: name.to_owned(),
        base_color: [r, g, b, 1.0],
        metallic: 0.0,
        roughness,
        ..Material::default()
    };
    let glint =
        Glint { count: 1e5, alpha: 0.5, gamma_deg: 2.0, seed: 11, color: Some([0.3, 0.31, 0.32]), ..Glint::default() };
    let alpha = glint.alpha;
    let snow = Material { glint: Some(glint), ..dielectric("snow", [0.83, 0.85, 0.88], alpha.sqrt() as f32) };
    let stone = dielectric("stone", [0.12, 0.11, 0.105], 0.75);

    let boulders = boulders();
    let cells = detail.cells(BOULDER_CELLS);
    let mut meshes = vec![field(detail, &boulders, 0)];
    for shape in 0..SHAPES {
        meshes.push(boulder::boulder(shape, cells, 1));
        meshes.push(boulder::cap(shape, cells, 0));
    }
    let mut instances = vec![Instance { mesh: 0, world_from_local: DAffine3::IDENTITY, name: "field".to_owned() }];
    for boulder in &boulders {
        let ground = carved(boulder.at);
        let place = DVec3::new(boulder.at.x, ground + 0.1 * boulder.size, boulder.at.y);
        let world_from_local = DAffine3::from_mat3_translation(
            turned(boulder.turn) * DMat3::from_diagonal(DVec3::splat(boulder.size)),
            place,
        );
        let stone = 1 + 2 * boulder.shape as usize;
        for mesh in [stone, stone + 1] {
            instances.push(Instance { mesh, world_from_local, name: meshes[mesh].name.clone() });
        }
    }
    Scene {
        name: "drift".to_owned(),
        meshes,
        instances,
        materials: vec![snow, stone],
        lights: vec![Light::Directional { direction: -SUN.normalize(), irradiance: [2.9, 1.95, 1.15] }],
        cameras: vec![Camera::looking_at("camera", EYE, DVec3::new(0.35, 0.85, -8.0), 40f64.to_radians(), 0.05)],
        environment: Some("dusk".to_owned()),
        ..Scene::default()
    }
}

/// About +Y. By a rational rotation, which rounds alike on every machine: `turn` from 0 to 6.3 goes all the way round.
fn turned(turn: f64) -> DMat3 {
    // tan of a quarter of the angle, nearly; exact angles do not matter.
    let t = (turn - 3.15) / 3.15;
    let (sin_half, cos_half) = (2.0 * t / (1.0 + t * t), (1.0 - t * t) / (1.0 + t * t));
    let (sin, cos) = (2.0 * sin_half * cos_half, cos_half * cos_half - sin_half * sin_half);
    DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Bounds;
    use std::collections::BTreeMap;

    fn point(mesh: &Mesh, index: u32) -> DVec3 {
        DVec3::from(mesh.positions[index as usize].map(f64::from))
    }

    /// How often each edge occurs, by the positions of its ends.
    fn edges(mesh: &Mesh) -> BTreeMap<[[u32; 3]; 2], usize> {
        let mut edges = BTreeMap::new();
        for corners in mesh.indices.as_chunks::<3>().0 {
            for k in 0..3 {
                let mut ends = [corners[k], corners[(k + 1) % 3]]
                    .map(|corner| mesh.positions[corner as usize].map(|coordinate| coordinate.to_bits()));
                ends.sort_unstable();
                *edges.entry(ends).or_default() += 1;
            }
        }
        edges
    }

    /// Of the field a coarse one will do. Boulders need all their cells: coarse ones fold where the shape is cracked.
    #[test]
    fn every_mesh_is_sound() {
        let scene = drift(Detail::Coarse);
        let mut meshes = vec![scene.meshes[0].clone()];
        for shape in 0..SHAPES {
            meshes.push(boulder::boulder(shape, BOULDER_CELLS, 1));
            meshes.push(boulder::cap(shape, BOULDER_CELLS, 0));
        }
        for mesh in &meshes {
            let vertices = mesh.positions.len();
            assert_eq!(
                (mesh.normals.len(), mesh.uv[0].len(), mesh.has_uv),
                (vertices, vertices, true),
                "{}",
                mesh.name
            );
            assert!(mesh.tangents.is_empty(), "no material has a normal map");
            assert!(mesh.uv[0].iter().flatten().all(|coordinate| coordinate.is_finite()));
            let (mut used, mut turned_away) = (vec![false; vertices], 0);
            for corners in mesh.indices.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|corner| point(mesh, corner));
                let normal = (b - a).cross(c - a).normalize();
                assert!(normal.is_finite(), "{}: a triangle without area at {a}", mesh.name);
                for corner in corners {
                    let [x, y, z] = mesh.normals[*corner as usize].map(f64::from);
                    let smooth = DVec3::new(x, y, z);
                    assert!((smooth.length() - 1.0).abs() < 1e-5, "{}: {smooth}", mesh.name);
                    turned_away += usize::from(smooth.dot(normal) <= 0.0);
                    used[*corner as usize] = true;
                }
            }
            // Only deep in cracks of the stone.
            let tolerable = if mesh.name == "field" { 0 } else { mesh.indices.len() / 2000 };
            assert!(turned_away <= tolerable, "{}: {turned_away} normals", mesh.name);
            assert!(used.iter().all(|used| *used), "{}: a vertex of no triangle", mesh.name);
            // No edge has three sides; of a whole boulder, each has two.
            let edges = edges(mesh);
            let open = edges.values().filter(|count| **count == 1).count();
            assert!(edges.values().all(|count| *count <= 2), "{}", mesh.name);
            assert_eq!(open == 0, mesh.name == "boulder", "{}: {open} open edges", mesh.name);
        }
        assert!(scene.instances.iter().all(|instance| instance.mesh < scene.meshes.len()));
        assert!(scene.meshes.iter().all(|mesh| mesh.material < scene.materials.len()));
    }

    #[test]
    fn the_field_faces_up_and_boulders_face_out() {
        let scene = drift(Detail::Coarse);
        for mesh in &scene.meshes {
            for corners in mesh.indices.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|corner| point(mesh, corner));
                let normal = (b - a).cross(c - a);
                let outwards = if mesh.name == "field" { DVec3::Y } else { a + b + c };
                assert!(normal.dot(outwards) > 0.0, "{} at {a}", mesh.name);
            }
        }
    }

    #[test]
    fn boulders_stand_in_the_snow_and_the_camera_above_it() {
        let scene = drift(Detail::Coarse);
        let bounds = scene.bounds().expect("there is something");
        let within = Bounds { min: DVec3::new(-240.0, -4.0, -262.0), max: DVec3::new(240.0, 30.0, 2.0) };
        assert_eq!(within.union(bounds), within, "{bounds:?}");
        assert!(EYE.y - carved(DVec2::ZERO) > 1.0);
        let boulders = boulders();
        assert_eq!(scene.instances.len(), 1 + 2 * boulders.len());
        for (boulder, instance) in boulders.iter().zip(scene.instances[1..].iter().step_by(2)) {
            let mesh = &scene.meshes[instance.mesh];
            let heights = mesh.positions.iter().map(|position| {
                let world = instance.world_from_local.transform_point3(DVec3::from(position.map(f64::from)));
                world.y - height(DVec2::new(world.x, world.z), &boulders)
            });
            let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
            assert!(low < 0.0 && high > 0.2 * boulder.size, "from {low} to {high} at {}", boulder.at);
        }
    }

    #[test]
    fn a_scene_made_twice_is_the_same() {
        assert_eq!(drift(Detail::Coarse), drift(Detail::Coarse));
        // A change of a shape is to be meant: pictures and figures of this scene are compared over time.
        let heights = [(0.0, -2.0), (2.5, -7.0), (-31.0, -80.0), (90.0, -240.0)]
            .map(|(x, z)| (1e6 * height(DVec2::new(x, z), &boulders())).round() as i64);
        assert_eq!(heights, [152_914, 166_451, 2_470_691, 7_042_560]);
    }

    /// Without making it: its million triangles take seconds in a test's profile.
    #[test]
    fn at_full_detail_there_are_a_million_triangles_in_buffers_that_every_device_binds() {
        let [columns, rows] = FIELD_CELLS;
        let field = 2 * columns * rows;
        let stone = 6 * 2 * BOULDER_CELLS * BOULDER_CELLS;
        assert!(field > 1_000_000);
        // Nodes of 64 bytes, at most one a triangle, and triangles of 48: below 128 MiB each.
        assert!(64 * (field + 2 * SHAPES as usize * stone) < 128 << 20);
        let coarse = drift(Detail::Coarse);
        assert_eq!(coarse.meshes[0].triangle_count(), 2 * (columns / 8) * (rows / 8));
        assert_eq!(coarse.meshes[1].triangle_count(), stone / 64);
    }

    #[test]
    fn growth_reaches_the_ratio() {
        for (ratio, steps) in [(236.0, 512), (4.0, 2), (1.5, 64)] {
            let product = (0..steps).fold(1.0, |product, _| product * growth(ratio, steps));
            assert!((product / ratio - 1.0).abs() < 1e-9, "{product} for {ratio}");
        }
    }

    #[test]
    fn turns_are_rotations_all_the_way_round() {
        let directions: Vec<DVec3> = (0..=62).map(|k| turned(f64::from(k) * 0.1) * DVec3::X).collect();
        let steps = directions.windows(2).map(|pair| pair[0].angle_between(pair[1]).to_degrees());
        assert!(steps.clone().all(|step| (1.0..16.0).contains(&step)));
        let all: f64 = steps.sum();
        assert!((350.0..360.0).contains(&all), "{all} degrees");
        assert!((turned(2.0).determinant() - 1.0).abs() < 1e-12);
        assert!(directions.iter().any(|d| d.z > 0.9) && directions.iter().any(|d| d.z < -0.9));
    }
}
