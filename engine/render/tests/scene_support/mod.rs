//! Small glTF files made in memory, for the tests of the loader.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use glam::Vec3;
use mica_render::scene::{Scene, SceneError, SceneErrorCode};
use serde_json::{Value, json};

/// A document and its only buffer, as they grow.
pub struct Document {
    /// The JSON.
    pub json: Value,
    /// The buffer.
    pub buffer: Vec<u8>,
}

impl Document {
    /// One node with one mesh of one primitive without attributes.
    pub fn empty() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": {} }] }],
            "accessors": [],
            "bufferViews": [],
        });
        Self { json, buffer: Vec::new() }
    }

    /// A unit square in the xy plane that faces +z, of two indexed triangles, with all common attributes.
    pub fn square() -> Self {
        let mut document = Self::empty();
        document.floats("POSITION", "VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        document.floats("NORMAL", "VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
        // The image's top left corner lies at the square's top left one.
        document.floats("TEXCOORD_0", "VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
        document.indices(&[0, 1, 2, 0, 2, 3]);
        document
    }

    /// The only primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Appends bytes to the buffer, aligned; the index of their view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        self.buffer.extend_from_slice(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    /// Appends an accessor; its index.
    pub fn accessor(&mut self, accessor: Value) -> usize {
        push(&mut self.json["accessors"], accessor)
    }

    /// An attribute of floats; the index of its accessor.
    pub fn floats(&mut self, attribute: &str, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let view = self.view(&bytes_of(values));
        let accessor = self.accessor(
            json!({ "bufferView": view, "componentType": 5126, "count": values.len() / width, "type": kind }),
        );
        self.primitive()["attributes"][attribute] = json!(accessor);
        accessor
    }

    /// Indices of 16 bits; the index of their accessor.
    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let accessor = self
            .accessor(json!({ "bufferView": view, "componentType": 5123, "count": indices.len(), "type": "SCALAR" }));
        self.primitive()["indices"] = json!(accessor);
        accessor
    }

    /// A material for the primitive, in place of any other.
    pub fn material(&mut self, material: Value) {
        self.json["materials"] = json!([material]);
        self.primitive()["material"] = json!(0);
    }

    /// A material with a flat normal map for the primitive, in place of any other.
    pub fn normal_map(&mut self) {
        let texture = self.texture(1, 1, |_, _| [128, 128, 255, 255]);
        self.material(json!({ "normalTexture": { "index": texture } }));
    }

    /// A PNG image with a texture of its own; the texture's index.
    pub fn texture(&mut self, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> usize {
        let view = self.view(&png(width, height, texel));
        let image = push(&mut self.json["images"], json!({ "bufferView": view, "mimeType": "image/png" }));
        push(&mut self.json["textures"], json!({ "source": image }))
    }

    /// The binary glTF file.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.buffer.is_empty() && json["buffers"].is_null() {
            json["buffers"] = json!([{ "byteLength": self.buffer.len() }]);
        }
        glb(json.to_string().as_bytes(), &self.buffer)
    }

    /// The scene that comes of it.
    pub fn load(&self) -> Result<Scene, SceneError> {
        Scene::from_glb_bytes("test.glb", &self.glb())
    }

    /// The scene that comes of it, which must be one.
    pub fn scene(&self) -> Scene {
        self.load().unwrap_or_else(|error| panic!("{error}"))
    }

    /// The error that comes of it: of this kind, at a place that contains `location`, on one line.
    pub fn refused(&self, code: SceneErrorCode, location: &str) {
        assert_refused(self.load(), code, location);
    }
}

/// Checks that loading failed as it should.
pub fn assert_refused<T>(result: Result<T, SceneError>, code: SceneErrorCode, location: &str) {
    let Err(error) = result else { panic!("loaded, where {code} was expected") };
    let line = error.to_string();
    assert_eq!(error.code, code, "{line}");
    assert!(error.location.contains(location), "`{location}` is not in the place of: {line}");
    assert!(line.contains(code.as_str()) && !line.contains('\n') && !error.file.is_empty(), "{line}");
}

/// What holds for every scene that was loaded.
pub fn assert_sound(scene: &Scene) {
    for mesh in &scene.meshes {
        let vertices = mesh.positions.len();
        assert_eq!(mesh.normals.len(), vertices);
        assert_eq!(mesh.has_uv, !mesh.uv[0].is_empty());
        assert!(mesh.material < scene.materials.len());
        let surface = &scene.materials[mesh.material];
        let coat_map = surface.clearcoat.and_then(|coat| coat.normal_texture);
        let has_tangents = mesh.has_uv && (surface.normal_texture.is_some() || coat_map.is_some());
        assert_eq!(mesh.tangents.len(), if has_tangents { vertices } else { 0 });
        for length in [mesh.uv[0].len(), mesh.uv[1].len(), mesh.colors.len()] {
            assert!(length == vertices || length == 0);
        }
        assert!(mesh.uv.iter().flatten().flatten().all(|c| c.is_finite()));
        assert!(mesh.indices.iter().all(|&index| (index as usize) < vertices));
        for normal in &mesh.normals {
            let n = Vec3::from(*normal);
            assert!((n.length() - 1.0).abs() < 3e-7, "{n}");
        }
        for (normal, tangent) in mesh.normals.iter().zip(&mesh.tangents) {
            let (n, t) = (Vec3::from(*normal), Vec3::new(tangent[0], tangent[1], tangent[2]));
            assert!((t.length() - 1.0).abs() < 3e-7, "{t}");
            assert!(n.dot(t).abs() < 3e-7 && tangent[3].abs() == 1.0, "{n} {t}");
        }
    }
    for texture in &scene.textures {
        assert_eq!(texture.pixels.len(), texture.width as usize * texture.height as usize * 4);
        assert!(texture.width > 0 && texture.height > 0);
    }
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len());
        assert!(instance.world_from_local.is_finite() && instance.world_from_local.inverse().is_finite());
    }
    assert!(scene.warnings.iter().all(|warning| !warning.contains('\n')));
}

/// A binary glTF of two chunks, the second left out when empty.
pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], bytes: &[u8], pad: u8| {
        let mut padded = bytes.to_vec();
        padded.resize(bytes.len().next_multiple_of(4), pad);
        [&(padded.len() as u32).to_le_bytes()[..], kind, &padded].concat()
    };
    let mut chunks = chunk(b"JSON", json, b' ');
    if !binary.is_empty() {
        chunks.extend(chunk(b"BIN\0", binary, 0));
    }
    let length = chunks.len() as u32 + 12;
    [b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes(), &chunks].concat()
}

/// A PNG file.
pub fn png(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(texel(x, y)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("memory has room");
    bytes.into_inner()
}

/// Little-endian floats.
pub fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn push(list: &mut Value, item: Value) -> usize {
    if list.is_null() {
        *list = json!([]);
    }
    let list = list.as_array_mut().expect("a list");
    list.push(item);
    list.len() - 1
}
