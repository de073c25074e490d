//! The hierarchy over the instances of a scene, with those of their meshes, ready for storage buffers.

use super::build::{Limits, Primitive, build};
use super::{Bounds, BvhError, END_OF_TRIANGLES, LARGEST_COORDINATE, MeshBvh, leaf, leaf_range, moved, renamed};
use glam::{DAffine3, DMat3, DVec3};
use mica_shaders::constants::{BVH_NOTHING, BVH_SCENE_LEVELS};
use mica_shaders::types::{BvhInstance, BvhNode, BvhTriangle};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Instances in one scene, at most: what halving alone can tell apart in [`BVH_SCENE_LEVELS`].
const MAX_INSTANCES: usize = 1 << BVH_SCENE_LEVELS;

/// Relative error of each term of a ray in local space: that of its coefficient, of a product and of three sums makes 5
/// units of rounding; the rest is reserve.
const RAY_ROUNDOFF: f64 = 8.0 * 0.5 * f32::EPSILON as f64;

/// An instance whose transform makes rounding errors so many times larger is stored in scene space instead. A rotation
/// makes them at most 3 times larger, scales along the mesh's or the scene's axes not at all.
const TOLERABLE_GAIN: f64 = 64.0;

/// A hierarchy over instances of meshes, in three arrays that are never empty, so that each makes a storage buffer.
#[derive(Clone, Debug)]
pub struct SceneBvh {
    /// The nodes of the scene and of every mesh in use.
    pub nodes: Vec<BvhNode>,
    /// The triangles of every mesh in use.
    pub triangles: Vec<BvhTriangle>,
    /// The scene, then the instances in the order they were given.
    pub instances: Vec<BvhInstance>,
}

/// An instance that a ray can meet.
struct Placed {
    instance: usize,
    mesh: usize,
    scene_from_local: DAffine3,
    /// Its box in scene space, without the rounding of f32.
    lower: DVec3,
    upper: DVec3,
}

impl SceneBvh {
    /// Builds over `instances`: the index of a mesh in `meshes`, and where it is in scene space.
    ///
    /// An instance of an empty mesh stays empty. One whose transform has no inverse (a mesh flattened by a scale of
    /// 0), or one too skewed for f32, is stored in scene space, as triangles of its own.
    ///
    /// # Errors
    /// [`BvhError`] for meshes that do not exist and transforms that are not finite or leave the range of coordinates.
    pub fn build(instances: &[(usize, DAffine3)], meshes: &[MeshBvh]) -> Result<Self, BvhError> {
        if instances.len() > MAX_INSTANCES {
            return Err(BvhError::TooMany { what: "instances", count: instances.len(), limit: MAX_INSTANCES });
        }
        let placed = instances
            .par_iter()
            .enumerate()
            .filter_map(|(instance, &(mesh, scene_from_local))| {
                Placed::new(instance, mesh, scene_from_local, meshes).transpose()
            })
            .collect::<Result<Vec<_>, BvhError>>()?;
        let reach =
            placed.iter().fold(DVec3::ZERO, |reach, placed| reach.max(placed.lower.abs()).max(placed.upper.abs()));

        let empty = instance(DAffine3::IDENTITY, BVH_NOTHING);
        let mut scene = Self { nodes: Vec::new(), triangles: Vec::new(), instances: vec![empty; instances.len() + 1] };
        let mut roots = BTreeMap::new();
        let mut primitives = Vec::with_capacity(placed.len());
        for placed in &placed {
            let index = placed.instance as u32 + 1;
            let mesh = &meshes[placed.mesh];
            let local_from_scene = placed.scene_from_local.inverse();
            let error = ray_error(placed.scene_from_local, local_from_scene, reach);
            let tolerable = TOLERABLE_GAIN * RAY_ROUNDOFF * reach.max_element();
            // Written so that NaN, from a transform without inverse, takes the second way.
            let (local_from_scene, root, bounds) = if error.cmple(DVec3::splat(tolerable)).all() {
                let root = match roots.get(&placed.mesh) {
                    Some(&root) => root,
                    None => scene.append(mesh)?,
                };
                roots.insert(placed.mesh, root);
                (local_from_scene, root, outward(placed.lower - error, placed.upper + error))
            } else {
                let mesh = in_scene_space(mesh, placed.scene_from_local)?;
                (DAffine3::IDENTITY, scene.append(&mesh)?, mesh.bounds)
            };
            scene.instances[index as usize] = instance(local_from_scene, root);
            primitives.push(Primitive { bounds, index });
        }
        scene.append_top(&mut primitives);
        Ok(scene)
    }

