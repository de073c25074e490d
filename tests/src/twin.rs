//! What f64 twins of glint shaders share beside the oracle's integer hash: numbers from words, the pixel's footprint on
//! the stage, the shares of an ellipse.

use glam::{DMat2, DVec2, DVec3};
use mica_accuracy::Condition;

/// Inside (0, 1), from 24 bits.
pub fn unit_from(bits: u32) -> f64 {
    (f64::from(bits >> 8) + 0.5) / 16_777_216.0
}

/// A whole number as two words.
pub fn words_of(whole: f64) -> [u32; 2] {
    let high = (whole / 4_194_304.0).floor();
    [high as i64 as u32, (whole - high * 4_194_304.0) as u32]
}

/// What a pixel of the stage sees.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Texture coordinates.
    pub uv: DVec2,
    /// Columns: their change from pixel to pixel, to the right and down.
    pub sides: DMat2,
    /// Towards the light, normal +Y.
    pub i: DVec3,
    /// Towards the viewer.
    pub o: DVec3,
}

/// The pixels of [`mica_accuracy::Stage`] row by row, by the stage's description: 1/256 m a pixel, seen from 500 m.
pub fn stage_pixels(condition: &Condition, side: u32) -> Vec<Seen> {
    let world = |local: DVec3| DVec3::new(local.y, local.z, local.x);
    let target = DVec3::new(0.4031, 0.0, 0.3527);
    let eye = target + 500.0 * world(condition.o());
    let backwards = (eye - target).normalize();
    let right = DVec3::Y.cross(backwards).normalize();
    let up = backwards.cross(right);
    let ray = |x: f64, y: f64| {
        let middle = 0.5 * f64::from(side);
        ((x - middle) * right - (y - middle) * up) / 256.0 / 500.0 - backwards
    };
    let uv = |x: f64, y: f64| {
        let ray = ray(x, y);
        let point = eye - eye.y / ray.y * ray;
        DVec2::new(point.x, point.z)
    };
    let step = 1e-3;
    (0..side)
        .flat_map(|y| (0..side).map(move |x| (f64::from(x) + 0.5, f64::from(y) + 0.5)))
        .map(|(x, y)| Seen {
            uv: uv(x, y),
            sides: DMat2::from_cols(
                (uv(x + step, y) - uv(x - step, y)) / (2.0 * step),
                (uv(x, y + step) - uv(x, y - step)) / (2.0 * step),
            ),
            i: world(condition.i()),
            o: -ray(x, y).normalize(),
        })
        .collect()
}

/// Half axes of the ellipse that these sides make of the unit circle, and the direction of the longer.
pub fn ellipse(sides: DMat2) -> (f64, f64, DVec2) {
    let form = sides * sides.transpose();
    let (middle, product) = (0.5 * (form.x_axis.x + form.y_axis.y), form.determinant());
    let greater = middle + (middle * middle - product).max(0.0).sqrt();
    let direction = DVec2::new(form.x_axis.y, greater - form.x_axis.x);
    let direction = if direction.length() > 1e-9 * greater { direction.normalize() } else { DVec2::X };
    (greater.sqrt(), (product / greater).sqrt(), direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_has_its_axes() {
        let turn = DMat2::from_angle(0.7);
        let (major, minor, direction) =
            ellipse(turn * DMat2::from_diagonal(DVec2::new(3.0, 0.5)) * DMat2::from_angle(1.1));
        assert!((major - 3.0).abs() < 1e-12 && (minor - 0.5).abs() < 1e-12);
        assert!(direction.perp_dot(turn.x_axis).abs() < 1e-12);
    }
}
