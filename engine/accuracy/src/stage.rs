//! A surface on which every pixel is one more sample of the same random number: what the flakes of one footprint reflect
//! of one light.
//!
//! A plane so far from a camera with so narrow a view that the light's direction, the view's and the footprint are the
//! same in every pixel. Footprints do not overlap, and the picture covers less than one square of texture along x, so
//! pixels are samples of their own, but for the N flakes that they share.

use glam::{DAffine3, DVec3};
use mica_gpu::{Error, Executor, Timing};
use mica_graph::Graph;
use mica_render::scene::{Camera, Glint, Instance, Light, Material, Mesh, Scene};
use mica_render::{Environment, Frame, OcclusionBackend, RenderError, Renderer, SettingError, View};

/// Metres, and units of texture, that a pixel covers where it is seen from above.
const PIXEL: f64 = 1.0 / 256.0;
/// From the camera to the middle of the picture, metres: directions differ by .03 degrees within it.
const DISTANCE: f64 = 500.0;
/// Half the side of the plane, metres.
const HALF: f32 = 8.0;

/// What is seen in every pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    /// Roughness.
    pub alpha: f64,
    /// Half-angle of the reflection cone, degrees.
    pub gamma_deg: f64,
    /// Flakes expected in a footprint, lit or not.
    pub flakes: f64,
    /// Angle of the light from the normal, degrees.
    pub theta_i_deg: f64,
    /// Angle of the view from the normal, degrees, on the other side for positive values of both.
    pub theta_o_deg: f64,
    /// Azimuth of the light, degrees: 0 is opposite to the viewer, where a mirror would reflect it.
    pub phi_deg: f64,
}

impl Condition {
    /// Towards the light, in the local frame: normal +Z, the viewer's side +X.
    pub fn i(&self) -> DVec3 {
        let (sin, cos) = self.theta_i_deg.to_radians().sin_cos();
        let (sin_phi, cos_phi) = self.phi_deg.to_radians().sin_cos();
        DVec3::new(-sin * cos_phi, sin * sin_phi, cos)
    }

    /// Towards the viewer, in the local frame.
    pub fn o(&self) -> DVec3 {
        let (sin, cos) = self.theta_o_deg.to_radians().sin_cos();
        DVec3::new(sin, 0.0, cos)
    }

    /// Area of the footprint in squares of texture.
    pub fn area(&self) -> f64 {
        PIXEL * PIXEL / self.theta_o_deg.to_radians().cos()
    }

    /// Flakes in a square of texture.
    pub fn count(&self) -> f64 {
        self.flakes / self.area()
    }
}

/// The plane under one directional light, rendered by one method.
pub struct Stage {
    renderer: Renderer,
    /// The angles that the renderer was made for.
    view: Condition,
}

impl Stage {
    /// The stage for the angles of `condition`, without environment, shadows or occlusion; flakes reflect everything.
    pub fn new(method: &str, condition: &Condition) -> Result<Self, RenderError> {
        let light = Light::Directional { direction: -world(condition.i()), irradiance: [1.0; 3] };
        Self::lit(method, condition, &[light], None)
    }

    /// The same under other lights, and an environment: pixels differ in what flakes mirror. Of the angles only the view's
    /// matters, which is towards +Z of the world.
    pub fn lit(
        method: &str,
        condition: &Condition,
        lights: &[Light],
        environment: Option<&Environment>,
    ) -> Result<Self, RenderError> {
        let corners = [[-HALF, -HALF], [-HALF, HALF], [HALF, HALF], [HALF, -HALF]];
        let mesh = Mesh {
            name: "stage".to_owned(),
            positions: corners.map(|[x, z]| [x, 0.0, z]).to_vec(),
            normals: vec![[0.0, 1.0, 0.0]; 4],
            uv: [corners.to_vec(), Vec::new()],
            indices: vec![0, 1, 2, 0, 2, 3],
            has_uv: true,
            ..Mesh::default()
        };
        let glint = Glint { count: 1.0, color: Some([1.0; 3]), method: Some(method.to_owned()), ..Glint::default() };
        let material = Material {
            name: "flakes".to_owned(),
            base_color: [0.0, 0.0, 0.0, 1.0],
            glint: Some(glint),
            ..Material::default()
        };
        let scene = Scene {
            name: "stage".to_owned(),
            meshes: vec![mesh],
            instances: vec![Instance { mesh: 0, world_from_local: DAffine3::IDENTITY, name: "stage".to_owned() }],
            materials: vec![material],
            ..Scene::default()
        };
        let renderer = Renderer::new(scene, lights, environment, OcclusionBackend::None)?;
        Ok(Self { renderer, view: *condition })
    }

    /// Sets one of the method's own settings.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SettingError> {
        self.renderer.set(None, key, value)
    }

    /// The renderer, for what a method makes before its first frame.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// The BRDF f(A, i, o) in 1/sr that each of `side` x `side` pixels shows, 128 being the most that lie within a square of
    /// texture; another `seed` gives other flakes.
    ///
    /// # Panics
    /// If the angles are not those that the stage was made for.
    pub fn samples(
        &mut self,
        executor: &mut Executor,
        condition: &Condition,
        side: u32,
        seed: u32,
    ) -> Result<Vec<f64>, StageError> {
        let mut graph = Graph::new();
        let frame = self.frame(&mut graph, condition, [side, seed], true)?;
        let download = graph.download_image(&frame.radiance);
        let mut run = executor.run(graph, Timing::Overlapped)?;
        let pixels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&run.take(download));
        let cos_i = condition.i().z;
        Ok(pixels.into_iter().map(|pixel| f64::from(pixel[1]) / cos_i).collect())
    }

    /// Declares a frame of `side` x `side` pixels that show flakes of a `seed`, with the method's glints or without.
    ///
    /// # Panics
    /// As [`Stage::samples`].
    pub fn frame(
        &mut self,
        graph: &mut Graph,
        condition: &Condition,
        [side, seed]: [u32; 2],
        glints: bool,
    ) -> Result<Frame, StageError> {
        let angles = |of: &Condition| (of.theta_i_deg, of.theta_o_deg, of.phi_deg);
        assert_eq!(angles(condition), angles(&self.view), "a stage is made for certain angles");
        for (key, value) in [
            ("count", condition.count()),
            ("alpha", condition.alpha),
            ("gamma_deg", condition.gamma_deg),
            ("seed", f64::from(seed)),
        ] {
            self.renderer.set(None, key, &value.to_string())?;
        }
        // Off the origin and the axes of the texture's squares, which some methods treat apart.
        let target = DVec3::new(0.4031, 0.0, 0.3527);
        let eye = target + DISTANCE * world(condition.o());
        let fov = 2.0 * (0.5 * f64::from(side) * PIXEL / DISTANCE).atan();
        let camera = Camera::looking_at("stage", eye, target, fov, 1.0);
        Ok(self.renderer.frame(graph, &View { glints, ..View::new(camera, [side, side]) }, None)?)
    }
}

/// What can go wrong while a method is measured.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The frame cannot be declared.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The frame does not run.
    #[error(transparent)]
    Gpu(#[from] Error),
}

/// The local frame's directions in the world: the plane's normal is +Y.
fn world(local: DVec3) -> DVec3 {
    DVec3::new(local.y, local.z, local.x)
}
