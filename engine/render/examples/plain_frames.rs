//! Prints the plans of frames in which nothing glints, byte for byte: first frames and later ones of every embedded scene with its
//! glints taken away, under an environment, lights, both and neither.
//!
//! `ci/check` compares what this prints with and without the methods (`--no-default-features`): who does not use them pays nothing.

use glam::DVec3;
use mica_graph::{Graph, Plan, Requirements};
use mica_render::scene::{EquirectMap, Light};
use mica_render::{EMBEDDED_SCENES, Environment, OcclusionBackend, Renderer, View};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    eprintln!("methods: {}", mica_render::METHODS.len());
    let sky = Environment { map: EquirectMap::constant([0.5; 3]), rotation_radians: 0.0 };
    let sun = Light::Directional { direction: -DVec3::Y, irradiance: [1.0; 3] };
    for embedded in EMBEDDED_SCENES {
        for (environment, lights) in [(None, vec![]), (Some(&sky), vec![]), (None, vec![sun]), (Some(&sky), vec![sun])]
        {
            let mut scene = embedded.load_coarse()?;
            scene.lights.clear();
            scene.materials.iter_mut().for_each(|material| material.glint = None);
            let view = View::new(scene.default_camera(), [320, 180]);
            let mut renderer = Renderer::new(scene, &lights, environment, OcclusionBackend::Bvh)?;
            for frame in ["first frame", "later frames"] {
                let mut g = Graph::new();
                let made = renderer.frame(&mut g, &view, None)?;
                g.export(&made.display);
                let (sky, lights) = (environment.is_some(), lights.len());
                println!("# {}, environment: {sky}, lights: {lights}, {frame}", embedded.name);
                println!("{}", Plan::new(g, &|resource, _| Requirements { bytes: resource.bytes(), alignment: 256 })?);
            }
        }
    }
    Ok(())
}
