//! Squares of flakes that frames of the renderer show: one flat on the ground in any light, and one tilted before a camera, of
//! which f64 says what each pixel sees.

use crate::{Laboratory, StabilityError};
use glam::{DAffine3, DMat2, DMat3, DVec2, DVec3};
use mica_gpu::Timing;
use mica_graph::{Graph, Image};
use mica_render::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{Environment, Frame, OcclusionBackend, Renderer, View};

/// A scene of nothing but a mesh of flakes, which alone reflect, and reflect everything.
fn of_flakes(mesh: Mesh, world_from_local: DAffine3, method: &str, glint: Glint) -> Scene {
    let glint = Glint { color: Some([1.0; 3]), method: Some(method.to_owned()), ..glint };
    let material = Material {
        name: "flakes".to_owned(),
        base_color: [0.0, 0.0, 0.0, 1.0],
        glint: Some(glint),
        ..Material::default()
    };
    Scene {
        name: "stage".to_owned(),
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_local, name: "stage".to_owned() }],
        materials: vec![material],
        ..Scene::default()
    }
}

/// Four corners in the order of a square's outline, to two triangles of a mesh.
fn add_square(mesh: &mut Mesh, corners: [([f32; 3], [f32; 2]); 4], normal: [f32; 3]) {
    let first = mesh.positions.len() as u32;
    for (position, uv) in corners {
        mesh.positions.push(position);
        mesh.normals.push(normal);
        mesh.uv[0].push(uv);
    }
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
}

fn empty_mesh() -> Mesh {
    Mesh { name: "stage".to_owned(), has_uv: true, ..Mesh::default() }
}

/// A square of the plane y = 0 about the origin, facing up. Its flakes alone reflect, and they reflect everything.
pub struct Plane {
    /// Half its side, metres.
    pub half: f32,
    /// Added to its texture coordinates, which are x and z.
    pub uv: [f32; 2],
    /// Towards the only light, whose irradiance is 1.
    pub light: Option<DVec3>,
    /// Light from everywhere.
    pub environment: Option<Environment>,
}

impl Plane {
    /// The plane as a method renders it, with these settings.
    ///
    /// # Errors
    /// Those of the renderer and its settings.
    pub fn renderer(&self, method: &str, settings: &[(&str, &str)]) -> Result<Renderer, StabilityError> {
        let [low, high] = [-self.half, self.half];
        let corners = [[low, low], [low, high], [high, high], [high, low]]
            .map(|[x, z]| ([x, 0.0, z], [x + self.uv[0], z + self.uv[1]]));
        let mut mesh = empty_mesh();
        add_square(&mut mesh, corners, [0.0, 1.0, 0.0]);
        let scene = of_flakes(mesh, DAffine3::IDENTITY, method, Glint::default());
        let sun = |towards: DVec3| Light::Directional { direction: -towards, irradiance: [1.0; 3] };
        let lights: Vec<Light> = self.light.map(sun).into_iter().collect();
        let mut renderer = Renderer::new(scene, &lights, self.environment.as_ref(), OcclusionBackend::None)?;
        for (key, value) in settings {
            renderer.set(None, key, value)?;
        }
        Ok(renderer)
    }
}

/// Radiance in the green channel of every pixel.
///
/// # Errors
/// Those of the renderer and of the device.
pub fn radiance(laboratory: &mut Laboratory, renderer: &mut Renderer, view: &View) -> Result<Vec<f64>, StabilityError> {
    let [pixels] = pixels(laboratory, renderer, view, |frame| [&frame.radiance])?;
    Ok(pixels.into_iter().map(|[_, green, ..]| f64::from(green)).collect())
}

/// Where in texture space the middle of every pixel lies, as methods are told.
///
/// # Errors
/// Those of the renderer and of the device.
pub fn texture_places(
    laboratory: &mut Laboratory,
    renderer: &mut Renderer,
    view: &View,
) -> Result<Vec<[f64; 2]>, StabilityError> {
    let [pixels] = pixels(laboratory, renderer, view, |frame| [&frame.uv])?;
    Ok(pixels.into_iter().map(|[u, v, ..]| [f64::from(u), f64::from(v)]).collect())
}

/// The pixels of some of a frame's images.
fn pixels<const N: usize>(
    laboratory: &mut Laboratory,
    renderer: &mut Renderer,
    view: &View,
    images: impl FnOnce(&Frame) -> [&Image; N],
) -> Result<[Vec<[f32; 4]>; N], StabilityError> {
    let mut graph = Graph::new();
    let frame = renderer.frame(&mut graph, view, None)?;
    let downloads = images(&frame).map(|image| graph.download_image(image));
    let mut run = laboratory.executor.run(graph, Timing::Overlapped)?;
    Ok(downloads.map(|download| bytemuck::pod_collect_to_vec(&run.take(download))))
}

/// The plane's local frame, with the normal along +Z: a direction of the world in it.
pub fn local(world: DVec3) -> DVec3 {
    DVec3::new(world.x, -world.z, world.y)
}

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
        let mut mesh = empty_mesh();
        for (left, right, jump) in [(-1.0, 0.0, 0.0), (0.0, 1.0, self.uv_jump)] {
            let corners = [(left, -1.0), (right, -1.0), (right, 1.0), (left, 1.0)].map(|(x, y)| {
                let at = self.half * DVec2::new(x, y);
                let uv = self.uv_per_metre * at + self.uv_offset;
                ([at.x as f32, at.y as f32, 0.0], [(uv.x + jump) as f32, uv.y as f32])
            });
            add_square(&mut mesh, corners, [0.0, 0.0, 1.0]);
        }
        mesh
    }

    /// The scene, its square placed by a transform in f64, under one light from straight above.
    pub fn scene(&self) -> Scene {
        let (method, count) = self.flakes;
        let glint = Glint { count, alpha: ALPHA, gamma_deg: GAMMA_DEG, ..Glint::default() };
        let world_from_local = self.world_from_local();
        let mut scene = of_flakes(self.mesh(), world_from_local, method, glint);
        let irradiance = [1.0; 3];
        scene.lights = vec![Light::Directional { direction: -world_from_local.matrix3.z_axis, irradiance }];
        scene
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
        let [radiance, uv, footprint] = pixels(laboratory, &mut renderer, &self.view(), |frame| {
            // Where nothing glints there are no footprints.
            [&frame.radiance, &frame.uv, frame.footprint.as_ref().unwrap_or(&frame.uv)]
        })?;
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
