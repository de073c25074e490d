//! What the host builds over a mesh: structure, depth, quality, copies, progress, determinism and refusals.

use crate::meshes::{self, Mesh};
use crate::scenes;
use glam::DVec3;
use mica_render::scene::bvh::{
    Bounds, BuildOptions, BvhError, LEAF_TRIANGLES, MeshBvh, SceneBvh, children, leaf_range,
};
use mica_shaders::constants::{BVH_LEAF, BVH_MESH_LEVELS, BVH_NOTHING};
use mica_shaders::types::{BvhNode, BvhTriangle};
use std::sync::atomic::{AtomicU64, Ordering};

pub fn built(mesh: &Mesh) -> MeshBvh {
    built_with(mesh, BuildOptions::default())
}

fn built_with(mesh: &Mesh, options: BuildOptions) -> MeshBvh {
    MeshBvh::build_with(&mesh.positions, &mesh.indices, options).expect("a usable mesh")
}

/// Calls `visit` with every reference below `reference`, its box as its parent has it, and its depth.
fn walk(nodes: &[BvhNode], reference: u32, bounds: Bounds, depth: u32, visit: &mut impl FnMut(u32, Bounds, u32)) {
    visit(reference, bounds, depth);
    if reference & BVH_LEAF == 0 {
        for (child, bounds) in children(&nodes[reference as usize]) {
            walk(nodes, child, bounds, depth + 1, visit);
        }
    }
}

/// The box of a triangle.
fn of_triangle(triangle: &BvhTriangle) -> Bounds {
    [triangle.a, triangle.b, triangle.c]
        .into_iter()
        .fold(Bounds::EMPTY, |bounds, corner| bounds.union(Bounds::of_point(corner)))
}

/// How many nodes lie above the deepest leaf.
pub fn depth(bvh: &MeshBvh) -> u32 {
    let mut deepest = 0;
    walk(bvh.nodes(), bvh.root(), bvh.bounds(), 0, &mut |_, _, depth| deepest = deepest.max(depth));
    deepest
}

#[test]
fn every_triangle_is_in_exactly_one_leaf_and_unchanged() {
    for (name, mesh) in meshes::all() {
        let bvh = built(&mesh);
        let mut seen = vec![0; mesh.triangles()];
        walk(bvh.nodes(), bvh.root(), bvh.bounds(), 0, &mut |reference, _, _| {
            let Some((first, count)) = leaf_range(reference) else { return };
            assert!(count as usize <= LEAF_TRIANGLES, "{name}");
            for triangle in &bvh.triangles()[first as usize..(first + count) as usize] {
                let index = triangle.index as usize;
                let corners = [0, 1, 2].map(|k| mesh.positions[mesh.indices[3 * index + k] as usize]);
                assert_eq!([triangle.a, triangle.b, triangle.c], corners, "{name}: triangle {index}");
                seen[index] += 1;
            }
        });
        // Of many copies the first is kept.
        let kept = if name == "identical" { 1 } else { mesh.triangles() };
        assert!(seen[..kept].iter().all(|&times| times == 1), "{name}: {seen:?}");
        assert!(seen[kept..].iter().all(|&times| times == 0), "{name}: {seen:?}");
    }
}

#[test]
fn every_node_is_reached_once_and_every_box_encloses_what_is_below_it() {
    for (name, mesh) in meshes::all() {
        let bvh = built(&mesh);
        let mut reached = 0;
        walk(bvh.nodes(), bvh.root(), bvh.bounds(), 0, &mut |reference, bounds, _| {
            if reference & BVH_LEAF == 0 {
                reached += 1;
                for (_, child) in children(&bvh.nodes()[reference as usize]) {
                    assert!(bounds.contains(&child), "{name}: {child:?} is not in {bounds:?}");
                }
            } else if let Some((first, count)) = leaf_range(reference) {
                for triangle in &bvh.triangles()[first as usize..(first + count) as usize] {
                    assert!(bounds.contains(&of_triangle(triangle)), "{name}: {triangle:?} is not in {bounds:?}");
                }
            }
        });
        assert_eq!(reached, bvh.nodes().len(), "{name}");
    }
}

#[test]
fn an_empty_mesh_has_no_root_and_a_single_triangle_no_node() {
    let empty = built(&Mesh::default());
    assert_eq!((empty.root(), empty.nodes().len(), empty.triangles().len()), (BVH_NOTHING, 0, 0));
    let one = built(&meshes::identical(1));
    assert_eq!((leaf_range(one.root()), one.nodes().len()), (Some((0, 1)), 0));
}

/// Where the heuristic alone would go deeper than the stack of a traversal, the tree stops short of it: 160 octaves of
/// sizes split off one octave or two at each level.
#[test]
fn no_path_is_longer_than_a_traversals_stack_allows() {
    for (name, mesh) in meshes::all() {
        assert!(depth(&built(&mesh)) <= BVH_MESH_LEVELS, "{name}");
    }
    let octaves = Mesh::soup((0..640).map(|k| {
        let place = 5e11 * 0.5f64.powf(k as f64 / 4.0);
        [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| place * (DVec3::ONE + 0.01 * corner))
    }));
    let deepest = depth(&built(&octaves));
    assert!((BVH_MESH_LEVELS - 3..=BVH_MESH_LEVELS).contains(&deepest), "{deepest} levels do not try the limit");
}

/// Masks may differ between them, so they are all kept.
#[test]
fn a_hundred_thousand_masked_triangles_in_one_place_split_in_halves() {
    let mesh = meshes::identical(100_000);
    let bvh = built_with(&mesh, BuildOptions { masked: true, ..BuildOptions::default() });
    assert_eq!((depth(&bvh), bvh.triangles().len()), (15, 100_000), "25,000 leaves of 4");
}

