//! A plane of flakes under one light, for what only whole frames show.

use crate::{Laboratory, StabilityError};
use glam::{DAffine3, DVec3};
use mica_gpu::Timing;
use mica_graph::{Graph, Image};
use mica_render::scene::{Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{Environment, Frame, OcclusionBackend, Renderer, View};

/// A square of the plane y = 0 about the origin, facing up. Its flakes alone reflect, and they reflect everything.
pub struct Plane {
    /// Half its side, metres.
    pub half: f32,
    /// Added to its texture coordinates, which are x and z.
    pub uv: [f32; 2],
    /// Towards the only light, whose irradiance is 1.
    pub light: Option<DVec3>,
    /// Light from everywhere.
    pub environment: Option<Environment>,
}

impl Plane {
    /// The plane as a method renders it, with these settings.
    ///
    /// # Errors
    /// Those of the renderer and its settings.
    pub fn renderer(&self, method: &str, settings: &[(&str, &str)]) -> Result<Renderer, StabilityError> {
        let corners =
            [[-self.half, -self.half], [-self.half, self.half], [self.half, self.half], [self.half, -self.half]];
        let mesh = Mesh {
            name: "plane".to_owned(),
            positions: corners.map(|[x, z]| [x, 0.0, z]).to_vec(),
            normals: vec![[0.0, 1.0, 0.0]; 4],
            uv: [corners.map(|[x, z]| [x + self.uv[0], z + self.uv[1]]).to_vec(), Vec::new()],
            indices: vec![0, 1, 2, 0, 2, 3],
            has_uv: true,
            ..Mesh::default()
        };
        let glint = Glint { color: Some([1.0; 3]), method: Some(method.to_owned()), ..Glint::default() };
        let material = Material {
            name: "flakes".to_owned(),
            base_color: [0.0, 0.0, 0.0, 1.0],
            glint: Some(glint),
            ..Material::default()
        };
        let scene = Scene {
            name: "plane".to_owned(),
            meshes: vec![mesh],
            instances: vec![Instance { mesh: 0, world_from_local: DAffine3::IDENTITY, name: "plane".to_owned() }],
            materials: vec![material],
            ..Scene::default()
        };
        let sun = |towards: DVec3| Light::Directional { direction: -towards, irradiance: [1.0; 3] };
        let lights: Vec<Light> = self.light.map(sun).into_iter().collect();
        let mut renderer = Renderer::new(scene, &lights, self.environment.as_ref(), OcclusionBackend::None)?;
        for (key, value) in settings {
            renderer.set(None, key, value)?;
        }
        Ok(renderer)
    }
}

/// Radiance in the green channel of every pixel.
///
/// # Errors
/// Those of the renderer and of the device.
pub fn radiance(laboratory: &mut Laboratory, renderer: &mut Renderer, view: &View) -> Result<Vec<f64>, StabilityError> {
    let pixels = pixels(laboratory, renderer, view, |frame| &frame.radiance)?;
    Ok(pixels.into_iter().map(|[_, green, ..]| f64::from(green)).collect())
}

/// Where in texture space the middle of every pixel lies, as methods are told.
///
/// # Errors
/// Those of the renderer and of the device.
pub fn texture_places(
    laboratory: &mut Laboratory,
    renderer: &mut Renderer,
    view: &View,
) -> Result<Vec<[f64; 2]>, StabilityError> {
    let pixels = pixels(laboratory, renderer, view, |frame| &frame.uv)?;
    Ok(pixels.into_iter().map(|[u, v, ..]| [f64::from(u), f64::from(v)]).collect())
}

fn pixels(
    laboratory: &mut Laboratory,
    renderer: &mut Renderer,
    view: &View,
    image: impl FnOnce(&Frame) -> &Image,
) -> Result<Vec<[f32; 4]>, StabilityError> {
    let mut graph = Graph::new();
    let frame = renderer.frame(&mut graph, view, None)?;
    let download = graph.download_image(image(&frame));
    let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// The plane's local frame, with the normal along +Z: a direction of the world in it.
pub fn local(world: DVec3) -> DVec3 {
    DVec3::new(world.x, -world.z, world.y)
}
