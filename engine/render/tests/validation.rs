//! Every embedded scene with every method under each kind of validation, which has nothing to say.
//!
//! With ray queries where the device offers them. GPU-assisted validation rewrites every shader, and software drivers then
//! take minutes to compile them: by default it sees what `GPU_ASSISTED_METHODS` draws, and everything where the
//! environment has `MICA_VALIDATE=all`.

use mica_gpu::{Device, DeviceOptions, Executor, Timing, Validation};
use mica_graph::Graph;
use mica_render::scene::procedural;
use mica_render::{EMBEDDED_SCENES, Environment, METHODS, OcclusionBackend, Renderer, View};

/// Pixels of a frame.
const SIZE: [u32; 2] = [32, 18];

/// Those that GPU-assisted validation always sees: without glints, and with the fewest passes of their own.
const GPU_ASSISTED_METHODS: [&str; 2] = ["smooth", "zirr_kaplanyan"];

/// Renders each scene with each method and fails at the first message.
fn render_all(validation: Validation, scenes: &[&str], methods: &[&str]) {
    let device = Device::new(&DeviceOptions { validation, ..DeviceOptions::default() }).expect("a device");
    let messages = device.messages();
    let bodies = [Some(OcclusionBackend::Bvh), device.info().offers_ray_query().then_some(OcclusionBackend::RayQuery)];
    let mut executor = Executor::new(device).expect("an executor");
    let mut frames = 0;
    for scene in EMBEDDED_SCENES.iter().filter(|scene| scenes.contains(&scene.name)) {
        let loaded = scene.load_coarse().expect("it is sound");
        let view = View::new(loaded.default_camera(), SIZE);
        let map = procedural::environment("studio").expect("it is listed");
        let environment = Environment { map, rotation_radians: 0.3 };
        let renderer = |body| Renderer::new(loaded.clone(), &[], Some(&environment), body).expect("the scene is sound");
        let mut renderers: Vec<Renderer> = bodies.into_iter().flatten().map(renderer).collect();
        for (index, method) in methods.iter().enumerate() {
            // The bodies take turns.
            let turn = index % renderers.len();
            let renderer = &mut renderers[turn];
            renderer.set_method(None, method).expect("it is listed");
            if *method == "wang2020" {
                renderer.set(None, "samples", "1").expect("a setting");
                renderer.set(None, "depth", "2").expect("a setting");
            }
            let mut graph = Graph::new();
            let frame = renderer.frame(&mut graph, &view, None).expect("the frame is declared");
            graph.export(&frame.display);
            executor.run(graph, Timing::Overlapped).expect("the frame runs");
            let said: Vec<String> = messages.take().iter().map(ToString::to_string).collect();
            assert!(said.is_empty(), "{} by {method}, {:?}:\n{}", scene.name, renderer.occlusion(), said.join("\n"));
            frames += 1;
        }
    }
    drop(executor);
    assert_eq!(messages.take(), [], "something is left");
    assert_eq!(frames, scenes.len() * methods.len(), "a scene or method is missing");
}

/// All but the scene of a million triangles, which is like the others in smaller pieces.
fn all_scenes() -> Vec<&'static str> {
    EMBEDDED_SCENES.iter().filter(|scene| !scene.is_large()).map(|scene| scene.name).collect()
}

fn all_methods() -> Vec<&'static str> {
    METHODS.iter().map(|method| method.name).collect()
}

#[test]
fn core_validation_has_nothing_to_say_about_any_scene_and_method() {
    render_all(Validation::Core, &all_scenes(), &all_methods());
}

#[test]
fn synchronisation_validation_has_nothing_to_say_about_any_scene_and_method() {
    render_all(Validation::Synchronization, &all_scenes(), &all_methods());
}

#[test]
fn gpu_assisted_validation_has_nothing_to_say_about_what_it_has_time_for() {
    match std::env::var("MICA_VALIDATE").as_deref() {
        Ok("all") => render_all(Validation::GpuAssisted, &all_scenes(), &all_methods()),
        _ => render_all(Validation::GpuAssisted, &["sphere"], &GPU_ASSISTED_METHODS),
    }
}