    /// Appends the nodes over the instances and makes their root the scene's.
    fn append_top(&mut self, primitives: &mut [Primitive]) {
        let tree = build(primitives, Limits { leaf: 1, levels: BVH_SCENE_LEVELS });
        let base = self.nodes.len() as u32;
        let named = |reference| match leaf_range(reference) {
            Some((position, _)) => leaf(primitives[position as usize].index, 1),
            None => moved(reference, base, 0),
        };
        self.nodes.extend(tree.nodes.iter().map(|node| renamed(node, named)));
        self.instances[0].root = named(tree.root);
        // A storage buffer has at least one element, even where no ray will ask for it.
        if self.nodes.is_empty() {
            self.nodes.push(BvhNode::default());
        }
        if self.triangles.is_empty() {
            self.triangles.push(BvhTriangle::default());
        }
    }

    /// Appends a mesh; returns the reference to its root.
    fn append(&mut self, mesh: &MeshBvh) -> Result<u32, BvhError> {
        let count = self.triangles.len() + mesh.triangles.len();
        if count > END_OF_TRIANGLES {
            return Err(BvhError::TooMany { what: "triangles", count, limit: END_OF_TRIANGLES });
        }
        let (nodes, triangles) = (self.nodes.len() as u32, self.triangles.len() as u32);
        self.nodes.extend(mesh.nodes.iter().map(|node| renamed(node, |reference| moved(reference, nodes, triangles))));
        self.triangles.extend_from_slice(&mesh.triangles);
        Ok(moved(mesh.root, nodes, triangles))
    }
}

impl Placed {
    /// Places one instance; `None` where its mesh is empty.
    fn new(
        instance: usize,
        mesh: usize,
        scene_from_local: DAffine3,
        meshes: &[MeshBvh],
    ) -> Result<Option<Self>, BvhError> {
        let Some(triangles) = meshes.get(mesh).map(MeshBvh::triangles) else {
            return Err(BvhError::NoSuchMesh { instance, mesh, meshes: meshes.len() });
        };
        let (mut lower, mut upper) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in triangles.iter().flat_map(|triangle| [triangle.a, triangle.b, triangle.c]) {
            let corner = scene_from_local.transform_point3(DVec3::from(corner.map(f64::from)));
            // Written so that NaN fails.
            if !corner.abs().cmple(DVec3::splat(f64::from(LARGEST_COORDINATE))).all() {
                return Err(BvhError::BadTransform { instance });
            }
            lower = lower.min(corner);
            upper = upper.max(corner);
        }
        Ok((!triangles.is_empty()).then_some(Self { instance, mesh, scene_from_local, lower, upper }))
    }
}

/// How far, along each axis of scene space, a ray traced in local space by f32 may pass from where it should.
///
/// The local origin `M o + t`, and any point along the ray, carries [`RAY_ROUNDOFF`] in each of its terms, and `W` takes
/// that back to scene space: with `R` the reach of the scene, `|W| (|M| R + |t|)` bounds the sum of the terms.
fn ray_error(scene_from_local: DAffine3, local_from_scene: DAffine3, reach: DVec3) -> DVec3 {
    let absolute = |matrix: DMat3| DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs());
    let local = absolute(local_from_scene.matrix3) * reach + local_from_scene.translation.abs();
    RAY_ROUNDOFF * (absolute(scene_from_local.matrix3) * local)
}

/// A mesh with its corners moved to scene space, each to the nearest f32.
fn in_scene_space(mesh: &MeshBvh, scene_from_local: DAffine3) -> Result<MeshBvh, BvhError> {
    let mut corners = vec![[[0.0; 3]; 3]; mesh.triangles.len()];
    for triangle in &mesh.triangles {
        corners[triangle.index as usize] = [triangle.a, triangle.b, triangle.c]
            .map(|corner| scene_from_local.transform_point3(DVec3::from(corner.map(f64::from))).as_vec3().to_array());
    }
    MeshBvh::over(&corners)
}

/// The least box of f32 around one of f64.
fn outward(lower: DVec3, upper: DVec3) -> Bounds {
    let down = |value: f64| if f64::from(value as f32) <= value { value as f32 } else { (value as f32).next_down() };
    let up = |value: f64| -down(-value);
    Bounds { lower: lower.to_array().map(down), upper: upper.to_array().map(up) }
}

/// A placement for the GPU, its map rounded to f32.
fn instance(local_from_scene: DAffine3, root: u32) -> BvhInstance {
    let row = |row| {
        let coefficients = local_from_scene.matrix3.row(row);
        [coefficients.x, coefficients.y, coefficients.z, local_from_scene.translation[row]].map(|value| value as f32)
    };
    BvhInstance { local_from_scene: [row(0), row(1), row(2)], root, ..BvhInstance::default() }
}
