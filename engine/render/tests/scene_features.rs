//! What glTF 2.0 can say, and the scene that comes of it.

mod scene_support;

use glam::{DVec3, Vec3};
use mica_render::scene::{Light, Mesh, Scene};
use scene_support::{Document, assert_sound, bytes_of};
use serde_json::{Value, json};

/// The corners of a mesh's triangles, in their order.
fn corners(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.indices.iter().map(|&index| mesh.positions[index as usize]).collect()
}

#[test]
fn a_plain_square_comes_through_as_it_is() {
    let scene = Document::square().scene();
    assert_sound(&scene);
    assert_eq!(scene.warnings, [""; 0]);
    let [mesh] = &scene.meshes[..] else { panic!("one mesh") };
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3]);
    assert_eq!(mesh.positions[2], [1.0, 1.0, 0.0]);
    assert_eq!(mesh.uv[0][3], [0.0, 0.0]);
    assert!(mesh.uv[1].is_empty() && mesh.colors.is_empty());
    assert_eq!(scene.triangle_count(), 2);
    assert_eq!(scene.materials.len(), 1, "the default material");
    let bounds = scene.bounds().expect("something");
    assert_eq!((bounds.min, bounds.max), (DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)));
}

#[test]
fn interleaved_attributes_are_read_with_their_stride() {
    let plain = Document::square().scene();
    let mut document = Document::empty();
    let mut vertices = Vec::new();
    for k in 0..4 {
        vertices.extend(bytes_of(&plain.meshes[0].positions[k]));
        vertices.extend(bytes_of(&plain.meshes[0].uv[0][k]));
        vertices.extend(bytes_of(&plain.meshes[0].normals[k]));
    }
    let view = document.view(&vertices);
    document.json["bufferViews"][view]["byteStride"] = json!(32);
    for (attribute, offset, kind) in [("POSITION", 0, "VEC3"), ("TEXCOORD_0", 12, "VEC2"), ("NORMAL", 20, "VEC3")] {
        let accessor = document.accessor(json!({
            "bufferView": view, "byteOffset": offset, "componentType": 5126, "count": 4, "type": kind,
        }));
        document.primitive()["attributes"][attribute] = json!(accessor);
    }
    document.indices(&[0, 1, 2, 0, 2, 3]);
    let scene = document.scene();
    assert_eq!(scene.meshes[0].positions, plain.meshes[0].positions);
    assert_eq!(scene.meshes[0].uv, plain.meshes[0].uv);
    assert_eq!(scene.meshes[0].normals, plain.meshes[0].normals);
}

#[test]
fn indices_of_every_width_or_none_mean_the_same() {
    let expected = corners(&Document::square().scene().meshes[0]);
    for (component, width) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut document = Document::square();
        let bytes: Vec<u8> = [0u32, 1, 2, 0, 2, 3].iter().flat_map(|k| k.to_le_bytes()[..width].to_vec()).collect();
        let view = document.view(&bytes);
        let accessor =
            document.accessor(json!({ "bufferView": view, "componentType": component, "count": 6, "type": "SCALAR" }));
        document.primitive()["indices"] = json!(accessor);
        assert_eq!(corners(&document.scene().meshes[0]), expected, "component type {component}");
    }
    let mut document = Document::empty();
    document.floats("POSITION", "VEC3", &expected.concat());
    assert_eq!(corners(&document.scene().meshes[0]), expected);
}

