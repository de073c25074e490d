//! The hierarchy over the instances of a scene, with those of their meshes, ready for storage buffers.

use super::build::{Limits, Primitive, build};
use super::{Bounds, BvhError, END_OF_TRIANGLES, MeshBvh, Placements, leaf, leaf_range, moved, renamed};
use glam::{DAffine3, DVec3, Vec3};
use mica_shaders::constants::{BVH_NOTHING, BVH_SCENE_LEVELS};
use mica_shaders::types::{BvhInstance, BvhNode, BvhTriangle};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;

/// A hierarchy over instances of meshes, in three arrays that are never empty, so that each makes a storage buffer.
#[derive(Clone, Debug)]
pub struct SceneBvh {
    /// The nodes of [`TopLevel`], then those of every mesh in use.
    pub nodes: Vec<BvhNode>,
    /// The triangles of every mesh in use.
    pub triangles: Vec<BvhTriangle>,
    /// The scene, then the instances in the order they were given.
    pub instances: Vec<BvhInstance>,
    /// What it takes to move instances: small, and of use after the arrays have gone to the device.
    pub top: SceneTop,
}

/// The instances of a scene, and where the hierarchies of their meshes begin.
#[derive(Clone, Debug)]
pub struct SceneTop {
    placements: Placements,
    /// Of each instance, with or without triangles.
    roots: Vec<u32>,
}

/// What depends on where instances are.
#[derive(Clone, Debug, PartialEq)]
pub struct TopLevel {
    /// The first nodes of the scene: one fewer than there are instances with triangles, wherever they are.
    pub nodes: Vec<BvhNode>,
    /// The scene, then the instances.
    pub instances: Vec<BvhInstance>,
}

impl SceneBvh {
    /// Builds over `instances`: the index of a mesh in `meshes`, and where it is in scene space.
    ///
    /// An instance of an empty mesh stays empty. One whose transform has no inverse (a mesh flattened by a scale of
    /// 0), or one that f32 would lose, is stored in scene space, as triangles of its own.
    ///
    /// # Errors
    /// [`BvhError`] for meshes that do not exist and transforms that are not finite or leave the range of coordinates.
    pub fn build(instances: &[(usize, DAffine3)], meshes: &[MeshBvh]) -> Result<Self, BvhError> {
        Self::build_with(instances, meshes, None)
    }

