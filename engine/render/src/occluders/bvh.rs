//! Occluders as a hierarchy of bounding volumes in storage buffers.

use super::{Places, is_masked};
use crate::RenderError;
use crate::filled::Filled;
use crate::scene::bvh::{BuildOptions, MeshBvh, SceneBvh, SceneTop};
use crate::scene::{Mesh, Scene};
use crate::scene_buffers::SceneBuffers;
use mica_graph::Graph;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// The hierarchy that `occlusion/bvh.glsl` walks.
pub(crate) struct Bvh {
    pub nodes: Filled,
    pub triangles: Filled,
    pub instances: Filled,
    /// What moves instances: neither nodes nor triangles of meshes are needed for it.
    top: SceneTop,
    /// The nodes over the instances, if they changed.
    top_nodes: Option<Arc<[u8]>>,
    /// Of each mesh, where an instance is stored in scene space: when that moves, no mesh is built over again. As large as
    /// the buffers, so scenes without such instances do without.
    meshes: Option<Vec<MeshBvh>>,
}

impl Bvh {
    /// Builds it on the host. `placed` counts triangles and instances that found their place.
    pub fn build(scene: &Scene, places: &Places, placed: Option<&AtomicU64>) -> Result<Self, RenderError> {
        let build = |mesh: &Mesh| {
            let options = BuildOptions { masked: is_masked(scene, mesh), placed };
            MeshBvh::build_with(&mesh.positions, &mesh.indices, options)
        };
        let meshes = scene.meshes.par_iter().map(build).collect::<Result<Vec<_>, _>>()?;
        Self::over(meshes, places, placed)
    }

    fn over(meshes: Vec<MeshBvh>, places: &Places, placed: Option<&AtomicU64>) -> Result<Self, RenderError> {
        let SceneBvh { nodes, triangles, instances, top } = SceneBvh::build_with(places, &meshes, placed)?;
        let meshes = top.stores_in_scene_space().then_some(meshes);
        Ok(Self {
            nodes: Filled::new("bvh_nodes", &nodes),
            triangles: Filled::new("bvh_triangles", &triangles),
            instances: Filled::new("bvh_instances", &instances),
            top,
            top_nodes: None,
            meshes,
        })
    }

    /// Follows instances that moved: the nodes above them are built again. If triangles are stored in scene space, or have to be
    /// from now on, those are too, and everything is laid out anew.
    pub fn place(
        &mut self,
        scene: &Scene,
        buffers: &SceneBuffers,
        places: &Places,
        moved: &Places,
    ) -> Result<(), RenderError> {
        match self.top.place(moved, |mesh| buffers.box_corners(mesh))? {
            Some(level) => {
                self.top_nodes = Some(Arc::from(bytemuck::cast_slice::<_, u8>(&level.nodes)));
                self.instances.replace(&level.instances);
            }
            None => {
                *self = match self.meshes.take() {
                    Some(meshes) => Self::over(meshes, places, None)?,
                    None => Self::build(scene, places, None)?,
                };
            }
        }
        Ok(())
    }

    /// Declares the uploads that are still to be done.
    pub fn update(&mut self, g: &mut Graph) {
        self.nodes.upload(g);
        if let Some(nodes) = self.top_nodes.take().filter(|nodes| !nodes.is_empty()) {
            g.update(&mut self.nodes.buffer, 0, nodes);
        }
        self.triangles.upload(g);
        self.instances.upload(g);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Atlas, AtlasLimits, Instance, Material};
    use glam::{DAffine3, DVec3};

    /// A triangle upright and one that is flattened, of a mesh each.
    fn scene() -> Scene {
        let mesh = |size: f32| Mesh {
            positions: vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, size]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let instance = |mesh, world_from_local| Instance { mesh, world_from_local, name: String::new() };
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        Scene {
            meshes: vec![mesh(1.0), mesh(2.0)],
            materials: vec![Material::default()],
            instances: vec![instance(0, DAffine3::IDENTITY), instance(1, flat)],
            ..Scene::default()
        }
    }

    #[test]
    fn moving_what_is_stored_in_scene_space_builds_over_no_mesh_again() {
        let mut scene = scene();
        let atlas = Atlas::pack(&[], AtlasLimits::default());
        let buffers = SceneBuffers::new(&scene, &[], &atlas).expect("a sound scene");
        let places = |scene: &Scene| -> Vec<_> {
            scene.instances.iter().map(|instance| (instance.mesh, buffers.scene_from_local(instance))).collect()
        };
        let mut bvh = Bvh::build(&scene, &places(&scene), None).expect("a sound scene");
        // To build over them again would fail.
        scene.meshes.iter_mut().for_each(|mesh| mesh.indices.push(7));
        let move_to = |scene: &mut Scene, bvh: &mut Bvh, place| {
            scene.instances[1].world_from_local = place;
            let places = places(scene);
            bvh.place(scene, &buffers, &places, &[(1, places[1].1)])
        };
        let flat = |y| DAffine3::from_translation(DVec3::Y * y) * DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        for y in [0.25, 0.5] {
            assert!(move_to(&mut scene, &mut bvh, flat(y)).is_ok(), "flat, and somewhere else");
        }
        assert!(move_to(&mut scene, &mut bvh, DAffine3::IDENTITY).is_ok(), "upright again");
        assert!(bvh.meshes.is_none(), "nothing is kept that has no use");
        assert!(move_to(&mut scene, &mut bvh, flat(0.5)).is_err(), "built over again");
    }
}