#[test]
fn vertices_that_no_triangle_has_are_left_out() {
    let mut document = Document::square();
    document.indices(&[0, 2, 3]);
    let expected = document.scene();
    assert_sound(&expected);
    assert_eq!(expected.meshes[0].positions, [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(expected.meshes[0].uv[0], [[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    assert_eq!(expected.meshes[0].indices, [0, 1, 2]);
    let bounds = Mesh::bounds(&expected.meshes[0]).expect("something");
    assert_eq!(bounds.max, DVec3::new(1.0, 1.0, 0.0));
    // Far away and in no triangle: neither shown nor bounded.
    document = Document::square();
    document.buffer[12..16].copy_from_slice(&1e6f32.to_le_bytes());
    document.indices(&[0, 2, 3]);
    assert_eq!(document.scene().bounds(), expected.bounds());
}

#[test]
fn sparse_accessors_replace_elements_of_views_and_of_zeros() {
    for with_view in [true, false] {
        let mut document = Document::square();
        let places = document.view(&[3, 0, 1, 0]);
        let values = document.view(&bytes_of(&[0.0, 2.0, 0.0, 3.0, 0.0, 0.0]));
        document.json["accessors"][0]["sparse"] = json!({
            "count": 2,
            // Not in ascending order, which exporters get wrong and which does no harm.
            "indices": { "bufferView": places, "componentType": 5123 },
            "values": { "bufferView": values },
        });
        let expected = if with_view {
            vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0]]
        } else {
            document.json["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
            document.indices(&[0, 1, 3, 0, 2, 3]);
            vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]]
        };
        let scene = document.scene();
        assert_eq!(scene.meshes[0].positions, expected);
        if !with_view {
            assert_eq!(scene.triangle_count(), 1, "the second has two corners at the origin");
            assert!(scene.warnings.iter().any(|warning| warning.contains("1 triangles without area")));
        }
    }
}

#[test]
fn strips_and_fans_keep_the_winding_of_their_first_triangle() {
    // A strip of four triangles in zigzag; a fan of three around the first vertex.
    let strip = [0., 0., 0., 0., 1., 0., 1., 0., 0., 1., 1., 0., 2., 0., 0., 2., 1., 0.];
    let fan = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., -1., 1., 0.];
    for (mode, positions, triangles, facing) in [(5, &strip[..], 4, -1.0), (6, &fan[..], 3, 1.0)] {
        let mut document = Document::empty();
        document.floats("POSITION", "VEC3", positions);
        document.primitive()["mode"] = json!(mode);
        let scene = document.scene();
        assert_sound(&scene);
        assert_eq!(scene.triangle_count(), triangles, "mode {mode}");
        assert!(
            scene.meshes[0].normals.iter().all(|n| *n == [0.0, 0.0, facing]),
            "mode {mode}: {:?}",
            scene.meshes[0].normals
        );
    }
    for mode in 0..4 {
        let mut document = Document::square();
        document.primitive()["mode"] = json!(mode);
        let scene = document.scene();
        assert_eq!(scene.triangle_count(), 0);
        assert!(scene.warnings.iter().any(|w| w.contains(if mode == 0 { "points" } else { "lines" })));
    }
}

#[test]
fn missing_normals_become_flat_and_vertices_unshared() {
    let mut document = Document::empty();
    // Two triangles that share an edge, at a right angle.
    document.floats("POSITION", "VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    document.floats("COLOR_0", "VEC4", &[1., 0., 0., 1., 0., 1., 0., 1., 0., 0., 1., 1., 1., 1., 1., 0.5]);
    document.indices(&[0, 1, 2, 0, 3, 1]);
    let scene = document.scene();
    assert_sound(&scene);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.normals, [[[0.0, 0.0, 1.0]; 3], [[0.0, 1.0, 0.0]; 3]].concat());
    assert_eq!(mesh.colors[4], [1.0, 1.0, 1.0, 0.5]);
}

#[test]
fn bad_normals_coordinates_and_tangents_are_repaired_and_counted() {
    let mut document = Document::square();
    document.floats("NORMAL", "VEC3", &[f32::NAN, 0., 1., 0., 0., 0., 0., 0., 5., 0., 0., 1e-20]);
    document.floats("TEXCOORD_0", "VEC2", &[0., 1., f32::INFINITY, 1., 1., 0., 0., 0.]);
    document.floats("TANGENT", "VEC4", &[0., 0., 1., 1., 2., 0., 0., -3., 0., 0., 0., 1., 1., 0., 0., 0.]);
    document.normal_map();
    let scene = document.scene();
    assert_sound(&scene);
    let mesh = &scene.meshes[0];
    assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 0.0, 1.0]));
    assert!(mesh.uv[0].contains(&[0.0, 0.0]) && mesh.uv[0].iter().flatten().all(|c| c.is_finite()));
    for count in ["2 normals", "1 texture coordinates", "3 tangents"] {
        assert!(scene.warnings.iter().any(|warning| warning.contains(count)), "{count}: {:?}", scene.warnings);
    }
}

#[test]
fn given_tangents_are_kept_made_unit_and_orthogonal() {
    let mut document = Document::square();
    document.floats("TANGENT", "VEC4", &[0., 3., 1., -2., 0., 1., 0., 1., -1., 0., 0., 1., 1e-20, 0., 0., 1.]);
    document.normal_map();
    let scene = document.scene();
    assert_sound(&scene);
    assert_eq!(scene.warnings, [""; 0]);
    let expected = [[0.0, 1.0, 0.0, -1.0], [0.0, 1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]];
    assert_eq!(scene.meshes[0].tangents, expected);
}

