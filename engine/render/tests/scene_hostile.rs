//! Files from anywhere: mutated ones, which may do anything but panic, hang or exhaust memory, and those of Debian's
//! assimp-testmodels, where they are installed.

mod scene_support;

use mica_render::scene::{EquirectMap, LoadLimits, Scene, SceneErrorCode as Code};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;
use scene_support::{Document, assert_sound, bytes_of};
use serde_json::json;
use std::io::{Cursor, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// A small file that uses as much of the loader as possible.
fn everything() -> Document {
    let mut document = Document::square();
    document.floats("TANGENT", "VEC4", &[1., 0., 0., 1.].repeat(4));
    document.floats("TEXCOORD_1", "VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    document.floats("COLOR_0", "VEC3", &[1., 0.5, 0.25].repeat(4));
    let places = document.view(&[1, 3]);
    let values = document.view(&bytes_of(&[1., 0., 0.5, 0., 1., 0.5]));
    document.json["accessors"][0]["sparse"] = json!({
        "count": 2, "indices": { "bufferView": places, "componentType": 5121 }, "values": { "bufferView": values },
    });
    let texture = document.texture(4, 4, |x, y| [x as u8 * 60, y as u8 * 60, 128, 255]);
    let mut strip = document.primitive().clone();
    strip["mode"] = json!(5);
    strip["attributes"] = json!({ "POSITION": 0, "TEXCOORD_0": 2 });
    document.material(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": texture, "texCoord": 1 }, "roughnessFactor": 0.5 },
        "normalTexture": { "index": texture, "extensions": { "KHR_texture_transform": { "rotation": 1, "scale": [2, 2] } } },
        "alphaMode": "MASK",
        "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1 }, "KHR_materials_ior": { "ior": 1.4 } },
        "extras": { "glint_count": 1e6, "glint_alpha": 0.1, "glint_color": [1, 1, 1] },
    }));
    document.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(strip);
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_texture_transform"]);
    document.json["extensions"]["KHR_lights_punctual"]["lights"] =
        json!([{ "type": "spot", "intensity": 10, "spot": {} }]);
    document.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }]);
    document.json["nodes"] = json!([
        { "mesh": 0, "children": [1, 2], "translation": [1, 2, 3] },
        { "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": [-1, 2, 1], "camera": 0 },
        { "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
    ]);
    document
}

