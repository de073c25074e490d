//! Rays to measure with: through the pixels of a camera, and from what these meet, about and towards a light.

use glam::DVec3;
use mica_render::View;
use mica_render::scene::{Light, Scene};
use mica_shaders::types::{Ray, RayAnswer};
use std::f64::consts::TAU;

/// As far as passes look that look without end.
const ENDLESS: f32 = 1e30;
/// Pixels along the side of a tile: the group of the passes that trace a ray for each pixel.
const TILE: u32 = 8;

/// Rays of one kind.
pub struct Rays {
    /// In the report.
    pub name: &'static str,
    /// Neighbours in the list are neighbours in a group of invocations.
    pub list: Vec<Ray>,
}

/// A point that the camera sees.
pub struct Seen {
    /// In scene space.
    position: DVec3,
    /// Of the triangle, unit, towards the camera.
    normal: DVec3,
}

/// One ray through each pixel, tile by tile as the passes go through the picture. Coherent.
pub fn camera(view: &View, center: DVec3) -> Rays {
    let [width, height] = view.size;
    let rotation = view.camera.world_from_camera.matrix3;
    let eye = (view.camera.eye() - center).as_vec3().to_array();
    let half_height = (0.5 * view.camera.vertical_fov_radians).tan();
    let pixel = 2.0 * half_height / f64::from(height);
    let ray = |x: u32, y: u32| {
        let right = (f64::from(x) + 0.5 - 0.5 * f64::from(width)) * pixel;
        let up = (0.5 * f64::from(height) - f64::from(y) - 0.5) * pixel;
        let direction = (rotation * DVec3::new(right, up, -1.0)).normalize().as_vec3().to_array();
        Ray { origin: eye, direction, t_max: ENDLESS, ..Ray::default() }
    };
    let mut list = Vec::with_capacity(width as usize * height as usize);
    for top in (0..height).step_by(TILE as usize) {
        for left in (0..width).step_by(TILE as usize) {
            let rows = top..height.min(top + TILE);
            list.extend(rows.flat_map(|y| (left..width.min(left + TILE)).map(move |x| (x, y))).map(|(x, y)| ray(x, y)));
        }
    }
    Rays { name: "camera", list }
}

/// Where rays met the scene.
pub fn seen(scene: &Scene, center: DVec3, rays: &Rays, answers: &[RayAnswer]) -> Vec<Seen> {
    let met = rays.list.iter().zip(answers).filter(|(_, answer)| answer.blocked != 0);
    met.filter_map(|(ray, answer)| {
        let instance = scene.instances.get(answer.instance as usize)?;
        let mesh = &scene.meshes[instance.mesh];
        let corners = mesh.indices.as_chunks::<3>().0.get(answer.triangle as usize)?;
        let [a, b, c] = corners.map(|vertex| {
            let local = DVec3::from(mesh.positions[vertex as usize].map(f64::from));
            instance.world_from_local.transform_point3(local) - center
        });
        let [v, w] = answer.barycentrics.map(f64::from);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let along = DVec3::from(ray.direction.map(f64::from));
        let position = a * (1.0 - v - w) + b * v + c * w;
        Some(Seen { position, normal: if normal.dot(along) > 0.0 { -normal } else { normal } })
    })
    .collect()
}

/// From the seen points in turn, each into a direction of its own about the normal, by the cosine's density: what light
/// that arrives from everywhere takes. Incoherent. None where nothing is seen.
pub fn diffuse(seen: &[Seen], count: u32) -> Option<Rays> {
    let list = spread(seen, count).zip(0..).map(|(seen, index)| {
        let [u, v] = random(index);
        let (sin, cos) = (TAU * u).sin_cos();
        let (tangent, bitangent) = seen.normal.any_orthonormal_pair();
        let direction = (tangent * cos + bitangent * sin) * v.sqrt() + seen.normal * (1.0 - v).sqrt();
        leaving(seen, direction, ENDLESS)
    });
    some("diffuse", list.collect())
}

/// From those seen points that face a light, in turn, towards it. None where none do.
pub fn shadow(seen: &[Seen], light: &Light, center: DVec3, count: u32) -> Option<Rays> {
    let towards = |from: DVec3| match *light {
        Light::Directional { direction, .. } => (-direction, ENDLESS),
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let way = position - center - from;
            // As far as the pass for shadows looks.
            (way.normalize_or_zero(), way.length() as f32 * 0.9999)
        }
    };
    let facing: Vec<(&Seen, (DVec3, f32))> = seen
        .iter()
        .map(|seen| (seen, towards(seen.position)))
        .filter(|(seen, (direction, _))| seen.normal.dot(*direction) > 0.0)
        .collect();
    // One each at most: the same ray twice would be no work.
    let count = count.min(facing.len() as u32);
    let list = spread(&facing, count).map(|(seen, (direction, distance))| leaving(seen, *direction, *distance));
    some("shadow", list.collect())
}

fn some(name: &'static str, list: Vec<Ray>) -> Option<Rays> {
    (!list.is_empty()).then_some(Rays { name, list })
}

