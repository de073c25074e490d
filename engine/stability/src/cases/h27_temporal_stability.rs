//! H27. The same frame twice; small motions.
//!
//! A flake keeps its place and its normal from frame to frame, and a count grows with its mean where the random word is the same. Forms
//! that draw anew, as soon as a direction passes a whole degree or an acceptance test turns out otherwise, flicker.

use crate::plane::{Plane, local, radiance};
use crate::{Check, Form, Laboratory, StabilityError, bits};
use glam::{DQuat, DVec2, DVec3};
use mica_oracle::flake_set::{FlakeSet, Footprint, hash2, is_lit};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::View;
use mica_render::scene::Camera;
use mica_shaders::types::Words;
use rayon::prelude::*;

const SIZE: [u32; 2] = [96, 54];
const ALPHA: f64 = 0.3;
const GAMMA_DEG: f64 = 6.0;
const COUNT: u64 = 20_000;
const SEED: u32 = 5;
/// Angle from the lower to the upper edge of the picture, radians.
const FOV: f64 = 0.5;
const EYE: DVec3 = DVec3::new(0.0, 2.0, 2.4);
const SUN: DVec3 = DVec3::new(0.2, 0.8, -0.6);

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut checks = vec![repeated(laboratory)?];
    checks.extend(moved(laboratory)?);
    checks.push(coupled(laboratory)?);
    Ok(checks)
}

fn plane() -> Plane {
    Plane { half: 40.0, uv: [0.0; 2], light: Some(SUN.normalize()), environment: None }
}

fn renderer(method: &str, own: &[(&str, &str)]) -> Result<mica_render::Renderer, StabilityError> {
    let [count, alpha, gamma] = [COUNT as f64, ALPHA, GAMMA_DEG].map(|number| number.to_string());
    let seed = SEED.to_string();
    let all = [("count", count.as_str()), ("alpha", &alpha), ("gamma_deg", &gamma), ("seed", &seed)];
    plane().renderer(method, &[&all, own].concat())
}

fn camera(eye: DVec3, target: DVec3) -> Camera {
    Camera::looking_at("eye", eye, target, FOV, 0.01)
}

/// The same frame over and over again, and a form whose words change with the frame.
fn repeated(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let frames = laboratory.inputs(8, 1000);
    let view = View::new(camera(EYE, DVec3::ZERO), SIZE);
    let mut every_flake = renderer("flakes", &[("most", "500")])?;
    let first = radiance(laboratory, &mut every_flake, &view)?;
    let mut differing = 0;
    for _ in 1..frames {
        let again = radiance(laboratory, &mut every_flake, &view)?;
        differing += first.iter().zip(&again).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    }
    // Seeds of their own stand for words drawn anew.
    let mut anew = renderer("flakes", &[("most", "500"), ("seed", "6")])?;
    let drawn = radiance(laboratory, &mut anew, &view)?;
    let changed = first.iter().zip(&drawn).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    let pixels = (frames - 1) as f64 * first.len() as f64;
    Ok(Check {
        what: "the same frame, again and again".to_owned(),
        error_of: "share of pixels with other bits than in the first frame".to_owned(),
        inputs: frames as u64,
        naive: Form::new("flakes drawn anew", changed as f64 / first.len() as f64),
        stable: Form::new("flakes by hashes of their place", differing as f64 / pixels),
        tolerance: 0.0,
    })
}

/// A dolly by .1 % of the distance and a pan by .01 degrees: how much pixels change, against how much the flakes do.
fn moved(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let pan = DQuat::from_rotation_y(0.01_f64.to_radians());
    let motions = [
        ("a dolly by .1 % of the distance", [(EYE, DVec3::ZERO), (EYE * 0.999, DVec3::ZERO)]),
        ("a pan by .01 degrees", [(EYE, DVec3::ZERO), (EYE, EYE + pan * -EYE)]),
    ];
    let mut checks = Vec::new();
    for (what, places) in motions {
        let of_flakes = change(&places.map(|(eye, target)| expected(eye, target)));
        let mut of_method = |method: &str, own: &[(&str, &str)]| {
            let mut renderer = renderer(method, own)?;
            let [before, after] =
                places.map(|(eye, target)| radiance(laboratory, &mut renderer, &View::new(camera(eye, target), SIZE)));
            let change = change(&[before?, after?]);
            Ok::<f64, StabilityError>((change / of_flakes - 1.0).abs())
        };
        checks.push(Check {
            what: what.to_owned(),
            error_of: "|sum of |change of a pixel| / sum of pixels, over the same of the flakes in f64, - 1|"
                .to_owned(),
            inputs: u64::from(SIZE[0] * SIZE[1]),
            naive: Form::new(
                "counts drawn anew for each whole degree",
                of_method("wang2018", &[("dpf", "closed"), ("samples", "1")])?,
            ),
            stable: Form::new("every flake", of_method("flakes", &[("most", "500")])?),
            // A fifth of what the list of cases allows. Flakes at edges may be on either side of them in f32.
            tolerance: 0.02,
        });
    }
    Ok(checks)
}

