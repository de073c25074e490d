//! Scenes that are damaged, hostile, or point elsewhere: F01 to F13.

use super::*;
use mica_fuzz::corpus::gltf::{glb, text, triangle};
use serde_json::{Value, json};
use std::fs;
use std::os::unix::fs::symlink;

/// A triangle whose document is changed, as a file.
fn changed(place: &Place, change: impl FnOnce(&mut Value)) -> String {
    let (mut document, buffer) = triangle();
    change(&mut document);
    place.file("scene.gltf", text(&document, &buffer))
}

/// A triangle in which one value is another must be refused, with these words.
#[track_caller]
fn refused_with(pointer: &str, value: Value, words: &[&str]) {
    let place = Place::new();
    let scene = changed(&place, |document| {
        *document.pointer_mut(pointer).unwrap_or_else(|| panic!("nothing is at {pointer}")) = value;
    });
    place.refused(&[&scene], &[&["scene.gltf: "], words].concat());
}

/// A triangle whose buffer's bytes are others.
fn with_bytes(place: &Place, at: usize, bytes: &[u8]) -> String {
    let (document, mut buffer) = triangle();
    buffer[at..at + bytes.len()].copy_from_slice(bytes);
    place.file("scene.gltf", text(&document, &buffer))
}

/// A triangle whose buffer lies where a URI says.
fn with_uri(place: &Place, uri: &str) -> String {
    let (mut document, buffer) = triangle();
    fs::write(place.path("secret.bin"), &buffer).expect("a file");
    fs::create_dir_all(place.path("scene/parts")).expect("a folder");
    fs::write(place.path("scene/parts/data.bin"), &buffer).expect("a file");
    document["buffers"] = json!([{ "byteLength": buffer.len(), "uri": uri }]);
    place.file("scene/scene.gltf", document.to_string())
}

#[test]
fn f01_an_index_past_the_vertices_is_refused() {
    let place = Place::new();
    let scene = with_bytes(&place, 100, &[3]);
    place.refused(&[&scene], &["meshes[0].primitives[0].indices", "ACCESSOR_INDEX_OOB", "index 2 is 3", "3 vertices"]);
}

#[test]
fn f02_counts_beyond_the_buffer_are_refused_before_anything_is_allocated() {
    for count in [json!(4_294_967_295u64), json!(1_000_000_000_000_000_000u64), json!(1e18), json!(4)] {
        for accessor in 0..4 {
            let name = format!("accessors[{accessor}]");
            refused_with(&format!("/accessors/{accessor}/count"), count.clone(), &[&name, "ACCESSOR_TOO_LONG", "; "]);
        }
    }
}

#[test]
fn f03_views_beyond_their_buffer_are_refused_without_overflow() {
    for (key, value) in [
        ("byteOffset", u64::MAX),
        ("byteOffset", u64::MAX - 35),
        ("byteLength", 1_000_000_000_000_000),
        ("byteLength", u64::MAX),
    ] {
        refused_with(&format!("/bufferViews/1/{key}"), json!(value), &["bufferViews[1]", "BUFFER_VIEW_TOO_LONG", "; "]);
    }
}

#[test]
fn f04_an_accessor_without_a_view_is_zeros_in_bounds() {
    // As normals, zeros are replaced by the triangle's own; as positions, there is nothing to show.
    let of_zeros = |accessor: usize, count: u64| {
        let place = Place::new();
        let scene = changed(&place, |document| {
            let kind = document["accessors"][accessor]["type"].clone();
            document["accessors"][accessor] = json!({ "componentType": 5126, "count": count, "type": kind });
        });
        (place, scene)
    };
    let (place, scene) = of_zeros(1, 3);
    assert!(place.rendered(&[&scene]).contains("3 normals that are zero or not finite"));
    let (place, scene) = of_zeros(0, 3);
    assert!(place.rendered(&[&scene]).contains("1 triangles without area"));
    let (place, scene) = of_zeros(0, (1 << 24) + 1);
    place.refused(&[&scene], &["accessors[0]", "ACCESSOR_TOO_LONG", "16777216 are allowed"]);
}

#[test]
fn f05_a_node_that_is_its_own_ancestor_is_refused() {
    for nodes in [
        json!([{ "mesh": 0, "children": [0] }]),
        json!([{ "mesh": 0, "children": [1] }, { "children": [0] }]),
        json!([{ "mesh": 0 }, { "children": [2] }, { "children": [1] }]),
    ] {
        refused_with("/nodes", nodes, &["nodes[", "NODE_LOOP", "; "]);
    }
    let chain: Vec<Value> = (1..1026).map(|child| json!({ "children": [child] })).chain([json!({})]).collect();
    refused_with("/nodes", Value::Array(chain), &["nodes[1025]", "NODE_TOO_DEEP", "1024"]);
}