/// So many of a list, in order, as evenly as can be; some of them several times if there are fewer.
fn spread<T>(list: &[T], count: u32) -> impl Iterator<Item = &T> {
    let count = if list.is_empty() { 0 } else { u64::from(count) };
    (0..count).map(move |index| &list[(index * list.len() as u64 / count) as usize])
}

/// A ray that leaves a surface; the shader moves its origin off it, as every pass does.
fn leaving(seen: &Seen, direction: DVec3, t_max: f32) -> Ray {
    Ray {
        origin: seen.position.as_vec3().to_array(),
        direction: direction.as_vec3().to_array(),
        normal: seen.normal.as_vec3().to_array(),
        t_max,
        ..Ray::default()
    }
}

/// Two numbers in [0, 1) for a ray (the output function of PCG, O'Neill 2014, twice).
fn random(index: u32) -> [f64; 2] {
    [0, 1].map(|which| {
        let state = (2 * index + which).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        f64::from((word >> 22) ^ word) / 4_294_967_296.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_render::scene::Camera;

    fn floor(x: f64) -> Seen {
        Seen { position: DVec3::new(x, 0.0, 0.0), normal: DVec3::Y }
    }

    #[test]
    fn camera_rays_pass_through_every_pixel_once_and_tile_by_tile() {
        let camera = Camera::looking_at("test", DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, -5.0), 1.0, 0.1);
        let rays = super::camera(&View::new(camera, [20, 12]), DVec3::new(1.0, 0.0, 0.0)).list;
        assert_eq!(rays.len(), 240);
        assert!(rays.iter().all(|ray| ray.origin == [0.0, 2.0, 3.0] && ray.normal == [0.0; 3]));
        // Where each passes through the plane of the picture, in pixels.
        let tan = 0.5_f64.tan();
        let pixel = |ray: &Ray| {
            let [x, y, z] = ray.direction.map(f64::from);
            [(x / -z / tan * 6.0 + 10.0 - 0.5), (6.0 - y / -z / tan * 6.0 - 0.5)]
        };
        let mut seen = std::collections::BTreeSet::new();
        for ray in &rays {
            let [x, y] = pixel(ray);
            assert!((x - x.round()).abs() < 1e-4 && (y - y.round()).abs() < 1e-4, "{x}, {y}");
            seen.insert((x.round() as i64, y.round() as i64));
        }
        assert_eq!((seen.len(), seen.first(), seen.last()), (240, Some(&(0, 0)), Some(&(19, 11))));
        let [x, y] = pixel(&rays[63]);
        assert_eq!((x.round(), y.round()), (7.0, 7.0));
    }

    #[test]
    fn diffuse_rays_leave_above_the_surface_by_the_cosine() {
        let seen: Vec<Seen> = (0..100).map(|x| floor(f64::from(x))).collect();
        let rays = diffuse(&seen, 20_000).expect("something is seen").list;
        assert_eq!(rays.len(), 20_000);
        assert_eq!((rays[0].origin[0], rays[19_999].origin[0]), (0.0, 99.0));
        let mean = |part: fn(&Ray) -> f32| rays.iter().map(|ray| f64::from(part(ray))).sum::<f64>() / 2e4;
        // The cosine's mean cosine is 2/3, and its square's 1/2; no direction about the normal is preferred.
        assert!((mean(|ray| ray.direction[1]) - 2.0 / 3.0).abs() < 0.01);
        assert!((mean(|ray| ray.direction[1] * ray.direction[1]) - 0.5).abs() < 0.01);
        assert!(mean(|ray| ray.direction[0]).abs() < 0.015 && mean(|ray| ray.direction[2]).abs() < 0.015);
        assert!(rays.iter().all(|ray| ray.direction[1] >= 0.0 && ray.normal == [0.0, 1.0, 0.0]));
        assert!(diffuse(&[], 10).is_none());
    }

    #[test]
    fn shadow_rays_go_to_the_light_from_what_faces_it() {
        let seen = [floor(0.0), Seen { normal: DVec3::NEG_Y, ..floor(1.0) }, floor(2.0)];
        let lamp = Light::Point { position: DVec3::new(2.0, 4.0, 1.0), radiant_intensity: [1.0; 3], range: None };
        let rays = shadow(&seen, &lamp, DVec3::new(0.0, 1.0, 1.0), 10).expect("two face it").list;
        assert_eq!(rays.len(), 2);
        assert_eq!(
            (rays[1].origin, rays[1].direction, rays[1].t_max),
            ([2.0, 0.0, 0.0], [0.0, 1.0, 0.0], 3.0 * 0.9999)
        );
        let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: [1.0; 3] };
        let rays = shadow(&seen, &sun, DVec3::ZERO, 1).expect("two face it").list;
        assert_eq!((rays.len(), rays[0].direction, rays[0].t_max), (1, [0.0, 1.0, 0.0], ENDLESS));
        let below = Light::Directional { direction: DVec3::Y, irradiance: [1.0; 3] };
        assert!(shadow(&seen[..1], &below, DVec3::ZERO, 10).is_none());
    }
}
