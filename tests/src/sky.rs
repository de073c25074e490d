//! A plane of flakes under an environment and no light.

use crate::shapes::{Eye, conductor, plane};
use crate::{Gpu, Picture};
use glam::DVec3;
use mica_render::scene::{EquirectMap, Glint};
use mica_render::{Environment, OcclusionBackend, Renderer, View};

/// The plane seen from straight above, every pixel alike, under a sky and no light: the mean of so many frames.
pub fn under_the_sky(
    gpu: &mut Gpu,
    method: &str,
    settings: &[(&str, &str)],
    (map, [alpha, gamma_deg], flakes): (EquirectMap, [f64; 2], f64),
    frames: u32,
) -> Picture {
    const SIDE: u32 = 64;
    let above = Eye { eye: DVec3::new(0.3, 50.0, 0.51), target: DVec3::new(0.3, 0.0, 0.5), vertical_fov_radians: 0.02 };
    let pixel = 2.0 * 50.0 * 0.01_f64.tan() / f64::from(SIDE);
    let count = flakes / (pixel * pixel);
    let glint = Glint { count, alpha, gamma_deg, color: Some([1.0; 3]), ..Glint::default() };
    let sky = Environment { map, rotation_radians: 0.0 };
    let scene = plane(conductor(method, glint), 8.0);
    let mut renderer = Renderer::new(scene, &[], Some(&sky), OcclusionBackend::None).expect("the scene is sound");
    for (key, value) in settings {
        renderer.set(None, key, value).expect("a setting");
    }
    let view = above.view([SIDE; 2]);
    let mut picture = gpu.render_sample(&mut renderer, &view, Some(0)).picture;
    for earlier in 1..frames {
        let next = View { sample_index: earlier, ..view.clone() };
        picture = gpu.render_sample(&mut renderer, &next, Some(earlier)).picture;
    }
    picture
}
