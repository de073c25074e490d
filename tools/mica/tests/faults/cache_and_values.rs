//! Damaged caches, values out of range, and cameras that see nothing: F36, F41 and F42.

use super::*;
use mica_fuzz::corpus::gltf::{text, triangle};
use mica_render::Cache;
use serde_json::{Value, json};
use std::fs;

#[test]
fn f36_every_flipped_bit_of_an_entry_is_seen() {
    let entry = Cache::entry("table", &(0..=255).collect::<Vec<u8>>());
    assert!(Cache::payload("table", &entry).is_some());
    for bit in 0..entry.len() * 8 {
        let mut damaged = entry.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(Cache::payload("table", &damaged), None, "bit {bit}");
    }
    for length in 0..entry.len() {
        assert_eq!(Cache::payload("table", &entry[..length]), None, "cut to {length}");
    }
    assert_eq!(Cache::payload("table", &[&entry[..], b"x"].concat()), None, "a byte more");
}

#[test]
fn f36_a_damaged_cache_is_said_made_again_and_changes_no_picture() {
    let place = Place::new();
    let cache = place.argument("cache");
    let arguments =
        ["sphere", "--method", "wang2020", "--set", "samples=1", "--set", "depth=3", "--cache", cache.as_str()];
    let picture = || {
        let bytes = fs::read(place.path("out/a.exr")).expect("a picture");
        fs::remove_file(place.path("out/a.exr")).expect("it is there");
        bytes
    };
    assert_eq!(place.rendered(&arguments), "");
    let expected = picture();
    // Beside the tables lie pipelines, in a file of the driver's own form.
    let mut entries: Vec<PathBuf> =
        fs::read_dir(&cache).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    entries.retain(|path| !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("pipelines")));
    entries.sort();
    let of = |table: &str| entries.iter().find(|path| path.to_string_lossy().contains(table)).cloned();
    for table in ["dpf", "prefiltered"] {
        let entry = of(table).unwrap_or_else(|| panic!("{table} in {entries:?}"));
        let key = entry.file_stem().expect("a name").to_string_lossy().into_owned();
        let whole = fs::read(&entry).expect("an entry");
        // What nobody stored, though it bears the marks of what was.
        for (bytes, says) in
            [(whole[..whole.len() / 2].to_vec(), true), (Cache::entry(&key, b"of another size"), false)]
        {
            fs::write(&entry, bytes).expect("an entry");
            let said = place.rendered(&arguments);
            assert_eq!(said.contains("is damaged or of another version"), says, "{table}: {said}");
            assert!(picture() == expected && fs::read(&entry).expect("an entry") == whole, "{table}");
        }
    }
    let entry = of("prefiltered").expect("tables are kept");
    let whole = fs::read(&entry).expect("an entry");
    let with = |at: usize, bytes: &[u8]| {
        let mut damaged = whole.clone();
        damaged[at..at + bytes.len()].copy_from_slice(bytes);
        damaged
    };
    let last = whole.len() - 1;
    for (what, damaged) in [
        ("cut", whole[..last].to_vec()),
        ("another version", with(8, &[whole[8] ^ 3])),
        ("a flipped bit", with(last, &[whole[last] ^ 0x40])),
    ] {
        fs::write(&entry, damaged).expect("an entry");
        let said = place.rendered(&arguments);
        assert!(said.lines().count() == 1 && said.contains("is damaged or of another version"), "{what}: {said}");
        assert!(picture() == expected, "{what}: another picture");
        assert!(fs::read(&entry).expect("an entry") == whole, "{what}: not made again");
    }
    // What is not even a file is left alone.
    fs::remove_file(&entry).expect("it is there");
    let made = Command::new("mkfifo").arg(&entry).status();
    assert!(made.is_ok_and(|status| status.success()), "mkfifo is part of every Debian");
    assert!(place.rendered(&arguments).contains("not a regular file"));
    assert!(picture() == expected);
}