    /// As [`SceneBvh::build`]; `placed` is raised by 1 for each instance whose box is known.
    ///
    /// # Errors
    /// As [`SceneBvh::build`].
    pub fn build_with(
        instances: &[(usize, DAffine3)],
        meshes: &[MeshBvh],
        placed: Option<&AtomicU64>,
    ) -> Result<Self, BvhError> {
        let corners_of = |mesh: usize| meshes[mesh].corners();
        let placements = Placements::new_with(instances, meshes.len(), corners_of, placed)?;
        let mut scene = Self {
            nodes: vec![BvhNode::default(); placements.list().len().saturating_sub(1)],
            triangles: Vec::new(),
            instances: Vec::new(),
            top: SceneTop { placements: Placements::default(), roots: vec![BVH_NOTHING; instances.len()] },
        };
        let mut roots: BTreeMap<usize, u32> = BTreeMap::new();
        for placed in placements.list() {
            let mesh = &meshes[placed.mesh];
            scene.top.roots[placed.instance] = if placed.in_scene_space {
                scene.append(&in_scene_space(mesh, placed.scene_from_local))?
            } else if let Some(&root) = roots.get(&placed.mesh) {
                root
            } else {
                *roots.entry(placed.mesh).insert_entry(scene.append(mesh)?).get()
            };
        }
        scene.top.placements = placements;
        let top = scene.top.level();
        scene.nodes[..top.nodes.len()].copy_from_slice(&top.nodes);
        scene.instances = top.instances;
        // A storage buffer has at least one element, even where no ray will ask for it.
        if scene.nodes.is_empty() {
            scene.nodes.push(BvhNode::default());
        }
        if scene.triangles.is_empty() {
            scene.triangles.push(BvhTriangle::default());
        }
        Ok(scene)
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

impl SceneTop {
    /// Moves instances, each to where it then is in scene space, without touching what lies below them. `corners_of` as in
    /// [`Placements::new`], as they were when the scene was built.
    ///
    /// `None` where the scene has to be built anew from its meshes, since triangles stored in scene space would move, or
    /// would now have to be stored there; nothing has changed then.
    ///
    /// # Errors
    /// [`BvhError`] as from [`Placements::moved`]; nothing has changed then.
    pub fn place<C: Iterator<Item = [f32; 3]>>(
        &mut self,
        moved: &[(usize, DAffine3)],
        corners_of: impl Fn(usize) -> C,
    ) -> Result<Option<TopLevel>, BvhError> {
        let Some(placements) = self.placements.moved(moved, corners_of)? else { return Ok(None) };
        self.placements = placements;
        Ok(Some(self.level()))
    }

    /// Whether any instance is stored in scene space, as triangles of its own.
    pub fn stores_in_scene_space(&self) -> bool {
        self.placements.list().iter().any(|placed| placed.in_scene_space)
    }

    fn level(&self) -> TopLevel {
        let mut instances = vec![record(DAffine3::IDENTITY, BVH_NOTHING); self.roots.len() + 1];
        let mut primitives = Vec::with_capacity(self.placements.list().len());
        for placed in self.placements.list() {
            let index = placed.instance + 1;
            let (local_from_scene, error) = match placed.ray_error(self.placements.reach()) {
                Some(error) if !placed.in_scene_space => (placed.scene_from_local.inverse(), error),
                _ => (DAffine3::IDENTITY, DVec3::ZERO),
            };
            instances[index] = record(local_from_scene, self.roots[placed.instance]);
            let bounds = outward(placed.lower - error, placed.upper + error);
            primitives.push(Primitive { bounds, index: index as u32 });
        }
        let tree = build(&mut primitives, Limits { leaf: 1, levels: BVH_SCENE_LEVELS }, None);
        let named = |reference| match leaf_range(reference) {
            Some((position, _)) => leaf(primitives[position as usize].index, 1),
            None => reference,
        };
        let nodes = tree.nodes.iter().map(|node| renamed(node, named)).collect();
        instances[0].root = named(tree.root);
        TopLevel { nodes, instances }
    }
}

/// A mesh with its corners moved to scene space, each to the nearest f32.
fn in_scene_space(mesh: &MeshBvh, scene_from_local: DAffine3) -> MeshBvh {
    let place =
        |corner: [f32; 3]| scene_from_local.transform_point3(Vec3::from(corner).as_dvec3()).as_vec3().to_array();
    let moved = |&BvhTriangle { a, index, b, c, .. }: &BvhTriangle| {
        let [a, b, c] = [a, b, c].map(place);
        BvhTriangle { a, index, b, c, ..BvhTriangle::default() }
    };
    mesh.rebuilt(&mesh.triangles.par_iter().map(moved).collect::<Vec<_>>())
}

/// The least box of f32 around one of f64.
fn outward(lower: DVec3, upper: DVec3) -> Bounds {
    let down = |value: f64| if f64::from(value as f32) <= value { value as f32 } else { (value as f32).next_down() };
    let up = |value: f64| -down(-value);
    Bounds { lower: lower.to_array().map(down), upper: upper.to_array().map(up) }
}

/// A placement for the GPU, its map rounded to f32.
fn record(local_from_scene: DAffine3, root: u32) -> BvhInstance {
    let row = |row| {
        let coefficients = local_from_scene.matrix3.row(row);
        [coefficients.x, coefficients.y, coefficients.z, local_from_scene.translation[row]].map(|value| value as f32)
    };
    BvhInstance { local_from_scene: [row(0), row(1), row(2)], root, ..BvhInstance::default() }
}
