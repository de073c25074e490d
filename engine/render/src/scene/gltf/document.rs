//! A document's JSON as the types of the `gltf` crate, and what that crate does not know.
//!
//! These types are plain data: that an index names an object and a number lies in its range is checked where they are
//! used. The crate's own accessors to them are left alone, for they take both for granted and panic otherwise.

use super::extensions;
use super::strict_json::{self, invalid};
use crate::scene::SceneError;
use ::gltf::json::extensions::texture::TextureTransform;
use ::gltf::json::material::{NormalTexture, OcclusionTexture};
use ::gltf::json::texture::Info;
use ::gltf::json::{Index, Root, Texture};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;
use serde_json::{Map, Value};

/// Reads a document, as far as it is used, and says what of it is left out.
///
/// Skins and animations are not played, so they are not read either: a defect in one does no harm.
pub fn read(text: &[u8]) -> Result<(Root, Vec<String>), SceneError> {
    let mut members = strict_json::parse(text)?;
    // First of all: in a document of another version nothing else need make sense.
    extensions::check_version(members.get("asset"))?;
    let mut warnings = Vec::new();
    let required: Vec<String> = list(&mut members, "extensionsRequired")?;
    let used: Vec<String> = list(&mut members, "extensionsUsed")?;
    extensions::check(&required, &used, &mut warnings)?;

    if let Some(Value::Array(animations)) = members.get("animations")
        && !animations.is_empty()
    {
        warnings.push(format!("its {} animations are not played", animations.len()));
    }
    // A scene of glTF may have no nodes; the crate's has a list of them.
    if let Some(Value::Array(scenes)) = members.get_mut("scenes") {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    let root = Root {
        scene: optional(&mut members, "scene")?,
        scenes: list(&mut members, "scenes")?,
        nodes: list(&mut members, "nodes")?,
        meshes: list(&mut members, "meshes")?,
        accessors: list(&mut members, "accessors")?,
        buffer_views: list(&mut members, "bufferViews")?,
        buffers: list(&mut members, "buffers")?,
        materials: list(&mut members, "materials")?,
        textures: list(&mut members, "textures")?,
        images: list(&mut members, "images")?,
        samplers: list(&mut members, "samplers")?,
        cameras: list(&mut members, "cameras")?,
        extensions: optional(&mut members, "extensions")?,
        extensions_required: required,
        extensions_used: used,
        ..Root::default()
    };
    Ok((root, warnings))
}

/// Item by item, so that an error names the one that it concerns.
fn list<T: DeserializeOwned>(members: &mut Map<String, Value>, key: &str) -> Result<Vec<T>, SceneError> {
    let typed = |(k, item): (usize, Value)| {
        serde_json::from_value(item).map_err(|error| invalid(format!("{key}[{k}]"), error.to_string()))
    };
    match members.remove(key) {
        None => Ok(Vec::new()),
        Some(Value::Array(items)) => items.into_iter().enumerate().map(typed).collect(),
        Some(_) => Err(invalid(key, "not an array")),
    }
}

fn optional<T: DeserializeOwned>(members: &mut Map<String, Value>, key: &str) -> Result<Option<T>, SceneError> {
    let value = members.remove(key);
    value.map(|value| serde_json::from_value(value).map_err(|error| invalid(key, error.to_string()))).transpose()
}

/// An extension that the crate hands on as it is; `location` names the object that has it.
pub fn extension<T: DeserializeOwned>(
    others: &Map<String, Value>,
    name: &str,
    location: &str,
) -> Result<Option<T>, SceneError> {
    let Some(value) = others.get(name) else { return Ok(None) };
    T::deserialize(value).map(Some).map_err(|error| invalid(format!("{location}.extensions.{name}"), error.to_string()))
}

/// What an application added to an object; null where it added nothing.
pub fn extras(extras: &Option<Box<RawValue>>, location: &str) -> Result<Value, SceneError> {
    extras.as_ref().map_or(Ok(Value::Null), |text| {
        serde_json::from_str(text.get()).map_err(|error| invalid(format!("{location}.extras"), error.to_string()))
    })
}

/// `KHR_materials_clearcoat`.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct ClearcoatObject {
    pub clearcoat_factor: f32,
    pub clearcoat_texture: Option<Info>,
    pub clearcoat_roughness_factor: f32,
    pub clearcoat_roughness_texture: Option<Info>,
    pub clearcoat_normal_texture: Option<NormalTexture>,
}

/// `KHR_materials_sheen`.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct SheenObject {
    pub sheen_color_factor: [f32; 3],
    pub sheen_color_texture: Option<Info>,
    pub sheen_roughness_factor: f32,
    pub sheen_roughness_texture: Option<Info>,
}

/// What the crate's three kinds of reference to a texture have in common.
pub trait TextureInfo {
    fn texture(&self) -> Index<Texture>;
    fn uv_set(&self) -> u32;
    /// `KHR_texture_transform`, which the crate knows on one kind of them only.
    fn transform(&self, location: &str) -> Result<Option<TextureTransform>, SceneError>;
}

impl TextureInfo for Info {
    fn texture(&self) -> Index<Texture> {
        self.index
    }

    fn uv_set(&self) -> u32 {
        self.tex_coord
    }

    fn transform(&self, _location: &str) -> Result<Option<TextureTransform>, SceneError> {
        Ok(self.extensions.as_ref().and_then(|extensions| extensions.texture_transform.clone()))
    }
}

impl TextureInfo for NormalTexture {
    fn texture(&self) -> Index<Texture> {
        self.index
    }

    fn uv_set(&self) -> u32 {
        self.tex_coord
    }

    fn transform(&self, location: &str) -> Result<Option<TextureTransform>, SceneError> {
        let Some(extensions) = &self.extensions else { return Ok(None) };
        extension(&extensions.others, "KHR_texture_transform", location)
    }
}

impl TextureInfo for OcclusionTexture {
    fn texture(&self) -> Index<Texture> {
        self.index
    }

    fn uv_set(&self) -> u32 {
        self.tex_coord
    }

    fn transform(&self, location: &str) -> Result<Option<TextureTransform>, SceneError> {
        let Some(extensions) = &self.extensions else { return Ok(None) };
        extension(&extensions.others, "KHR_texture_transform", location)
    }
}
