//! How each method looks: a colour and a marker of its own, the same in every chart.

use super::{Ink, Shape, Stroke};
use mica_render::METHODS;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A colour and a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Told apart by those who see fewer colours, as far as twelve can be, and legible on white and on black.
    pub colour: [u8; 3],
    marker: Marker,
}

/// Filled shapes: colours are then told apart at their best.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Marker {
    Disc,
    /// Corners, and how far the first is turned from the top, degrees.
    Polygon(u32, f64),
    Star,
    /// Two bars across each other, turned as above.
    Cross(f64),
}

/// After M. Okabe and K. Ito, Color Universal Design (2008), and the muted scheme of P. Tol, Colour Schemes (2021), moved
/// towards the middle of lightness.
const LOOKS: [Look; 12] = [
    Look { colour: [0x80, 0x80, 0x80], marker: Marker::Disc },
    Look { colour: [0x1b, 0x7f, 0xc4], marker: Marker::Star },
    Look { colour: [0xd5, 0x5e, 0x00], marker: Marker::Polygon(4, 0.0) },
    Look { colour: [0x00, 0x9e, 0x73], marker: Marker::Polygon(3, 0.0) },
    Look { colour: [0xd0, 0x4f, 0x96], marker: Marker::Polygon(4, 45.0) },
    Look { colour: [0xc8, 0x93, 0x00], marker: Marker::Polygon(5, 0.0) },
    Look { colour: [0x8a, 0x63, 0xcf], marker: Marker::Polygon(3, 180.0) },
    Look { colour: [0x3a, 0xa6, 0x9b], marker: Marker::Cross(0.0) },
    Look { colour: [0x8c, 0x8a, 0x1f], marker: Marker::Cross(45.0) },
    Look { colour: [0xb5, 0x44, 0x5a], marker: Marker::Polygon(6, 0.0) },
    Look { colour: [0x45, 0xa8, 0xe0], marker: Marker::Polygon(3, 90.0) },
    Look { colour: [0x5d, 0x98, 0x2a], marker: Marker::Polygon(3, 270.0) },
];

/// The look of a method; one that this build does not know has one by its name.
pub fn look_of(method: &str) -> Look {
    let known = METHODS.iter().position(|info| info.name == method);
    let by_name = || method.bytes().fold(0_usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(byte.into()));
    look_of_number(known.unwrap_or_else(by_name))
}

/// The look of what has no name: of the first, the second and so on.
pub const fn look_of_number(number: usize) -> Look {
    LOOKS[number % LOOKS.len()]
}

/// A marker alone in a square of these many pixels, for legends of a page.
pub fn swatch(look: Look, side: f64) -> super::Drawing {
    let mut drawing = super::Drawing::new([side, side], String::new());
    drawing.shapes.push(look.mark([side / 2.0; 2], side * 0.38, Some(Ink::Own(look.colour, 1.0)), None));
    drawing
}

impl Look {
    /// The marker about a point. Radii are those of a disc as large.
    pub fn mark(self, centre: [f64; 2], radius: f64, fill: Option<Ink>, stroke: Option<Stroke>) -> Shape {
        let turned = |angle: f64, radius: f64| {
            let (sin, cos) = (angle - FRAC_PI_2).sin_cos();
            [centre[0] + radius * cos, centre[1] + radius * sin]
        };
        let points: Vec<[f64; 2]> = match self.marker {
            Marker::Disc => return Shape::Disc { centre, radius, fill, stroke },
            Marker::Polygon(corners, turn) => {
                // As large as the disc, by area.
                let step = TAU / f64::from(corners);
                let outer = radius * (TAU / (f64::from(corners) * step.sin())).sqrt();
                (0..corners).map(|k| turned(turn.to_radians() + f64::from(k) * step, outer)).collect()
            }
            Marker::Star => {
                (0..10).map(|k| turned(f64::from(k) * PI / 5.0, radius * if k % 2 == 0 { 1.5 } else { 0.66 })).collect()
            }
            Marker::Cross(turn) => {
                let (long, half) = (1.3 * radius, 0.42 * radius);
                let (far, near) = (long.hypot(half), half * std::f64::consts::SQRT_2);
                let aside = (half / long).atan();
                (0..4)
                    .flat_map(|k| {
                        let arm = f64::from(k) * FRAC_PI_2 + turn.to_radians();
                        [turned(arm - aside, far), turned(arm + aside, far), turned(arm + PI / 4.0, near)]
                    })
                    .collect()
            }
        };
        Shape::Line { points, closed: true, fill, stroke }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_look_of_its_own() {
        assert!(METHODS.len() <= LOOKS.len(), "a look for each method");
        for (k, look) in LOOKS.iter().enumerate() {
            for other in &LOOKS[..k] {
                assert!(look.colour != other.colour && look.marker != other.marker, "{look:?} {other:?}");
            }
        }
        assert_eq!(look_of("nobody knows this one"), look_of("nobody knows this one"));
    }
}
