//! H28. Energy from near to far and from few flakes to many.
//!
//! One surface is seen from straight above: from 1e-4 metres a pixel holds 2 flakes, from 1e6 metres 2e20. Nearly all of them are
//! lit. What is left of chance is which, .08 % of the mean; how many there are near the camera is counted.

use crate::stage::{Plane, local, radiance};
use crate::{Check, Form, Laboratory, StabilityError};
use glam::{DVec2, DVec3};
use mica_oracle::cone_mean::ConeMeans;
use mica_oracle::flake_set::{FlakeSet, Footprint};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::View;
use mica_render::scene::Camera;

/// Pixels along each side of the picture.
const SIDE: u32 = 128;
/// Flakes in the picture where it shows fewest.
const FEWEST: f64 = 2.0 * (SIDE * SIDE) as f64;
/// Angle that the picture covers, radians.
const FOV: f64 = 0.2;
/// Roughness and half-angle of the cone, in degrees: of 100 flakes 98 are lit.
const ALPHA: f64 = 0.08;
const GAMMA_DEG: f64 = 20.0;
const SEED: u32 = 1;
/// Distances of the camera, metres.
const NEAREST: f64 = 1e-4;
const FARTHEST: f64 = 1e6;
/// As many as a square of texture may hold.
const MOST_FLAKES: f64 = 1e12;

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

/// A method and its settings.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// Which.
    pub method: &'static str,
    /// Those that other methods lack.
    pub own: &'static [(&'static str, &'static str)],
}

/// All flakes are looked at.
pub const EVERY_FLAKE: Shown = Shown { method: "flakes", own: &[("most", "200")] };
/// Counts on grids about the footprint, by a gate and a rounded normal number, below one flake a cell too.
pub const GATED: Shown = Shown { method: "deliot_belcour", own: &[] };

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let near_and_far: Vec<Sight> = distances(laboratory.inputs(1, 4) as i32).into_iter().map(seen_from).collect();
    let few_and_many: Vec<Sight> = [1e3, 1e6, 1e9, 1e12].into_iter().map(of_count).collect();
    let mut checks = Vec::new();
    for (what, sights) in [
        ("mean radiance of a surface from 1e-4 to 1e6 metres away", near_and_far),
        ("mean radiance with a thousand flakes in a square to 1e12", few_and_many),
    ] {
        let mut farthest_off = |shown: Shown| {
            let limit = limit(laboratory, shown)?;
            sights.iter().try_fold(0.0_f64, |worst, sight| {
                Ok::<f64, StabilityError>(worst.max((radiance_seen(laboratory, shown, *sight)? / limit - 1.0).abs()))
            })
        };
        checks.push(Check {
            what: what.to_owned(),
            error_of: "|mean over the picture / that of infinitely many flakes - 1|".to_owned(),
            inputs: sights.len() as u64,
            naive: Form::new("Deliot and Belcour 2023 as printed", farthest_off(GATED)?),
            stable: Form::new("every flake", farthest_off(EVERY_FLAKE)?),
            tolerance: 5e-3,
        });
    }
    Ok(checks)
}

/// Ten decades of distances, so many to a decade.
pub fn distances(to_a_decade: i32) -> Vec<f64> {
    (-4 * to_a_decade..=6 * to_a_decade).map(|step| 10_f64.powf(f64::from(step) / f64::from(to_a_decade))).collect()
}

/// Metres along each side of a picture from so far away.
fn width_from(distance: f64) -> f64 {
    2.0 * distance * (0.5 * FOV).tan()
}

/// The same surface from so far away.
pub fn seen_from(distance: f64) -> Sight {
    let squares_a_metre = (FEWEST / MOST_FLAKES).sqrt() / width_from(NEAREST);
    Sight { distance, squares: squares_a_metre * width_from(distance), count: MOST_FLAKES as u64 }
}

/// As many flakes in the picture as always, of so many in a square.
fn of_count(count: f64) -> Sight {
    let squares = (FEWEST / count).sqrt();
    let squares = if squares > 1.0 { squares.round() } else { squares };
    let count = if squares >= 1.0 { FEWEST / (squares * squares) } else { count };
    Sight { distance: 1.0, squares, count: count as u64 }
}

/// The mean radiance of the picture, as many flakes being there as are expected.
///
/// # Errors
/// Those of the device and the renderer.
pub fn radiance_seen(laboratory: &mut Laboratory, shown: Shown, sight: Sight) -> Result<f64, StabilityError> {
    /// More flakes than this are as many as expected, to a thousandth.
    const CERTAIN: f64 = 1e6;
    let width = width_from(sight.distance);
    let scale = sight.squares / width;
    // Triangles of a square of texture or more: near the camera is near beside them, too.
    let half = (0.6 * width).max(0.5 / scale);
    let plane = Plane { half: half as f32, uv: [0.0; 2], light: Some(DVec3::Y), environment: None };
    let all = [
        ("count", sight.count.to_string()),
        ("alpha", ALPHA.to_string()),
        ("gamma_deg", GAMMA_DEG.to_string()),
        ("seed", SEED.to_string()),
        ("uv_scale", scale.to_string()),
    ];
    let settings = [&all.each_ref().map(|(key, value)| (*key, value.as_str()))[..], shown.own].concat();
    let mut renderer = plane.renderer(shown.method, &settings)?;
    let eye = DVec3::Y * sight.distance;
    let camera = Camera::looking_at("above", eye, DVec3::ZERO, FOV, 0.1 * sight.distance);
    let pixels = radiance(laboratory, &mut renderer, &View::new(camera, [SIDE; 2]))?;
    let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;

    // Of a part of a square chance says how many are there.
    let expected = sight.count as f64 * sight.squares * sight.squares;
    if shown.method != EVERY_FLAKE.method || sight.squares >= 1.0 || expected > CERTAIN {
        return Ok(mean);
    }
    let mut present = 0.0;
    let corner = DVec2::splat(-0.5 * sight.squares);
    let sides = [DVec2::new(sight.squares, 0.0), DVec2::new(0.0, sight.squares)];
    FlakeSet::new(sight.count, ALPHA, SEED)?.for_each_in(&Footprint { corner, sides }, |_| present += 1.0);
    Ok(mean * expected / present)
}

/// What pictures show of infinitely many flakes: of every flake in f64; of other methods what they show themselves, as they
/// approximate the lobe, too.
///
/// # Errors
/// Those of the device and the renderer.
pub fn limit(laboratory: &mut Laboratory, shown: Shown) -> Result<f64, StabilityError> {
    if shown.method == EVERY_FLAKE.method { expected() } else { radiance_seen(laboratory, shown, seen_from(FARTHEST)) }
}

/// The mean over the picture of the BRDF over the cone: of one quarter, as the plane looks the same from all sides.
fn expected() -> Result<f64, StabilityError> {
    const STEPS: u32 = 6;
    let facets = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational)?;
    let i = local(DVec3::Y);
    let mut radiance = 0.0;
    for (x, y) in (0..STEPS).flat_map(|x| (0..STEPS).map(move |y| (x, y))) {
        let [x, z] = [x, y].map(|at| (f64::from(at) + 0.5) / f64::from(STEPS) * (0.5 * FOV).tan());
        let of = ConeMeans::new(&facets, i, local(DVec3::new(-x, 1.0, -z).normalize()), GAMMA_DEG.to_radians());
        radiance += of.discrete * i.z / f64::from(STEPS * STEPS);
    }
    Ok(radiance)
}
