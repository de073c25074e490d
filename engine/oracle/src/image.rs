//! What the `smooth` method should show: a rough conductor under known light, one bounce, nothing in the way.

use glam::DVec3;
use rayon::prelude::*;

use crate::OracleError;
use crate::albedo::AlbedoTable;
use crate::microfacet::Conductor;
use crate::scene::{Camera, Hit, Lights, Shape, Size};

/// An image of linear RGB radiance, row by row from the top left, with a mask of what was hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width and height in pixels.
    pub size: Size,
    /// Radiance of each pixel.
    pub radiance: Vec<[f64; 3]>,
    /// Whether each pixel's ray met the shape.
    pub hit: Vec<bool>,
}

impl Image {
    /// Mean radiance over all pixels.
    pub fn mean(&self) -> [f64; 3] {
        mean_of(self.radiance.iter()).unwrap_or([0.0; 3])
    }

    /// Mean radiance over the pixels that hit the shape; `None` when none did.
    pub fn mean_over_hits(&self) -> Option<[f64; 3]> {
        mean_of(self.radiance.iter().zip(&self.hit).filter(|(_, hit)| **hit).map(|(radiance, _)| radiance))
    }
}

/// The mean of some colours; `None` of none.
fn mean_of<'a>(colors: impl Iterator<Item = &'a [f64; 3]>) -> Option<[f64; 3]> {
    let (mut sum, mut count) = ([0.0; 3], 0usize);
    for color in colors {
        count += 1;
        for (s, c) in sum.iter_mut().zip(color) {
            *s += c;
        }
    }
    (count > 0).then(|| sum.map(|s| s / count as f64))
}

/// Radiance through the centre of every pixel: the environment where the ray misses `shape`; elsewhere the
/// environment and the point lights reflected once by `conductor`, unshadowed.
///
/// The environment's share is its radiance times the directional albedo, interpolated to 1e-6 of the radiance.
///
/// # Errors
/// When the camera has no direction, an impossible field of view, or stands behind the surface; when the shape or an
/// image side is empty.
pub fn smooth_image(
    shape: &Shape,
    camera: &Camera,
    conductor: &Conductor,
    lights: &Lights,
    size: Size,
) -> Result<Image, OracleError> {
    if let Shape::Sphere { radius, .. } = *shape {
        crate::error::in_range("sphere radius", radius, radius > 0.0 && radius.is_finite(), "positive and finite")?;
    }
    if !shape.is_outside(camera.eye) {
        return Err(OracleError::CameraBehindSurface);
    }
    let rays = camera.pixel_rays(size)?;
    let albedo = AlbedoTable::new(&conductor.microfacets);
    let pixels: Vec<([f64; 3], bool)> = (0..size.height)
        .into_par_iter()
        .flat_map_iter(|y| (0..size.width).map(move |x| (x, y)))
        .map(|(x, y)| {
            let direction = rays.direction(x, y);
            match shape.intersect(camera.eye, direction) {
                Some(hit) => (reflected(conductor, &albedo, lights, hit, -direction), true),
                None => (lights.environment, false),
            }
        })
        .collect();
    let (radiance, hit) = pixels.into_iter().unzip();
    Ok(Image { size, radiance, hit })
}

