//! Materials of the document, their values checked, their textures registered by use (glTF 2.0, section 3.9).

use super::document::{self, ClearcoatObject, SheenObject, TextureInfo};
use super::glints;
use super::images::TextureUses;
use crate::scene::{AlphaMode, Clearcoat, Encoding, Material, SceneError, SceneErrorCode, Sheen, Specular, TextureRef};
use ::gltf::json;
use ::gltf::json::Root;
use ::gltf::json::material::NormalTexture;
use ::gltf::json::validation::Checked;
use std::fmt::Display;
use std::ops::RangeInclusive;

/// Colours and strengths.
const UNIT: RangeInclusive<f32> = 0.0..=1.0;
/// Light, and what glTF leaves unbounded above.
const POSITIVE: RangeInclusive<f32> = 0.0..=1e9;
/// Scales and offsets of texture space.
const ANY: RangeInclusive<f32> = -1e9..=1e9;

/// Reads every material; `uses` collects what they need of the textures.
pub fn read(document: &Root, uses: &mut TextureUses) -> Result<Vec<Material>, SceneError> {
    document.materials.iter().enumerate().map(|(k, object)| read_one(object, format!("materials[{k}]"), uses)).collect()
}

fn read_one(object: &json::Material, location: String, uses: &mut TextureUses) -> Result<Material, SceneError> {
    let at = |field: &str| format!("{location}.{field}");
    let pbr = &object.pbr_metallic_roughness;
    let within_pbr = |field: &str| at(&format!("pbrMetallicRoughness.{field}"));
    let none = Extensions::default();
    let extensions = object.extensions.as_ref().unwrap_or(&none);
    let strength = extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength.0);
    let strength =
        check_range(strength, &POSITIVE, &at("extensions.KHR_materials_emissive_strength.emissiveStrength"))?;
    let emissive = all_in_range(object.emissive_factor.0, &POSITIVE, &at("emissiveFactor"))?;
    let occlusion = object.occlusion_texture.as_ref().map_or(1.0, |info| info.strength.0);
    Ok(Material {
        name: object.name.clone().unwrap_or_else(|| location.clone()),
        base_color: all_in_range(pbr.base_color_factor.0, &UNIT, &within_pbr("baseColorFactor"))?,
        base_color_texture: texture(&pbr.base_color_texture, Encoding::Srgb, &within_pbr("baseColorTexture"), uses)?,
        metallic: check_range(pbr.metallic_factor.0, &UNIT, &within_pbr("metallicFactor"))?,
        roughness: check_range(pbr.roughness_factor.0, &UNIT, &within_pbr("roughnessFactor"))?,
        metallic_roughness_texture: texture(
            &pbr.metallic_roughness_texture,
            Encoding::Linear,
            &within_pbr("metallicRoughnessTexture"),
            uses,
        )?,
        emissive: emissive.map(|c| c * strength),
        emissive_texture: texture(&object.emissive_texture, Encoding::Srgb, &at("emissiveTexture"), uses)?,
        normal_texture: texture(&object.normal_texture, Encoding::Normal, &at("normalTexture"), uses)?,
        normal_scale: normal_scale(&object.normal_texture, &at("normalTexture.scale"))?,
        occlusion_texture: texture(&object.occlusion_texture, Encoding::Linear, &at("occlusionTexture"), uses)?,
        occlusion_strength: check_range(occlusion, &UNIT, &at("occlusionTexture.strength"))?,
        alpha: alpha_mode(object, &location)?,
        double_sided: object.double_sided,
        unlit: extensions.unlit.is_some(),
        ior: ior(extensions.ior.as_ref().map(|e| e.ior.0), &at("extensions.KHR_materials_ior.ior"))?,
        specular: specular(extensions, &location, uses)?,
        clearcoat: clearcoat(extensions, &location, uses)?.filter(|coat| coat.factor > 0.0),
        sheen: sheen(extensions, &location, uses)?.filter(|sheen| sheen.color != [0.0; 3]),
        glint: glints::read(&document::extras(&object.extras, &location)?, &location, &mut uses.warnings)?,
    })
}

type Extensions = json::extensions::material::Material;

fn specular(extensions: &Extensions, location: &str, uses: &mut TextureUses) -> Result<Specular, SceneError> {
    let Some(object) = &extensions.specular else { return Ok(Specular::default()) };
    let at = |field: &str| format!("{location}.extensions.KHR_materials_specular.{field}");
    Ok(Specular {
        factor: check_range(object.specular_factor.0, &UNIT, &at("specularFactor"))?,
        texture: texture(&object.specular_texture, Encoding::Linear, &at("specularTexture"), uses)?,
        color: all_in_range(object.specular_color_factor.0, &POSITIVE, &at("specularColorFactor"))?,
        color_texture: texture(&object.specular_color_texture, Encoding::Srgb, &at("specularColorTexture"), uses)?,
    })
}

