//! Materials as glTF and its extensions describe them, and glints as extras do.

mod scene_support;

use mica_render::scene::{AlphaMode, Encoding, TextureRef, Wrap};
use scene_support::Document;
use serde_json::{Value, json};

#[test]
fn materials_are_read_with_their_extensions() {
    let mut document = Document::square();
    let texture = document.texture(2, 2, |x, _| [x as u8 * 255, 0, 0, 255]);
    document.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648, "magFilter": 9728 }]);
    document.json["textures"][texture]["sampler"] = json!(0);
    document.material(json!({
        "name": "paint",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
            "baseColorTexture": { "index": texture, "texCoord": 1 },
            "metallicFactor": 0.5,
            "roughnessFactor": 0.25,
            "metallicRoughnessTexture": { "index": texture },
        },
        "normalTexture": { "index": texture, "scale": -2 },
        "occlusionTexture": { "index": texture, "strength": 0.75 },
        "emissiveFactor": [1, 0.5, 0],
        "emissiveTexture": { "index": texture },
        "alphaMode": "MASK",
        "alphaCutoff": 0.3,
        "doubleSided": true,
        "extensions": {
            "KHR_materials_emissive_strength": { "emissiveStrength": 8 },
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_specular": { "specularFactor": 0.6, "specularColorFactor": [2, 1, 1] },
            "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1,
                "clearcoatNormalTexture": { "index": texture, "scale": 0.5 } },
            "KHR_materials_sheen": { "sheenColorFactor": [0.1, 0, 0], "sheenRoughnessFactor": 0.9 },
        },
    }));
    let scene = document.scene();
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!(material.name, "paint");
    assert_eq!(material.base_color, [0.1, 0.2, 0.3, 0.4]);
    assert_eq!((material.metallic, material.roughness), (0.5, 0.25));
    assert_eq!((material.normal_scale, material.occlusion_strength), (-2.0, 0.75));
    assert_eq!(material.emissive, [8.0, 4.0, 0.0]);
    assert_eq!(material.alpha, AlphaMode::Mask { cutoff: 0.3 });
    assert!(material.double_sided && !material.unlit && material.glint.is_none());
    assert_eq!((material.ior, material.specular.factor), (1.33, 0.6));
    assert_eq!(material.specular.color, [2.0, 1.0, 1.0]);
    let coat = material.clearcoat.expect("a clear coat");
    assert_eq!((coat.factor, coat.roughness, coat.normal_scale), (1.0, 0.1, 0.5));
    let sheen = material.sheen.expect("sheen");
    assert_eq!((sheen.color, sheen.roughness), ([0.1, 0.0, 0.0], 0.9));

    // One image, three ways to use it.
    let used = |reference: Option<TextureRef>| &scene.textures[reference.expect("a texture").texture];
    assert_eq!(scene.textures.len(), 3);
    assert_eq!(used(material.base_color_texture).encoding, Encoding::Srgb);
    assert_eq!(material.base_color_texture.map(|t| t.texture), material.emissive_texture.map(|t| t.texture));
    assert_eq!(used(material.metallic_roughness_texture).encoding, Encoding::Linear);
    assert_eq!(used(material.normal_texture).encoding, Encoding::Normal);
    assert_eq!(used(material.occlusion_texture).wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(used(material.occlusion_texture).nearest);
    assert_eq!(used(material.occlusion_texture).pixels[4..8], [255, 0, 0, 255]);
    assert_eq!(material.base_color_texture.map(|t| t.uv_set), Some(1));
}