/// A few digits or bytes changed, or a part cut out or doubled.
fn mutate(good: &[u8], random: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let mut below = |limit: usize| random.next_u32() as usize % limit.max(1);
    for _ in 0..=below(3) {
        let at = below(bytes.len());
        match below(10) {
            // Another number in JSON that stays JSON; the longer, the larger.
            0..=5 => {
                let digit = bytes[at..].iter().position(u8::is_ascii_digit).map_or(at, |ahead| at + ahead);
                let digits = (0..1 + below(3) * below(4)).map(|_| b'0' + below(10) as u8).collect::<Vec<u8>>();
                bytes.splice(digit..digit + 1, digits);
            }
            6 => bytes[at] = below(256) as u8,
            7 => bytes[at] ^= 1 << below(8),
            8 => {
                let end = (at + below(16)).min(bytes.len());
                bytes.drain(at..end);
            }
            _ => {
                let end = (at + below(16)).min(bytes.len());
                let doubled = bytes[at..end].to_vec();
                bytes.splice(at..at, doubled);
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

#[test]
fn twenty_thousand_mutated_files_are_loaded_or_refused() {
    let document = everything();
    assert_sound(&document.scene());
    assert_eq!(document.scene().meshes.len(), 2);
    let good = document.glb();
    let limits = LoadLimits { total_bytes: 1 << 24, ..LoadLimits::default() };
    let mut random = Pcg64Mcg::new(0x6d69_6361);
    let (mut loaded, mut codes) = (0, std::collections::BTreeMap::new());
    for k in 0..20_000 {
        let mut bytes = mutate(&good, &mut random);
        // Most of them with lengths made right again, so that the change is seen behind the container.
        if k % 8 != 0 && bytes.len() > 20 {
            let grown = bytes.len() as i64 - good.len() as i64;
            let chunk = i64::from(u32::from_le_bytes([good[12], good[13], good[14], good[15]])) + grown;
            let length = bytes.len() as u32;
            bytes[..12].copy_from_slice(&[b"glTF", &2u32.to_le_bytes()[..], &length.to_le_bytes()].concat());
            bytes[12..20].copy_from_slice(&[&(chunk as u32).to_le_bytes()[..], b"JSON"].concat());
        }
        let result = catch_unwind(AssertUnwindSafe(|| {
            let result = Scene::from_glb_bytes_within("mutated", &bytes, &limits);
            if let Ok(scene) = &result {
                assert_sound(scene);
            }
            result
        }));
        match result.unwrap_or_else(|_| panic!("mutation {k} panicked")) {
            Ok(_) => loaded += 1,
            Err(error) => {
                assert!(!error.to_string().contains('\n') && error.file == "mutated", "{error}");
                *codes.entry(error.code.as_str()).or_insert(0) += 1;
            }
        }
    }
    // Most of the loader is seen: many files load all the same, and many different defects are found.
    assert!(loaded > 2000 && codes.len() > 14, "{loaded} loaded; {codes:?}");
}

/// Runs one test of this file in a process of its own whose address space is bounded, as an allocation that fails
/// ends a process; true in that process.
fn in_bounded_memory(test: &str) -> bool {
    const CHILD: &str = "MICA_TEST_IN_BOUNDED_MEMORY";
    if std::env::var_os(CHILD).is_some() {
        return true;
    }
    let status = Command::new("sh")
        .args(["-c", "ulimit -v 4194304 && exec \"$0\" --exact \"$1\""])
        .arg(std::env::current_exe().expect("the test's own path"))
        .arg(test)
        .env(CHILD, "1")
        .status()
        .expect("a shell");
    assert!(status.success(), "{test} in bounded memory: {status}");
    false
}

#[test]
fn mutated_environment_maps_neither_panic_nor_exhaust_memory() {
    if !in_bounded_memory("mutated_environment_maps_neither_panic_nor_exhaust_memory") {
        return;
    }
    let pixel = |x: usize, y: usize| (x as f32, y as f32, (x * y) as f32 + 0.5);
    let exr = |tiled: bool| {
        use exr::prelude::{
            Blocks, Compression, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, Vec2, WritableImage,
        };
        let encoding = exr::image::Encoding {
            compression: if tiled { Compression::Uncompressed } else { Compression::PIZ },
            blocks: if tiled { Blocks::Tiles(Vec2(16, 16)) } else { Blocks::ScanLines },
            line_order: LineOrder::Increasing,
        };
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| pixel(at.x(), at.y()));
        let layer = Layer::new((32, 16), LayerAttributes::named("sky"), encoding, channels);
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).expect("memory");
        bytes.into_inner()
    };
    let hdr = {
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n".to_vec();
        // Each line in runs: 32 times one byte, for each of four channels.
        bytes.extend([2, 2, 0, 32, 160, 77, 160, 90, 160, 13, 160, 130].repeat(16));
        bytes
    };
    for (name, good) in [("scan lines", exr(false)), ("tiles", exr(true)), ("radiance", hdr)] {
        EquirectMap::from_file_bytes(name, &good).expect("the unchanged map");
        let mut random = Pcg64Mcg::new(0x736b_7973);
        let mut read = 0;
        for k in 0..3000 {
            let bytes = mutate(&good, &mut random);
            let start = Instant::now();
            let result = EquirectMap::from_file_bytes(name, &bytes);
            assert!(start.elapsed() < Duration::from_secs(5), "{name}, mutation {k}: {:?}", start.elapsed());
            if let Ok((map, _)) = result {
                read += 1;
                assert_eq!(map.texels.len(), map.width as usize * map.height as usize);
                assert!(map.texels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "{name}, mutation {k}");
            }
        }
        assert!(read > 100, "{name}: only {read} of 3000 were read, so the decoder was hardly reached");
    }
}

/// Every `.gltf` and `.glb` below a folder, sorted.
fn gltf_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(folder) = pending.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// What the collection holds that is broken on purpose, or older than glTF 2.0.
const BROKEN: [(&str, Code); 11] = [
    ("glTF/", Code::UnknownVersion),
    ("glTF2/BoxTextured-glTF-techniqueWebGL/", Code::UnsupportedExtension),
    ("glTF2/BoxWithInfinites-glTF-Binary/", Code::AccessorInvalidFloat),
    ("glTF2/IndexOutOfRange/AllIndicesOutOfRange.gltf", Code::AccessorIndexOob),
    ("glTF2/IndexOutOfRange/IndexOutOfRange.gltf", Code::AccessorIndexOob),
    ("glTF2/MissingBin/", Code::FileUnreadable),
    ("glTF2/RecursiveNodes/", Code::NodeLoop),
    ("glTF2/SchemaFailures/", Code::InvalidJson),
    ("glTF2/TestNoRootNode/NoScene.gltf", Code::UnresolvedReference),
    ("glTF2/draco/", Code::UnsupportedCompression),
    ("glTF2/wrongTypes/", Code::InvalidJson),
];

#[test]
fn the_files_of_assimp_load_or_say_why_not() {
    // Straight to stderr: what is skipped or found shall be seen in a run that passes, too.
    let mut log = std::io::stderr();
    let folder = Path::new("/usr/share/assimp/models");
    let files = gltf_files(folder);
    if files.is_empty() {
        let why = "assimp-testmodels is not installed";
        let _ = writeln!(log, "1 skipped: the_files_of_assimp_load_or_say_why_not: {why}");
        return;
    }
    let (mut loaded, mut refused) = (0, 0);
    for path in files {
        let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
        let expected = BROKEN.iter().find(|(broken, _)| name.starts_with(broken)).map(|(_, code)| *code);
        let result = Scene::load(&path);
        assert_eq!(result.as_ref().err().map(|error| error.code), expected, "{name}: {:?}", result.as_ref().err());
        match result {
            Ok(scene) => {
                assert_sound(&scene);
                let Scene { textures, materials, warnings, .. } = &scene;
                let counts = format!("{} triangles, {} materials", scene.triangle_count(), materials.len());
                let _ = writeln!(log, "{name}: {counts}, {} textures, {} warnings", textures.len(), warnings.len());
                loaded += 1;
            }
            Err(error) => {
                let _ = writeln!(log, "{error}");
                refused += 1;
            }
        }
    }
    let _ = writeln!(log, "{loaded} loaded, {refused} refused as they should be");
}