/// The cost by the heuristic's own measure: expected visits and tests of a ray that meets the root's box.
fn cost(bvh: &MeshBvh) -> f64 {
    let mut cost = 0.0;
    walk(bvh.nodes(), bvh.root(), bvh.bounds(), 0, &mut |reference, bounds, _| {
        let tests = leaf_range(reference).map_or(1, |(_, count)| count);
        cost += bounds.half_area() / bvh.bounds().half_area() * f64::from(tests);
    });
    cost
}

/// The same cost of the tree that splits in halves along the widest axis.
fn cost_of_halving(triangles: &mut [(DVec3, Bounds)], root: &Bounds) -> f64 {
    let bounds = triangles.iter().fold(Bounds::EMPTY, |bounds, triangle| bounds.union(triangle.1));
    let share = bounds.half_area() / root.half_area();
    if triangles.len() <= LEAF_TRIANGLES {
        return share * triangles.len() as f64;
    }
    let low = triangles.iter().fold(DVec3::INFINITY, |low, triangle| low.min(triangle.0));
    let high = triangles.iter().fold(DVec3::NEG_INFINITY, |high, triangle| high.max(triangle.0));
    let axis = (high - low).max_position();
    triangles.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
    let (left, right) = triangles.split_at_mut(triangles.len() / 2);
    share + cost_of_halving(left, root) + cost_of_halving(right, root)
}

/// The bounds are a little above what was measured: 0.845, 0.812, 0.824 and 0.563.
#[test]
fn the_tree_costs_clearly_less_than_one_of_halves() {
    // A dense small sphere inside a sparse large one: halves follow the counts, good planes the empty space.
    let sparse = meshes::bumpy_icosphere(2).map(|point| 100.0 * point);
    let dense = meshes::bumpy_icosphere(4).map(|point| point + DVec3::new(30.0, 20.0, 10.0));
    let cases = [
        ("icosphere", meshes::bumpy_icosphere(5), 0.88),
        ("soup", meshes::random_triangles(20_000, 0.05, 5), 0.85),
        ("sticks", meshes::long_sticks(2_000), 0.86),
        ("nested", sparse.and(dense), 0.6),
    ];
    for (name, mesh, most) in cases {
        let bvh = built(&mesh);
        let mut triangles: Vec<(DVec3, Bounds)> = bvh
            .triangles()
            .iter()
            .map(|triangle| {
                let bounds = of_triangle(triangle);
                let middle = std::array::from_fn(|k| f64::from(bounds.lower[k]) + f64::from(bounds.upper[k]));
                (DVec3::from_array(middle), bounds)
            })
            .collect();
        let ratio = cost(&bvh) / cost_of_halving(&mut triangles, &bvh.bounds());
        println!("{name}: {ratio:.3} of the cost of halving");
        assert!(ratio < most, "{name}: {ratio:.3} of the cost of halving");
    }
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mesh = meshes::bumpy_icosphere(6);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| built(&mesh))
    };
    let (one, four) = (with(1), with(4));
    assert_eq!(one.nodes(), four.nodes());
    assert_eq!(one.triangles(), four.triangles());
}

#[test]
fn unusable_meshes_are_refused_with_the_place_of_the_fault() {
    let good = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let refused = |positions: &[[f32; 3]], indices: &[u32]| MeshBvh::build(positions, indices).expect_err("a refusal");
    assert_eq!(refused(&good, &[0, 1]), BvhError::PartialTriangle { indices: 2 });
    let expected = BvhError::NoSuchVertex { triangle: 1, vertex: 3, vertices: 3 };
    assert_eq!(refused(&good, &[0, 1, 2, 0, 1, 3]), expected);
    for bad in [f32::INFINITY, -2e12] {
        let position = [0.0, bad, 0.0];
        let expected = BvhError::BadPosition { triangle: 0, position };
        assert_eq!(refused(&[good[0], good[1], position], &[0, 1, 2]), expected);
    }
    let nan = refused(&[good[0], good[1], [f32::NAN; 3]], &[0, 1, 2]);
    assert!(matches!(nan, BvhError::BadPosition { triangle: 0, .. }), "{nan}");
    assert!(MeshBvh::build(&[good[0], good[1], good[2], [f32::NAN; 3]], &[0, 1, 2]).is_ok(), "no triangle uses it");
}

#[test]
fn progress_ends_at_the_number_of_triangles_and_of_instances() {
    for mesh in [Mesh::default(), meshes::random_triangles(3, 0.1, 1), meshes::random_triangles(50_000, 0.1, 2)] {
        let placed = AtomicU64::new(0);
        let bvh = built_with(&mesh, BuildOptions { placed: Some(&placed), ..BuildOptions::default() });
        assert_eq!(placed.load(Ordering::Relaxed), mesh.triangles() as u64);
        let placed = AtomicU64::new(0);
        SceneBvh::build_with(&scenes::twelve_places(), &[bvh], Some(&placed)).expect("a usable scene");
        assert_eq!(placed.load(Ordering::Relaxed), 12);
    }
}

/// Of copies in one place the first is kept; where masks may tell them apart, of those that share their vertices.
#[test]
fn copies_are_dropped_where_rays_cannot_tell_them_apart() {
    let apart = meshes::identical(1_000).and(meshes::random_triangles(50, 0.1, 3));
    let kept = |mesh: &Mesh, masked| {
        let bvh = built_with(mesh, BuildOptions { masked, ..BuildOptions::default() });
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
