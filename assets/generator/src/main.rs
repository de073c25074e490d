//! Writes the embedded scenes: `make-scenes [FOLDER [SCENE...]]`, by default all of them into `assets/scenes`.

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let folder = arguments.next().map_or_else(|| PathBuf::from("assets/scenes"), PathBuf::from);
    let wanted: Vec<_> = arguments.collect();
    if let Some(unknown) = wanted.iter().find(|w| mica_generator::SCENES.iter().all(|(name, _)| w.as_os_str() != *name))
    {
        eprintln!("make-scenes: no scene is called {}; leave the names away to make all", unknown.display());
        return ExitCode::from(2);
    }
    for (name, scene) in mica_generator::SCENES {
        if !wanted.is_empty() && wanted.iter().all(|w| w.as_os_str() != name) {
            continue;
        }
        let path = folder.join(name).with_extension("glb");
        let bytes = scene().to_glb();
        if let Err(error) = std::fs::write(&path, &bytes) {
            eprintln!("make-scenes: cannot write {}: {error}; does the folder exist?", path.display());
            return ExitCode::from(2);
        }
        println!("{} {} bytes", path.display(), bytes.len());
    }
    ExitCode::SUCCESS
}
