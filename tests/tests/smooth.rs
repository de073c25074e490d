//! Method `smooth` against the f64 oracle: a rough conductor under constant light from everywhere and a point light.

use glam::DVec3;
use mica_oracle::image::smooth_image;
use mica_oracle::microfacet::{Conductor, Microfacets, Ndf, SmithFit};
use mica_oracle::scene::{Lights, PointLight, Shape, Size};
use mica_render::scene::{EquirectMap, Glint, Light, Scene};
use mica_render::{Environment, OcclusionBackend, Renderer};
use mica_tests::shapes::{BEFORE_SPHERE, Eye, OVER_PLANE, conductor, plane, sphere};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [160, 90];
const F0: [f32; 3] = [0.9, 0.6, 0.3];
const SKY: [f32; 3] = [0.8, 1.0, 1.4];
/// What the mean of each channel may be off by, as is asked of this method.
const TOLERANCE: f64 = 0.005;

/// What lights the shape.
#[derive(Clone, Copy, Debug)]
struct Lighting {
    sky: bool,
    lamp: Option<DVec3>,
}

/// Red, green and blue of the lamp, W/sr.
const LAMP: [f32; 3] = [6.0, 5.0, 4.0];

impl Lighting {
    fn oracle(self) -> Lights {
        let points = self.lamp.map(|position| PointLight { position, intensity: LAMP.map(f64::from) });
        let environment = if self.sky { SKY.map(f64::from) } else { [0.0; 3] };
        Lights { environment, points: points.into_iter().collect() }
    }

    fn renderer(self, scene: Scene, occlusion: OcclusionBackend) -> Renderer {
        let sky = self.sky.then(|| Environment { map: EquirectMap::constant(SKY), rotation_radians: 0.7 });
        let lamp = self.lamp.map(|position| Light::Point { position, radiant_intensity: LAMP, range: None });
        Renderer::new(scene, lamp.as_slice(), sky.as_ref(), occlusion).expect("the scene is sound")
    }
}

fn truth(shape: &Shape, eye: Eye, lighting: Lighting, alpha: f64) -> mica_oracle::image::Image {
    let microfacets = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Rational).expect("a valid roughness");
    let conductor = Conductor { microfacets, f0: F0.map(f64::from) };
    let size = Size { width: SIZE[0] as usize, height: SIZE[1] as usize };
    smooth_image(shape, &eye.oracle(), &conductor, &lighting.oracle(), size).expect("an image")
}

/// The greatest relative difference of a channel's mean.
fn worst(rendered: [f64; 3], expected: [f64; 3]) -> f64 {
    let errors = rendered.iter().zip(expected).map(|(r, e)| (r / e - 1.0).abs());
    // Not `f64::max`, which passes over what is not a number.
    errors.max_by(f64::total_cmp).expect("there are three channels")
}

/// Root mean square and greatest relative difference over the pixels that both hit, in green.
fn pixel_errors(picture: &Picture, truth: &mica_oracle::image::Image) -> (f64, f64) {
    let both = picture.hits().into_iter().zip(&truth.hit).map(|(a, b)| a && *b);
    let errors: Vec<f64> = both
        .enumerate()
        .filter(|(index, both)| *both && truth.radiance[*index][1] > 1e-6)
        .map(|(index, _)| f64::from(picture.pixels[index][1]) / truth.radiance[index][1] - 1.0)
        .collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    ((squares / errors.len() as f64).sqrt(), errors.iter().fold(0.0, |worst, error| worst.max(error.abs())))
}

fn agrees_with_the_oracle(shape: Shape, scene: fn(mica_render::scene::Material) -> Scene, eye: Eye, lamp: DVec3) {
    let mut gpu = Gpu::new();
    let lightings = [
        Lighting { sky: true, lamp: None },
        Lighting { sky: false, lamp: Some(lamp) },
        Lighting { sky: true, lamp: Some(lamp) },
    ];
    for (lighting, occlusion) in
        lightings.into_iter().zip([OcclusionBackend::Bvh, OcclusionBackend::None, OcclusionBackend::Bvh])
    {
        let glint = Glint { count: 1e6, color: Some(F0), ..Glint::default() };
        let mut renderer = lighting.renderer(scene(conductor("smooth", glint)), occlusion);
        for alpha in [0.1, 0.2, 0.5] {
            renderer.set(None, "alpha", &alpha.to_string()).expect("a setting");
            let picture = gpu.render(&mut renderer, &eye.view(SIZE)).picture;
            let truth = truth(&shape, eye, lighting, alpha);
            let expected = truth.mean_over_hits().expect("the shape is in view");
            let mean = picture.mean_over_hits();
            let hits = picture.hits();
            let elsewhere = hits.iter().zip(&truth.hit).filter(|(a, b)| a != b).count();
            let (rms, most) = pixel_errors(&picture, &truth);
            println!(
                "{shape:?} alpha {alpha} {lighting:?}: mean off by {:.2e}, pixels by {rms:.2e} rms, \
                 {most:.2e} at most; {elsewhere} of {} pixels hit by one only",
                worst(mean, expected),
                hits.len(),
            );
            let case = format!("{shape:?} at alpha {alpha} under {lighting:?}: {mean:?} is not {expected:?}");
            assert_eq!(picture.nonfinite(), 0, "alpha {alpha}, {lighting:?}");
            assert!(worst(mean, expected) < TOLERANCE, "{case}");
            assert!(elsewhere * 500 <= hits.len(), "{elsewhere} pixels are hit by one only");
            // What the test would not forgive.
            for factor in [0.99, 1.01] {
                assert!(worst(mean, expected.map(|value| value * factor)) > TOLERANCE, "1 % must show: {case}");
            }
            if lighting.lamp.is_some() && !lighting.sky {
                let rougher = self::truth(&shape, eye, lighting, 1.02 * alpha);
                assert!(rms < 2e-3, "{rms}: {case}");
                assert!(pixel_errors(&picture, &rougher).0 > 2e-3, "another roughness must show: {case}");
            }
        }
    }
}

/// Measured on lavapipe: means within 0.07 %, pixels within 0.11 %; most of it is F0 cut down to half floats.
#[test]
fn the_smooth_plane_is_as_bright_as_the_oracle_says() {
    let shape = Shape::Plane { height: 0.0 };
    agrees_with_the_oracle(shape, |material| plane(material, 40.0), OVER_PLANE, DVec3::new(0.4, 1.2, -1.0));
}

/// Measured on lavapipe: means within 0.07 %, pixels within 0.13 % rms and 1.2 % at the silhouette.
#[test]
fn the_smooth_sphere_is_as_bright_as_the_oracle_says() {
    let shape = Shape::Sphere { center: DVec3::ZERO, radius: 1.0 };
    agrees_with_the_oracle(shape, |material| sphere(material, 256), BEFORE_SPHERE, DVec3::new(2.0, 2.5, 1.5));
}

/// Light that a lamp below the horizon sends does not arrive, and a conductor's colour is its own.
#[test]
fn nothing_but_the_flakes_reflects() {
    let mut gpu = Gpu::new();
    let glint = Glint { count: 1e6, color: Some([1.0, 0.0, 0.0]), alpha: 0.2, ..Glint::default() };
    let below = Lighting { sky: false, lamp: Some(DVec3::new(0.0, -1.0, 0.0)) };
    let mut renderer = below.renderer(plane(conductor("smooth", glint), 40.0), OcclusionBackend::None);
    let picture = gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture;
    assert_eq!(picture.mean(), [0.0; 3]);
    assert!(picture.hits().iter().all(|hit| *hit), "the plane fills the view");
}
