//! Broken and hostile glTF files: each is refused with the code of its defect and the place where it is.

mod scene_support;

use mica_render::scene::{LoadLimits, Scene, SceneErrorCode as Code};
use scene_support::{Document, assert_refused, bytes_of, glb};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

#[test]
fn an_index_past_the_vertices_is_refused() {
    let mut document = Document::square();
    document.indices(&[0, 1, 2, 0, 2, 4]);
    document.refused(Code::AccessorIndexOob, "meshes[0].primitives[0].indices");
}

#[test]
fn counts_beyond_the_buffer_are_refused_before_anything_is_allocated() {
    for count in [json!(5), json!(4294967295u64), json!(1000000000000000000u64), json!(1e18)] {
        for accessor in 0..4 {
            let mut document = Document::square();
            document.json["accessors"][accessor]["count"] = if accessor == 3 { json!(7) } else { count.clone() };
            document.refused(Code::AccessorTooLong, &format!("accessors[{accessor}]"));
        }
    }
}

#[test]
fn zeros_without_a_buffer_view_are_bounded_too() {
    let mut document = Document::empty();
    let accessor = document.accessor(json!({ "componentType": 5126, "count": 4294967295u64, "type": "VEC3" }));
    document.primitive()["attributes"]["POSITION"] = json!(accessor);
    document.refused(Code::AccessorTooLong, "accessors[0]");

    // Allowed alone, but not a hundred times.
    document.json["accessors"][0]["count"] = json!(1 << 24);
    let primitive = document.primitive().clone();
    document.json["meshes"][0]["primitives"] = Value::Array(vec![primitive; 100]);
    let limits = LoadLimits { total_bytes: 1 << 20, ..LoadLimits::default() };
    let refused = Scene::from_glb_bytes_within("zeros.glb", &document.glb(), &limits);
    assert_refused(refused, Code::SceneTooLarge, "POSITION");
}

#[test]
fn views_beyond_their_buffer_are_refused_without_overflow() {
    for (offset, length) in [(u64::MAX, 1u64), (u64::MAX - 3, 48), (0, 1_000_000_000_000_000), (1 << 40, 0)] {
        let mut document = Document::square();
        document.json["bufferViews"][0]["byteOffset"] = json!(offset);
        document.json["bufferViews"][0]["byteLength"] = json!(length);
        document.refused(Code::BufferViewTooLong, "bufferViews[0]");
    }
    for stride in [1, 11] {
        let mut document = Document::square();
        document.json["bufferViews"][0]["byteStride"] = json!(stride);
        document.refused(Code::BufferViewStride, "POSITION (accessors[0])");
    }
    let mut document = Document::square();
    document.json["bufferViews"][0]["byteStride"] = json!(u64::MAX);
    document.refused(Code::AccessorTooLong, "POSITION (accessors[0])");
    document = Document::square();
    document.json["accessors"][0]["byteOffset"] = json!(u64::MAX);
    document.refused(Code::AccessorTooLong, "POSITION (accessors[0])");
}

#[test]
fn buffers_shorter_than_declared_are_refused() {
    let mut document = Document::square();
    document.json["buffers"] = json!([{ "byteLength": document.buffer.len() + 4 }]);
    document.refused(Code::BufferTooShort, "buffers[0]");
    document.json["buffers"] = json!([{ "byteLength": 4 }]);
    document.refused(Code::BufferViewTooLong, "bufferViews[0]");
    document.json["buffers"] = json!([]);
    document.refused(Code::UnresolvedReference, "bufferViews[0]");
}

#[test]
fn sparse_replacements_outside_of_the_accessor_are_refused() {
    let mut document = Document::square();
    let places = document.view(&[1, 4]);
    let values = document.view(&bytes_of(&[0.0; 6]));
    document.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": 5121 },
        "values": { "bufferView": values },
    });
    document.refused(Code::SparseIndexOob, "POSITION");
    document.json["accessors"][0]["sparse"]["count"] = json!(5);
    document.refused(Code::SparseIndexOob, "accessors[0]");
}

#[test]
fn attributes_of_unequal_length_or_wrong_type_are_refused() {
    let mut document = Document::square();
    document.json["accessors"][1]["count"] = json!(3);
    document.refused(Code::UnequalCounts, "attributes.NORMAL");
    document = Document::square();
    document.json["accessors"][0]["type"] = json!("VEC2");
    document.refused(Code::AccessorFormat, "attributes.POSITION (accessors[0])");
    document = Document::square();
    document.json["accessors"][3]["componentType"] = json!(5122);
    document.refused(Code::AccessorFormat, "primitives[0].indices");
    document = Document::square();
    document.json["accessors"][0]["componentType"] = json!(5124);
    document.refused(Code::AccessorFormat, "attributes.POSITION (accessors[0])");
    for mode in [7, (1u64 << 32) + 4] {
        let mut document = Document::square();
        document.primitive()["mode"] = json!(mode);
        document.refused(Code::ValueNotInRange, "primitives[0].mode");
    }
}

