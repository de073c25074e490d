//! Rays through the occluders of a renderer, and past a plain list of the same triangles.

use crate::{Laboratory, StabilityError};
use glam::{DAffine3, DVec3};
use mica_gpu::Timing;
use mica_graph::{Extent, Graph};
use mica_render::scene::{Instance, Material, Mesh, Scene};
use mica_render::{OcclusionBackend, Question, Ray, RayAnswer, Renderer};
use mica_shaders::listed_triangles::{Bind, Params};
use mica_shaders::types::{ListedHit, ListedRay, ListedTriangle};

/// Triangles that share no vertex, placed in the world.
pub fn soup(triangles: &[[DVec3; 3]], world_from_local: DAffine3) -> Scene {
    let positions: Vec<[f32; 3]> = triangles.iter().flatten().map(|corner| corner.as_vec3().to_array()).collect();
    let mesh = Mesh {
        name: "soup".to_owned(),
        normals: vec![[0.0, 0.0, 1.0]; positions.len()],
        indices: (0..positions.len() as u32).collect(),
        positions,
        ..Mesh::default()
    };
    Scene {
        name: "soup".to_owned(),
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_local, name: "soup".to_owned() }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

/// Corners of the only mesh's triangles, in its own space, exactly.
pub fn triangles_of(scene: &Scene) -> Vec<[DVec3; 3]> {
    let corner = |position: &[f32; 3]| DVec3::from(position.map(f64::from));
    scene.meshes[0].positions.as_chunks::<3>().0.iter().map(|corners| corners.each_ref().map(corner)).collect()
}

/// An endless ray.
pub fn ray(origin: DVec3, direction: DVec3) -> Ray {
    let [origin, direction] = [origin, direction].map(|of| of.as_vec3().to_array());
    Ray { origin, direction, t_max: f32::INFINITY, ..Ray::default() }
}

impl Laboratory<'_> {
    /// What rays in scene space meet first of a scene, by the hierarchy that the renderer builds and walks.
    pub fn closest(&mut self, scene: &Scene, rays: &[Ray]) -> Result<Vec<RayAnswer>, StabilityError> {
        let mut renderer = Renderer::new(scene.clone(), &[], None, OcclusionBackend::Bvh)?;
        let mut graph = Graph::new();
        let mut asked = graph.buffer("rays", size_of_val(rays) as u64);
        graph.upload(&mut asked, bytemuck::cast_slice::<_, u8>(rays));
        let mut answers = graph.buffer("answers", (rays.len() * size_of::<RayAnswer>()) as u64);
        renderer.trace(&mut graph, &asked, rays.len() as u32, Question::Closest, &mut answers)?;
        let download = graph.download(&answers);
        let bytes = self.executor.run(graph, Timing::Overlapped)?.take(download);
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// What the same rays meet first of a list of triangles in scene space, one after the other by the test of Moeller and
    /// Trumbore 1997.
    pub fn closest_listed(&mut self, triangles: &[[DVec3; 3]], rays: &[Ray]) -> Result<Vec<RayAnswer>, StabilityError> {
        let corner = |corner: &DVec3| corner.as_vec3().extend(0.0).to_array();
        let triangles: Vec<ListedTriangle> =
            triangles.iter().map(|corners| ListedTriangle { corners: corners.each_ref().map(corner) }).collect();
        let listed: Vec<ListedRay> = rays
            .iter()
            .map(|ray| ListedRay { origin: ray.origin, t_max: ray.t_max, direction: ray.direction, reserved: 0 })
            .collect();
        let mut graph = Graph::new();
        let mut list = graph.buffer("triangles", size_of_val(&triangles[..]) as u64);
        graph.upload(&mut list, bytemuck::cast_slice::<_, u8>(&triangles));
        let mut asked = graph.buffer("rays", size_of_val(&listed[..]) as u64);
        graph.upload(&mut asked, bytemuck::cast_slice::<_, u8>(&listed));
        let mut hits = graph.buffer("hits", (rays.len() * size_of::<ListedHit>()) as u64);
        let bind = Bind { listed_rays: &asked, listed_triangles: &list, listed_hits: &mut hits };
        let params = Params { count: rays.len() as u32, triangle_count: triangles.len() as u32 };
        graph.pass(bind, params, Extent::new(rays.len() as u32, 1));
        let download = graph.download(&hits);
        let bytes = self.executor.run(graph, Timing::Overlapped)?.take(download);
        let answer = |hit: ListedHit| RayAnswer {
            t: hit.t,
            blocked: u32::from(hit.triangle != 0),
            triangle: hit.triangle.saturating_sub(1),
            ..RayAnswer::default()
        };
        Ok(bytemuck::pod_collect_to_vec::<u8, ListedHit>(&bytes).into_iter().map(answer).collect())
    }
}