/// Radiance that leaves `hit` towards `view` (world space).
fn reflected(conductor: &Conductor, albedo: &AlbedoTable, lights: &Lights, hit: Hit, view: DVec3) -> [f64; 3] {
    let (tangent, bitangent) = hit.normal.any_orthonormal_pair();
    let local = |v: DVec3| DVec3::new(v.dot(tangent), v.dot(bitangent), v.dot(hit.normal));
    let o = local(view);
    let mut radiance = albedo.at(o.z).of_conductor(conductor.f0);
    for (channel, environment) in radiance.iter_mut().zip(lights.environment) {
        *channel *= environment;
    }
    for light in &lights.points {
        let to_light = light.position - hit.position;
        let Some(direction) = to_light.try_normalize() else { continue };
        let i = local(direction);
        let falloff = i.z.max(0.0) / to_light.length_squared();
        let brdf = conductor.smooth_brdf(i, o);
        for ((channel, intensity), brdf) in radiance.iter_mut().zip(light.intensity).zip(brdf) {
            *channel += intensity * falloff * brdf;
        }
    }
    radiance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::albedo::directional_albedo;
    use crate::microfacet::{Microfacets, Ndf, SmithFit};
    use crate::quadrature::integrate;
    use crate::scene::PointLight;

    const SIZE: Size = Size { width: 64, height: 48 };

    fn conductor(alpha: f64, f0: [f64; 3]) -> Conductor {
        let microfacets = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Rational).expect("a valid roughness");
        Conductor { microfacets, f0 }
    }

    fn camera(eye: DVec3) -> Camera {
        Camera { eye, target: DVec3::ZERO, vertical_fov_radians: 0.8 }
    }

    fn sphere() -> Shape {
        Shape::Sphere { center: DVec3::ZERO, radius: 1.0 }
    }

    fn environment(radiance: [f64; 3]) -> Lights {
        Lights { environment: radiance, points: vec![] }
    }

    #[test]
    fn a_mirror_in_a_white_furnace_is_invisible() {
        let image = smooth_image(
            &sphere(),
            &camera(DVec3::new(0.0, 1.0, 4.0)),
            &conductor(0.001, [1.0; 3]),
            &environment([2.0, 3.0, 4.0]),
            SIZE,
        )
        .expect("an image");
        let mean = image.mean_over_hits().expect("the sphere is in view");
        assert!(image.hit.contains(&false) && image.hit.contains(&true));
        for (mean, environment) in mean.into_iter().zip([2.0, 3.0, 4.0]) {
            assert!((mean / environment - 1.0).abs() < 2e-3, "{mean} {environment}");
        }
        let miss = image.hit.iter().position(|hit| !hit).expect("background is in view");
        assert_eq!(image.radiance[miss], [2.0, 3.0, 4.0]);
    }

    #[test]
    fn the_sphere_covers_the_solid_angle_it_should() {
        let size = Size { width: 400, height: 300 };
        let camera = camera(DVec3::new(0.0, 0.0, 4.0));
        let lights = environment([1.0; 3]);
        let image = smooth_image(&sphere(), &camera, &conductor(0.3, [1.0; 3]), &lights, size).expect("an image");
        let covered = image.hit.iter().filter(|hit| **hit).count() as f64;
        // The silhouette is a cone of tangents: a disc of radius 1/sqrt(15) at distance 1.
        let half_height = 0.4_f64.tan();
        let expected = std::f64::consts::PI / 15.0 / (2.0 * half_height / 300.0).powi(2);
        assert!((covered / expected - 1.0).abs() < 5e-3, "{covered} of {expected}");
    }

    #[test]
    fn each_pixel_of_the_plane_has_the_albedo_of_its_view_angle() {
        let conductor = conductor(0.2, [0.9, 0.6, 0.2]);
        let camera = Camera { eye: DVec3::new(3.0, 2.0, 1.0), target: DVec3::ZERO, vertical_fov_radians: 1.2 };
        let plane = Shape::Plane { height: 0.5 };
        let image = smooth_image(&plane, &camera, &conductor, &environment([1.0, 1.0, 2.0]), SIZE).expect("an image");
        let rays = camera.pixel_rays(SIZE).expect("rays");
        for (x, y) in [(0, 47), (32, 24), (63, 30)] {
            let at = y * SIZE.width + x;
            assert!(image.hit[at]);
            let cos = -rays.direction(x, y).y;
            let albedo = directional_albedo(&conductor.microfacets, DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos));
            let [r, g, b] = albedo.of_conductor(conductor.f0);
            for (value, expected) in image.radiance[at].into_iter().zip([r, g, 2.0 * b]) {
                assert!((value - expected).abs() < 3e-6, "{value} {expected}");
            }
        }
    }

    /// All light that a plane sends towards a far camera from one point light passes through one integral over the
    /// light's directions; here the pixels' sum is held against it.
    #[test]
    fn point_light_reflected_by_a_plane_adds_up_to_the_integral_over_the_plane() {
        let conductor = conductor(0.5, [1.0; 3]);
        let eye = DVec3::new(0.0, 5.0, 0.0);
        let camera = Camera { eye, target: DVec3::ZERO, vertical_fov_radians: 1.4 };
        let light = PointLight { position: DVec3::new(0.0, 2.0, 0.0), intensity: [3.0; 3] };
        let lights = Lights { environment: [0.0; 3], points: vec![light] };
        let size = Size { width: 256, height: 256 };
        let image = smooth_image(&Shape::Plane { height: 0.0 }, &camera, &conductor, &lights, size).expect("an image");
        // In the frame of the plane with both points on its axis, radiance depends on the distance from the axis.
        let radiance = |distance: f64| {
            let o = DVec3::new(-distance, 0.0, 5.0).normalize();
            let i = DVec3::new(-distance, 0.0, 2.0).normalize();
            3.0 * conductor.smooth_brdf(i, o)[0] * i.z / (distance * distance + 4.0)
        };
        // A square image: eight right-angled triangles, to the azimuth of the corner.
        let edge = 5.0 * 0.7_f64.tan();
        let triangle = |phi: f64| integrate(|r| [r * radiance(r)], &[0.0, edge / phi.cos()], 1e-10);
        let sum = 8.0 * integrate(triangle, &[0.0, std::f64::consts::FRAC_PI_4], 1e-9)[0];
        let mean = sum / (4.0 * edge * edge);
        assert!((image.mean()[0] / mean - 1.0).abs() < 1e-4, "{} {mean}", image.mean()[0]);
    }

    #[test]
    fn a_light_below_the_surface_adds_nothing_and_twice_the_distance_a_quarter() {
        let conductor = conductor(0.4, [0.8; 3]);
        let plane = Shape::Plane { height: 0.0 };
        let camera = camera(DVec3::new(0.0, 1.0, 2.0));
        let mean_with = |position: DVec3| {
            let points = vec![PointLight { position, intensity: [1.0; 3] }];
            let lights = Lights { environment: [0.0; 3], points };
            smooth_image(&plane, &camera, &conductor, &lights, SIZE).expect("an image").mean_over_hits()
        };
        assert_eq!(mean_with(DVec3::new(0.0, -1.0, 0.0)), Some([0.0; 3]));
        let far = mean_with(DVec3::new(0.0, 1e6, -2e6)).expect("hits")[0];
        let farther = mean_with(DVec3::new(0.0, 2e6, -4e6)).expect("hits")[0];
        assert!(far > 0.0 && (far / farther - 4.0).abs() < 1e-4, "{far} {farther}");
    }

    #[test]
    fn the_image_is_upright_and_not_mirrored() {
        let conductor = conductor(0.3, [1.0; 3]);
        let light = PointLight { position: DVec3::new(5.0, 5.0, 5.0), intensity: [100.0; 3] };
        let lights = Lights { environment: [0.0; 3], points: vec![light] };
        let camera = camera(DVec3::new(0.0, 0.0, 4.0));
        let image = smooth_image(&sphere(), &camera, &conductor, &lights, SIZE).expect("an image");
        let brightest = (0..image.radiance.len())
            .max_by(|a, b| image.radiance[*a][0].total_cmp(&image.radiance[*b][0]))
            .expect("pixels");
        let (x, y) = (brightest % SIZE.width, brightest / SIZE.width);
        assert!(x > SIZE.width / 2 && y < SIZE.height / 2, "light from the upper right shines at {x}, {y}");
    }

    #[test]
    fn a_camera_that_cannot_see_is_an_error() {
        let conductor = conductor(0.3, [1.0; 3]);
        let see = |shape: Shape, camera: Camera, size: Size| {
            smooth_image(&shape, &camera, &conductor, &Lights::default(), size).expect_err("must be refused")
        };
        let inside = Camera { target: DVec3::X, ..camera(DVec3::ZERO) };
        assert_eq!(see(sphere(), inside, SIZE), OracleError::CameraBehindSurface);
        assert_eq!(see(Shape::Plane { height: 1.0 }, inside, SIZE), OracleError::CameraBehindSurface);
        let blind = Camera { target: DVec3::Z * 3.0, ..camera(DVec3::Z * 3.0) };
        assert_eq!(see(sphere(), blind, SIZE), OracleError::CameraWithoutDirection);
        let flat = Camera { vertical_fov_radians: 0.0, ..camera(DVec3::Z * 3.0) };
        assert!(matches!(see(sphere(), flat, SIZE), OracleError::OutOfRange { .. }));
        let none = Size { width: 0, height: 5 };
        assert!(matches!(see(sphere(), camera(DVec3::Z * 3.0), none), OracleError::OutOfRange { .. }));
        let point = Shape::Sphere { center: DVec3::ZERO, radius: 0.0 };
        assert!(matches!(see(point, camera(DVec3::Z * 3.0), SIZE), OracleError::OutOfRange { .. }));
    }
}
