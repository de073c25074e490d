//! What a hierarchy of bounding volumes hides: each light's shadow, and the mirror direction of the glints.

use glam::DVec3;
use mica_render::scene::{EquirectMap, Glint, Instance, Light, Material, Scene};
use mica_render::{Environment, OcclusionBackend, Renderer};
use mica_tests::shapes::{OVER_PLANE, conductor, plane, seen_plane};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [160, 90];
/// The roof: a rectangle above the plane, out of the camera's view.
const ROOF_HEIGHT: f64 = 1.5;
const ROOF_CENTER: [f64; 2] = [0.0, -4.5];
const ROOF_HALF: [f64; 2] = [1.0, 1.5];

/// The glinting plane below a black roof.
fn under_a_roof(method: &str) -> Scene {
    let glint = Glint { count: 1e12, alpha: 0.5, gamma_deg: 2.0, ..Glint::default() };
    let mut scene = plane(conductor(method, glint), 40.0);
    let black = Material { name: "roof".to_owned(), base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    let mut roof = plane(black, 1.0);
    roof.meshes[0].material = 1;
    scene.meshes.append(&mut roof.meshes);
    scene.materials.append(&mut roof.materials);
    let [x, z] = ROOF_CENTER;
    let [half_x, half_z] = ROOF_HALF;
    let world_from_local = glam::DAffine3::from_translation(DVec3::new(x, ROOF_HEIGHT, z))
        * glam::DAffine3::from_scale(DVec3::new(half_x, 1.0, half_z));
    scene.instances.push(Instance { mesh: 1, world_from_local, name: "roof".to_owned() });
    scene
}

/// Whether the ray from a point of the plane upwards in a direction meets the roof; `None` where it nearly touches the
/// roof's edge.
fn meets_roof(point: DVec3, direction: DVec3) -> Option<bool> {
    const EDGE: f64 = 0.03;
    let at = point + direction * (ROOF_HEIGHT / direction.y);
    let beyond = (0..2)
        .map(|axis| (at.to_array()[2 * axis] - ROOF_CENTER[axis]).abs() - ROOF_HALF[axis])
        .fold(f64::NEG_INFINITY, f64::max);
    (beyond.abs() > EDGE).then_some(beyond < 0.0)
}

/// Fails unless the pixels of `with` are black in `channel` where the roof is in the way from the seen point, and those
/// of `without` elsewhere.
fn is_black_where_hidden(with: &Picture, without: &Picture, channel: usize, hidden: impl Fn(DVec3) -> Option<bool>) {
    let (mut black, mut bright) = (0, 0);
    for (pixel, (point, _)) in seen_plane(SIZE).into_iter().enumerate() {
        let (shown, free) = (with.pixels[pixel][channel], without.pixels[pixel][channel]);
        assert!(free > 0.0, "pixel {pixel} has something to lose");
        match hidden(point) {
            Some(true) => {
                assert_eq!(shown, 0.0, "pixel {pixel} at {point}, channel {channel}");
                black += 1;
            }
            Some(false) => {
                assert_eq!(shown, free, "pixel {pixel} at {point}, channel {channel}");
                bright += 1;
            }
            None => {}
        }
    }
    println!("channel {channel}: {black} pixels hidden, {bright} free of {}", with.pixels.len());
    assert!(black > 500 && bright > 5000, "{black} hidden, {bright} free");
}

#[test]
fn each_light_has_its_own_shadow() {
    let mut gpu = Gpu::new();
    let positions = [DVec3::new(0.8, 4.0, -5.0), DVec3::new(-1.5, 5.0, -6.0)];
    let light = |index: usize| {
        let mut radiant_intensity = [0.0; 3];
        radiant_intensity[index] = 30.0;
        Light::Point { position: positions[index], radiant_intensity, range: None }
    };
    let lights = [light(0), light(1)];
    let [with, without] = [OcclusionBackend::Bvh, OcclusionBackend::None].map(|occlusion| {
        let mut renderer = Renderer::new(under_a_roof("smooth"), &lights, None, occlusion).expect("the scene is sound");
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    });
    for (channel, position) in positions.into_iter().enumerate() {
        is_black_where_hidden(&with, &without, channel, |point| meets_roof(point, position - point));
    }
}

#[test]
fn glints_vanish_where_their_mirror_direction_is_occluded() {
    let mut gpu = Gpu::new();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let [with, without] = [OcclusionBackend::Bvh, OcclusionBackend::None].map(|occlusion| {
        let mut renderer =
            Renderer::new(under_a_roof("wang2020"), &[], Some(&environment), occlusion).expect("the scene is sound");
        for (key, value) in [("samples", "16"), ("depth", "4"), ("blur", "off"), ("color", "1,1,1")] {
            renderer.set(None, key, value).expect("a setting");
        }
        gpu.precompute(&mut renderer);
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    });
    let mirrored = |point: DVec3| {
        let ray = point - OVER_PLANE.eye;
        DVec3::new(ray.x, -ray.y, ray.z)
    };
    is_black_where_hidden(&with, &without, 1, |point| meets_roof(point, mirrored(point)));
}