#[test]
fn f06_two_parents_and_a_million_nodes_in_a_chain_are_refused() {
    let nodes = json!([{ "children": [2] }, { "children": [2] }, { "mesh": 0 }]);
    refused_with("/nodes", nodes, &["nodes[1].children[0]", "NODE_PARENT_OVERRIDE", "; "]);
    let (mut document, buffer) = triangle();
    document["nodes"] = json!(["NODES"]);
    let mut chain = String::with_capacity(20_000_000);
    for child in 1..1_000_000 {
        chain += &format!("{{\"children\":[{child}]}},");
    }
    let place = Place::new();
    let scene = place.file("scene.gltf", text(&document, &buffer).replace("\"NODES\"", &(chain + "{}")));
    place.refused(&[&scene], &["nodes[1025]", "NODE_TOO_DEEP", "; "]);
}

#[test]
fn f07_positions_must_be_finite_and_other_attributes_are_repaired_and_counted() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let place = Place::new();
        let scene = with_bytes(&place, 16, &bad.to_le_bytes());
        place.refused(&[&scene], &["attributes.POSITION", "ACCESSOR_INVALID_FLOAT", "position 1 is", "; "]);
        for (at, words) in [(36, "1 normals that are zero or not finite"), (80, "1 texture coordinates of TEXCOORD_0")]
        {
            let place = Place::new();
            let scene = with_bytes(&place, at, &bad.to_le_bytes());
            assert!(place.rendered(&[&scene]).contains(words), "{bad} at byte {at}");
        }
    }
    // Of any length but none, a normal is as good as a unit one.
    let place = Place::new();
    let scene = with_bytes(&place, 44, &1e-20f32.to_le_bytes());
    assert!(!place.rendered(&[&scene]).contains("normals"));
}

#[test]
fn f08_uris_reach_the_scenes_folder_and_nothing_else() {
    let place = Place::new();
    place.rendered(&[&with_uri(&place, "parts/data.bin")]);
    fs::remove_file(place.path("out/a.exr")).expect("it was written");
    let secret = place.argument("secret.bin");
    symlink(&secret, place.path("scene/link.bin")).expect("a link");
    symlink(place.path(""), place.path("scene/up")).expect("a link");
    for uri in [
        "../secret.bin",
        "parts/../../secret.bin",
        "..%2Fsecret.bin",
        "%2e%2e%2fsecret.bin",
        &format!("file://{secret}"),
        &format!("FILE:{secret}"),
        &secret,
        &secret.replace('/', "%2F"),
        "link.bin",
        "up/secret.bin",
        "C:\\secret.bin",
        "C:/secret.bin",
        "..\\secret.bin",
        "parts/data.bin\0",
        "parts/data.bin%00",
        "parts/%ff.bin",
    ] {
        place.refused(&[&with_uri(&place, uri)], &["buffers[0]", "NON_RELATIVE_URI", "scene's folder"]);
    }
    // Decoded once: a name with percent signs, of which there is no file.
    place.refused(&[&with_uri(&place, "%252e%252e/secret.bin")], &["buffers[0]", "FILE_UNREADABLE"]);
    // Images and the environment go the same way.
    let image = changed(&place, |document| {
        document["images"] = json!([{ "uri": "../secret.bin" }]);
        document["textures"] = json!([{ "source": 0 }]);
        document["materials"][0] = json!({ "normalTexture": { "index": 0 } });
    });
    place.refused(&[&image], &["images[0]", "NON_RELATIVE_URI"]);
    for uri in ["../secret.exr", "/etc/passwd", "file:///etc/passwd"] {
        let sky = changed(&place, |document| document["scenes"][0]["extras"] = json!({ "environment": uri }));
        place.refused(&[&sky], &["scene.gltf", uri, "--env"]);
    }
}

#[test]
fn f09_what_is_no_regular_file_is_neither_read_nor_waited_for() {
    let place = Place::new();
    let uri = |uri: &str| with_uri(&place, uri);
    uri("pipe");
    let made = Command::new("mkfifo").arg(place.path("scene/pipe")).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo is part of every Debian");
    symlink("/dev/zero", place.path("scene/zero")).expect("a link");
    for name in ["pipe", "parts"] {
        place.refused(&[&uri(name)], &["buffers[0]", "FILE_NOT_REGULAR", "; name a regular file"]);
    }
    for name in ["zero", "/dev/zero", "http://example.org/data.bin", "https://example.org/", "//example.org/x"] {
        place.refused(&[&uri(name)], &["buffers[0]", "NON_RELATIVE_URI"]);
    }
    let pipe = place.argument("scene/pipe");
    for path in ["/dev/zero", &pipe, place.folder.path().to_str().expect("a plain name")] {
        place.refused(&[path], &[path, "FILE_NOT_REGULAR"]);
        place.refused(&["sphere", "--env", path], &[path, "FILE_NOT_REGULAR"]);
    }
}

