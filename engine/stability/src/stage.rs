//! A tilted plane before a camera, which frames of the renderer show, and what f64 says of each of its pixels.

use crate::{Laboratory, StabilityError};
use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3};
use mica_gpu::Timing;
use mica_graph::Graph;
use mica_render::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{OcclusionBackend, Renderer, View};

/// A square, and an eye before its middle.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Half the square's side, metres.
    pub half: f64,
    /// From its middle to the eye, metres.
    pub distance: f64,
    /// Between its normal and the view, degrees.
    pub tilt_deg: f64,
    /// Where its middle is in the world, metres.
    pub place: DVec3,
    /// Texture coordinates along a metre.
    pub uv_per_metre: f64,
    /// What is added to them.
    pub uv_offset: f64,
    /// What is added to u on the right half: the seam of an atlas.
    pub uv_jump: f64,
    /// The method, and flakes in a square of texture.
    pub flakes: (&'static str, f64),
}

/// Roughness of the flakes.
pub const ALPHA: f64 = 0.5;
/// Half-angle of the cone that a flake reflects into, degrees.
pub const GAMMA_DEG: f64 = 3.0;
/// Pixels along each side of a frame.
pub const SIDE: u32 = 32;
/// From edge to edge of the picture: pixels are those of 1080 rows over 40 degrees.
const FOV_RADIANS: f64 = 0.7 * SIDE as f64 / 1080.0;

impl Default for Stage {
    fn default() -> Self {
        Self {
            half: 1.0,
            distance: 1.0,
            tilt_deg: 30.0,
            place: DVec3::ZERO,
            uv_per_metre: 1.0,
            uv_offset: 0.0,
            uv_jump: 0.0,
            flakes: ("smooth", 1e6),
        }
    }
}

/// What a frame says of each pixel, row by row.
pub struct Seen {
    /// Green radiance.
    pub radiance: Vec<f32>,
    /// Texture coordinates.
    pub uv: Vec<[f32; 2]>,
    /// Their derivatives: du/dx, dv/dx, du/dy, dv/dy.
    pub footprint: Vec<[f32; 4]>,
}

impl Stage {
    /// From the square's own space, where it lies in z = 0 about the origin, to the world.
    fn world_from_local(&self) -> DAffine3 {
        let turned = DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
        DAffine3 { matrix3: turned, translation: self.place }
    }

    /// From the square to the eye, a unit vector, in the square's own space.
    fn towards_eye(&self) -> DVec3 {
        let (sin, cos) = self.tilt_deg.to_radians().sin_cos();
        DVec3::new(0.6 * sin, 0.8 * sin, cos)
    }

