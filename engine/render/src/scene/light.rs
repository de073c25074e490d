//! Lights and cameras.

use glam::{DAffine3, DMat3, DVec3};

/// A light without extent (`KHR_lights_punctual`), in world space.
///
/// That extension's candela and lux are taken as W/sr and W/m2, one to one: glTF does not say by which luminous
/// efficacy its colours were weighted, and the rest of the renderer is radiometric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Shines from a point into all directions.
    Point {
        /// Metres.
        position: DVec3,
        /// Radiant intensity, W/sr per channel.
        radiant_intensity: [f32; 3],
        /// Distance beyond which it has no effect, metres; none is infinite.
        range: Option<f32>,
    },
    /// Shines from infinitely far away.
    Directional {
        /// Unit; the way the light travels, from the source towards the scene.
        direction: DVec3,
        /// On a surface that faces the light, W/m2 per channel.
        irradiance: [f32; 3],
    },
    /// Shines from a point into a cone.
    Spot {
        /// Metres.
        position: DVec3,
        /// Unit; the axis of the cone, the way the light travels.
        direction: DVec3,
        /// Radiant intensity along the axis, W/sr per channel.
        radiant_intensity: [f32; 3],
        /// Distance beyond which it has no effect, metres; none is infinite.
        range: Option<f32>,
        /// Half-angle within which it has its full intensity; less than the outer one.
        inner_cone_radians: f32,
        /// Half-angle beyond which it has none; at most pi/2.
        outer_cone_radians: f32,
    },
}

/// A perspective camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// From the file, or made from the camera's place in it.
    pub name: String,
    /// A rotation and the eye's position: the camera looks along its -Z, +Y is up.
    pub world_from_camera: DAffine3,
    /// Full angle from the bottom of the picture to its top; within (0, pi).
    pub vertical_fov_radians: f64,
    /// Nothing nearer is seen, metres; positive.
    pub near: f64,
}

impl Camera {
    /// A camera at `eye` that looks at `target` with +Y upwards in the picture, as far as that is possible.
    pub fn looking_at(name: &str, eye: DVec3, target: DVec3, vertical_fov_radians: f64, near: f64) -> Self {
        let backwards = (eye - target).try_normalize().unwrap_or(DVec3::Z);
        // Straight up or down, the picture's top is -Z (or +Z), as when a level camera tips over.
        let right =
            DVec3::Y.cross(backwards).try_normalize().filter(|_| backwards.y.abs() < 1.0 - 1e-12).unwrap_or(DVec3::X);
        let rotation = DMat3::from_cols(right, backwards.cross(right), backwards);
        Self {
            name: name.to_owned(),
            world_from_camera: DAffine3::from_mat3_translation(rotation, eye),
            vertical_fov_radians,
            near,
        }
    }

    /// Where it stands, metres.
    pub fn eye(&self) -> DVec3 {
        self.world_from_camera.translation
    }

    /// Where it looks, unit.
    pub fn forward(&self) -> DVec3 {
        -self.world_from_camera.matrix3.z_axis
    }
}
