//! glTF 2.0 files into scenes: everything that the file says is checked here before it is believed.
//!
//! The document's structures are those of the `gltf` crate, the checks are our own: a file may refer to what is not
//! there, declare sizes without end, loop, or point at other people's files, and none of that may panic, hang or exhaust
//! memory. So the crate's readers, which trust a file once its indices are in range, are not used.

mod accessor;
mod container;
mod document;
mod extensions;
mod geometry;
mod glints;
mod images;
mod limits;
mod materials;
mod nodes;
mod source;
mod strict_json;

pub use limits::LoadLimits;
pub(super) use source::read_regular_file;

use super::error::OneLine;
use super::{Instance, Material, Mesh, Scene, SceneError, SceneErrorCode};
use ::gltf::json::{Buffer, Root};
use accessor::{Reader, named};
use images::TextureUses;
use limits::Budget;
use nodes::Placed;
use rayon::prelude::*;
use source::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Loads a file and what it refers to.
pub fn load(path: &Path, limits: &LoadLimits) -> Result<Scene, SceneError> {
    let file = path.display().to_string();
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let name = path.file_name().map_or_else(|| file.clone(), |name| name.to_string_lossy().into_owned());
    source::read_regular_file(path, limits.file_bytes, "")
        .and_then(|bytes| read(name, &bytes, Some(folder), limits))
        .map_err(|error| error.in_file(&file))
}

/// Reads a file's bytes; it may refer to no other files.
pub fn from_bytes(name: &str, bytes: &[u8], limits: &LoadLimits) -> Result<Scene, SceneError> {
    read(name.to_owned(), bytes, None, limits).map_err(|error| error.in_file(name))
}

fn read(name: String, bytes: &[u8], folder: Option<PathBuf>, limits: &LoadLimits) -> Result<Scene, SceneError> {
    let container = container::open(bytes)?;
    let (document, mut warnings) = document::read(container.json)?;
    let source = Source { folder, limits };
    let budget = Budget::new(limits.total_bytes);
    let Placed { meshes: placements, lights, cameras, warnings: said } = nodes::walk(&document, limits)?;
    warnings.extend(said);
    let buffers = read_buffers(&document, &source, container.binary, &budget)?;
    let reader = Reader { document: &document, buffers, budget: &budget };

    let mut uses = TextureUses::new(&document);
    let mut materials = materials::read(&document, &mut uses)?;
    let (textures, said) = uses.decode(&reader, &source)?;
    warnings.extend(said);

    let shown: BTreeSet<usize> = placements.iter().map(|(mesh, ..)| *mesh).collect();
    let (meshes, of_object, said) = read_meshes(&reader, &shown, &mut materials)?;
    warnings.extend(said);
    let instances: Vec<Instance> = placements
        .into_iter()
        .flat_map(|(object, world_from_local, name)| {
            let meshes = &of_object[&object];
            meshes.iter().map(move |&mesh| Instance { mesh, world_from_local, name: name.clone() })
        })
        .collect();
    if instances.is_empty() {
        warnings.push("nothing in it can be shown".to_owned());
    }

    let environment = match nodes::scene_index(&document)? {
        None => None,
        Some(scene) => {
            let extras = document::extras(&document.scenes[scene].extras, &format!("scenes[{scene}]"))?;
            extras.get("environment").and_then(|name| name.as_str()).map(str::to_owned)
        }
    };
    let warnings: Vec<String> = warnings.iter().map(|warning| OneLine(warning).to_string()).collect();
    for warning in &warnings {
        log::warn!("{}: {warning}", OneLine(&name));
    }
    let mut scene = Scene { name, meshes, instances, materials, textures, lights, cameras, warnings, environment };
    scene.centre_far_meshes();
    Ok(scene)
}

/// The bytes of every buffer, as many as it declares; none where the document gives a buffer no data.
fn read_buffers(
    document: &Root,
    source: &Source,
    binary: Option<&[u8]>,
    budget: &Budget,
) -> Result<Vec<Option<Vec<u8>>>, SceneError> {
    let read = |(k, buffer): (usize, &Buffer)| {
        let location = format!("buffers[{k}]");
        let mut bytes = match (&buffer.uri, binary) {
            (Some(uri), _) => source.read(uri, &location)?,
            (None, Some(binary)) if k == 0 => binary.to_vec(),
            (None, _) => return Ok(None),
        };
        if (bytes.len() as u64) < buffer.byte_length.0 {
            let what = format!("declares {} bytes, but has {}", buffer.byte_length.0, bytes.len());
            let remedy = "copy the file again: it is cut short";
            return Err(SceneError::new(SceneErrorCode::BufferTooShort, location, what, remedy));
        }
        bytes.truncate(buffer.byte_length.0 as usize);
        budget.claim(bytes.len() as u64, &location)?;
        Ok(Some(bytes))
    };
    document.buffers.iter().enumerate().map(read).collect()
}

/// The scene's meshes, those that came of each of the document's, and what had to be said.
type Meshes = (Vec<Mesh>, BTreeMap<usize, Vec<usize>>, Vec<String>);

/// Builds the meshes of the document's objects that are shown, in order.
fn read_meshes(reader: &Reader, shown: &BTreeSet<usize>, materials: &mut Vec<Material>) -> Result<Meshes, SceneError> {
    let mut jobs = Vec::new();
    for &object in shown {
        let meshes = &reader.document.meshes;
        for (k, primitive) in meshes[object].primitives.iter().enumerate() {
            let location = format!("meshes[{object}].primitives[{k}]");
            if let Some(material) = primitive.material {
                named(&reader.document.materials, material.value(), "materials", &format!("{location}.material"))?;
            }
            jobs.push((object, primitive, location));
        }
    }
    // Primitives without a material share one that follows those of the file.
    let default_material = materials.len();
    if jobs.iter().any(|(_, primitive, _)| primitive.material.is_none()) {
        materials.push(Material::default());
    }
    let built: Vec<_> = jobs
        .par_iter()
        .map(|(object, primitive, location)| {
            let name = reader.document.meshes[*object].name.clone().unwrap_or_else(|| location.clone());
            let material = primitive.material.map_or(default_material, |material| material.value());
            geometry::build(reader, primitive, name, (material, &materials[material]), location)
        })
        .collect();

    let mut meshes = Vec::new();
    let mut warnings = Vec::new();
    let mut of_object: BTreeMap<usize, Vec<usize>> = shown.iter().map(|&object| (object, Vec::new())).collect();
    for (built, (object, ..)) in built.into_iter().zip(&jobs) {
        let built = built?;
        warnings.extend(built.warnings);
        if let Some(mesh) = built.mesh {
            of_object.entry(*object).or_default().push(meshes.len());
            meshes.push(mesh);
        }
    }
    Ok((meshes, of_object, warnings))
}
