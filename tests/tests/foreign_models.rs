//! Models made by other people's exporters, as Debian packages them for the tests of assimp: what loads, renders.

use mica_render::scene::{EquirectMap, Light, Scene, procedural};
use mica_render::{Environment, OcclusionBackend, Renderer, View};
use mica_tests::{Gpu, Tally};
use std::path::{Path, PathBuf};

/// Where the package assimp-testmodels keeps its glTF 2.0 files.
const FOLDER: &str = "/usr/share/assimp/models/glTF2";
/// How many of them can be drawn: the others are broken on purpose, ask for what is refused by name, or hold no
/// triangle.
const LEAST: usize = 20;

fn models(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the folder is readable")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            models(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb") {
            found.push(path);
        }
    }
}

/// Light from the right, so that every model has a bright and a dark side, whatever its scale.
fn lit() -> (Environment, [Light; 1]) {
    let map: EquirectMap = procedural::environment("overcast").expect("it is listed");
    let direction = glam::DVec3::new(-1.0, -0.6, -0.8).normalize();
    (Environment { map, rotation_radians: 0.0 }, [Light::Directional { direction, irradiance: [2.0, 1.9, 1.7] }])
}

#[test]
fn models_of_other_exporters_render() {
    let mut tally = Tally::default();
    if !Path::new(FOLDER).is_dir() {
        tally.skipped(FOLDER, "it is not there: Debian's assimp-testmodels has it");
        tally.finish("models of other exporters", if std::env::var_os("CI").is_some() { LEAST } else { 0 });
        return;
    }
    let mut paths = Vec::new();
    models(Path::new(FOLDER), &mut paths);
    let mut gpu = Gpu::new();
    let (environment, lights) = lit();
    for path in paths {
        let name = path.strip_prefix(FOLDER).expect("below the folder").display().to_string();
        let scene = match Scene::load(&path) {
            Ok(scene) => scene,
            Err(error) => {
                tally.skipped(name, format!("refused: {error}"));
                continue;
            }
        };
        if scene.triangle_count() == 0 {
            tally.skipped(name, "it has no triangles");
            continue;
        }
        // A camera of ours: those in the files may look elsewhere.
        let view = View::new(Scene { cameras: Vec::new(), ..scene.clone() }.default_camera(), [64, 36]);
        let mut renderer =
            Renderer::new(scene, &lights, Some(&environment), OcclusionBackend::Bvh).expect("what loads can be drawn");
        let picture = gpu.render(&mut renderer, &view).picture;
        assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{name}");
        let hits = picture.hits().iter().filter(|hit| **hit).count();
        assert!(hits > 0, "{name}: nothing is seen");
        assert!(picture.mean_over_hits().iter().sum::<f64>() > 0.0, "{name}: all is black");
        assert!(picture.variance() > 0.0, "{name}: all pixels are alike");
        tally.ran(name);
    }
    tally.finish("models of other exporters", LEAST);
}
