//! What only whole frames show: distances, and texture far from its origin.

use super::{Series, Sweep, errors, greatest, linear, log};
use crate::cases::{EVERY_FLAKE, GATED, Shown, distances, limit, radiance_seen, seen_from};
use crate::stage::{Plane, texture_places};
use crate::{Laboratory, StabilityError, arithmetic};
use glam::DVec3;
use mica_render::View;
use mica_render::scene::Camera;
use mica_shaders::types::Operands;

/// Mean radiance of a surface over ten decades of distance.
///
/// # Errors
/// Those of the device and the renderer.
pub fn distance(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    let distances = distances(laboratory.inputs(2, 8) as i32);
    let mut over = |shown: Shown| -> Result<Vec<(f64, f64)>, StabilityError> {
        let limit = limit(laboratory, shown)?;
        let ratio = |distance: &f64| Ok((*distance, radiance_seen(laboratory, shown, seen_from(*distance))? / limit));
        distances.iter().map(ratio).collect()
    };
    let points = over(EVERY_FLAKE)?;
    Ok(Sweep {
        name: "distance".to_owned(),
        title: "Ten decades of distance".to_owned(),
        x: log("distance in metres"),
        y: linear("mean radiance / that of infinitely many flakes"),
        worst: greatest(points.iter().map(|(_, ratio)| (ratio - 1.0).abs())),
        series: vec![
            Series { name: "every flake".to_owned(), points },
            Series { name: "Deliot and Belcour 2023 as printed".to_owned(), points: over(GATED)? },
        ],
        claim: "Mean radiance of a surface is flat within .5 % from 1e-4 to 1e6 metres.".to_owned(),
        tolerance: 5e-3,
    })
}

/// Where in their square of texture the pixels of a plane lie, whole squares from the origin.
///
/// # Errors
/// Those of the device and the renderer.
pub fn offset(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    const SIDE: u32 = 32;
    /// Angle that the picture covers, radians: it is .2 metres wide.
    const FOV: f64 = 0.2;
    let mut squares = vec![1.0_f32];
    squares.extend((1..=6).flat_map(|decade| [2.0, 5.0, 10.0].map(|part| part * 10_f32.powi(decade - 1))));
    let (mut stable, mut naive) = (Vec::new(), Vec::new());
    for offset in squares {
        let plane = Plane { half: 1.0, uv: [offset; 2], light: Some(DVec3::Y), environment: None };
        let mut renderer = plane.renderer("flakes", &[("count", "1000"), ("most", "0")])?;
        let camera = Camera::looking_at("above", DVec3::Y, DVec3::ZERO, FOV, 0.1);
        let places = texture_places(laboratory, &mut renderer, &View::new(camera, [SIDE; 2]))?;
        let pixel = 2.0 * (0.5 * FOV).tan() / f64::from(SIDE);
        // Distance of fractions around the square: just below 1 is near 0.
        let apart = |shown: f64, truth: f64| ((shown - truth + 0.5).rem_euclid(1.0) - 0.5).abs();
        let middle = |index: u32| (f64::from(index) + 0.5 - 0.5 * f64::from(SIDE)) * pixel;
        let off = places
            .iter()
            .zip(0..)
            .map(|(place, index)| apart(place[0], middle(index % SIDE)).max(apart(place[1], middle(index / SIDE))));
        stable.push((f64::from(offset), greatest(off)));
        let operands: Vec<Operands> = (0..SIDE)
            .map(|index| {
                let weight = (0.5 * (middle(index) + 1.0)) as f32;
                Operands { a: [offset - 1.0, offset + 1.0, offset - 1.0, 0.0], b: [weight, 0.0, 0.0, 0.0], c: [0.0; 4] }
            })
            .collect();
        let fractions = laboratory.floats(&operands, arithmetic!(place_interpolated))?;
        let off = fractions
            .iter()
            .zip(&operands)
            .map(|(fraction, of)| apart(f64::from(*fraction), 2.0 * f64::from(of.b[0]) - 1.0));
        naive.push((f64::from(offset), greatest(off)));
    }
    Ok(Sweep {
        name: "offset".to_owned(),
        title: "Texture up to a million squares from its origin".to_owned(),
        x: log("squares of texture between the surface and the origin"),
        y: log("greatest error of a pixel's place in its square"),
        worst: greatest(stable.iter().map(|(_, off)| *off)),
        series: vec![
            errors("whole squares taken off each triangle's corners", stable),
            errors("fraction of the interpolated coordinate", naive),
        ],
        claim: "A pixel's place in its square of texture is known within 1e-6 of the square, up to 1e6 squares away."
            .to_owned(),
        tolerance: 1e-6,
    })
}
