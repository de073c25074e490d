//! The embedded scenes as files: that they are what the generator writes, and that their surfaces are fit for flakes.

use std::path::Path;
use std::sync::OnceLock;

use glam::{DMat2, DVec2, DVec3};
use mica_generator::SCENES;
use serde_json::Value;

/// Every scene's name and file, made once for all tests.
fn made() -> &'static [(&'static str, Vec<u8>)] {
    static MADE: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
    MADE.get_or_init(|| SCENES.iter().map(|(name, scene)| (*name, scene().to_glb())).collect())
}

/// A .glb file taken apart by the letter of its format, independently of the writer's structs.
struct Glb<'a> {
    json: Value,
    binary: &'a [u8],
}

struct Primitive {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[usize; 3]>,
    material: Value,
}

impl<'a> Glb<'a> {
    fn read(bytes: &'a [u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let json_length = word(12);
        assert_eq!(&bytes[16..20], b"JSON");
        assert_eq!(&bytes[24 + json_length..28 + json_length], b"BIN\0");
        assert_eq!(word(20 + json_length), bytes.len() - 28 - json_length);
        let json = serde_json::from_slice(&bytes[20..20 + json_length]).expect("the first chunk is JSON");
        Self { json, binary: &bytes[28 + json_length..] }
    }

    fn number(value: &Value) -> usize {
        value.as_u64().expect("an index or a size") as usize
    }

    /// The numbers of an accessor, whatever its type.
    fn numbers(&self, accessor: &Value) -> Vec<f64> {
        let accessor = &self.json["accessors"][Self::number(accessor)];
        let view = &self.json["bufferViews"][Self::number(&accessor["bufferView"])];
        let offset = Self::number(&view["byteOffset"]);
        let bytes = &self.binary[offset..offset + Self::number(&view["byteLength"])];
        let numbers: Vec<f64> = match Self::number(&accessor["componentType"]) {
            5123 => bytes.chunks_exact(2).map(|b| f64::from(u16::from_le_bytes([b[0], b[1]]))).collect(),
            5125 => bytes.chunks_exact(4).map(|b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect(),
            5126 => bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect(),
            other => panic!("component type {other}"),
        };
        let width = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            other => panic!("type {other:?}"),
        };
        assert_eq!(numbers.len(), width * Self::number(&accessor["count"]));
        numbers
    }

    fn primitives(&self) -> Vec<Primitive> {
        let meshes = self.json["meshes"].as_array().expect("meshes");
        let primitives = meshes.iter().flat_map(|mesh| mesh["primitives"].as_array().expect("primitives"));
        primitives
            .map(|primitive| {
                let attributes = &primitive["attributes"];
                let vectors = |name: &str| {
                    let numbers = self.numbers(&attributes[name]);
                    numbers.chunks_exact(3).map(|c| DVec3::new(c[0], c[1], c[2])).collect()
                };
                let indices = self.numbers(&primitive["indices"]);
                Primitive {
                    positions: vectors("POSITION"),
                    normals: vectors("NORMAL"),
                    uvs: self.numbers(&attributes["TEXCOORD_0"]).chunks_exact(2).map(DVec2::from_slice).collect(),
                    triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| i as usize)).collect(),
                    material: self.json["materials"][Self::number(&primitive["material"])].clone(),
                }
            })
            .collect()
    }
}

#[test]
fn committed_scenes_are_what_the_generator_writes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    for (name, bytes) in made() {
        let path = folder.join(name).with_extension("glb");
        let committed = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(committed == *bytes, "{name}.glb differs: run `cargo run -p mica-generator`");
    }
    let on_disk = std::fs::read_dir(&folder).expect("the folder of scenes").count();
    assert_eq!(on_disk, SCENES.len(), "a file in {} has no scene", folder.display());
}

#[test]
fn a_scene_made_twice_has_the_same_bytes() {
    for (name, scene) in SCENES.iter().filter(|(name, _)| ["cloth", "shoe"].contains(name)) {
        let (_, first) = made().iter().find(|(made, _)| made == name).expect("made");
        assert!(scene().to_glb() == *first, "{name}");
    }
}

#[test]
fn all_scenes_together_are_under_six_megabytes() {
    let total: usize = made().iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(total < 6_000_000, "{total} bytes");
}

