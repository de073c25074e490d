//! The few scenes whose picture is known in closed form: one shape, a pinhole camera, a constant environment and
//! point lights. World space: right-handed, +Y up, metres.

use glam::DVec3;

use crate::OracleError;
use crate::error::in_range;

/// A surface, seen from its outer side only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// The infinite plane y = `height`, with normal +Y.
    Plane {
        /// Height above the origin, metres.
        height: f64,
    },
    /// A sphere with outward normals.
    Sphere {
        /// Its centre, world space.
        center: DVec3,
        /// Its radius, metres.
        radius: f64,
    },
}

/// Where a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The point, world space.
    pub position: DVec3,
    /// The unit outward normal there.
    pub normal: DVec3,
}

impl Shape {
    /// Whether `point` (world space) is strictly on the outer side.
    pub fn is_outside(&self, point: DVec3) -> bool {
        match *self {
            Self::Plane { height } => point.y > height,
            Self::Sphere { center, radius } => point.distance(center) > radius,
        }
    }

    /// The first point of the shape along the ray from `origin` (outside) in the unit direction `direction`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        match *self {
            Self::Plane { height } => (direction.y < 0.0).then(|| {
                let distance = (height - origin.y) / direction.y;
                let position = origin + distance * direction;
                Hit { position: DVec3::new(position.x, height, position.z), normal: DVec3::Y }
            }),
            Self::Sphere { center, radius } => {
                let to_center = center - origin;
                let along = to_center.dot(direction);
                // The distance of the centre from the ray, not a difference of large squares.
                let miss = to_center - along * direction;
                let half_chord_squared = radius * radius - miss.length_squared();
                (along > 0.0 && half_chord_squared >= 0.0).then(|| {
                    let normal = (-miss - half_chord_squared.sqrt() * direction).normalize();
                    Hit { position: center + radius * normal, normal }
                })
            }
        }
    }
}

/// A pinhole camera. The image's up is world +Y as far as that is possible; where the camera looks straight up or down,
/// its right is world +X.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole, world space.
    pub eye: DVec3,
    /// A point in the image's centre.
    pub target: DVec3,
    /// Angle between the upper and lower edge of the image, radians in (0, pi).
    pub vertical_fov_radians: f64,
}

/// Width and height of an image in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A camera made ready to give the direction of each pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelRays {
    forward: DVec3,
    /// From the image's centre to its right edge, at distance 1.
    right: DVec3,
    /// From the image's centre to its upper edge, at distance 1.
    up: DVec3,
    size: Size,
}

impl Camera {
    pub(crate) fn pixel_rays(&self, size: Size) -> Result<PixelRays, OracleError> {
        let fov = self.vertical_fov_radians;
        in_range("vertical_fov_radians", fov, fov > 0.0 && fov < std::f64::consts::PI, "in (0, pi)")?;
        for (what, count) in [("image width", size.width), ("image height", size.height)] {
            in_range(what, count as f64, count > 0, "at least 1")?;
        }
        let forward = (self.target - self.eye).try_normalize().ok_or(OracleError::CameraWithoutDirection)?;
        let sideways = forward.cross(DVec3::Y);
        let right = if sideways.length_squared() > 2e-12 { sideways.normalize() } else { DVec3::X };
        let half_height = (fov / 2.0).tan();
        let half_width = half_height * size.width as f64 / size.height as f64;
        Ok(PixelRays { forward, right: right * half_width, up: right.cross(forward) * half_height, size })
    }
}

impl PixelRays {
    /// The unit direction through the centre of the pixel in column `x` and row `y`, row 0 being the top.
    pub(crate) fn direction(&self, x: usize, y: usize) -> DVec3 {
        self.ray(x, y).normalize()
    }

    /// The same, of length 1 along the camera's axis.
    pub(crate) fn ray(&self, x: usize, y: usize) -> DVec3 {
        let across = 2.0 * (x as f64 + 0.5) / self.size.width as f64 - 1.0;
        let upward = 1.0 - 2.0 * (y as f64 + 0.5) / self.size.height as f64;
        self.forward + across * self.right + upward * self.up
    }

    /// How [`Self::ray`] changes from one column to the next, and from one row to the next.
    pub(crate) fn steps(&self) -> [DVec3; 2] {
        [2.0 / self.size.width as f64 * self.right, -2.0 / self.size.height as f64 * self.up]
    }
}

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is, world space.
    pub position: DVec3,
    /// Radiant intensity, linear RGB: it gives the irradiance intensity * cos / distance^2.
    pub intensity: [f64; 3],
}

/// All light in the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    /// Radiance that arrives from every direction alike, linear RGB.
    pub environment: [f64; 3],
    /// Lights without extent.
    pub points: Vec<PointLight>,
}
