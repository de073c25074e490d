//! What the host builds over placed meshes: boxes, triangles in scene space, instances that move, and refusals.

use crate::mesh_hierarchy::built;
use crate::meshes::{self, Mesh};
use crate::scenes;
use glam::{DAffine3, DMat3, DVec3};
use mica_render::scene::bvh::{Bounds, BvhError, Placements, SceneBvh, children, leaf_range};
use mica_shaders::constants::{BVH_NOTHING, BVH_SCENE_LEVELS};

/// The corners of the triangles of a mesh.
fn corners(mesh: &Mesh) -> impl Iterator<Item = [f32; 3]> + '_ {
    mesh.indices.iter().map(|&vertex| mesh.positions[vertex as usize])
}

#[test]
fn unusable_scenes_are_refused_with_the_place_of_the_fault() {
    let meshes = [built(&meshes::identical(1))];
    let refused = |instance| SceneBvh::build(&[(0, DAffine3::IDENTITY), instance], &meshes).expect_err("a refusal");
    let expected = BvhError::NoSuchMesh { instance: 1, mesh: 2, meshes: 1 };
    assert_eq!(refused((2, DAffine3::IDENTITY)), expected);
    for far in [DVec3::splat(f64::NAN), DVec3::X * 1e13, DVec3::X * f64::INFINITY] {
        assert_eq!(refused((0, DAffine3::from_translation(far))), BvhError::BadTransform { instance: 1 });
    }
}

#[test]
fn a_scene_without_triangles_still_fills_its_buffers() {
    let empty = built(&Mesh::default());
    for instances in [vec![], vec![(0, DAffine3::IDENTITY); 3]] {
        let scene = SceneBvh::build(&instances, std::slice::from_ref(&empty)).expect("a scene");
        assert_eq!(scene.instances.len(), instances.len() + 1);
        assert_eq!(scene.instances[0].root, BVH_NOTHING);
        assert_eq!((scene.nodes.len(), scene.triangles.len()), (1, 1), "one unused element each");
    }
}

/// Corners moved to scene space in f64 lie inside, strictly where the transform is inexact; the mesh is stored once.
#[test]
fn the_boxes_of_instances_enclose_them_in_scene_space() {
    let mesh = meshes::bumpy_icosphere(3);
    let instances = scenes::twelve_places();
    let bvh = built(&mesh);
    let scene = SceneBvh::build(&instances, std::slice::from_ref(&bvh)).expect("a scene");
    assert_eq!(scene.triangles.len(), mesh.triangles());
    assert_eq!(scene.nodes.len(), bvh.nodes().len() + instances.len() - 1);

    let mut seen = vec![0; instances.len()];
    let mut deepest = 0;
    fn below(
        scene: &SceneBvh,
        reference: u32,
        bounds: Option<Bounds>,
        depth: u32,
        visit: &mut impl FnMut(usize, Bounds, u32),
    ) {
        match (leaf_range(reference), bounds) {
            (Some((instance, _)), Some(bounds)) => visit(instance as usize - 1, bounds, depth),
            _ => children(&scene.nodes[reference as usize])
                .into_iter()
                .for_each(|(child, bounds)| below(scene, child, Some(bounds), depth + 1, visit)),
        }
    }
    below(&scene, scene.instances[0].root, None, 0, &mut |instance, bounds, depth| {
        seen[instance] += 1;
        deepest = deepest.max(depth);
        for triangle in 0..mesh.triangles() {
            for corner in mesh.corners(triangle) {
                let place = instances[instance].1.transform_point3(corner);
                for axis in 0..3 {
                    let inside =
                        f64::from(bounds.lower[axis]) < place[axis] && place[axis] < f64::from(bounds.upper[axis]);
                    assert!(inside, "instance {instance}: {place} is not in {bounds:?}");
                }
            }
        }
    });
    assert!(seen.iter().all(|&times| times == 1), "{seen:?}");
    assert!(deepest <= BVH_SCENE_LEVELS);
}

/// A flattened mesh is still seen: its corners are stored where they are. So is one so skewed that f32 would lose it.
#[test]
fn instances_without_a_usable_inverse_are_stored_in_scene_space() {
    let mesh = meshes::bumpy_icosphere(2);
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 2.0));
    let skewed = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1e-4, 0.0), DVec3::Z));
    let plain = DAffine3::from_scale(DVec3::new(1e-6, 1.0, -3.0));
    let instances = [(0, plain), (0, flat), (0, skewed)];
    let scene = SceneBvh::build(&instances, &[built(&mesh)]).expect("a scene");
    assert_eq!(scene.triangles.len(), 3 * mesh.triangles());
    let identity = scene.instances[0].local_from_scene;
    assert_ne!(scene.instances[1].local_from_scene, identity, "scales along the axes lose nothing");
    assert_eq!(scene.instances[2].local_from_scene, identity);
    assert_eq!(scene.instances[3].local_from_scene, identity);
    let flattened = &scene.triangles[mesh.triangles()..2 * mesh.triangles()];
    for triangle in flattened {
        let [a, ..] = mesh.corners(triangle.index as usize);
        assert_eq!(triangle.a, flat.transform_point3(a).as_vec3().to_array());
    }
}

#[test]
fn a_moved_instance_leaves_a_scene_as_if_built_there() {
    let mesh = meshes::random_triangles(500, 0.1, 4);
    let meshes = [built(&mesh), built(&Mesh::default())];
    let mut places = scenes::twelve_places();
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
    let mesh = meshes::random_triangles(20, 0.1, 4);
    let mut places = scenes::twelve_places();
    places[2].1 = DAffine3::from_scale(DVec3::new(0.0, 1.0, 1.0));
    let placements = Placements::new(&places, 1, |_| corners(&mesh)).expect("usable places");
    let own: Vec<usize> =
        placements.list().iter().filter(|placed| placed.in_scene_space).map(|placed| placed.instance).collect();
    assert_eq!(own, [2]);
    let scene = SceneBvh::build(&places, &[built(&mesh)]).expect("a usable scene");
    let identity = scene.instances[0].local_from_scene;
    let stored: Vec<usize> = (0..12).filter(|k| scene.instances[k + 1].local_from_scene == identity).collect();
    assert_eq!(stored, own);
}