#[test]
fn references_to_nothing_are_refused_where_they_are_made() {
    let cases = [
        ("/nodes/0/mesh", "nodes[0]"),
        ("/meshes/0/primitives/0/attributes/POSITION", "attributes.POSITION"),
        ("/meshes/0/primitives/0/indices", "primitives[0].indices"),
        ("/accessors/0/bufferView", "accessors[0]"),
        ("/scenes/0/nodes/0", "scenes[0].nodes[0]"),
    ];
    for (pointer, location) in cases {
        // 2^32 is 0 to whoever keeps 32 bits of it, and 2^32 - 1 may stand for none.
        for index in [json!(9), json!(u32::MAX), json!(1u64 << 32), json!(u64::MAX)] {
            let mut document = Document::square();
            *document.json.pointer_mut(pointer).expect("there") = index;
            document.refused(Code::UnresolvedReference, location);
        }
    }
    let mut document = Document::square();
    document.primitive()["material"] = json!(0);
    document.refused(Code::UnresolvedReference, "primitives[0].material");
}

#[test]
fn nodes_that_are_no_trees_are_refused() {
    for (nodes, code, location) in [
        (json!([{ "children": [0] }]), Code::NodeLoop, "nodes[0]"),
        (json!([{}, { "children": [2] }, { "children": [1] }]), Code::NodeLoop, "nodes[1]"),
        (json!([{ "children": [1] }, { "children": [0] }]), Code::NodeLoop, "nodes[0]"),
        (json!([{ "children": [2] }, { "children": [2] }, {}]), Code::NodeParentOverride, "nodes[1].children[0]"),
        (json!([{ "children": [1, 1] }, {}]), Code::NodeParentOverride, "nodes[0].children[1]"),
        (json!([{ "children": [7] }]), Code::UnresolvedReference, "nodes[0].children[0]"),
    ] {
        let mut document = Document::square();
        document.json["nodes"] = nodes;
        document.refused(code, location);
    }
    let mut document = Document::square();
    document.json["nodes"] = json!([{}, { "children": [0] }]);
    document.refused(Code::SceneNonRootNode, "scenes[0].nodes[0]");
}

#[test]
fn a_million_nodes_in_a_chain_overflow_no_stack() {
    let mut document = Document::square();
    let chain = (1..1_000_000).map(|child| json!({ "children": [child] })).chain([json!({})]).collect();
    document.json["nodes"] = Value::Array(chain);
    document.refused(Code::NodeTooDeep, "nodes[1025]");
    // At the root of a list of a million they are fine.
    document.json["nodes"] = Value::Array(vec![json!({}); 1_000_000]);
    document.json["nodes"][0]["mesh"] = json!(0);
    assert_eq!(document.scene().instances.len(), 1);
}

#[test]
fn few_bytes_cannot_ask_for_endless_instances() {
    let mut document = Document::square();
    let primitive = document.primitive().clone();
    document.json["meshes"][0]["primitives"] = Value::Array(vec![primitive; 3000]);
    document.json["nodes"] = Value::Array(vec![json!({ "mesh": 0 }); 3000]);
    document.json["scenes"][0]["nodes"] = (0..3000).collect();
    document.refused(Code::SceneTooLarge, "nodes[");
}

#[test]
fn positions_that_are_not_finite_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut document = Document::square();
        document.buffer[16..20].copy_from_slice(&bad.to_le_bytes());
        document.refused(Code::AccessorInvalidFloat, "meshes[0].primitives[0].attributes.POSITION");
    }
}

