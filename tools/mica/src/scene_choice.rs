//! The scene that was asked for: embedded, or a file.

use crate::error::Failure;
use crate::progress::Progress;
use mica_render::scene::{Scene, SceneError};
use mica_render::{EMBEDDED_SCENES, embedded_scene};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// Name of the thread that reads what the user gave.
const LOADER: &str = "loader";
/// How many of them there are.
static READING: AtomicUsize = AtomicUsize::new(0);

/// Whether this thread reads what the user gave: the loader itself, or one that helps it.
pub fn reads() -> bool {
    // The main thread, which waits for the loader, is the only other one meanwhile.
    READING.load(Ordering::SeqCst) > 0 && std::thread::current().name() != Some("main")
}

/// A scene, and where it came from.
pub struct ChosenScene {
    /// As it was asked for.
    pub name: String,
    /// The folder of its file; none for embedded scenes.
    pub folder: Option<PathBuf>,
    /// The scene itself.
    pub scene: Scene,
}

/// Whether there is an embedded scene of that name, or else a file: known before anything else is done.
pub fn check(choice: &Path) -> Result<(), Failure> {
    let name = choice.display();
    if choice.to_str().and_then(embedded_scene).is_some() || choice.exists() {
        return Ok(());
    }
    if choice.extension().is_some() {
        return Err(Failure::bad_input(format!("{name}: there is no such file; name one that is there")));
    }
    let known: Vec<&str> = EMBEDDED_SCENES.iter().map(|scene| scene.name).collect();
    let known = known.join(", ");
    Err(Failure::bad_input(format!(
        "no scene `{name}`: embedded are {known}; or give the path of a .gltf or .glb file"
    )))
}

/// Loads the embedded scene of that name, or else the file.
pub fn load(choice: &Path, progress: &mut Progress) -> Result<ChosenScene, Failure> {
    let name = choice.display().to_string();
    if let Some(embedded) = choice.to_str().and_then(embedded_scene) {
        let scene = on_loader(&name, progress, || embedded.load())?;
        return Ok(ChosenScene { name, folder: None, scene });
    }
    if choice.extension().is_none() {
        check(choice)?;
    }
    let path = choice.to_owned();
    let folder = path.parent().map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let folder = folder.map(Path::to_owned);
    let scene = on_loader(&name, progress, move || Scene::load(&path))?;
    Ok(ChosenScene { name, folder, scene })
}

/// Reads something on a thread of its own: progress is shown meanwhile, and a panic there is an error here.
pub fn on_loader<T: Send + 'static>(
    what: &str,
    progress: &mut Progress,
    read: impl FnOnce() -> Result<T, SceneError> + Send + 'static,
) -> Result<T, Failure> {
    let (to, from) = mpsc::channel();
    READING.fetch_add(1, Ordering::SeqCst);
    let thread = std::thread::Builder::new().name(LOADER.to_owned()).spawn(move || {
        // The receiver waits as long as this thread lives.
        let _ = to.send(read());
    });
    if let Err(error) = thread {
        READING.fetch_sub(1, Ordering::SeqCst);
        return Err(Failure::bad_input(format!("{what}: no thread to read it on: {error}")));
    }
    let result = progress.wait(&format!("reading {what}"), from);
    READING.fetch_sub(1, Ordering::SeqCst);
    match result {
        Some(result) => Ok(result?),
        None => Err(Failure::bad_input(format!(
            "{what}: the loader gave up on it (run with RUST_LOG=debug for details); check the file, and report it if \
             other programs read it"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panicking() -> Result<(), Failure> {
        on_loader("x.glb", &mut Progress::new(true), || -> Result<(), SceneError> { panic!("injected") })
    }

    #[test]
    fn f43_a_panic_of_the_loader_is_a_failure_and_nothing_waits_for_it() {
        let failure = panicking().expect_err("it panicked");
        assert_eq!(failure.code, crate::error::BAD_INPUT);
        assert!(failure.to_string().contains("x.glb: the loader gave up on it"), "{failure}");
    }

    #[test]
    #[ignore = "is run alone by the test below, as it changes what the process says of panics"]
    fn panic_as_the_program_does() {
        crate::quiet_loader_panics();
        assert!(panicking().is_err());
        assert!(!reads(), "it is over");
    }

    #[test]
    fn f43_a_panic_of_the_loader_says_nothing_itself() {
        let program = std::env::current_exe().expect("this program");
        let alone = ["--exact", "--ignored", "--nocapture", "scene_choice::tests::panic_as_the_program_does"];
        let output = std::process::Command::new(program).args(alone).output().expect("it starts");
        assert!(output.status.success() && String::from_utf8_lossy(&output.stdout).contains("1 passed"), "{output:?}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    }
}