#[test]
fn every_scene_has_a_camera_an_environment_and_something_that_glints() {
    for (name, bytes) in made() {
        let glb = Glb::read(bytes);
        let cameras = glb.json["nodes"].as_array().expect("nodes").iter().filter(|n| n["camera"].is_u64()).count();
        assert_eq!(cameras, 1, "{name}");
        assert!(glb.json["scenes"][0]["extras"]["environment"].is_string(), "{name}");
        let materials = glb.json["materials"].as_array().expect("materials");
        let glinting: Vec<_> = materials.iter().filter(|m| m["extras"]["glint_count"].is_f64()).collect();
        assert_eq!(glinting.len(), if *name == "dress" { 2 } else { 1 }, "{name}");
        for material in glinting {
            for key in ["glint_alpha", "glint_gamma_deg", "glint_seed", "glint_color"] {
                assert!(!material["extras"][key].is_null(), "{name}: {material} lacks {key}");
            }
        }
    }
}

#[test]
fn normals_are_unit_and_on_the_outer_side_of_their_triangles() {
    for (name, bytes) in made() {
        for primitive in Glb::read(bytes).primitives() {
            let what = format!("{name}, {}", primitive.material["name"]);
            assert!(primitive.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5), "{what}");
            let (mut area, mut turned_away) = (0.0, 0.0);
            for t in &primitive.triangles {
                let [a, b, c] = t.map(|i| primitive.positions[i]);
                let facing = (b - a).cross(c - a);
                area += facing.length();
                if t.iter().any(|&i| primitive.normals[i].dot(facing) < 0.0) {
                    turned_away += facing.length();
                }
            }
            assert!(turned_away < 0.01 * area, "{what}: {:.4} of its area", turned_away / area);
        }
    }
}

#[test]
fn flakes_are_spread_evenly_over_what_glints() {
    for (name, bytes) in made().iter().filter(|(name, _)| !["sphere", "plane"].contains(name)) {
        for primitive in Glb::read(bytes).primitives() {
            if primitive.material["extras"]["glint_count"].is_null() {
                continue;
            }
            // Least and greatest UV length of a unit length on the surface, weighted by area.
            let mut scales = Vec::new();
            for t in &primitive.triangles {
                let [a, b, c] = t.map(|i| primitive.positions[i]);
                let [ua, ub, uc] = t.map(|i| primitive.uvs[i]);
                let (ab, ac) = (b - a, c - a);
                let area = ab.cross(ac).length();
                let x = ab.normalize();
                let y = ab.cross(ac).normalize().cross(x);
                let plane = DMat2::from_cols(DVec2::new(ab.length(), 0.0), DVec2::new(ac.dot(x), ac.dot(y)));
                if area > 1e-12 {
                    let stretch = DMat2::from_cols(ub - ua, uc - ua) * plane.inverse();
                    let squared = stretch.transpose() * stretch;
                    let half_trace = 0.5 * (squared.x_axis.x + squared.y_axis.y);
                    let spread = (half_trace * half_trace - squared.determinant()).max(0.0).sqrt();
                    scales.push(((half_trace - spread).max(0.0).sqrt(), (half_trace + spread).sqrt(), area));
                }
            }
            scales.sort_by(|a, b| a.1.total_cmp(&b.1));
            let total: f64 = scales.iter().map(|s| s.2).sum();
            let mut seen = 0.0;
            let median = scales.iter().find(|s| {
                seen += s.2;
                seen >= 0.5 * total
            });
            let (_, median, _) = median.expect("some triangle");
            let even = |s: &&(f64, f64, f64)| s.0 > median / 1.6 && s.1 < median * 1.6;
            let evenly: f64 = scales.iter().filter(even).map(|s| s.2).sum();
            let what = &primitive.material["name"];
            assert!(
                evenly > 0.95 * total,
                "{name}, {what}: {:.3} of the area within 1.6 of the median",
                evenly / total
            );
        }
    }
}

#[test]
fn the_spheres_normals_are_its_positions_directions() {
    let (_, bytes) = made().iter().find(|(name, _)| *name == "sphere").expect("made");
    for primitive in Glb::read(bytes).primitives() {
        for (position, normal) in primitive.positions.iter().zip(&primitive.normals) {
            assert!(position.normalize().distance(*normal) < 1e-6);
        }
    }
}
