//! One function for each format: it reads bytes as the renderer does, and asserts that what was read is sound.

use crate::corpus::gltf::with_image;
use mica_render::Cache;
use mica_render::scene::{EquirectMap, LoadLimits, Scene};

/// What entries of the cache are stored under.
pub const CACHE_KEY: &str = "table";

/// So little that thousands of inputs a second leave the machine alone; the checks are the same.
fn limits() -> LoadLimits {
    LoadLimits { image_bytes: 1 << 22, total_bytes: 1 << 24, instances: 1 << 12, ..LoadLimits::default() }
}

/// glTF as JSON; true where a scene came of it.
pub fn gltf(bytes: &[u8]) -> bool {
    scene(bytes)
}

/// Binary glTF; true where a scene came of it.
pub fn glb(bytes: &[u8]) -> bool {
    scene(bytes)
}

/// An OpenEXR environment map; true where it was read.
pub fn exr(bytes: &[u8]) -> bool {
    map(bytes)
}

/// A Radiance environment map; true where it was read.
pub fn hdr(bytes: &[u8]) -> bool {
    map(bytes)
}

/// A PNG as the texture of a scene; true where it was read.
pub fn png(bytes: &[u8]) -> bool {
    scene(&with_image(bytes))
}

/// A JPEG as the texture of a scene; true where it was read.
pub fn jpeg(bytes: &[u8]) -> bool {
    scene(&with_image(bytes))
}

/// An entry of the cache; true where it is one that was written.
pub fn cache(bytes: &[u8]) -> bool {
    let payload = Cache::payload(CACHE_KEY, bytes);
    if let Some(payload) = &payload {
        assert_eq!(Cache::entry(CACHE_KEY, payload), bytes, "the checksum of other bytes was taken");
    }
    payload.is_some()
}

fn scene(bytes: &[u8]) -> bool {
    match Scene::from_glb_bytes_within("fuzz", bytes, &limits()) {
        Ok(scene) => {
            assert_sound(&scene);
            true
        }
        Err(error) => {
            assert_one_line(&error.to_string());
            false
        }
    }
}

fn map(bytes: &[u8]) -> bool {
    match EquirectMap::from_file_bytes("fuzz", bytes) {
        Ok((map, _)) => {
            assert_eq!(map.texels.len(), map.width as usize * map.height as usize);
            assert!(map.texels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "texels are not repaired");
            true
        }
        Err(error) => {
            assert_one_line(&error.to_string());
            false
        }
    }
}

fn assert_one_line(error: &str) {
    assert!(!error.contains('\n') && error.len() < 2000, "{error}");
}

/// What the renderer takes for granted of a scene.
fn assert_sound(scene: &Scene) {
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert!(mesh.indices.iter().all(|&index| (index as usize) < vertices), "an index past the vertices");
        assert!(mesh.material < scene.materials.len());
        assert_eq!(mesh.normals.len(), vertices);
        assert!(
            [mesh.uv[0].len(), mesh.uv[1].len(), mesh.colors.len(), mesh.tangents.len()]
                .iter()
                .all(|length| [0, vertices].contains(length))
        );
        assert!(mesh.positions.iter().chain(&mesh.normals).flatten().all(|c| c.is_finite()));
        assert!(mesh.uv.iter().flatten().flatten().all(|c| c.is_finite()));
    }
    for texture in &scene.textures {
        assert!(texture.width > 0 && texture.height > 0);
        assert_eq!(texture.pixels.len(), texture.width as usize * texture.height as usize * 4);
    }
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len() && instance.world_from_local.is_finite());
    }
}
