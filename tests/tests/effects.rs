//! What a frame is not called for is not simulated, and nobody sees the difference.

use glam::{DAffine3, DVec3};
use mica_gpu::{DeviceKind, Timing};
use mica_graph::{Effects, Graph};
use mica_render::scene::{Camera, EquirectMap, Glint, Light, Material};
use mica_render::{EMBEDDED_SCENES, Environment, OcclusionBackend, Renderer, View, embedded_scene};
use mica_shaders::{constants as c, types};
use mica_tests::{Gpu, shapes};

/// How far two pictures may be apart: not at all where the driver rounds alike whatever code is left out. Elsewhere code that is compiled
/// without a branch may be contracted otherwise, by 16 units in the last place of what is added up; single flakes may then
/// fall on the other side of a threshold, in one of 500 pixels at most.
fn assert_alike(what: &str, gpu: &mut Gpu, pictures: [mica_tests::Picture; 2]) {
    let [specialised, forced] = pictures;
    if gpu.executor().device().info().kind == DeviceKind::Cpu {
        let differing = specialised.differing(&forced);
        assert!(
            differing.is_empty(),
            "{what}: {} pixels differ, the first is {:?}",
            differing.len(),
            differing.first()
        );
    } else {
        let apart = specialised.apart(&forced, 16.0 * f32::EPSILON).len();
        assert!(apart * 500 <= specialised.pixels.len(), "{what}: {apart} pixels are apart");
    }
}

/// All scenes but the large one, with few settings each: whatever they do not call for is forced on.
#[test]
fn simulating_everything_shows_what_specialised_frames_show() {
    let mut gpu = Gpu::new();
    let sky = Environment { map: EquirectMap::constant([0.4, 0.5, 0.6]), rotation_radians: 0.3 };
    let sun = Light::Directional { direction: DVec3::new(0.3, -1.0, -0.5).normalize(), irradiance: [2.0, 1.8, 1.5] };
    let mut compared = 0;
    for scene in EMBEDDED_SCENES.iter().filter(|scene| scene.name != "drift") {
        let loaded = embedded_scene(scene.name).expect("it is embedded").load_coarse().expect("it is sound");
        let view = View::new(loaded.default_camera(), [64, 36]);
        for (method, light, environment) in [
            ("smooth", None, Some(&sky)),
            ("wang2020", Some(sun), Some(&sky)),
            ("deliot_belcour", Some(sun), None),
            ("kemppinen", None, None),
        ] {
            let lights: Vec<Light> = light.into_iter().collect();
            let mut renderer =
                Renderer::new(loaded.clone(), &lights, environment, OcclusionBackend::Bvh).expect("sound");
            renderer.set_method(None, method).expect("the method exists");
            let pictures = [Effects::NONE, Effects::ALL].map(|forced| {
                renderer.simulate(forced);
                gpu.render(&mut renderer, &view).picture
            });
            assert_alike(&format!("{} by {method}", scene.name), &mut gpu, pictures);
            compared += 1;
        }
    }
    assert!(compared >= 20, "{compared} pictures");
}

/// Passes over glints run on the tiles that show some, counted pixel by pixel here.
#[test]
fn glints_are_worked_on_where_they_are_seen() {
    let mut gpu = Gpu::new();
    let glint = Glint { count: 1e5, alpha: 0.3, gamma_deg: 3.0, ..Glint::default() };
    let mut scene = shapes::plane(shapes::conductor("kemppinen", glint), 0.1);
    // The rest of the screen is seen, and does not glint.
    scene.materials.push(Material { name: "wall".to_owned(), ..Material::default() });
    let mut wall = scene.meshes[0].clone();
    wall.material = 1;
    scene.meshes.push(wall);
    let mut behind = scene.instances[0].clone();
    behind.mesh = 1;
    behind.world_from_local *=
        DAffine3::from_scale_rotation_translation(DVec3::splat(100.0), glam::DQuat::IDENTITY, DVec3::ZERO);
    behind.world_from_local.translation -= DVec3::new(0.0, 0.5, 0.0);
    scene.instances.push(behind);
    let center = scene.instances[0].world_from_local.translation;
    for (size, distance) in [([256, 144], 3.0), ([131, 77], 1.0), ([64, 64], 0.2)] {
        let eye = center + DVec3::new(0.05, 1.0, 0.1).normalize() * distance;
        let view = View::new(Camera::looking_at("test", eye, center, 0.7, 0.001), size);
        let mut renderer = Renderer::new(scene.clone(), &[], None, OcclusionBackend::None).expect("sound");
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, &view, None).expect("it is declared");
        let lists = graph.download(frame.tile_lists.as_ref().expect("something glints"));
        let ids = graph.download_image(&frame.ids);
        let mut run = gpu.executor().run(graph, Timing::Overlapped).expect("the frame runs");
        let lists: Vec<types::TileList> = bytemuck::pod_collect_to_vec(&run.take(lists));
        let ids: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&run.take(ids));
        let [columns, rows] = size.map(|side| side.div_ceil(c::TILE_SIDE));
        let shows = |tile: u32| {
            let (x, y) = (tile % columns * c::TILE_SIDE, tile / columns * c::TILE_SIDE);
            let pixels = (0..c::TILE_SIDE).flat_map(|dy| (0..c::TILE_SIDE).map(move |dx| [x + dx, y + dy]));
            let mut inside = pixels.filter(|[x, y]| *x < size[0] && *y < size[1]);
            inside.any(|[x, y]| ids[(y * size[0] + x) as usize][0] == 1)
        };
        let expected = (0..columns * rows).filter(|tile| shows(*tile)).count() as u32;
        assert!(expected > 0, "{size:?}: the glinting square is seen");
        assert_eq!((lists.len(), lists[0].tiles, lists[0].groups), (1, expected, [expected, 1, 1]), "{size:?}");
    }
}