#[test]
fn transforms_that_are_no_finite_affine_maps_are_refused() {
    for node in [
        json!({ "rotation": [0, 0, 0, 0] }),
        json!({ "translation": [1e308, 0, 0], "scale": [1e308, 1, 1], "children": [1] }),
        json!({ "matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }),
    ] {
        let mut document = Document::square();
        document.json["nodes"] = json!([node, { "scale": [1e308, 1e308, 1e308], "mesh": 0 }]);
        document.refused(Code::NodeTransform, "nodes[");
    }
}

/// A folder with a scene whose only buffer has the URI, and the scene's path.
fn scene_with_uri(folder: &Path, uri: &str) -> std::path::PathBuf {
    let mut document = Document::square();
    document.json["buffers"] = json!([{ "byteLength": document.buffer.len(), "uri": uri }]);
    fs::create_dir_all(folder.join("scene/parts")).expect("a folder");
    fs::write(folder.join("secret.bin"), &document.buffer).expect("written");
    fs::write(folder.join("scene/parts/data 1.bin"), &document.buffer).expect("written");
    let path = folder.join("scene/scene.gltf");
    fs::write(&path, document.json.to_string()).expect("written");
    path
}

#[test]
fn uris_reach_files_in_the_folder_and_below_only() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for uri in ["parts/data 1.bin", "parts/data%201.bin", "./parts/./data%201.bin", "parts//data%201.bin"] {
        let loaded = Scene::load(&scene_with_uri(folder, uri));
        assert_eq!(loaded.map(|scene| scene.triangle_count()), Ok(2), "{uri}");
    }
    let absolute = folder.join("secret.bin").display().to_string();
    std::os::unix::fs::symlink(folder.join("secret.bin"), folder.join("scene/link.bin")).expect("a link");
    for uri in [
        "../secret.bin",
        "parts/../../secret.bin",
        "..%2Fsecret.bin",
        "%2e%2e/secret.bin",
        "%2E%2E%2Fsecret.bin",
        &format!("file://{absolute}"),
        &absolute,
        &absolute.replace('/', "%2f"),
        "http://example.org/data.bin",
        "C:\\secret.bin",
        "C:/secret.bin",
        "..\\secret.bin",
        "parts/data 1.bin%00.png",
        "parts/%zz.bin",
        "%ff.bin",
        "",
        ".",
        "link.bin",
    ] {
        assert_refused(Scene::load(&scene_with_uri(folder, uri)), Code::NonRelativeUri, "buffers[0]");
    }
    // Decoded once, not twice: this names a file that does not exist.
    assert_refused(Scene::load(&scene_with_uri(folder, "%252e%252e/secret.bin")), Code::FileUnreadable, "buffers[0]");
    let bytes = fs::read(scene_with_uri(folder, "parts/data 1.bin")).expect("read");
    assert_refused(Scene::from_glb_bytes("bytes", &bytes), Code::NonRelativeUri, "buffers[0]");
}

#[test]
fn pipes_devices_and_folders_are_refused_without_waiting() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let path = scene_with_uri(folder, "pipe");
    let made = std::process::Command::new("mkfifo").arg(folder.join("scene/pipe")).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo is part of every Debian");
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let _ = sender.send(Scene::load(&path));
    });
    let result = receiver.recv_timeout(std::time::Duration::from_secs(5)).expect("an answer within 5 seconds");
    assert_refused(result, Code::FileNotRegular, "buffers[0]");
    assert_refused(Scene::load(&scene_with_uri(folder, "parts")), Code::FileNotRegular, "buffers[0]");
    assert_refused(Scene::load(folder), Code::FileNotRegular, "");
    assert_refused(Scene::load(Path::new("/dev/zero")), Code::FileNotRegular, "");
    assert_refused(Scene::load(&folder.join("missing.glb")), Code::FileUnreadable, "");
}

#[test]
fn data_uris_are_bounded_and_must_be_base64() {
    let uri = |body: &str| {
        let mut document = Document::square();
        document.json["buffers"] = json!([{ "byteLength": 160, "uri": format!("data:{body}") }]);
        Scene::from_glb_bytes("test", document.json.to_string().as_bytes())
    };
    for body in ["", "application/octet-stream,AAAA", ";base64,A", ";base64,AA*A", "nothing"] {
        assert_refused(uri(body), Code::InvalidDataUri, "buffers[0]");
    }
    assert_refused(uri(";base64,AAAA"), Code::BufferTooShort, "buffers[0]");

    // Two gigabytes, of which the file system stores none.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("huge.gltf");
    fs::File::create(&path).and_then(|file| file.set_len(1 << 31)).expect("a sparse file");
    assert_refused(Scene::load(&path), Code::FileTooLarge, "");
    let mut document = Document::square();
    let long = format!("data:;base64,{}", "A".repeat(1000));
    document.json["buffers"] = json!([{ "byteLength": 160, "uri": long }]);
    fs::write(&path, document.json.to_string()).expect("written");
    let limits = LoadLimits { data_uri_chars: 1000, ..LoadLimits::default() };
    assert_refused(Scene::load_within(&path, &limits), Code::FileTooLarge, "buffers[0]");
}