fn clearcoat(extensions: &Extensions, location: &str, uses: &mut TextureUses) -> Result<Option<Clearcoat>, SceneError> {
    const NAME: &str = "KHR_materials_clearcoat";
    let object: Option<ClearcoatObject> = document::extension(&extensions.others, NAME, location)?;
    let Some(object) = object else { return Ok(None) };
    let at = |field: &str| format!("{location}.extensions.{NAME}.{field}");
    Ok(Some(Clearcoat {
        factor: check_range(object.clearcoat_factor, &UNIT, &at("clearcoatFactor"))?,
        texture: texture(&object.clearcoat_texture, Encoding::Linear, &at("clearcoatTexture"), uses)?,
        roughness: check_range(object.clearcoat_roughness_factor, &UNIT, &at("clearcoatRoughnessFactor"))?,
        roughness_texture: texture(
            &object.clearcoat_roughness_texture,
            Encoding::Linear,
            &at("clearcoatRoughnessTexture"),
            uses,
        )?,
        normal_texture: texture(
            &object.clearcoat_normal_texture,
            Encoding::Normal,
            &at("clearcoatNormalTexture"),
            uses,
        )?,
        normal_scale: normal_scale(&object.clearcoat_normal_texture, &at("clearcoatNormalTexture.scale"))?,
    }))
}

fn sheen(extensions: &Extensions, location: &str, uses: &mut TextureUses) -> Result<Option<Sheen>, SceneError> {
    const NAME: &str = "KHR_materials_sheen";
    let object: Option<SheenObject> = document::extension(&extensions.others, NAME, location)?;
    let Some(object) = object else { return Ok(None) };
    let at = |field: &str| format!("{location}.extensions.{NAME}.{field}");
    Ok(Some(Sheen {
        color: all_in_range(object.sheen_color_factor, &UNIT, &at("sheenColorFactor"))?,
        color_texture: texture(&object.sheen_color_texture, Encoding::Srgb, &at("sheenColorTexture"), uses)?,
        roughness: check_range(object.sheen_roughness_factor, &UNIT, &at("sheenRoughnessFactor"))?,
        roughness_texture: texture(
            &object.sheen_roughness_texture,
            Encoding::Linear,
            &at("sheenRoughnessTexture"),
            uses,
        )?,
    }))
}

fn texture(
    info: &Option<impl TextureInfo>,
    encoding: Encoding,
    location: &str,
    uses: &mut TextureUses,
) -> Result<Option<TextureRef>, SceneError> {
    let Some(info) = info else { return Ok(None) };
    let transform = info.transform(location)?;
    let set = transform.as_ref().and_then(|transform| transform.tex_coord).unwrap_or(info.uv_set());
    if set > 1 {
        uses.warnings.push(format!("{location}: uses texture coordinates {set}, of which 0 and 1 are kept; left out"));
        return Ok(None);
    }
    let Some(texture) = uses.register(info.texture(), encoding, location)? else { return Ok(None) };
    let transform = match transform {
        None => TextureRef::IDENTITY,
        Some(transform) => {
            let at = |field: &str| format!("{location}.extensions.KHR_texture_transform.{field}");
            let [u, v] = all_in_range(transform.offset.0, &ANY, &at("offset"))?;
            let [su, sv] = all_in_range(transform.scale.0, &ANY, &at("scale"))?;
            let (sin, cos) = f64::from(check_range(transform.rotation.0, &ANY, &at("rotation"))?).sin_cos();
            let (sin, cos) = (sin as f32, cos as f32);
            // Counter-clockwise as seen, with v downwards. The matrix in the extension's text turns the other way than
            // its own example and the reference viewer, which agree.
            [[cos * su, sin * sv, u], [-sin * su, cos * sv, v]]
        }
    };
    Ok(Some(TextureRef { texture, uv_set: set, transform }))
}

fn normal_scale(info: &Option<NormalTexture>, location: &str) -> Result<f32, SceneError> {
    check_range(info.as_ref().map_or(1.0, |info| info.scale), &ANY, location)
}

fn alpha_mode(object: &json::Material, location: &str) -> Result<AlphaMode, SceneError> {
    match object.alpha_mode {
        Checked::Valid(json::material::AlphaMode::Opaque) => Ok(AlphaMode::Opaque),
        Checked::Valid(json::material::AlphaMode::Blend) => Ok(AlphaMode::Blend),
        Checked::Valid(json::material::AlphaMode::Mask) => {
            let cutoff = object.alpha_cutoff.unwrap_or_default().0;
            Ok(AlphaMode::Mask { cutoff: check_range(cutoff, &POSITIVE, &format!("{location}.alphaCutoff"))? })
        }
        Checked::Invalid => Err(SceneError::new(
            SceneErrorCode::ValueNotInRange,
            format!("{location}.alphaMode"),
            "a mode that does not exist; OPAQUE, MASK and BLEND do",
            "set one of these",
        )),
    }
}

/// An index of refraction: at least 1, or 0, which stands for a Fresnel of 1.
fn ior(ior: Option<f32>, location: &str) -> Result<f32, SceneError> {
    match ior {
        None => Ok(1.5),
        Some(0.0) => Ok(0.0),
        Some(ior) => check_range(ior, &(1.0..=1e3), location),
    }
}

fn all_in_range<const N: usize>(
    values: [f32; N],
    range: &RangeInclusive<f32>,
    location: &str,
) -> Result<[f32; N], SceneError> {
    for value in values {
        check_range(value, range, location)?;
    }
    Ok(values)
}

/// The value, or an error that states the range; NaN is in no range.
pub fn check_range<T: PartialOrd + Display>(
    value: T,
    range: &RangeInclusive<T>,
    location: &str,
) -> Result<T, SceneError> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(SceneError::new(
        SceneErrorCode::ValueNotInRange,
        location,
        format!("{value}, where {} to {} is allowed", range.start(), range.end()),
        "set a value in that range",
    ))
}