#[test]
fn only_normal_maps_call_for_tangents() {
    for (material, wanted) in [
        (json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }), false),
        (json!({ "extras": { "glint_count": 1000 } }), false),
        (json!({ "normalTexture": { "index": 0 } }), true),
        (
            json!({ "extensions": { "KHR_materials_clearcoat":
            { "clearcoatFactor": 1, "clearcoatNormalTexture": { "index": 0 } } } }),
            true,
        ),
        // A coat of no strength is none.
        (json!({ "extensions": { "KHR_materials_clearcoat": { "clearcoatNormalTexture": { "index": 0 } } } }), false),
    ] {
        for given in [false, true] {
            let mut document = Document::square();
            document.texture(1, 1, |_, _| [128, 128, 255, 255]);
            document.material(material.clone());
            if given {
                document.floats("TANGENT", "VEC4", &[1., 0., 0., 1.].repeat(4));
            }
            let scene = document.scene();
            assert_sound(&scene);
            assert_eq!(scene.meshes[0].tangents.len(), if wanted { 4 } else { 0 }, "{material}");
        }
    }
}

#[test]
fn tangents_follow_the_coordinates_of_the_normal_map() {
    let tangent = |material: Value| {
        let mut document = Document::square();
        // The second set is the first turned: its u grows upwards.
        document.floats("TEXCOORD_1", "VEC2", &[0., 0., 0., 1., 1., 1., 1., 0.]);
        document.texture(1, 1, |_, _| [128, 128, 255, 255]);
        document.material(material);
        let scene = document.scene();
        assert_sound(&scene);
        scene.meshes[0].tangents[0]
    };
    let coat = |set: u32| {
        json!({ "KHR_materials_clearcoat":
            { "clearcoatFactor": 1, "clearcoatNormalTexture": { "index": 0, "texCoord": set } } })
    };
    assert_eq!(tangent(json!({ "normalTexture": { "index": 0 } }))[..3], [1.0, 0.0, 0.0]);
    assert_eq!(tangent(json!({ "normalTexture": { "index": 0, "texCoord": 1 } }))[..3], [0.0, 1.0, 0.0]);
    assert_eq!(tangent(json!({ "extensions": coat(1) }))[..3], [0.0, 1.0, 0.0]);
    // The base's map comes first.
    assert_eq!(tangent(json!({ "normalTexture": { "index": 0 }, "extensions": coat(1) }))[..3], [1.0, 0.0, 0.0]);
}

#[test]
fn normalised_and_quantised_attributes_are_decoded() {
    let mut document = Document::square();
    document.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    document.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let mut attribute = |name: &str, bytes: &[u8], accessor: Value, stride: usize| {
        let view = document.view(bytes);
        document.json["bufferViews"][view]["byteStride"] = json!(stride);
        let mut accessor = accessor;
        accessor["bufferView"] = json!(view);
        accessor["count"] = json!(4);
        let accessor = document.accessor(accessor);
        document.primitive()["attributes"][name] = json!(accessor);
    };
    let shorts: Vec<u8> = [[0i16, 0, 0, 0], [300, 0, 0, 0], [300, -300, 0, 0], [0, -300, 0, 0]]
        .concat()
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    attribute("POSITION", &shorts, json!({ "componentType": 5122, "type": "VEC3" }), 8);
    let normals = [0u8, 0, 0x81, 0].repeat(4); // -127
    attribute("NORMAL", &normals, json!({ "componentType": 5120, "normalized": true, "type": "VEC3" }), 4);
    let uvs = [0u8, 255, 0, 0, 255, 255, 0, 0, 255, 51, 0, 0, 0, 0, 0, 0];
    attribute("TEXCOORD_0", &uvs, json!({ "componentType": 5121, "normalized": true, "type": "VEC2" }), 4);
    attribute(
        "COLOR_0",
        &[255, 0, 102, 0].repeat(4),
        json!({ "componentType": 5121, "normalized": true, "type": "VEC3" }),
        4,
    );
    let scene = document.scene();
    assert_sound(&scene);
    let mesh = &scene.meshes[0];
    let third = mesh.positions.iter().position(|p| *p == [300.0, -300.0, 0.0]).expect("the third corner");
    assert_eq!(mesh.normals[third], [0.0, 0.0, -1.0]);
    assert_eq!(mesh.uv[0][third], [1.0, 0.2]);
    assert_eq!(mesh.colors[third], [1.0, 0.0, 0.4, 1.0]);
}

