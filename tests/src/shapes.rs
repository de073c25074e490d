//! Scenes of one shape, whose picture the oracle knows: a plane and a sphere, all of one glinting conductor.

use glam::{DAffine3, DVec2, DVec3};
use mica_render::View;
use mica_render::scene::{Camera, Glint, Instance, Material, Mesh, Scene};

/// Where a camera stands and looks; the renderer's and the oracle's cameras are made from it.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// World space, metres.
    pub eye: DVec3,
    /// What is in the middle of the picture.
    pub target: DVec3,
    /// Angle from the lower to the upper edge of the picture, radians.
    pub vertical_fov_radians: f64,
}

impl Eye {
    /// The renderer's view.
    pub fn view(&self, size: [u32; 2]) -> View {
        View::new(Camera::looking_at("test", self.eye, self.target, self.vertical_fov_radians, 0.01), size)
    }

    /// The direction, not of length 1, through a point of the picture, in pixels from its upper left corner.
    pub fn ray(&self, size: [u32; 2], [x, y]: [f64; 2]) -> DVec3 {
        let backwards = (self.eye - self.target).normalize();
        let right = DVec3::Y.cross(backwards).normalize();
        let up = backwards.cross(right);
        let half_height = (0.5 * self.vertical_fov_radians).tan();
        let [width, height] = size.map(f64::from);
        let half_width = half_height * width / height;
        (2.0 * x / width - 1.0) * half_width * right + (1.0 - 2.0 * y / height) * half_height * up - backwards
    }

    /// The oracle's camera.
    pub fn oracle(&self) -> mica_oracle::scene::Camera {
        mica_oracle::scene::Camera {
            eye: self.eye,
            target: self.target,
            vertical_fov_radians: self.vertical_fov_radians,
        }
    }
}

/// A camera that sees nothing but the plane y = 0: angles from its normal are 40 to 75 degrees.
pub const OVER_PLANE: Eye = Eye { eye: DVec3::new(0.0, 2.0, 3.0), target: DVec3::ZERO, vertical_fov_radians: 0.6 };

/// A camera that sees the whole unit sphere about the origin.
pub const BEFORE_SPHERE: Eye = Eye { eye: DVec3::new(1.0, 1.5, 3.5), target: DVec3::ZERO, vertical_fov_radians: 0.65 };

/// A black conductor whose flakes alone reflect.
pub fn conductor(method: &str, glint: Glint) -> Material {
    Material {
        name: "flakes".to_owned(),
        base_color: [0.0, 0.0, 0.0, 1.0],
        glint: Some(Glint { method: Some(method.to_owned()), ..glint }),
        ..Material::default()
    }
}

/// The square |x|, |z| <= `half` of the plane y = 0, facing up; texture coordinates are x and z in metres.
pub fn plane(material: Material, half: f32) -> Scene {
    let corners = [[-half, -half], [-half, half], [half, half], [half, -half]];
    let mesh = Mesh {
        name: "plane".to_owned(),
        positions: corners.map(|[x, z]| [x, 0.0, z]).to_vec(),
        normals: vec![[0.0, 1.0, 0.0]; 4],
        uv: [corners.to_vec(), Vec::new()],
        indices: vec![0, 1, 2, 0, 2, 3],
        has_uv: true,
        ..Mesh::default()
    };
    one_mesh("plane", mesh, material)
}

/// The unit sphere about the origin, of `rings` bands of `2 rings` quadrangles, with the true sphere's normals; texture
/// coordinates are azimuth and polar angle, each from 0 to 1.
pub fn sphere(material: Material, rings: u32) -> Scene {
    let sectors = 2 * rings;
    let mut mesh = Mesh { name: "sphere".to_owned(), has_uv: true, ..Mesh::default() };
    for ring in 0..=rings {
        for sector in 0..=sectors {
            let uv = DVec2::new(f64::from(sector) / f64::from(sectors), f64::from(ring) / f64::from(rings));
            let (sin_azimuth, cos_azimuth) = (uv.x * std::f64::consts::TAU).sin_cos();
            let (sin_polar, cos_polar) = (uv.y * std::f64::consts::PI).sin_cos();
            let point = DVec3::new(sin_polar * sin_azimuth, cos_polar, sin_polar * cos_azimuth).as_vec3().to_array();
            mesh.positions.push(point);
            mesh.normals.push(point);
            mesh.uv[0].push(uv.as_vec2().to_array());
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let at = |down: u32, right: u32| (ring + down) * (sectors + 1) + sector + right;
            if ring > 0 {
                mesh.indices.extend([at(0, 0), at(1, 1), at(0, 1)]);
            }
            if ring + 1 < rings {
                mesh.indices.extend([at(0, 0), at(1, 0), at(1, 1)]);
            }
        }
    }
    one_mesh("sphere", mesh, material)
}

/// A sphere that lies on a plane: instance 0 is the plane, 16 radii wide, and instance 1 the sphere of so many `rings`,
/// which touches it in the middle, at `place`.
pub fn sphere_on_plane(material: Material, rings: u32, radius: f64, place: DVec3) -> Scene {
    let mut scene = plane(material.clone(), 1.0);
    scene.meshes.append(&mut sphere(material, rings).meshes);
    let scaled = |by: f64, to: DVec3| DAffine3::from_translation(to) * DAffine3::from_scale(DVec3::splat(by));
    scene.instances[0].world_from_local = scaled(8.0 * radius, place);
    let world_from_local = scaled(radius, place + radius * DVec3::Y);
    scene.instances.push(Instance { mesh: 1, world_from_local, name: "sphere".to_owned() });
    scene
}

/// The point of [`plane`] that [`OVER_PLANE`] sees through the centre of each pixel, and its area in texture space:
/// that of the parallelogram spanned by its derivatives, from central differences of the exact point.
pub fn seen_plane(size: [u32; 2]) -> Vec<(DVec3, f64)> {
    let point = |x: f64, y: f64| {
        let ray = OVER_PLANE.ray(size, [x, y]);
        OVER_PLANE.eye - OVER_PLANE.eye.y / ray.y * ray
    };
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (f64::from(x) + 0.5, f64::from(y) + 0.5)));
    let step = 1e-4;
    pixels
        .map(|(x, y)| {
            let dx = (point(x + step, y) - point(x - step, y)) / (2.0 * step);
            let dy = (point(x, y + step) - point(x, y - step)) / (2.0 * step);
            // Texture coordinates are x and z.
            (point(x, y), DVec2::new(dx.x, dx.z).perp_dot(DVec2::new(dy.x, dy.z)).abs())
        })
        .collect()
}

fn one_mesh(name: &str, mesh: Mesh, material: Material) -> Scene {
    Scene {
        name: name.to_owned(),
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_local: DAffine3::IDENTITY, name: name.to_owned() }],
        materials: vec![material],
        ..Scene::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_wind_as_their_normals_point() {
        for scene in [plane(Material::default(), 2.0), sphere(Material::default(), 8)] {
            let mesh = &scene.meshes[0];
            let point = |index: u32| DVec3::from(mesh.positions[index as usize].map(f64::from));
            for triangle in mesh.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|corner| point(triangle[corner]));
                let normal = DVec3::from(mesh.normals[triangle[0] as usize].map(f64::from));
                assert!((b - a).cross(c - a).dot(normal) > 0.0, "{}: {triangle:?}", scene.name);
            }
        }
    }
}