    fn mesh(&self) -> Mesh {
        let mut mesh = Mesh { name: "stage".to_owned(), has_uv: true, ..Mesh::default() };
        for (left, right, jump) in [(-1.0, 0.0, 0.0), (0.0, 1.0, self.uv_jump)] {
            let first = mesh.positions.len() as u32;
            for (x, y) in [(left, -1.0), (right, -1.0), (right, 1.0), (left, 1.0)] {
                let at = self.half * DVec2::new(x, y);
                mesh.positions.push([at.x as f32, at.y as f32, 0.0]);
                mesh.normals.push([0.0, 0.0, 1.0]);
                let uv = self.uv_per_metre * at + self.uv_offset;
                mesh.uv[0].push([(uv.x + jump) as f32, uv.y as f32]);
            }
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        mesh
    }

    /// The scene, its square placed by a transform in f64, under one light from straight above.
    pub fn scene(&self) -> Scene {
        let (method, count) = self.flakes;
        let glint = Glint {
            count,
            alpha: ALPHA,
            gamma_deg: GAMMA_DEG,
            color: Some([1.0; 3]),
            method: Some(method.to_owned()),
            ..Glint::default()
        };
        let material = Material {
            name: "stage".to_owned(),
            base_color: [0.0, 0.0, 0.0, 1.0],
            glint: Some(glint),
            ..Material::default()
        };
        let world_from_local = self.world_from_local();
        Scene {
            name: "stage".to_owned(),
            meshes: vec![self.mesh()],
            instances: vec![Instance { mesh: 0, world_from_local, name: "stage".to_owned() }],
            materials: vec![material],
            lights: vec![Light::Directional { direction: -world_from_local.matrix3.z_axis, irradiance: [1.0; 3] }],
            ..Scene::default()
        }
    }

    /// The same with its corners in world space, as f32 has them.
    pub fn scene_in_the_world(&self) -> Scene {
        let mut scene = self.scene();
        let place = std::mem::replace(&mut scene.instances[0].world_from_local, DAffine3::IDENTITY);
        let mesh = &mut scene.meshes[0];
        for position in &mut mesh.positions {
            let local = DVec3::from(position.map(f64::from));
            *position = place.transform_point3(local).as_vec3().to_array();
        }
        mesh.normals.fill(place.matrix3.z_axis.as_vec3().to_array());
        scene
    }

    /// What the eye sees.
    pub fn view(&self) -> View {
        let eye = self.place + self.distance * (self.world_from_local().matrix3 * self.towards_eye());
        let camera = Camera::looking_at("stage", eye, self.place, FOV_RADIANS, 1e-3 * self.distance);
        View::new(camera, [SIDE; 2])
    }

    /// The frame of one of the two scenes.
    ///
    /// # Errors
    /// Those of the renderer and of the device.
    pub fn seen(&self, laboratory: &mut Laboratory, scene: Scene) -> Result<Seen, StabilityError> {
        let mut renderer = Renderer::new(scene, &[], None, OcclusionBackend::None)?;
        if self.flakes.0 == "flakes" {
            // Fewer passes, and still more flakes than any footprint here holds by chance.
            renderer.set(None, "most", "2000")?;
        }
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, &self.view(), None)?;
        let [radiance, uv, footprint] =
            [&frame.radiance, &frame.uv, &frame.footprint].map(|image| graph.download_image(image));
        let mut run = laboratory.executor.run(graph, Timing::Overlapped)?;
        let [radiance, uv, footprint] = [radiance, uv, footprint].map(|image| {
            let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&run.take(image));
            pixels
        });
        Ok(Seen {
            radiance: radiance.into_iter().map(|[_, green, _, _]| green).collect(),
            uv: uv.into_iter().map(|[u, v, _, _]| [u, v]).collect(),
            footprint,
        })
    }

    /// The derivatives of the texture coordinates in each pixel, columns d/dx and d/dy: those of the point where its ray meets
    /// the plane, times those of the coordinates that the corners have in f32.
    pub fn footprints(&self) -> Vec<DMat2> {
        let camera = self.view().camera.world_from_camera.matrix3;
        let local = self.world_from_local().matrix3.transpose();
        let [right, up, backwards] = [camera.x_axis, camera.y_axis, camera.z_axis].map(|axis| local * axis);
        let pixel = 2.0 * (0.5 * FOV_RADIANS).tan() / f64::from(SIDE);
        let (dx, dy) = (pixel * right, -pixel * up);
        let height = self.distance * self.towards_eye().z;
        let mesh = self.mesh();
        let [low, high] = [0, 2].map(|corner| {
            let ([x, y, _], uv) = (mesh.positions[corner], mesh.uv[0][corner]);
            [DVec2::new(x.into(), y.into()), DVec2::from(uv.map(f64::from))]
        });
        let uv_per_metre = (high[1] - low[1]) / (high[0] - low[0]);
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                let [across, down] = [x, y].map(|at| f64::from(at) + 0.5 - 0.5 * f64::from(SIDE));
                let ray = across * dx + down * dy - backwards;
                let t = -height / ray.z;
                let moved = |step: DVec3| uv_per_metre * (t * (step - ray * (step.z / ray.z))).truncate();
                DMat2::from_cols(moved(dx), moved(dy))
            })
            .collect()
    }

    /// Towards the light and the viewer, about the square's normal.
    pub fn directions(&self) -> [DVec3; 2] {
        [DVec3::Z, self.towards_eye()]
    }
}
