//! The scenes that are asked about: those of the program, and garbage.

use crate::meshes::{self, Mesh};
use crate::random::Random;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use mica_render::EMBEDDED_SCENES;
use mica_render::scene::{self, Instance, Material, Scene};

/// A scene of meshes with one material, each placed by its index.
pub fn of(name: &str, meshes: Vec<Mesh>, places: &[(usize, DAffine3)]) -> Scene {
    let mesh = |mesh: Mesh| scene::Mesh {
        normals: vec![[0.0, 1.0, 0.0]; mesh.positions.len()],
        positions: mesh.positions,
        indices: mesh.indices,
        ..scene::Mesh::default()
    };
    let place = |&(mesh, world_from_local)| Instance { mesh, world_from_local, name: String::new() };
    Scene {
        name: name.to_owned(),
        meshes: meshes.into_iter().map(mesh).collect(),
        instances: places.iter().map(place).collect(),
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

/// A scene of one mesh where it is.
pub fn alone(name: &str, mesh: Mesh) -> Scene {
    of(name, vec![mesh], &[(0, DAffine3::IDENTITY)])
}

/// The scenes that come with the program.
pub fn embedded() -> Vec<Scene> {
    EMBEDDED_SCENES.iter().map(|scene| scene.load_coarse().expect("an embedded scene")).collect()
}

/// Scenes that no artist would make on purpose, less those with more copies of a triangle than a ray may test.
pub fn garbage() -> Vec<Scene> {
    let mut scenes: Vec<Scene> = meshes::all()
        .into_iter()
        .filter(|(name, _)| !["identical", "soup"].contains(name))
        .map(|(name, mesh)| alone(name, mesh))
        .collect();
    let sphere = || meshes::bumpy_icosphere(3);
    let far = DVec3::new(1.48e5, 1234.0, -2.23e5);
    scenes.extend([
        alone("nothing but vertices", Mesh { positions: vec![[0.0; 3], [1.0; 3]], indices: Vec::new() }),
        alone("soup", meshes::soup(5_000, 0.05, 5)),
        alone("copies", meshes::identical(30).and(meshes::soup(500, 0.3, 37))),
        alone("coordinates of 1e-4", meshes::soup(2_000, 0.1, 41).map(|point| 1e-4 * point)),
        alone("coordinates of 1e6", meshes::soup(2_000, 0.1, 43).map(|point| 1e6 * point)),
        alone("from 1e-4 to 1e6", meshes::of_all_sizes(2_000)),
        alone("without area", meshes::without_area(2_000)),
        alone("grid", meshes::grid(64)),
        alone("in one plane", meshes::in_one_plane(40)),
        of("twelve instances", vec![sphere()], &twelve_places()),
        of("a hundred instances", vec![meshes::bumpy_icosphere(2)], &scattered(100, 47)),
        of("mirrored", vec![sphere()], &[(0, DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)))]),
        of("scaled along the axes", vec![sphere()], &[(0, DAffine3::from_scale(DVec3::new(1e-3, 20.0, -1.0)))]),
        of("flattened", vec![sphere(), meshes::cube()], &flattened()),
        of("skewed", vec![sphere(), meshes::cube()], &skewed()),
        of("far from its own origin", vec![sphere().map(|point| point + far)], &brought_back(far)),
        of("huge and tiny", vec![meshes::cube(), sphere()], &huge_and_tiny()),
        of("mixed", vec![sphere(), Mesh::default(), meshes::cube(), meshes::long_sticks(300)], &mixed()),
    ]);
    scenes
}

/// Twelve placements of one mesh: turned, scaled by different factors along its axes, every third one mirrored.
pub fn twelve_places() -> Vec<(usize, DAffine3)> {
    let mut random = Random::new(7);
    (0..12)
        .map(|k| {
            let mirror = if k % 3 == 0 { -1.0 } else { 1.0 };
            let scale =
                DVec3::new(random.between(0.2, 0.5), mirror * random.between(0.2, 0.5), random.between(0.2, 0.5));
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
            let place = DVec3::new((k % 4) as f64 - 1.5, (k / 4) as f64 - 1.0, random.between(-0.5, 0.5));
            (0, DAffine3::from_scale_rotation_translation(scale, turn, place))
        })
        .collect()
}

fn scattered(count: usize, seed: u64) -> Vec<(usize, DAffine3)> {
    let mut random = Random::new(seed);
    let place = |random: &mut Random| {
        let scale = DVec3::new(random.between(0.5, 1.0), random.between(0.5, 1.0), random.between(0.5, 1.0));
        let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        DAffine3::from_scale_rotation_translation(0.2 * scale, turn, random.point())
    };
    (0..count).map(|_| (0, place(&mut random))).collect()
}

/// By scales of 0 along one axis, along two and along all, beside one that is as it was.
fn flattened() -> Vec<(usize, DAffine3)> {
    let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
    let at = |scale: [f64; 3], place: [f64; 3]| {
        DAffine3::from_scale_rotation_translation(DVec3::from(scale), turn, DVec3::from(place))
    };
    vec![
        (0, at([1.0, 0.0, 2.0], [0.0, 0.0, 0.0])),
        (1, at([0.0, 0.0, 1.0], [2.0, 0.0, 1.0])),
        (1, at([0.0, 0.0, 0.0], [1.0, 1.0, 1.0])),
        (1, at([0.3, 0.3, 0.3], [-1.0, 1.0, 1.0])),
    ]
}

/// Sheared, one a little and one so far that it has hardly an inverse.
fn skewed() -> Vec<(usize, DAffine3)> {
    let shear = |far: f64, along: f64, place: DVec3| {
        let matrix = DMat3::from_cols(DVec3::X, DVec3::new(far, along, 0.0), DVec3::new(0.0, 0.2 * far, 1.0));
        DAffine3::from_mat3_translation(matrix, place)
    };
    vec![(0, shear(0.7, 1.0, DVec3::ZERO)), (1, shear(1.0, 1e-4, DVec3::new(2.0, 1.0, 0.0)))]
}

fn brought_back(from: DVec3) -> Vec<(usize, DAffine3)> {
    vec![
        (0, DAffine3::from_translation(-from)),
        (0, DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0)) * DAffine3::from_translation(DVec3::X * 2.5 - from)),
    ]
}

/// Within each other: cubes of half extents 1e6, 1 and 1e-4, and spheres between them.
fn huge_and_tiny() -> Vec<(usize, DAffine3)> {
    [(0, 1e6), (1, 1e3), (0, 1.0), (1, 0.5), (1, 1e-3), (0, 1e-4)]
        .map(|(mesh, scale)| (mesh, DAffine3::from_scale(DVec3::splat(scale))))
        .to_vec()
}

fn mixed() -> Vec<(usize, DAffine3)> {
    let turn = DQuat::from_axis_angle(DVec3::new(0.64, -0.48, 0.6), 2.0);
    vec![
        (0, DAffine3::IDENTITY),
        (1, DAffine3::from_scale(DVec3::splat(5.0))),
        (2, DAffine3::from_scale_rotation_translation(DVec3::new(0.5, -0.5, 3.0), turn, DVec3::new(2.0, 0.0, 0.0))),
        (3, DAffine3::from_translation(DVec3::new(0.0, 2.0, 0.0))),
        // Where it is already: every hit is a tie.
        (0, DAffine3::IDENTITY),
        (2, DAffine3::from_scale(DVec3::new(0.2, 0.0, 0.2))),
    ]
}
