//! What the host promises beside the hierarchy itself: progress, copies, moving instances.

use crate::shapes::{self, Mesh};
use glam::{DAffine3, DVec3};
use mica_render::scene::bvh::{BuildOptions, MeshBvh, Placements, SceneBvh};
use std::sync::atomic::{AtomicU64, Ordering};

fn built(mesh: &Mesh, options: BuildOptions) -> MeshBvh {
    MeshBvh::build_with(&mesh.positions, &mesh.indices, options).expect("a usable mesh")
}

/// The corners of the triangles of a mesh.
fn corners(mesh: &Mesh) -> impl Iterator<Item = [f32; 3]> + '_ {
    mesh.indices.iter().map(|&vertex| mesh.positions[vertex as usize])
}

#[test]
fn progress_ends_at_the_number_of_triangles_and_of_instances() {
    for mesh in [Mesh::default(), shapes::random_triangles(3, 0.1, 1), shapes::random_triangles(50_000, 0.1, 2)] {
        let placed = AtomicU64::new(0);
        let bvh = built(&mesh, BuildOptions { placed: Some(&placed), ..BuildOptions::default() });
        assert_eq!(placed.load(Ordering::Relaxed), mesh.triangles() as u64);
        let placed = AtomicU64::new(0);
        SceneBvh::build_with(&shapes::twelve_places(), &[bvh], Some(&placed)).expect("a usable scene");
        assert_eq!(placed.load(Ordering::Relaxed), 12);
    }
}

/// Of copies in one place the first is kept; where masks may tell them apart, of those that share their vertices.
#[test]
fn copies_are_dropped_where_rays_cannot_tell_them_apart() {
    let apart = shapes::identical(1_000).and(shapes::random_triangles(50, 0.1, 3));
    let kept = |mesh: &Mesh, masked| {
        let bvh = built(mesh, BuildOptions { masked, ..BuildOptions::default() });
        let mut indices: Vec<u32> = bvh.triangles().iter().map(|triangle| triangle.index).collect();
        indices.sort_unstable();
        indices
    };
    let distinct: Vec<u32> = std::iter::once(0).chain(1_000..1_050).collect();
    assert_eq!(kept(&apart, false), distinct);
    assert_eq!(kept(&apart, true).len(), 1_050);
    let mut shared = apart;
    shared.indices[..3_000].iter_mut().zip([0, 1, 2].into_iter().cycle()).for_each(|(index, vertex)| *index = vertex);
    assert_eq!(kept(&shared, true), distinct);
}

#[test]
fn a_moved_instance_leaves_a_scene_as_if_built_there() {
    let mesh = shapes::random_triangles(500, 0.1, 4);
    let meshes = [built(&mesh, BuildOptions::default()), built(&Mesh::default(), BuildOptions::default())];
    let mut places = shapes::twelve_places();
    places.insert(5, (1, DAffine3::IDENTITY));
    let mut scene = SceneBvh::build(&places, &meshes).expect("a usable scene");
    let moves =
        [(3, DAffine3::from_translation(DVec3::new(3.0, -2.0, 1.0))), (5, DAffine3::IDENTITY), (12, places[0].1)];
    for (instance, place) in moves {
        places[instance].1 = place;
    }
    let empty = Mesh::default();
    let of_mesh = |index: usize| corners([&mesh, &empty][index]);
    let top = scene.top.place(&moves, of_mesh).expect("usable places").expect("no other storage");
    let anew = SceneBvh::build(&places, &meshes).expect("a usable scene");
    assert_eq!(top.instances, anew.instances);
    assert_eq!(top.nodes, anew.nodes[..11]);
    assert_eq!(scene.nodes[11..], anew.nodes[11..], "what lies below is not touched");

    let flat = [(3, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)))];
    assert!(scene.top.place(&flat, of_mesh).expect("usable places").is_none(), "flattened: its triangles move");
    let lost = [(0, DAffine3::from_translation(DVec3::splat(f64::NAN)))];
    assert!(scene.top.place(&lost, of_mesh).is_err());
    assert_eq!(scene.top.place(&[], of_mesh), Ok(Some(top)), "neither has changed anything");
}

#[test]
fn both_bodies_hear_the_same_of_where_instances_are() {
    let mesh = shapes::random_triangles(20, 0.1, 4);
    let mut places = shapes::twelve_places();
    places[2].1 = DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0));
    let placements = Placements::new(&places, 1, |_| corners(&mesh)).expect("usable places");
    let own: Vec<usize> =
        placements.list().iter().filter(|placed| placed.in_scene_space).map(|placed| placed.instance).collect();
    assert_eq!(own, [2]);
    let scene = SceneBvh::build(&places, &[built(&mesh, BuildOptions::default())]).expect("a usable scene");
    let identity = scene.instances[0].local_from_scene;
    let stored: Vec<usize> = (0..12).filter(|k| scene.instances[k + 1].local_from_scene == identity).collect();
    assert_eq!(stored, own);
}
