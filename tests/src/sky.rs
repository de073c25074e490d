//! A plane of flakes seen from straight above, every pixel alike: under an environment, or under many lights.

use crate::shapes::{Eye, conductor, plane};
use crate::{Gpu, Picture};
use glam::DVec3;
use mica_render::scene::{EquirectMap, Glint, Light};
use mica_render::{Environment, OcclusionBackend, Renderer, View};

/// Roughness and the cone's half-angle in degrees; flakes expected in a footprint.
type Flakes = ([f64; 2], f64);

fn seen_from_above(
    method: &str,
    settings: &[(&str, &str)],
    ([alpha, gamma_deg], flakes): Flakes,
    lights: &[Light],
    sky: Option<&Environment>,
) -> (Renderer, View) {
    const SIDE: u32 = 64;
    let above = Eye { eye: DVec3::new(0.3, 50.0, 0.51), target: DVec3::new(0.3, 0.0, 0.5), vertical_fov_radians: 0.02 };
    let pixel = 2.0 * 50.0 * 0.01_f64.tan() / f64::from(SIDE);
    let count = flakes / (pixel * pixel);
    let glint = Glint { count, alpha, gamma_deg, color: Some([1.0; 3]), ..Glint::default() };
    let scene = plane(conductor(method, glint), 8.0);
    let mut renderer = Renderer::new(scene, lights, sky, OcclusionBackend::None).expect("the scene is sound");
    for (key, value) in settings {
        renderer.set(None, key, value).expect("a setting");
    }
    (renderer, above.view([SIDE; 2]))
}

/// Under a sky and no light: the mean of so many frames.
pub fn under_the_sky(
    gpu: &mut Gpu,
    method: &str,
    settings: &[(&str, &str)],
    (map, material, flakes): (EquirectMap, [f64; 2], f64),
    frames: u32,
) -> Picture {
    let sky = Environment { map, rotation_radians: 0.0 };
    let (mut renderer, view) = seen_from_above(method, settings, (material, flakes), &[], Some(&sky));
    let mut picture = gpu.render_sample(&mut renderer, &view, Some(0)).picture;
    for earlier in 1..frames {
        let next = View { sample_index: earlier, ..view.clone() };
        picture = gpu.render_sample(&mut renderer, &next, Some(earlier)).picture;
    }
    picture
}

/// Thirty-two lights of irradiance 1 from one direction, and one light of 32: the means over many pixels, the one over the
/// other. No pixel is without a finite value of at least 0, or dark.
pub fn thirty_two_lights_over_one(gpu: &mut Gpu, method: &str, settings: &[(&str, &str)], flakes: Flakes) -> f64 {
    let mut mean = |number: usize| {
        let (sin, cos) = 10_f64.to_radians().sin_cos();
        let light =
            Light::Directional { direction: DVec3::new(-sin, -cos, 0.0), irradiance: [32.0 / number as f32; 3] };
        let (mut renderer, view) = seen_from_above(method, settings, flakes, &vec![light; number], None);
        let picture = gpu.render_sample(&mut renderer, &view, Some(0)).picture;
        let bad = picture.pixels.iter().filter(|pixel| !(pixel[1].is_finite() && pixel[1] > 0.0)).count();
        assert_eq!(bad, 0, "{method}, {number} lights, {flakes:?}: pixels without light");
        picture.mean()[1]
    };
    mean(32) / mean(1)
}
