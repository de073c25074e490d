//! A scene as plain data: meshes, where they stand, how they look, and what lights them. No GPU.

mod atlas;
pub mod bvh;
mod centre;
mod cone_means;
mod contained;
mod environment;
mod environment_exr;
mod environment_file;
mod error;
mod fingerprint;
mod gltf;
mod light;
mod material;
mod memory;
mod mesh;
pub mod procedural;
mod small_lights;
mod tangents;
mod texture;

pub use atlas::{Atlas, AtlasImage, AtlasLimits, AtlasRecord};
pub use environment::{EnvironmentReport, EquirectMap};
pub use error::{SceneError, SceneErrorCode};
pub use gltf::LoadLimits;
pub use light::{Camera, Light};
pub use material::{AlphaMode, Clearcoat, Glint, Material, Sheen, Specular, TextureRef};
pub use mesh::{Bounds, Instance, Mesh};
pub use small_lights::{LightRing, SmallLight};
pub use texture::{Encoding, MipLevel, Texture, Wrap, mip_count, mip_extent};

use glam::DVec3;
use std::path::Path;

/// Everything that a picture shows, in a right-handed world, +Y up, metres.
///
/// A loaded scene is sound: every index in it is in range, every number finite, every attribute as long as its mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The file's name, or what the caller called it.
    pub name: String,
    /// Each with one material.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes.
    pub instances: Vec<Instance>,
    /// Each used by some mesh, or from the file.
    pub materials: Vec<Material>,
    /// What the materials refer to.
    pub textures: Vec<Texture>,
    /// In world space.
    pub lights: Vec<Light>,
    /// In the order of the file's nodes.
    pub cameras: Vec<Camera>,
    /// What was ignored, approximated or repaired, one line each.
    pub warnings: Vec<String>,
    /// The environment that the scene asks for (`environment` in the glTF scene's extras): a name or a path, as
    /// written there, not resolved.
    pub environment: Option<String>,
}

impl Scene {
    /// Loads a `.gltf` or `.glb` file and what it refers to, within [`LoadLimits::default`].
    ///
    /// What is wrong beyond repair is an error; what was repaired or left out is in [`Scene::warnings`]. Meshes are near
    /// their own origin: see [`Scene::centre_far_meshes`].
    pub fn load(path: &Path) -> Result<Scene, SceneError> {
        Self::load_within(path, &LoadLimits::default())
    }

    /// Loads a `.gltf` or `.glb` file within limits of one's own.
    pub fn load_within(path: &Path, limits: &LoadLimits) -> Result<Scene, SceneError> {
        gltf::load(path, limits)
    }

    /// Reads a binary glTF that refers to no other files; `name` stands for the file's in errors.
    pub fn from_glb_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
        Self::from_glb_bytes_within(name, bytes, &LoadLimits::default())
    }

    /// Reads a binary glTF that refers to no other files, within limits of one's own.
    pub fn from_glb_bytes_within(name: &str, bytes: &[u8], limits: &LoadLimits) -> Result<Scene, SceneError> {
        gltf::from_bytes(name, bytes, limits)
    }

    /// The box around all instances, in world space; none when nothing is there.
    pub fn bounds(&self) -> Option<Bounds> {
        let of_mesh: Vec<Option<Bounds>> = self.meshes.iter().map(Mesh::bounds).collect();
        self.instances
            .iter()
            .filter_map(|instance| {
                let local = of_mesh[instance.mesh]?;
                let corner = |k: usize| {
                    let pick = |axis: usize| if k >> axis & 1 == 0 { local.min[axis] } else { local.max[axis] };
                    instance.world_from_local.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
                };
                Bounds::around((0..8).map(corner))
            })
            .reduce(Bounds::union)
    }

    /// How many triangles the instances show together.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|instance| self.meshes[instance.mesh].triangle_count()).sum()
    }

    /// The file's first camera, or else one that sees the whole scene from the front, a little from above.
    pub fn default_camera(&self) -> Camera {
        if let Some(camera) = self.cameras.first() {
            return camera.clone();
        }
        let (center, radius) = self.bounds().map_or((DVec3::ZERO, 1.0), |b| (b.center(), b.radius()));
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let vertical_fov_radians = 40f64.to_radians();
        let distance = 1.05 * radius / (vertical_fov_radians / 2.0).sin();
        let eye = center + DVec3::new(0.35, 0.35, 1.0).normalize() * distance;
        Camera::looking_at("default", eye, center, vertical_fov_radians, (distance - radius) * 0.1)
    }
}
