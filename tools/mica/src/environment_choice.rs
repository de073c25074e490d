//! The light from everywhere that was asked for, on the command line or by the scene.

use crate::args::{numbers, power};
use crate::error::Failure;
use crate::progress::Progress;
use crate::scene_choice::{ChosenScene, on_loader};
use mica_render::Environment;
use mica_render::scene::{EquirectMap, procedural};
use std::path::{Component, Path, PathBuf};

/// What lights a scene that says nothing of light at all.
const DEFAULT: &str = "overcast";

/// An environment, and what it was asked for by.
pub struct ChosenEnvironment {
    /// Name, path, `constant:R,G,B` or `none`.
    pub name: String,
    /// None for `none`.
    pub environment: Option<Environment>,
}

/// The environment of `--env`, or else the scene's own, or else what fits its lights.
pub fn choose(
    asked: Option<&Path>,
    rotation_deg: f64,
    chosen: &ChosenScene,
    has_lights: bool,
    progress: &mut Progress,
) -> Result<ChosenEnvironment, Failure> {
    let (name, map) = match (asked, &chosen.scene.environment) {
        (Some(asked), _) => (asked.display().to_string(), of_command_line(asked, progress)?),
        (None, Some(own)) => (own.clone(), Some(of_scene(own, chosen, progress)?)),
        (None, None) if has_lights => ("none".to_owned(), None),
        (None, None) => (DEFAULT.to_owned(), procedural::environment(DEFAULT)),
    };
    let environment = map.map(|map| Environment { map, rotation_radians: rotation_deg.to_radians() });
    Ok(ChosenEnvironment { name, environment })
}

/// What `--env` names; none for `none`.
pub fn of_command_line(asked: &Path, progress: &mut Progress) -> Result<Option<EquirectMap>, Failure> {
    let text = asked.to_str().unwrap_or_default();
    if text == "none" {
        return Ok(None);
    }
    if let Some(rgb) = text.strip_prefix("constant:") {
        return constant(rgb).map(Some);
    }
    if let Some(map) = procedural::environment(text) {
        return Ok(Some(map));
    }
    check(asked)?;
    from_file(asked, progress).map(Some)
}

/// Whether `--env` names something: what the file holds is seen when it is read.
pub fn check(asked: &Path) -> Result<(), Failure> {
    let text = asked.to_str().unwrap_or_default();
    if let Some(rgb) = text.strip_prefix("constant:") {
        return constant(rgb).map(|_| ());
    }
    let is_name = text == "none" || procedural::NAMES.iter().any(|(name, _)| *name == text);
    if is_name || asked.extension().is_some() || asked.exists() {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "no environment `{}`: there are {}, none and constant:R,G,B; or give the path of an .exr or .hdr file",
        asked.display(),
        names()
    )))
}

fn constant(rgb: &str) -> Result<EquirectMap, Failure> {
    let radiance = numbers(rgb).and_then(power).ok_or_else(|| {
        Failure::bad_input(format!("--env constant:{rgb}: expected constant:R,G,B, each a number from 0 to 1e12"))
    })?;
    Ok(EquirectMap::constant(radiance))
}

/// What the scene's file asks for: a name, or a file in the scene's own folder or below it.
fn of_scene(own: &str, chosen: &ChosenScene, progress: &mut Progress) -> Result<EquirectMap, Failure> {
    if let Some(map) = procedural::environment(own) {
        return Ok(map);
    }
    match chosen.folder.as_deref().and_then(|folder| confined(folder, Path::new(own))) {
        Some(path) => from_file(&path, progress),
        None => Err(Failure::bad_input(format!(
            "{}: its environment `{own}` is neither one of {} nor a file in its folder; choose one with --env",
            chosen.name,
            names()
        ))),
    }
}

/// The path within a folder, if that is where it leads, symbolic links followed.
fn confined(folder: &Path, path: &Path) -> Option<PathBuf> {
    let inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let (folder, path) = (folder.canonicalize().ok()?, folder.join(path).canonicalize().ok()?);
    (inside && path.starts_with(folder)).then_some(path)
}

fn from_file(path: &Path, progress: &mut Progress) -> Result<EquirectMap, Failure> {
    let file = path.to_owned();
    // What had to be repaired is in the log.
    let (map, _) = on_loader(&path.display().to_string(), progress, move || EquirectMap::load(&file))?;
    Ok(map)
}

fn names() -> String {
    procedural::NAMES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_default_exists() {
        assert!(procedural::environment(DEFAULT).is_some());
    }

    #[test]
    fn a_scene_reaches_nothing_outside_its_folder() {
        let outside = tempfile::tempdir().expect("a temporary folder");
        let folder = outside.path().join("scene");
        fs::create_dir_all(folder.join("maps")).expect("a folder");
        fs::write(outside.path().join("secret.exr"), "x").expect("a file");
        fs::write(folder.join("maps/sky.exr"), "x").expect("a file");
        std::os::unix::fs::symlink("../secret.exr", folder.join("link.exr")).expect("a link");
        assert!(confined(&folder, Path::new("maps/sky.exr")).is_some());
        let absolute = folder.join("maps/sky.exr");
        for bad in
            ["../secret.exr", "maps/../../secret.exr", "link.exr", "missing.exr", absolute.to_str().unwrap_or("/")]
        {
            assert_eq!(confined(&folder, Path::new(bad)), None, "{bad}");
        }
    }
}
