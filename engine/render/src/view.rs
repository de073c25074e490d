//! Where a frame is seen from, and the numbers that tell the shaders so.

use crate::scene::Camera;
use glam::{DMat4, DVec3, DVec4};
use mica_shaders::types;

/// A camera and a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Pixels along x and y, each at least 1.
    pub size: [u32; 2],
    /// Where in its pixel each ray passes, in pixels from the centre: within -1/2..1/2.
    pub jitter: [f64; 2],
    /// Factor of the radiance before tone mapping.
    pub exposure: f32,
    /// Which sample of its pixels the frame is.
    pub sample_index: u32,
    /// Side of the part of its pixel that a sample stands for, in pixels: footprints are that large. 1 is the whole pixel.
    pub span: f64,
    /// Whether glints are drawn. Without them the frame is what lies below them, and tables are kept as they are.
    pub glints: bool,
}

impl View {
    /// A view through pixel centres, exposure 1.
    pub fn new(camera: Camera, size: [u32; 2]) -> Self {
        Self { camera, size, jitter: [0.0; 2], exposure: 1.0, sample_index: 0, span: 1.0, glints: true }
    }

    /// The same view, its rays moved within their pixels by the `index`-th point of a sequence that fills the pixel
    /// evenly (R2, Roberts 2018); the first passes through the centres.
    pub fn sample(&self, index: u32) -> Self {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
        let jitter = STEPS.map(|step| (f64::from(index) * step + 0.5).fract() - 0.5);
        Self { jitter, sample_index: index, ..self.clone() }
    }

    /// The same view, its pixels taken apart into `parts` x `parts` squares, of which this frame shows the one in `column`
    /// and `row` of each: the mean over all of them is what a box filter sees, with every flake counted once.
    pub fn part(&self, parts: u32, column: u32, row: u32) -> Self {
        let span = 1.0 / f64::from(parts.max(1));
        let jitter = [column, row].map(|place| (f64::from(place) + 0.5) * span - 0.5);
        Self { jitter, span, sample_index: row * parts + column, ..self.clone() }
    }

    /// The camera's part of the frame's constants. Scene space is world space about `center`.
    pub(crate) fn frame(&self, center: DVec3) -> types::Frame {
        let [width, height] = self.size.map(f64::from);
        let rotation = self.camera.world_from_camera.matrix3;
        let (right, up, backwards) = (rotation.x_axis, rotation.y_axis, rotation.z_axis);
        let eye = self.camera.eye() - center;
        let half_height = (0.5 * self.camera.vertical_fov_radians).tan();
        let half_width = half_height * width / height;

        // A pixel's ray is corner + (x + 1/2) dx + (y + 1/2) dy; the jitter moves the corner.
        let dx = right * (2.0 * half_width / width);
        let dy = up * (-2.0 * half_height / height);
        let corner = -backwards - right * half_width + up * half_height + self.jitter[0] * dx + self.jitter[1] * dy;

        // Reversed depth without a far plane: clip z is the near distance, clip w the distance along the view.
        let camera_from_scene = DMat4::from_cols(
            DVec4::new(right.x, up.x, backwards.x, 0.0),
            DVec4::new(right.y, up.y, backwards.y, 0.0),
            DVec4::new(right.z, up.z, backwards.z, 0.0),
            DVec4::new(-right.dot(eye), -up.dot(eye), -backwards.dot(eye), 1.0),
        );
        let shift = [-2.0 * self.jitter[0] / width, 2.0 * self.jitter[1] / height];
        let clip_from_camera = DMat4::from_cols(
            DVec4::new(1.0 / half_width, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 1.0 / half_height, 0.0, 0.0),
            DVec4::new(-shift[0], -shift[1], 0.0, -1.0),
            DVec4::new(0.0, 0.0, self.camera.near, 0.0),
        );
        let clip_from_scene = (clip_from_camera * camera_from_scene).as_mat4();
        types::Frame {
            clip_from_scene: clip_from_scene.to_cols_array_2d(),
            eye: xyz0(eye),
            ray_corner: xyz0(corner),
            ray_dx: xyz0(dx),
            ray_dy: xyz0(dy),
            width: self.size[0],
            height: self.size[1],
            sample_index: self.sample_index,
            span: self.span as f32,
            ..Default::default()
        }
    }
}

fn xyz0(v: DVec3) -> [f32; 4] {
    let v = v.as_vec3();
    [v.x, v.y, v.z, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn projected(view: &View, point: DVec3) -> [f64; 2] {
        let frame = view.frame(DVec3::ZERO);
        let clip = glam::Mat4::from_cols_array_2d(&frame.clip_from_scene) * point.as_vec3().extend(1.0);
        let ndc = clip / clip.w;
        let [width, height] = view.size.map(f64::from);
        [(f64::from(ndc.x) * 0.5 + 0.5) * width, (0.5 - f64::from(ndc.y) * 0.5) * height]
    }

    #[test]
    fn rays_pass_through_the_points_that_project_onto_their_pixels() {
        let camera = Camera::looking_at("test", DVec3::new(3.0, 2.0, 5.0), DVec3::new(0.3, 0.1, -0.2), 0.7, 0.1);
        for sample in 0..5 {
            let view = View::new(camera.clone(), [320, 180]).sample(sample);
            let frame = view.frame(DVec3::ZERO);
            for (x, y) in [(0u32, 0u32), (319, 179), (17, 101), (200, 3)] {
                let ray: Vec<f64> = (0..3)
                    .map(|axis| {
                        f64::from(frame.ray_corner[axis])
                            + (f64::from(x) + 0.5) * f64::from(frame.ray_dx[axis])
                            + (f64::from(y) + 0.5) * f64::from(frame.ray_dy[axis])
                    })
                    .collect();
                let point = camera.eye() + 4.2 * DVec3::new(ray[0], ray[1], ray[2]);
                let [px, py] = projected(&view, point);
                assert!((px - f64::from(x) - 0.5).abs() < 1e-3, "x {px} for {x}, sample {sample}");
                assert!((py - f64::from(y) - 0.5).abs() < 1e-3, "y {py} for {y}, sample {sample}");
            }
        }
    }

    #[test]
    fn parts_tile_the_pixel() {
        let view = View::new(Camera::looking_at("test", DVec3::Z, DVec3::ZERO, 0.7, 0.1), [8, 8]);
        assert_eq!(view.part(1, 0, 0), view);
        let (first, last) = (view.part(4, 0, 0), view.part(4, 3, 2));
        assert_eq!((first.span, first.jitter), (0.25, [-0.375, -0.375]));
        assert_eq!((last.sample_index, last.jitter), (11, [0.375, 0.125]));
    }

    #[test]
    fn samples_fill_the_pixel_evenly() {
        let view = View::new(Camera::looking_at("test", DVec3::Z, DVec3::ZERO, 0.7, 0.1), [8, 8]);
        assert_eq!(view.sample(0).jitter, [0.0, 0.0]);
        let mut counts = [0; 4];
        for index in 0..400 {
            let [x, y] = view.sample(index).jitter;
            assert!((-0.5..0.5).contains(&x) && (-0.5..0.5).contains(&y));
            counts[usize::from(x >= 0.0) + 2 * usize::from(y >= 0.0)] += 1;
        }
        assert!(counts.iter().all(|&count| (90..=110).contains(&count)), "{counts:?}");
    }
}