#[test]
fn f10_data_in_uris_is_bounded_and_must_be_base64() {
    let place = Place::new();
    // Two gigabytes of data, of which the file system stores none.
    let huge = place.file("huge.gltf", r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"data:;base64,"#);
    fs::File::options().append(true).open(&huge).and_then(|file| file.set_len(1 << 31)).expect("a sparse file");
    place.refused(&[&huge], &["huge.gltf", "FILE_TOO_LARGE", "1073741824 are allowed"]);
    for body in ["", ",AAAA", ";base64,A", ";base64,AA*A", "nothing", ";base64;charset=x,AAAA"] {
        let scene = with_uri(&place, &format!("data:{body}"));
        place.refused(&[&scene], &["buffers[0]", "INVALID_DATA_URI", "; "]);
    }
    place.refused(&[&with_uri(&place, "data:;base64,AAAA")], &["buffers[0]", "BUFFER_BYTE_LENGTH_MISMATCH", "has 3"]);
}

#[test]
fn f11_json_that_is_deep_doubled_or_no_json_is_refused() {
    let (open, close) = ("[".repeat(100_000), "]".repeat(100_000));
    let objects = format!("{}1{}", r#"{"a":"#.repeat(100_000), "}".repeat(100_000));
    let place = Place::new();
    for members in [
        format!(r#""extras":{open}{close}"#),
        format!(r#""materials":[{{"extras":{objects}}}]"#),
        r#""nodes":[],"nodes":[]"#.to_owned(),
        r#""nodes":[{"mesh":0,"mesh":1}]"#.to_owned(),
        r#""nodes":[{"translation":[1e999,0,0]}]"#.to_owned(),
        r#""nodes":[{"name":"\ud800"}]"#.to_owned(),
        r#""nodes":[{"name":"\udc00\ud800"}]"#.to_owned(),
        r#""nodes":[{"mesh":-1}]"#.to_owned(),
        r#""nodes":[{"mesh":0}"#.to_owned(),
        "\"nodes\":[NaN]".to_owned(),
    ] {
        let json = format!(r#"{{"asset":{{"version":"2.0"}},{members}}}"#);
        place.refused(&[&place.file("scene.gltf", &json)], &["scene.gltf", "INVALID_JSON", "; export the file again"]);
        place.refused(&[&place.file("scene.glb", glb(json.as_bytes(), b""))], &["scene.glb", "INVALID_JSON"]);
    }
    place.refused(&[&place.file("scene.gltf", b"{\"asset\":\"\xff\"}")], &["scene.gltf", "INVALID_JSON"]);
}

#[test]
fn f12_a_binary_file_whose_lengths_are_wrong_is_refused() {
    let place = Place::new();
    let (document, buffer) = triangle();
    let whole = glb(document.to_string().as_bytes(), &buffer);
    // Every byte of the headers and of the end, and some between: cut, and cut with the total made right again.
    let between = (40..whole.len() - 20).step_by(31);
    for length in (4..40).chain(between).chain(whole.len() - 20..whole.len()) {
        place.refused(&[&place.file("cut.glb", &whole[..length])], &["cut.glb", "INVALID_GLB", "; "]);
        if length > 12 {
            let mut cut = whole[..length].to_vec();
            cut[8..12].copy_from_slice(&(length as u32).to_le_bytes());
            place.refused(&[&place.file("cut.glb", cut)], &["cut.glb", "; "]);
        }
    }
    let json_bytes = u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    for (at, words) in [(8, "header"), (12, "chunk 0"), (20 + json_bytes, "chunk 1")] {
        for length in [0x7fff_ffffu32, 0xffff_ffff, 0xffff_fff0, whole.len() as u32 + 1] {
            let mut wrong = whole.clone();
            wrong[at..at + 4].copy_from_slice(&length.to_le_bytes());
            place.refused(&[&place.file("wrong.glb", wrong)], &["wrong.glb", words, "INVALID_GLB", "; "]);
        }
    }
}

#[test]
fn f13_an_extension_that_is_required_and_unknown_is_named() {
    for (name, code) in [
        ("VENDOR_unheard_of", "UNSUPPORTED_EXTENSION"),
        ("KHR_draco_mesh_compression", "UNSUPPORTED_COMPRESSION"),
        ("EXT_meshopt_compression", "UNSUPPORTED_COMPRESSION"),
        ("a\nb\u{1b}[2J", "UNSUPPORTED_EXTENSION"),
    ] {
        let place = Place::new();
        let scene = changed(&place, |document| {
            document["extensionsUsed"] = json!([name]);
            document["extensionsRequired"] = json!([name]);
        });
        let shown = name.escape_default().to_string();
        place.refused(&[&scene], &[code, if name.contains('\n') { "a\\nb" } else { &shown }, "; "]);
    }
}
