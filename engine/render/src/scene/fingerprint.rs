//! What a scene or an environment shows in a few letters: figures measured of it are worth keeping while these stay the same.

use super::{EquirectMap, Mesh, Scene, Texture};
use std::fmt::{self, Arguments, Write};

impl Scene {
    /// Letters that change with anything that a picture shows. Where the scene was loaded from, and what was said of it then,
    /// are no part of that.
    pub fn fingerprint(&self) -> String {
        let Self { name: _, meshes, instances, materials, textures, lights, cameras, warnings: _, environment: _ } =
            self;
        let mut letters = Letters::default();
        for mesh in meshes {
            let Mesh { name: _, positions, normals, tangents, uv: [uv0, uv1], colors, indices, material, has_uv } =
                mesh;
            letters.bytes(bytemuck::cast_slice(positions));
            letters.bytes(bytemuck::cast_slice(normals));
            letters.bytes(bytemuck::cast_slice(tangents));
            letters.bytes(bytemuck::cast_slice(uv0));
            letters.bytes(bytemuck::cast_slice(uv1));
            letters.bytes(bytemuck::cast_slice(colors));
            letters.bytes(bytemuck::cast_slice(indices));
            letters.text(format_args!("{material} {has_uv}"));
        }
        for texture in textures {
            let Texture { name: _, width, height, pixels, encoding, wrap, nearest } = texture;
            letters.bytes(pixels);
            letters.text(format_args!("{width} {height} {encoding:?} {wrap:?} {nearest}"));
        }
        // These are small. Numbers are written with all the digits that tell them apart.
        letters.text(format_args!("{instances:?} {materials:?} {lights:?} {cameras:?}"));
        letters.finish()
    }
}

impl EquirectMap {
    /// Letters that change with any of its texels.
    pub fn fingerprint(&self) -> String {
        let Self { width, height, texels } = self;
        let mut letters = Letters::default();
        letters.text(format_args!("{width} {height}"));
        letters.bytes(bytemuck::cast_slice(texels));
        letters.finish()
    }
}

/// A hash of parts, each told apart from the next.
#[derive(Default)]
struct Letters {
    hasher: blake3::Hasher,
}

impl Letters {
    fn bytes(&mut self, bytes: &[u8]) {
        self.hasher.update(&(bytes.len() as u64).to_le_bytes());
        self.hasher.update(bytes);
    }

    fn text(&mut self, text: Arguments) {
        // Nothing in here fails.
        let _ = self.write_fmt(text);
        // No text that is written here holds it.
        self.hasher.update(&[0]);
    }

    fn finish(&self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}

impl Write for Letters {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.hasher.update(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedded_scene;
    use crate::scene::{Camera, Light};
    use glam::DVec3;

    fn sphere() -> Scene {
        embedded_scene("sphere").expect("it is embedded").load().expect("it is sound")
    }

    #[test]
    fn a_scene_is_recognised_wherever_it_comes_from() {
        let mut moved = sphere();
        moved.name = "elsewhere/sphere.glb".to_owned();
        moved.warnings.push("something was repaired".to_owned());
        assert_eq!(moved.fingerprint(), sphere().fingerprint());
    }

    #[test]
    fn whatever_a_picture_shows_changes_the_letters() {
        let changes: [fn(&mut Scene); 10] = [
            |scene| scene.meshes[0].positions[3][1] = f32::from_bits(scene.meshes[0].positions[3][1].to_bits() ^ 1),
            |scene| scene.meshes[0].normals[0] = [0.0, 1.0, 0.0],
            |scene| scene.meshes[0].uv[0][7][0] += 0.25,
            |scene| scene.meshes[0].indices.swap(0, 1),
            |scene| scene.meshes[0].colors.push([1.0; 4]),
            |scene| scene.meshes[0].has_uv = false,
            |scene| scene.instances.clear(),
            |scene| scene.materials[0].double_sided ^= true,
            |scene| scene.lights.push(Light::Directional { direction: DVec3::NEG_Y, irradiance: [1.0; 3] }),
            |scene| {
                scene.cameras.insert(0, Camera::looking_at("other", DVec3::Z, DVec3::ZERO, 0.7, 0.1));
            },
        ];
        let own = sphere().fingerprint();
        let mut all = vec![own];
        for (index, change) in changes.into_iter().enumerate() {
            let mut scene = sphere();
            change(&mut scene);
            let letters = scene.fingerprint();
            assert!(!all.contains(&letters), "change {index}");
            all.push(letters);
        }
    }

    #[test]
    fn attributes_do_not_run_into_each_other() {
        let of = |positions: Vec<[f32; 3]>, normals: Vec<[f32; 3]>| {
            let mesh = Mesh { positions, normals, ..Default::default() };
            Scene { meshes: vec![mesh], ..Default::default() }.fingerprint()
        };
        assert_ne!(of(vec![[0.0; 3]; 2], vec![[0.0; 3]]), of(vec![[0.0; 3]], vec![[0.0; 3]; 2]));
    }

    #[test]
    fn an_environment_is_told_from_another_of_the_same_bytes() {
        let of = |width, height| EquirectMap { width, height, texels: vec![[1.0; 3]; 8] }.fingerprint();
        assert_ne!(of(4, 2), of(2, 4));
        let mut map = EquirectMap::constant([1.0; 3]);
        let before = map.fingerprint();
        map.texels[0][2] = 1.5;
        assert_ne!(before, map.fingerprint());
    }
}
