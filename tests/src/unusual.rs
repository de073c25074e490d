//! Footprints that no scene of ours has, of any size and stretch, anywhere in texture space; and cameras that move by
//! less than a pixel.

use crate::shapes::{OVER_PLANE, conductor, plane};
use crate::{Gpu, Picture};
use glam::{DMat2, DVec2, DVec3};
use mica_render::scene::{Camera, Glint, Light};
use mica_render::{OcclusionBackend, Renderer, View};

const SIZE: [u32; 2] = [32, 18];
/// Metres, and texture coordinates before `uv_from_plane`, that a pixel covers at the middle of the picture, about.
const PIXEL: f64 = 0.13;

/// The plane under one light, with other texture coordinates.
fn renderer(method: &str, count: f64, uv_from_plane: DMat2, offset: DVec2) -> Renderer {
    let glint = Glint { count, alpha: 0.4, gamma_deg: 3.0, ..Glint::default() };
    let mut scene = plane(conductor(method, glint), 40.0);
    for uv in &mut scene.meshes[0].uv[0] {
        let at = uv_from_plane * DVec2::new(f64::from(uv[0]), f64::from(uv[1])) + offset;
        *uv = [at.x as f32, at.y as f32];
    }
    let light = Light::Directional { direction: DVec3::new(0.1, -1.0, -0.5), irradiance: [1.0; 3] };
    Renderer::new(scene, &[light], None, OcclusionBackend::None).expect("the scene is sound")
}

/// Renders with footprints from 1e-12 to 1e6, texture coordinates to 1e6 and beyond, stretched up to 10^4 : 1 and
/// without any extent, with 1 to 10^12 flakes a square: every pixel must be finite and not negative. Where each
/// footprint holds thousands of lit flakes, returns the picture's mean over that of the smooth surface.
pub fn ratios_over_unusual_footprints(gpu: &mut Gpu, method: &str, settings: &[(&str, &str)]) -> Vec<f64> {
    let mut draw = |method: &str, settings: &[(&str, &str)], count: f64, uv: DMat2, offset: DVec2| {
        let mut renderer = renderer(method, count, uv, offset);
        for (key, value) in settings {
            renderer.set(None, key, value).expect("a setting");
        }
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    };
    let smooth = draw("smooth", &[], 1.0, DMat2::IDENTITY, DVec2::ZERO).mean()[1];
    let mut ratios = Vec::new();
    for (size, offset) in
        [(0.0, 0.3), (1e-12, 0.0), (1e-6, 0.0), (1e-3, -1e6), (0.1, 0.0), (1.0, 1e6), (1e3, 0.0), (1e6, -1e6)]
    {
        for stretch in [1.0, 1e4] {
            for count in [1.0, 1e6, 1e12] {
                let scale = DVec2::new(size, size / stretch) / PIXEL;
                let uv = DMat2::from_angle(0.3) * DMat2::from_diagonal(scale) * DMat2::from_angle(0.9);
                let picture = draw(method, settings, count, uv, DVec2::new(offset, -0.7 * offset));
                let case =
                    format!("{method} {settings:?}: size {size:e}, stretch {stretch:e}, offset {offset:e}, {count:e}");
                assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{case}");
                // About one in a thousand is lit. Far from the origin, f32 does not tell neighbouring pixels apart.
                if size * size / stretch * count > 1e7 && offset.abs() < 1e3 * size {
                    ratios.push(picture.mean()[1] / smooth);
                    println!("{case}: {:.4} of the smooth surface", picture.mean()[1] / smooth);
                }
            }
        }
    }
    assert!(ratios.len() >= 6, "{ratios:?}");
    ratios
}

/// Pictures by a camera that moves along the plane by `step` pixels from each to the next, with the same directions:
/// about six flakes a pixel, a fifth of one lit.
pub fn panned(gpu: &mut Gpu, method: &str, settings: &[(&str, &str)], step: f64, pictures: u32) -> Vec<Picture> {
    const SIDE: u32 = 64;
    const PAN_PIXEL: f64 = 1.0 / 128.0;
    const HEIGHT: f64 = 20.0;
    let glint = Glint { count: 1e5, alpha: 0.3, gamma_deg: 6.0, ..Glint::default() };
    let light = Light::Directional { direction: DVec3::new(0.1, -1.0, 0.0), irradiance: [1.0; 3] };
    let mut renderer =
        Renderer::new(plane(conductor(method, glint), 8.0), &[light], None, OcclusionBackend::None).expect("a scene");
    for (key, value) in settings {
        renderer.set(None, key, value).expect("a setting");
    }
    let fov = 2.0 * (0.5 * f64::from(SIDE) * PAN_PIXEL / HEIGHT).atan();
    let mut at = |x: f64| {
        let target = DVec3::new(0.31 + x, 0.0, 0.27);
        let camera = Camera::looking_at("pan", target + HEIGHT * DVec3::new(0.05, 1.0, 0.1), target, fov, 1.0);
        gpu.render(&mut renderer, &View::new(camera, [SIDE, SIDE])).picture
    };
    (0..pictures).map(|picture| at(f64::from(picture) * step * PAN_PIXEL)).collect()
}

/// The greatest change of a pixel from one picture to the next, over the mean.
pub fn greatest_jump(pictures: &[Picture]) -> f64 {
    let jumps = pictures.windows(2).map(|pair| {
        let mean = pair[0].mean()[1];
        let changes = pair[0].pixels.iter().zip(&pair[1].pixels).map(|(a, b)| f64::from((a[1] - b[1]).abs()) / mean);
        changes.fold(0.0, f64::max)
    });
    jumps.fold(0.0, f64::max)
}