#[test]
fn json_that_is_deep_doubled_or_malformed_is_refused() {
    let deep = format!(
        r#"{{"asset":{{"version":"2.0"}},"materials":[{{"extras":{}1{}}}]}}"#,
        "[".repeat(100_000),
        "]".repeat(100_000)
    );
    for json in [
        &deep[..],
        r#"{"asset":{"version":"2.0"},"nodes":[],"nodes":[]}"#,
        r#"{"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0,"POSITION":1}}]}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"translation":[1e999,0,0]}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"name":"\ud800"}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":{}}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":-1}]}"#,
        r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0.5}]}"#,
        r#"{"asset":{"version":"2.0"}"#,
        r#"{"asset":{"version":"2.0"}} x"#,
        "{",
    ] {
        assert_refused(Scene::from_glb_bytes("bytes", json.as_bytes()), Code::InvalidJson, "");
    }
    // A value of the wrong type is found in its object.
    for (key, objects, location) in [
        ("nodes", json!([{}, { "mesh": "first" }]), "nodes[1]"),
        ("accessors", json!([{ "componentType": 5126, "type": "VEC3" }]), "accessors[0]"),
        (
            "materials",
            json!([{ "extensions": { "KHR_materials_clearcoat": "thick" } }]),
            "materials[0].extensions.KHR_",
        ),
        ("materials", json!([{ "extensions": { "KHR_materials_sheen": { "sheenColorFactor": 1 } } }]), "materials[0]"),
    ] {
        let mut document = Document::square();
        document.json[key] = objects;
        document.refused(Code::InvalidJson, location);
    }
    for bytes in [&b""[..], b"PK\x03\x04", b"solid cube", b"[]", b"   "] {
        assert_refused(Scene::from_glb_bytes("bytes", bytes), Code::UnknownFormat, "");
    }
}

#[test]
fn a_text_of_too_many_objects_or_values_is_refused_before_it_is_read() {
    for (item, count) in [("{}", 1 << 21), ("0", 1 << 26)] {
        let list = format!("{}{item}", format!("{item},").repeat(count));
        let text = format!(r#"{{"asset":{{"version":"2.0"}},"extras":[{list}]}}"#);
        assert_refused(Scene::from_glb_bytes("bytes", text.as_bytes()), Code::SceneTooLarge, "");
    }
}

#[test]
fn a_binary_file_cut_anywhere_is_refused() {
    let whole = Document::square().glb();
    for length in 0..whole.len() {
        let cut = Scene::from_glb_bytes("cut", &whole[..length]);
        let code = cut.err().map(|error| error.code);
        let expected = if length < 4 { Code::UnknownFormat } else { Code::InvalidGlb };
        assert_eq!(code, Some(expected), "cut to {length} of {} bytes", whole.len());
    }
    // The same with the total length corrected, so that the cut lies in a chunk.
    for length in (13..whole.len()).step_by(3) {
        let mut cut = whole[..length].to_vec();
        cut[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        assert!(Scene::from_glb_bytes("cut", &cut).is_err(), "cut to {length} of {} bytes", whole.len());
    }
    let mut first = glb(b"{}", &[]);
    first[16..20].copy_from_slice(b"BIN\0");
    assert_refused(Scene::from_glb_bytes("bytes", &first), Code::InvalidGlb, "chunk 0");
    for length in 0..12u32 {
        let mut short = whole.clone();
        short[8..12].copy_from_slice(&length.to_le_bytes());
        assert_refused(Scene::from_glb_bytes("bytes", &short), Code::InvalidGlb, "header");
    }
    let mut version = whole.clone();
    version[4] = 1;
    assert_refused(Scene::from_glb_bytes("bytes", &version), Code::UnknownVersion, "header");
}

#[test]
fn what_a_file_requires_must_be_known() {
    let require = |name: &str| {
        let mut document = Document::square();
        document.json["extensionsUsed"] = json!([name]);
        document.json["extensionsRequired"] = json!([name]);
        document
    };
    let unknown = require("VENDOR_unheard_of").load().expect_err("refused");
    assert_eq!(unknown.code, Code::UnsupportedExtension);
    assert!(unknown.to_string().contains("VENDOR_unheard_of"), "{unknown}");
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let refused = require(name).load().expect_err("refused");
        assert_eq!(refused.code, Code::UnsupportedCompression);
        assert!(refused.to_string().contains(name), "{refused}");
    }
    for name in ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_unlit"] {
        assert_eq!(require(name).scene().warnings, [""; 0], "{name}");
    }
    let mut optional = Document::square();
    optional.json["extensionsUsed"] = json!(["VENDOR_unheard_of"]);
    assert!(optional.scene().warnings.iter().any(|warning| warning.contains("VENDOR_unheard_of")));
    for asset in [json!({}), json!({ "version": "1.0" }), json!({ "version": "2.1", "minVersion": "2.1" })] {
        let mut document = Document::square();
        document.json["asset"] = asset;
        document.refused(Code::UnknownVersion, "asset");
    }
}

