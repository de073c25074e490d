//! H28. Energy from near to far and from few flakes to many.
//!
//! A plane seen from straight above shows exactly one square of texture, or a whole number of them, so that the number of flakes in
//! the picture is known; nearly all of them are lit. What is left of chance is which: .07 % of the mean.

use crate::count_law::{Law, exact_moments, gated_moments};
use crate::plane::{Plane, local, radiance};
use crate::{Check, Form, Laboratory, StabilityError};
use glam::{DVec2, DVec3};
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::flake_set::{FlakeSet, Footprint};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::View;
use mica_render::scene::Camera;

/// Pixels along each side of the picture.
const SIDE: u32 = 64;
/// Flakes in the picture.
const SEEN: f64 = 32.0 * (SIDE * SIDE) as f64;
/// Angle that the picture covers, radians.
const FOV: f64 = 0.2;
/// Roughness and half-angle of the cone, in degrees: of 100 flakes 98 are lit.
const ALPHA: f64 = 0.08;
const GAMMA_DEG: f64 = 20.0;
const SEED: u32 = 1;

/// How a plane is seen.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// From the camera to the plane, metres.
    pub distance: f64,
    /// Squares of texture along each side of the picture.
    pub squares: f64,
    /// Flakes in a square.
    pub count: u64,
}

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let distances = distances(laboratory.inputs(1, 4) as i32);
    let near_and_far: Vec<Sight> = distances.into_iter().map(seen_from).collect();
    let few_and_many: Vec<Sight> = [1e3, 1e6, 1e9, 1e12].into_iter().map(of_count).collect();
    let truth = expected()?;
    let gated = gated_moments(laboratory, &[truth.law])?[0].mean / exact_moments(truth.law).mean - 1.0;
    let mut checks = Vec::new();
    for (what, sights) in [
        ("mean radiance of a plane from 1e-4 to 1e6 metres away", near_and_far),
        ("mean radiance with a thousand flakes in a square to 1e12", few_and_many),
    ] {
        let mut worst: f64 = 0.0;
        for sight in &sights {
            let off = (radiance_seen(laboratory, *sight)? / truth.radiance - 1.0).abs();
            worst = worst.max(off);
        }
        checks.push(Check {
            what: what.to_owned(),
            error_of: "|mean over the picture / mean of the BRDF over the cone in f64 - 1|".to_owned(),
            inputs: sights.len() as u64,
            naive: Form::new("as many flakes, counted by a gate and a rounded normal number", gated.abs()),
            stable: Form::new("every flake", worst),
            tolerance: 5e-3,
        });
    }
    Ok(checks)
}

/// Ten decades of distances, so many to a decade.
pub fn distances(to_a_decade: i32) -> Vec<f64> {
    (-4 * to_a_decade..=6 * to_a_decade).map(|step| 10_f64.powf(f64::from(step) / f64::from(to_a_decade))).collect()
}

/// One square of texture, from so far away.
pub fn seen_from(distance: f64) -> Sight {
    Sight { distance, squares: 1.0, count: SEEN as u64 }
}

/// As many flakes in the picture as always, of so many in a square.
fn of_count(count: f64) -> Sight {
    let squares = (SEEN / count).sqrt();
    let squares = if squares > 1.0 { squares.round() } else { squares };
    let count = if squares >= 1.0 { SEEN / (squares * squares) } else { count };
    Sight { distance: 1.0, squares, count: count as u64 }
}

/// The mean radiance of the picture, as many flakes being there as are expected.
///
/// # Errors
/// Those of the device and the renderer.
pub fn radiance_seen(laboratory: &mut Laboratory, sight: Sight) -> Result<f64, StabilityError> {
    let width = 2.0 * sight.distance * (0.5 * FOV).tan();
    let scale = sight.squares / width;
    // Triangles of a metre or more: near the camera is near beside them, too.
    let plane = Plane { half: (0.6 * width).max(1.0) as f32, uv: [0.0; 2], light: Some(DVec3::Y), environment: None };
    let settings = [
        ("count", sight.count.to_string()),
        ("alpha", ALPHA.to_string()),
        ("gamma_deg", GAMMA_DEG.to_string()),
        ("seed", SEED.to_string()),
        ("uv_scale", scale.to_string()),
        ("most", "200".to_owned()),
    ];
    let mut renderer = plane.renderer("flakes", &settings.each_ref().map(|(key, value)| (*key, value.as_str())))?;
    let eye = DVec3::Y * sight.distance;
    let camera = Camera::looking_at("above", eye, DVec3::ZERO, FOV, 0.1 * sight.distance);
    let pixels = radiance(laboratory, &mut renderer, &View::new(camera, [SIDE; 2]))?;
    let shown = pixels.iter().sum::<f64>() / pixels.len() as f64;

    // Of a part of a square chance says how many are there.
    let area = sight.squares * sight.squares;
    if area >= 1.0 {
        return Ok(shown);
    }
    let mut present = 0.0;
    let corner = DVec2::splat(-0.5 * sight.squares);
    let sides = [DVec2::new(sight.squares, 0.0), DVec2::new(0.0, sight.squares)];
    FlakeSet::new(sight.count, ALPHA, SEED)?.for_each_in(&Footprint { corner, sides }, |_| present += 1.0);
    Ok(shown * sight.count as f64 * area / present)
}

/// What a picture shows on average.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Mean radiance of infinitely many flakes.
    pub radiance: f64,
    /// The law of the lit flakes in a pixel.
    pub law: Law,
}

/// What all pictures show on average: of one quarter, as the plane looks the same from all sides.
///
/// # Errors
/// None but the oracle's.
pub fn expected() -> Result<Expected, StabilityError> {
    const STEPS: u32 = 6;
    let facets = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational)?;
    let i = local(DVec3::Y);
    let (mut radiance, mut lit) = (0.0, 0.0);
    for (x, y) in (0..STEPS).flat_map(|x| (0..STEPS).map(move |y| (x, y))) {
        let [x, z] = [x, y].map(|at| (f64::from(at) + 0.5) / f64::from(STEPS) * (0.5 * FOV).tan());
        let of = ConeMeans::new(&facets, i, local(DVec3::new(-x, 1.0, -z).normalize()), GAMMA_DEG.to_radians());
        radiance += of.discrete * i.z / f64::from(STEPS * STEPS);
        lit += of.lit_probability / f64::from(STEPS * STEPS);
    }
    Ok(Expected { radiance, law: [(SEEN / f64::from(SIDE * SIDE)) as f32, lit as f32] })
}
