//! What figures take for the displayed picture is what the tone mapping shows.

use mica_accuracy::displayed;
use mica_gpu::Timing;
use mica_graph::Graph;
use mica_render::{OcclusionBackend, Renderer, View, embedded_scene};
use mica_tests::{Gpu, Picture};

/// To one of 255 steps, as devices round powers each in their own way; from pictures that are nearly black to such as have
/// little but highlights.
#[test]
fn the_tone_mapping_of_figures_is_that_of_the_renderer() {
    let scene = embedded_scene("shoe").expect("it is embedded").load_coarse().expect("it is sound");
    let view = View::new(scene.default_camera(), [96, 54]);
    let mut renderer = Renderer::new(scene, &[], None, OcclusionBackend::None).expect("the scene is sound");
    renderer.set_method(None, "smooth").expect("the method exists");
    let mut gpu = Gpu::new();
    let mut highlights = 0;
    for exposure in [0.05, 1.0, 60.0] {
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, &View { exposure, ..view.clone() }, None).expect("it is declared");
        let [radiance, display] = [&frame.radiance, &frame.display].map(|image| graph.download_image(image));
        let mut run = gpu.executor().run(graph, Timing::Overlapped).expect("the frame runs");
        let radiance: Vec<[f32; 3]> = Picture::from_bytes(view.size, &run.take(radiance))
            .pixels
            .iter()
            .map(|pixel| [pixel[0], pixel[1], pixel[2]])
            .collect();
        let display = run.take(display);
        let shown = displayed(&radiance, exposure);
        for (pixel, (shown, expected)) in shown.as_chunks::<3>().0.iter().zip(display.as_chunks::<4>().0).enumerate() {
            let is_near = shown.iter().zip(expected).all(|(shown, expected)| shown.abs_diff(*expected) <= 1);
            assert!(
                is_near,
                "exposure {exposure}, pixel {pixel}: {shown:?} is not {expected:?} ({:?})",
                radiance[pixel]
            );
            highlights += u32::from(shown.iter().any(|channel| *channel > 230));
        }
        assert!(shown.iter().any(|channel| *channel > 10), "exposure {exposure}: there is something to see");
    }
    assert!(highlights > 50, "{highlights} pixels are in the shoulder");
}