#[test]
fn f41_material_values_out_of_range_are_refused_with_their_range() {
    for (key, range, values) in [
        ("glint_count", "0 to 1000000000000", vec![json!(1e30), json!(-1), json!(-1e-30)]),
        ("glint_alpha", "0.001 to 1", vec![json!(0), json!(-0.5), json!(1e30), json!(2)]),
        ("glint_gamma_deg", "0.01 to 30", vec![json!(0), json!(180), json!(-6), json!(31)]),
        ("glint_uv_scale", " to ", vec![json!(-1e300)]),
        ("glint_color", "0 to 1", vec![json!([1, 2, 1]), json!([-1, 0, 0])]),
    ] {
        for value in values {
            let (mut document, buffer) = triangle();
            document["materials"][0] = json!({ "extras": { "glint_count": 1000, key: value } });
            let place = Place::new();
            let scene = place.file("scene.gltf", text(&document, &buffer));
            place.refused(&[&scene], &["materials[0]", key, range, "VALUE_NOT_IN_RANGE", "; "]);
        }
    }
    let place = Place::new();
    for (set, range) in [
        ("count=1e30", "0 to 1e12"),
        ("count=-1", "0 to 1e12"),
        ("count=NaN", "0 to 1e12"),
        ("count=inf", "0 to 1e12"),
        ("alpha=0", "0.001 to 1"),
        ("alpha=NaN", "0.001 to 1"),
        ("alpha=-0.1", "0.001 to 1"),
        ("gamma_deg=0", "0.01 to 30"),
        ("gamma_deg=180", "0.01 to 30"),
        ("gamma_deg=NaN", "0.01 to 30"),
        ("seed=-1", "whole number"),
    ] {
        place.refused(&["sphere", "--method", "wang2020", "--set", set], &[set, range, "; "]);
    }
}

/// The image of a report on stdout.
fn image(output: &Output) -> Value {
    let report: Value = serde_json::from_slice(&output.stdout).expect("a report");
    report["image"].clone()
}

#[test]
fn f42_cameras_that_see_nothing_are_refused_or_see_finite_numbers() {
    let place = Place::new();
    for camera in ["0,0,3:0,0,0:0", "0,0,3:0,0,0:180", "0,0,3:0,0,0:-40", "0,0,3:0,0,0:NaN", "1,1,1:1,1,1:40"] {
        place.refused(&["sphere", "--camera", camera], &["--camera", camera]);
    }
    let with_camera = |camera: Value, node: Value| {
        let (mut document, buffer) = triangle();
        document["cameras"] = json!([{ "type": "perspective", "perspective": camera }]);
        document["nodes"] = json!([{ "mesh": 0 }, node]);
        document["scenes"][0]["nodes"] = json!([0, 1]);
        place.file("scene.gltf", text(&document, &buffer))
    };
    let good = json!({ "yfov": 0.7, "znear": 0.1 });
    for yfov in [json!(0), json!(-1), json!(3.2), json!(1e300)] {
        let scene = with_camera(json!({ "yfov": yfov, "znear": 0.1 }), json!({ "camera": 0 }));
        place.refused(&[&scene], &["cameras[0]", "yfov", "VALUE_NOT_IN_RANGE", "; "]);
    }
    for node in [
        json!({ "camera": 0, "scale": [0, 0, 0] }),
        json!({ "camera": 0, "matrix": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1] }),
    ] {
        let output = place.render(MEMORY_KIB, &[&with_camera(good.clone(), node.clone())]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains("camera") || said.contains("nodes[1]"), "{node}: {said}");
        assert!([Some(0), Some(2)].contains(&output.status.code()), "{node}: {said}");
    }
    // Within a surface, on it, at a light, and so far away that nothing is left of the scene.
    for camera in ["0,0,0:0,0,-1:40", "0,0.5,0:0,0,0:179", "1,2,3:0,0,0:0.01", "0,0,1e9:0,0,0:40"] {
        let lit = ["sphere", "--light", "point:1,2,3,10,10,10", "--camera", camera, "--json", "-"];
        let output = place.render(MEMORY_KIB, &lit);
        assert!(output.status.success(), "{camera}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(image(&output)["nonfinite"], json!(0), "{camera}");
    }
}