#[test]
fn texture_transforms_scale_then_rotate_then_shift() {
    let transformed = |transform: Value, [u, v]: [f32; 2]| {
        let mut document = Document::square();
        let index = document.texture(1, 1, |_, _| [255; 4]);
        let info = json!({ "index": index, "extensions": { "KHR_texture_transform": transform } });
        document.material(json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }));
        let reference = document.scene().materials[0].base_color_texture.expect("a texture");
        let place = reference.transform.map(|[a, b, c]| a * u + b * v + c);
        (place.map(|c| (c * 1e6).round() / 1e6), reference.uv_set)
    };
    // The extension's own example: the lower left quarter of the image, turned clockwise by a right angle.
    let quarter = json!({ "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5] });
    assert_eq!(transformed(quarter.clone(), [0.0, 0.0]).0, [0.0, 1.0]);
    assert_eq!(transformed(quarter.clone(), [1.0, 0.0]).0, [0.0, 0.5]);
    assert_eq!(transformed(quarter, [0.0, 1.0]).0, [0.5, 1.0]);
    let uneven = json!({ "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1 });
    assert_eq!(transformed(uneven, [1.0, 1.0]), ([3.0, -2.0], 1));
    assert_eq!(transformed(json!({}), [0.25, 0.75]), ([0.25, 0.75], 0));
}

#[test]
fn every_kind_of_texture_can_be_transformed() {
    let mut document = Document::square();
    let index = document.texture(1, 1, |_, _| [128, 128, 255, 255]);
    let info = json!({ "index": index, "extensions": { "KHR_texture_transform": { "scale": [2, 3], "texCoord": 1 } } });
    document.material(json!({
        "pbrMetallicRoughness": { "baseColorTexture": info, "metallicRoughnessTexture": info },
        "normalTexture": info, "occlusionTexture": info, "emissiveTexture": info,
        "extensions": {
            "KHR_materials_specular": { "specularTexture": info, "specularColorTexture": info },
            "KHR_materials_clearcoat": { "clearcoatFactor": 1, "clearcoatTexture": info,
                "clearcoatRoughnessTexture": info, "clearcoatNormalTexture": info },
            "KHR_materials_sheen": { "sheenColorFactor": [1, 1, 1], "sheenColorTexture": info,
                "sheenRoughnessTexture": info },
        },
    }));
    let scene = document.scene();
    let material = &scene.materials[0];
    let coat = material.clearcoat.expect("a clear coat");
    let sheen = material.sheen.expect("sheen");
    for reference in [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emissive_texture,
        material.specular.texture,
        material.specular.color_texture,
        coat.texture,
        coat.roughness_texture,
        coat.normal_texture,
        sheen.color_texture,
        sheen.roughness_texture,
    ] {
        let reference = reference.expect("a texture");
        assert_eq!((reference.uv_set, reference.transform), (1, [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]));
    }
}

#[test]
fn glints_come_from_flat_extras() {
    let glint = |extras: Value| {
        let mut document = Document::square();
        document.material(json!({ "extras": extras }));
        let scene = document.scene();
        (scene.materials[0].glint.clone(), scene.warnings)
    };
    let (full, warnings) = glint(json!({
        "glint_count": 1e6, "glint_alpha": 0.5, "glint_gamma_deg": 2, "glint_seed": 7.0, "glint_color": [1, 0.5, 0, 1],
        "glint_uv_scale": 4, "glint_method": "wang2020", "glint_uv_set": 1, "glint_gama_deg": 3, "other": [1, 2],
    }));
    let full = full.expect("glints");
    assert_eq!((full.count, full.alpha, full.gamma_deg, full.seed), (1e6, 0.5, 2.0, 7));
    assert_eq!((full.color, full.uv_scale, full.uv_set), (Some([1.0, 0.5, 0.0]), 4.0, 1));
    assert_eq!(full.method.as_deref(), Some("wang2020"));
    let warned = |of: &str| warnings.iter().any(|warning| warning.contains(of));
    assert!(warned("glint_gama_deg"), "a misspelt key is named: {warnings:?}");
    assert!(warned("no area in texture space"), "the square has no second set: {warnings:?}");
    assert_eq!(warnings.len(), 2);
    assert_eq!(glint(json!({ "glint_count": 0, "glint_alpha": 0.5 })).0, None);
    assert_eq!(glint(json!({ "glint_alpha": 0.5 })).0, None);
    assert_eq!(glint(json!("none")).0, None);
    assert!(glint(json!({ "glint_count": 5 })).0.is_some_and(|glint| glint.alpha == 0.1 && glint.gamma_deg == 6.0));
}