/// By how much the second picture differs from the first.
fn change([before, after]: &[Vec<f64>; 2]) -> f64 {
    let sum: f64 = before.iter().zip(after).map(|(before, after)| (after - before).abs()).sum();
    sum / before.iter().sum::<f64>()
}

/// Radiance of every pixel, flake by flake in f64.
fn expected(eye: DVec3, target: DVec3) -> Vec<f64> {
    let Ok(set) = FlakeSet::new(COUNT, ALPHA, SEED) else { return Vec::new() };
    let Ok(facets) = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational) else { return Vec::new() };
    let i = local(SUN.normalize());
    let sin2 = (0.5 * GAMMA_DEG.to_radians()).sin().powi(2);
    let backwards = (eye - target).normalize();
    let right = DVec3::Y.cross(backwards).normalize();
    let up = backwards.cross(right);
    let [width, height] = SIZE.map(f64::from);
    let pixel = 2.0 * (0.5 * FOV).tan() / height;
    let of_pixel = |index: u32| {
        let [x, y] = [index % SIZE[0], index / SIZE[0]].map(|at| f64::from(at) + 0.5);
        let ray = (x - 0.5 * width) * pixel * right - (y - 0.5 * height) * pixel * up - backwards;
        let point = eye - eye.y / ray.y * ray;
        let sides = [right * pixel, -up * pixel].map(|change| {
            // d(eye + ray t) along the plane.
            let moved = -eye.y / ray.y * (change - ray / ray.y * change.y);
            DVec2::new(moved.x, moved.z)
        });
        let o = local((eye - point).normalize());
        let footprint = Footprint { corner: DVec2::new(point.x, point.z) - 0.5 * (sides[0] + sides[1]), sides };
        let mut lit = 0.0;
        set.for_each_in(&footprint, |flake| lit += if is_lit(flake.normal, i, o, sin2) { flake.weight() } else { 0.0 });
        let shadowing = facets.g1_over_cos(i) * facets.g1_over_cos(o);
        lit / (COUNT as f64 * footprint.area() * 4.0 * std::f64::consts::PI * sin2)
            * 0.5
            * (i + o).length()
            * shadowing
            * i.z
    };
    (0..SIZE[0] * SIZE[1]).into_par_iter().map(of_pixel).collect()
}

/// Counts where the probability grows by a thousandth and the random word stays.
fn coupled(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const FLAKES: f32 = 1e9;
    let words = laboratory.inputs(20_000, 2_000_000) as u32;
    let means = [20.0_f32, 100.0, 1e4];
    let asked = |factor: f32, of: &dyn Fn(f32, u32) -> Words| -> Vec<Words> {
        means
            .iter()
            .flat_map(|mean| (0..words).map(move |index| (*mean, index)))
            .map(|(mean, index)| of(mean * factor, index))
            .collect()
    };
    let inverted = |mean: f32, index: u32| Words {
        a: [hash2(index, 7), FLAKES.to_bits(), (mean / FLAKES).to_bits(), 0],
        b: [0; 4],
    };
    let rejected = |mean: f32, index: u32| Words { a: [mean.to_bits(), hash2(index, 7), 0, 0], b: [0; 4] };
    // What a count moves by beyond the step of its mean and its rounding, in standard deviations.
    let farthest = |before: &[[u32; 4]], after: &[[u32; 4]]| {
        let jump = |(index, (before, after)): (usize, (&[u32; 4], &[u32; 4]))| {
            let mean = f64::from(means[index / words as usize]);
            let moved = f64::from(f32::from_bits(after[0])) - f64::from(f32::from_bits(before[0]));
            (moved - 1e-3 * mean).abs().max(1.0) / mean.sqrt() - 1.0 / mean.sqrt()
        };
        before.iter().zip(after).enumerate().map(jump).fold(0.0, f64::max)
    };
    let stable = [1.0, 1.001].map(|factor| laboratory.words(&asked(factor, &inverted), bits!(count_inverted)));
    let naive = [1.0, 1.001].map(|factor| laboratory.words(&asked(factor, &rejected), bits!(rejected_count)));
    let [stable, naive] = [stable, naive].map(|[before, after]| Ok::<f64, StabilityError>(farthest(&before?, &after?)));
    Ok(Check {
        what: "counts of mean 20 to 10,000 where the probability grows by .1 %".to_owned(),
        error_of: "what a count moves by beyond its mean and 1 flake, in standard deviations".to_owned(),
        inputs: means.len() as u64 * u64::from(words),
        naive: Form::new("transformed rejection", naive?),
        stable: Form::new("the quantile of the same word", stable?),
        tolerance: 0.05,
    })
}
