//! The real-time heuristics `zirr_kaplanyan`, `wang_bowles` and `shopf` where numbers run out: every pixel of every
//! picture is finite and not negative.

use glam::DVec3;
use mica_render::scene::{EquirectMap, Glint, Light, Scene};
use mica_render::{Environment, OcclusionBackend, Renderer};
use mica_tests::shapes::{Eye, conductor, plane, sphere};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [17, 11];

/// Each method with the settings that take other ways through it.
const VARIANTS: &[(&str, &[(&str, &str)])] = &[
    ("zirr_kaplanyan", &[]),
    ("zirr_kaplanyan", &[("variation", "100"), ("cone", "0.01"), ("cells", "3"), ("root_two", "true")]),
    ("wang_bowles", &[("repaired", "false")]),
    ("wang_bowles", &[("repaired", "true"), ("layers", "2")]),
    ("shopf", &[("repaired", "false")]),
    ("shopf", &[("repaired", "true"), ("share", "1")]),
];

/// The scene under two suns and a constant sky, whose tables are the same for all methods and made once.
fn renderer(scene: Scene) -> Renderer {
    let lights = [
        Light::Directional { direction: DVec3::new(0.0, -1.0, 0.0), irradiance: [1.0; 3] },
        Light::Directional { direction: DVec3::new(0.6, -0.1, -0.79), irradiance: [1e4; 3] },
    ];
    let sky = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    Renderer::new(scene, &lights, Some(&sky), OcclusionBackend::None).expect("the scene is sound")
}

/// Hands the scene to a method with these settings.
fn choose(renderer: &mut Renderer, method: &str, settings: &[(&str, &str)]) {
    renderer.set_method(None, method).expect("a method");
    for (key, value) in settings {
        renderer.set(None, key, value).expect("a setting");
    }
}

fn is_sound(picture: &Picture, case: &str) {
    assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{case}");
    assert!(picture.mean()[1] > 0.0, "{case}: all is dark");
}

fn glint(count: f64) -> Glint {
    Glint { count, alpha: 0.3, gamma_deg: 2.0, color: Some([1.0; 3]), ..Glint::default() }
}

/// Straight down and along the axes, and almost so, from a hair's breadth to a million metres.
#[test]
fn views_along_the_axes_from_near_and_far_are_sound() {
    let mut gpu = Gpu::new();
    let mut on_plane = renderer(plane(conductor("smooth", glint(1e6)), 1e3));
    let mut on_sphere = renderer(sphere(conductor("smooth", glint(1e6)), 16));
    for (method, settings) in VARIANTS {
        choose(&mut on_plane, method, settings);
        for distance in [1e-3, 10.0 / 3.0, 1e6] {
            for tilt in [0.0, 1e-4] {
                let eye = Eye {
                    eye: DVec3::new(tilt * distance, distance, 0.0),
                    target: DVec3::ZERO,
                    vertical_fov_radians: 1e-3,
                };
                let mut view = eye.view(SIZE);
                view.camera.near = 1e-3 * distance;
                is_sound(&gpu.render(&mut on_plane, &view).picture, &format!("{method} {settings:?} {eye:?}"));
            }
        }
        choose(&mut on_sphere, method, settings);
        for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            let eye = Eye { eye: 4.0 * axis, target: DVec3::ZERO, vertical_fov_radians: 0.6 };
            let picture = gpu.render(&mut on_sphere, &eye.view(SIZE)).picture;
            is_sound(&picture, &format!("{method} {settings:?} along {axis}"));
        }
    }
}

/// Texture coordinates of 1e-12 to 1e6 a pixel, to a million squares from the origin; the least and the greatest
/// numbers of flakes, roughnesses and cones.
#[test]
fn extreme_textures_and_materials_are_sound() {
    let mut gpu = Gpu::new();
    let eye = Eye { eye: DVec3::new(0.3, 1.0, 1.4), target: DVec3::new(0.3, 0.0, 0.2), vertical_fov_radians: 0.5 };
    let mut renderer = renderer(plane(conductor("smooth", glint(1e6)), 8.0));
    for (method, settings) in VARIANTS {
        choose(&mut renderer, method, settings);
        choose(&mut renderer, method, &[("count", "1e6"), ("alpha", "0.3"), ("gamma_deg", "2")]);
        let mut check = |gpu: &mut Gpu, set: &[(&str, &str)], eye: &Eye| {
            for (key, value) in set {
                renderer.set(None, key, value).expect("a setting");
            }
            let picture = gpu.render(&mut renderer, &eye.view(SIZE)).picture;
            is_sound(&picture, &format!("{method} {settings:?} {set:?} {eye:?}"));
        };
        for uv_scale in ["1e-6", "1", "1e6"] {
            for fov in [1e-6, 0.5, 2.5] {
                check(&mut gpu, &[("uv_scale", uv_scale)], &Eye { vertical_fov_radians: fov, ..eye });
            }
        }
        check(&mut gpu, &[("uv_scale", "1")], &eye);
        for count in ["0", "1e12"] {
            for (alpha, gamma) in [("0.001", "0.01"), ("0.001", "30"), ("1", "0.01"), ("1", "30")] {
                check(&mut gpu, &[("count", count), ("alpha", alpha), ("gamma_deg", gamma)], &eye);
            }
        }
    }
}