#[test]
fn a_dense_accessor_without_a_view_is_zeros() {
    let mut document = Document::square();
    let accessor = document.accessor(json!({ "componentType": 5126, "count": 4, "type": "VEC2" }));
    document.primitive()["attributes"]["TEXCOORD_1"] = json!(accessor);
    assert_eq!(document.scene().meshes[0].uv[1], [[0.0; 2]; 4]);
}

#[test]
fn transforms_multiply_down_the_hierarchy_and_mirrors_are_seen() {
    let mut document = Document::square();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    document.json["scenes"][0]["nodes"] = json!([0, 3]);
    document.json["nodes"] = json!([
        { "translation": [10, 0, 0], "children": [1, 2] },
        { "rotation": [0, 0, half, half], "scale": [2, 3, 1], "mesh": 0 },
        { "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1], "mesh": 0, "name": "mirror" },
        { "scale": [1, 0, 1], "mesh": 0 },
    ]);
    let scene = document.scene();
    let [turned, mirrored] = &scene.instances[..] else { panic!("two instances") };
    assert_eq!(scene.meshes.len(), 1, "instances share their mesh");
    let at = turned.world_from_local.transform_point3(DVec3::new(1.0, 1.0, 0.0));
    assert!(at.abs_diff_eq(DVec3::new(7.0, 2.0, 0.0), 1e-12), "{at}");
    assert!(!turned.mirrors() && mirrored.mirrors());
    assert_eq!(mirrored.world_from_local.transform_point3(DVec3::X), DVec3::new(14.0, 6.0, 7.0));
    assert_eq!(mirrored.name, "mirror");
    assert!(scene.warnings.iter().any(|warning| warning.contains("nodes[3]") && warning.contains("zero")));
    assert_eq!(scene.triangle_count(), 4);
    let bounds = scene.bounds().expect("something");
    assert!(bounds.min.abs_diff_eq(DVec3::new(7.0, 0.0, 0.0), 1e-12), "{bounds:?}");
    assert!(bounds.max.abs_diff_eq(DVec3::new(15.0, 7.0, 7.0), 1e-12), "{bounds:?}");
}

#[test]
fn generated_tangents_follow_u_and_bitangents_go_up_in_the_image() {
    let mut document = Document::square();
    document.normal_map();
    let mesh = &document.scene().meshes[0];
    // u grows along +x, v along -y: the image is upright, so a normal map's +y is +y, with no mirror.
    assert!(mesh.tangents.iter().all(|t| *t == [1.0, 0.0, 0.0, 1.0]), "{:?}", mesh.tangents);

    // The second square shows the image mirrored; it meets the first at a seam where their tangents oppose.
    let mut document = Document::empty();
    document.floats("POSITION", "VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., 2., 0., 0., 2., 1., 0.]);
    document.floats("NORMAL", "VEC3", &[0., 0., 1.].repeat(6));
    document.floats("TEXCOORD_0", "VEC2", &[0., 1., 1., 1., 1., 0., 0., 0., 0., 1., 0., 0.]);
    document.indices(&[0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2]);
    document.normal_map();
    let scene = document.scene();
    assert_sound(&scene);
    let mesh = &scene.meshes[0];
    for (k, &index) in mesh.indices.iter().enumerate() {
        let [x, .., w] = mesh.tangents[index as usize];
        let expected = if k < 6 { 1.0 } else { -1.0 };
        assert_eq!([x, w], [expected, expected], "corner {k}");
    }
    assert_eq!(mesh.positions.len(), 8, "the two vertices of the seam, and only they, are split");
}

#[test]
fn meshes_without_coordinates_do_not_glint_and_say_so() {
    let mut document = Document::empty();
    let mut positions = Vec::new();
    for k in 0..64u32 {
        let (y, angle) = (k as f32 / 31.5 - 1.0, k as f32);
        let radius = (1.0 - y * y).max(0.0).sqrt();
        positions.extend([radius * angle.cos(), y, radius * angle.sin()]);
    }
    document.floats("NORMAL", "VEC3", &positions);
    document.floats("POSITION", "VEC3", &positions);
    document.indices(&(0..60).collect::<Vec<u16>>());
    document.material(json!({ "extras": { "glint_count": 1000 } }));
    let scene = document.scene();
    assert_sound(&scene);
    assert!(!scene.meshes[0].has_uv);
    assert!(scene.warnings.iter().any(|warning| warning.contains("20 of its triangles have no area in texture space")));
}

#[test]
fn what_is_not_shown_is_not_read() {
    // None of this is shown: pointers of animations have no node, which glTF's own have.
    let mut document = Document::square();
    document.json["animations"] = json!([{
        "samplers": [{ "input": 0, "output": 99 }],
        "channels": [{ "sampler": 0, "target": { "path": "pointer" } }],
    }]);
    document.json["skins"] = json!([{ "joints": [99] }]);
    document.json["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    document.json["scenes"] = json!([{ "nodes": [0] }, { "name": "empty" }]);
    let scene = document.scene();
    assert_eq!(scene.triangle_count(), 2);
    assert_eq!(scene.warnings, ["its 1 animations are not played"]);
    document.json["scene"] = json!(1);
    let scene = document.scene();
    assert!(scene.instances.is_empty());
    assert!(scene.warnings.contains(&"nothing in it can be shown".to_owned()));
    // Texture formats that are not read leave the surface untextured.
    document.material(json!({ "emissiveTexture": { "index": 0 } }));
    assert!(document.scene().warnings.iter().any(|warning| warning.contains("textures[0] has no PNG or JPEG image")));
}

#[test]
fn whole_numbers_may_be_written_with_a_fraction_of_zero() {
    let mut document = Document::square();
    for list in ["accessors", "bufferViews"] {
        for object in document.json[list].as_array_mut().expect("a list") {
            for value in object.as_object_mut().expect("an object").values_mut() {
                if let Some(number) = value.as_f64() {
                    *value = json!(number);
                }
            }
        }
    }
    document.primitive()["attributes"]["POSITION"] = json!(0.0);
    document.json["scenes"][0]["nodes"] = json!([0.0]);
    assert!(document.json.to_string().contains("\"byteLength\":48.0"), "the test is about this");
    assert_eq!(document.scene().meshes, Document::square().scene().meshes);
}

#[test]
fn chunks_of_unknown_kinds_are_passed_over() {
    let expected = Document::square().scene();
    let mut bytes = Document::square().glb();
    bytes.extend(b"\x04\0\0\0DATAabcd");
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let scene = Scene::from_glb_bytes("test.glb", &bytes).expect("loaded");
    assert_eq!(scene.meshes, expected.meshes);
    // What follows the declared length is no part of the file.
    let mut bytes = Document::square().glb();
    bytes.extend([0xff; 64]);
    let scene = Scene::from_glb_bytes("test.glb", &bytes).expect("loaded");
    assert_eq!(scene.meshes, expected.meshes);
}

#[test]
fn lights_stand_and_point_as_their_nodes_do() {
    let mut document = Document::square();
    document.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        { "type": "point", "color": [1, 0.5, 0.25], "intensity": 100, "range": 20 },
        { "type": "directional", "intensity": 3 },
        { "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.2 } },
    ]);
    let light = |k: usize| json!({ "KHR_lights_punctual": { "light": k } });
    let half = std::f64::consts::FRAC_1_SQRT_2;
    document.json["nodes"] = json!([
        { "mesh": 0, "children": [1, 2, 3], "scale": [2, 2, 2] },
        { "translation": [1, 2, 3], "extensions": light(0) },
        { "rotation": [-half, 0, 0, half], "extensions": light(1) },
        { "extensions": light(2) },
    ]);
    let scene = document.scene();
    let [point, directional, spot] = &scene.lights[..] else { panic!("three lights") };
    assert_eq!(
        *point,
        Light::Point { position: DVec3::new(2.0, 4.0, 6.0), radiant_intensity: [100.0, 50.0, 25.0], range: Some(20.0) }
    );
    let Light::Directional { direction, irradiance } = directional else { panic!("a directional light") };
    assert!(direction.abs_diff_eq(DVec3::NEG_Y, 1e-12), "turned by -90 degrees about x, it shines down: {direction}");
    assert_eq!(*irradiance, [3.0; 3]);
    let Light::Spot { direction, inner_cone_radians, outer_cone_radians, .. } = spot else { panic!("a spot") };
    assert_eq!((*direction, *inner_cone_radians, *outer_cone_radians), (DVec3::NEG_Z, 0.1, 0.2));
}

#[test]
fn cameras_ignore_scale_and_orthographic_ones_are_approximated() {
    let mut document = Document::square();
    document.json["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } },
        { "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1.5, "znear": 0.5, "zfar": 10 } },
    ]);
    document.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    document.json["nodes"] = json!([
        { "mesh": 0 },
        { "camera": 0, "scale": [2, -3, 4], "translation": [0, 0, 5] },
        { "camera": 1 },
    ]);
    let scene = document.scene();
    let [perspective, orthographic] = &scene.cameras[..] else { panic!("two cameras") };
    assert_eq!((perspective.vertical_fov_radians, perspective.near), (f64::from(0.7f32), f64::from(0.1f32)));
    assert_eq!((perspective.eye(), perspective.forward()), (DVec3::new(0.0, 0.0, 5.0), DVec3::NEG_Z));
    let rotation = perspective.world_from_camera.matrix3;
    assert!((rotation.determinant() - 1.0).abs() < 1e-12, "a rotation, whatever the scale");
    // In the plane where it stood, it sees as far up as before, and nothing nearer than its near plane.
    let distance = orthographic.eye().z;
    assert!((distance * (orthographic.vertical_fov_radians / 2.0).tan() - 1.5).abs() < 1e-9);
    assert_eq!(orthographic.near, distance + 0.5);
    assert!(scene.warnings.iter().any(|warning| warning.contains("orthographic")));
    assert_eq!(scene.default_camera(), *perspective);
}

#[test]
fn without_a_camera_the_whole_scene_is_in_view() {
    let mut document = Document::square();
    document.json["nodes"][0]["translation"] = json!([1000, -50, 3]);
    let scene = document.scene();
    let camera = scene.default_camera();
    let camera_from_world = camera.world_from_camera.inverse();
    let limit = (camera.vertical_fov_radians / 2.0).tan();
    for corner in &scene.meshes[0].positions {
        let world = scene.instances[0].world_from_local.transform_point3(Vec3::from(*corner).as_dvec3());
        let seen = camera_from_world.transform_point3(world);
        assert!(-seen.z > camera.near && (seen.y / -seen.z).abs() < limit && (seen.x / -seen.z).abs() < limit);
    }
    assert!(Scene::default().bounds().is_none() && Scene::default().default_camera().near > 0.0);
}

#[test]
fn the_scene_that_the_document_names_is_shown() {
    let mut document = Document::square();
    document.json["scenes"] = json!([{ "nodes": [0] }, { "nodes": [1], "extras": { "environment": "overcast" } }]);
    document.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [1, 0, 0] }]);
    assert_eq!(document.scene().instances[0].world_from_local.translation, DVec3::ZERO);
    assert_eq!(document.scene().environment, None);
    document.json["scene"] = json!(1);
    let scene = document.scene();
    assert_eq!(scene.instances[0].world_from_local.translation, DVec3::X);
    assert_eq!(scene.environment.as_deref(), Some("overcast"));
    document.json.as_object_mut().expect("an object").remove("scene");
    document.json.as_object_mut().expect("an object").remove("scenes");
    assert_eq!(document.scene().instances.len(), 2, "without scenes, all roots are shown");
}

#[test]
fn data_uris_and_files_hold_the_same_as_a_binary_chunk() {
    use base64::Engine;
    let expected = Document::square().scene();
    let mut document = Document::square();
    let payload = base64::engine::general_purpose::STANDARD.encode(&document.buffer);
    let length = document.buffer.len();
    for uri in [
        format!("data:application/gltf-buffer;base64,{payload}"),
        format!("DATA:;BASE64,{}", payload.trim_end_matches('=')),
    ] {
        document.json["buffers"] = json!([{ "byteLength": length, "uri": uri }]);
        let scene = Scene::from_glb_bytes("test.glb", document.json.to_string().as_bytes()).expect("loaded");
        assert_eq!(scene.meshes, expected.meshes);
    }
    // The bytes of a binary chunk may be padded beyond the buffer's length.
    document = Document::square();
    document.json["buffers"] = json!([{ "byteLength": length }]);
    document.buffer.extend([0; 3]);
    assert_eq!(document.scene().meshes, expected.meshes);
}
