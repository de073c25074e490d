//! glTF documents, as JSON and in binary.

use crate::corpus::png;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

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

/// A document's JSON with its only buffer in a URI.
pub fn text(document: &Value, buffer: &[u8]) -> String {
    let mut document = document.clone();
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(buffer));
    document["buffers"] = json!([{ "byteLength": buffer.len(), "uri": uri }]);
    document.to_string()
}

/// A triangle with normals, texture coordinates and indices, and its buffer: bytes 0, 36, 72 and 96 on.
pub fn triangle() -> (Value, Vec<u8>) {
    let corners = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let normals = [0., 0., 1.].repeat(3);
    let uv = [0., 1., 1., 1., 0., 0.];
    let floats = corners.iter().chain(&normals).chain(&uv).flat_map(|value: &f32| value.to_le_bytes());
    let buffer = floats.chain([0, 0, 1, 0, 2, 0, 0, 0]).collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0,
        }] }],
        "materials": [{}],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 72, "byteLength": 24 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 6 },
        ],
        "buffers": [{ "byteLength": 104 }],
    });
    (document, buffer)
}

/// The triangle with as much of glTF as is read: sparse replacements, a texture, materials, lights, cameras, nodes.
fn everything() -> (Value, Vec<u8>) {
    let (mut document, mut buffer) = triangle();
    let image = png::files().swap_remove(1);
    let places = buffer.len();
    buffer.extend([1, 0, 0, 0]);
    buffer.extend([1f32, 0., 0.5].iter().flat_map(|value| value.to_le_bytes()));
    let at = buffer.len();
    buffer.extend(&image);
    let views = [(places, 1), (places + 4, 12), (at, image.len())];
    for (offset, length) in views {
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(list) = document["bufferViews"].as_array_mut() {
            list.push(view);
        }
    }
    document["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": 4, "componentType": 5121 }, "values": { "bufferView": 5 },
    });
    document["images"] = json!([{ "bufferView": 6, "mimeType": "image/png" }]);
    document["samplers"] = json!([{ "wrapS": 33071, "magFilter": 9728 }]);
    document["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    document["materials"] = json!([{
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "roughnessFactor": 0.5 },
        "normalTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } },
        "alphaMode": "MASK",
        "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1 }, "KHR_materials_ior": { "ior": 1.4 } },
        "extras": { "glint_count": 1e6, "glint_alpha": 0.1, "glint_color": [1, 1, 1] },
    }]);
    document["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_texture_transform"]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } });
    document["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
    document["nodes"] = json!([
        { "mesh": 0, "children": [1, 2], "translation": [1, 2, 3] },
        { "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": [-1, 2, 1], "camera": 0 },
        { "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    document["buffers"][0]["byteLength"] = json!(buffer.len());
    (document, buffer)
}

/// Documents that are wrong in one place: a pointer into the triangle's, and what stands there instead.
const DEFECTS: [(&str, &str); 8] = [
    ("/nodes/0", r#"{"mesh":0,"children":[0]}"#),
    ("/accessors/0/count", "4294967295"),
    ("/bufferViews/0/byteOffset", "18446744073709551615"),
    ("/accessors/3/componentType", "5122"),
    ("/scenes/0/nodes", "[0,9]"),
    ("/nodes/0", r#"{"mesh":0,"scale":[1e308,0,0]}"#),
    ("/materials/0", r#"{"extras":{"glint_count":1e30}}"#),
    ("/meshes/0/primitives/0/mode", "5"),
];

/// Good documents and bad, each with its buffer.
fn documents() -> Vec<(Value, Vec<u8>)> {
    let (good, buffer) = triangle();
    let bad = DEFECTS.iter().map(|(pointer, value)| {
        let mut document = good.clone();
        document["meshes"][0]["primitives"][0]["mode"] = json!(4);
        if let (Some(place), Ok(value)) = (document.pointer_mut(pointer), serde_json::from_str(value)) {
            *place = value;
        }
        (document, buffer.clone())
    });
    // An index past the vertices.
    let mut past = buffer.clone();
    past[100] = 3;
    [everything(), (good.clone(), buffer.clone()), (good.clone(), past)].into_iter().chain(bad).collect()
}

/// All of them as JSON.
pub fn texts() -> Vec<Vec<u8>> {
    documents().iter().map(|(document, buffer)| text(document, buffer).into_bytes()).collect()
}

/// All of them in binary.
pub fn binaries() -> Vec<Vec<u8>> {
    documents().iter().map(|(document, buffer)| glb(document.to_string().as_bytes(), buffer)).collect()
}

/// A scene that shows an image, whatever its bytes are.
pub fn with_image(image: &[u8]) -> Vec<u8> {
    glb(WITH_IMAGE.replace("LENGTH", &image.len().to_string()).as_bytes(), image)
}

/// Nothing but a texture, and a material that asks for it.
const WITH_IMAGE: &str = r#"{"asset":{"version":"2.0"},"images":[{"bufferView":0,"mimeType":"image/png"}],
"textures":[{"source":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
"bufferViews":[{"buffer":0,"byteLength":LENGTH}],"buffers":[{"byteLength":LENGTH}]}"#;