#[test]
fn material_values_outside_of_their_range_are_refused_with_it() {
    for (material, location) in [
        (json!({ "pbrMetallicRoughness": { "roughnessFactor": 1.5 } }), "roughnessFactor"),
        (json!({ "pbrMetallicRoughness": { "baseColorFactor": [1, 1, -0.1, 1] } }), "baseColorFactor"),
        (json!({ "emissiveFactor": [0, 1e300, 0] }), "emissiveFactor"),
        (json!({ "alphaMode": "DITHER" }), "alphaMode"),
        (json!({ "extensions": { "KHR_materials_ior": { "ior": 0.5 } } }), "KHR_materials_ior"),
        (json!({ "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 2 } } }), "clearcoatFactor"),
        (json!({ "extras": { "glint_count": 1e30 } }), "extras.glint_count"),
        (json!({ "extras": { "glint_count": -1 } }), "extras.glint_count"),
        (json!({ "extras": { "glint_count": "many" } }), "extras.glint_count"),
        (json!({ "extras": { "glint_alpha": 0 } }), "extras.glint_alpha"),
        (json!({ "extras": { "glint_gamma_deg": 0 } }), "extras.glint_gamma_deg"),
        (json!({ "extras": { "glint_gamma_deg": 180 } }), "extras.glint_gamma_deg"),
        (json!({ "extras": { "glint_seed": 0.5 } }), "extras.glint_seed"),
        (json!({ "extras": { "glint_color": [1, 1] } }), "extras.glint_color"),
        (json!({ "extras": { "glint_method": 3 } }), "extras.glint_method"),
    ] {
        let mut document = Document::square();
        document.material(material);
        document.refused(Code::ValueNotInRange, location);
    }
    let mut document = Document::square();
    document.material(json!({ "extras": { "glint_gamma_deg": 31 } }));
    let line = document.load().expect_err("refused").to_string();
    assert!(line.contains("0.01 to 30"), "the range is not in: {line}");
}

#[test]
fn images_are_bounded_before_they_are_decoded() {
    let with_image = |bytes: &[u8]| {
        let mut document = Document::square();
        let view = document.view(bytes);
        document.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
        document.json["textures"] = json!([{ "source": 0 }]);
        document.material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
        document
    };
    // A header that declares 60,000 x 60,000 texels, with the right checksum, over next to no data.
    let mut header = b"IHDR".to_vec();
    header.extend(60_000u32.to_be_bytes());
    header.extend(60_000u32.to_be_bytes());
    header.extend([8, 6, 0, 0, 0]);
    let mut bomb = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    bomb.extend(&header);
    bomb.extend(crc32(&header).to_be_bytes());
    bomb.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    with_image(&bomb).refused(Code::ImageTooLarge, "images[0]");

    let good = scene_support::png(4, 4, |x, y| [x as u8, y as u8, 0, 255]);
    with_image(&good).scene();
    with_image(&good[..good.len() - 30]).refused(Code::InvalidImage, "images[0]");
    let mut damaged = good.clone();
    damaged[30] ^= 1;
    with_image(&damaged).refused(Code::InvalidImage, "images[0]");
    with_image(b"GIF89a").refused(Code::InvalidImage, "images[0]");
    with_image(b"RIFF\0\0\0\0WEBPVP8 ").refused(Code::InvalidImage, "images[0]");
    with_image(b"").refused(Code::InvalidImage, "images[0]");
}

/// The checksum of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

#[test]
fn an_error_is_one_line_however_the_file_names_things() {
    let mut document = Document::square();
    document.json["extensionsRequired"] = json!([format!("a\nb\u{1b}[2J{}", "x".repeat(10_000))]);
    let line = document.load().expect_err("refused").to_string();
    assert!(!line.contains(['\n', '\u{1b}']) && line.len() < 1000, "{line}");
}

#[test]
fn lights_of_no_power_that_sums_can_hold_are_refused() {
    for light in [
        json!({ "type": "point", "intensity": 1e38 }),
        json!({ "type": "directional", "color": [1e30, 0, 0], "intensity": 1e30 }),
        json!({ "type": "spot", "intensity": 1.1e12, "spot": {} }),
        json!({ "type": "point", "intensity": -1 }),
    ] {
        let mut document = Document::square();
        document.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        document.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([light]);
        document.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(0);
        document.refused(Code::ValueNotInRange, "nodes[0].extensions.KHR_lights_punctual.light");
    }
}
