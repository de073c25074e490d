//! Occluders as a hierarchy of bounding volumes in storage buffers.

use super::{Places, corners_of, is_masked};
use crate::RenderError;
use crate::filled::Filled;
use crate::scene::bvh::{BuildOptions, MeshBvh, SceneBvh, SceneTop};
use crate::scene::{Mesh, Scene};
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
}

impl Bvh {
    /// Builds it on the host. `placed` counts triangles that found their place.
    pub fn build(scene: &Scene, places: &Places, placed: Option<&AtomicU64>) -> Result<Self, RenderError> {
        let build = |mesh: &Mesh| {
            let options = BuildOptions { masked: is_masked(scene, mesh), placed };
            MeshBvh::build_with(&mesh.positions, &mesh.indices, options)
        };
        let meshes = scene.meshes.par_iter().map(build).collect::<Result<Vec<_>, _>>()?;
        let SceneBvh { nodes, triangles, instances, top } = SceneBvh::build(places, &meshes)?;
        Ok(Self {
            nodes: Filled::new("bvh_nodes", &nodes),
            triangles: Filled::new("bvh_triangles", &triangles),
            instances: Filled::new("bvh_instances", &instances),
            top,
            top_nodes: None,
        })
    }

    /// Follows instances that moved: the nodes above them are built again, or all if triangles are held in scene space.
    pub fn place(&mut self, scene: &Scene, places: &Places, moved: &Places) -> Result<(), RenderError> {
        match self.top.place(moved, |mesh| corners_of(&scene.meshes[mesh]))? {
            Some(level) => {
                self.top_nodes = Some(Arc::from(bytemuck::cast_slice::<_, u8>(&level.nodes)));
                self.instances.replace(&level.instances);
            }
            None => *self = Self::build(scene, places, None)?,
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
