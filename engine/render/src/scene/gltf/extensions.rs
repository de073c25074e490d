//! What a file asks of its reader: its version and its extensions.

use crate::scene::{SceneError, SceneErrorCode};
use serde_json::Value;

/// What is read. Textures of other formats are not, but materials that only prefer them are.
const KNOWN: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Compressed geometry.
const COMPRESSIONS: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Refuses what cannot be shown as its author meant it, and says what is left out.
pub fn check(required: &[String], used: &[String], warnings: &mut Vec<String>) -> Result<(), SceneError> {
    for (k, name) in required.iter().enumerate() {
        let location = format!("extensionsRequired[{k}]");
        if COMPRESSIONS.contains(&name.as_str()) {
            let what = format!("geometry is compressed by {name}, which is not read");
            let remedy = "export it without compression";
            return Err(SceneError::new(SceneErrorCode::UnsupportedCompression, location, what, remedy));
        }
        if !KNOWN.contains(&name.as_str()) {
            let what = format!("requires {name}, which is not known here");
            let remedy = "export it without that extension";
            return Err(SceneError::new(SceneErrorCode::UnsupportedExtension, location, what, remedy));
        }
    }
    for name in used {
        if !KNOWN.contains(&name.as_str()) {
            warnings.push(format!("uses {name}, which is ignored"));
        }
    }
    Ok(())
}

/// Refuses a document, by its `asset`, that is not glTF 2.0.
pub fn check_version(asset: Option<&Value>) -> Result<(), SceneError> {
    let unknown = |location: &str, what: &Value| {
        let what = format!("{what}, where 2.0 is read");
        Err(SceneError::new(SceneErrorCode::UnknownVersion, location, what, "export it as glTF 2.0"))
    };
    let of_asset = |key: &str| asset.and_then(|asset| asset.get(key)).unwrap_or(&Value::Null);
    // A string; before 1.0, a number.
    let version = of_asset("version");
    if version.as_str().and_then(|version| version.split('.').next()) != Some("2") {
        return unknown("asset.version", version);
    }
    match of_asset("minVersion") {
        Value::Null => Ok(()),
        least if least == "2.0" => Ok(()),
        least => unknown("asset.minVersion", least),
    }
}
