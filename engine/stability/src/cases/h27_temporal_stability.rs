//! H27. The same frame twice; small motions.
//!
//! A flake keeps its place and its normal from frame to frame, and a count grows with its mean where the random word is the same. Flakes
//! that are drawn by the number of the frame boil, those drawn by the pixel stand still on the screen while the surface moves
//! on, and counts flicker where an acceptance test turns out otherwise.

use crate::stage::{Plane, local, radiance};
use crate::{Check, Form, Laboratory, StabilityError, bits};
use glam::{DQuat, DVec2, DVec3};
use mica_oracle::flake_set::{FlakeSet, Footprint, hash2, is_lit};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::scene::Camera;
use mica_render::{Renderer, View};
use mica_shaders::types::Words;
use rayon::prelude::*;

const SIZE: [u32; 2] = [96, 54];
const ALPHA: f64 = 0.3;
const GAMMA_DEG: f64 = 6.0;
const COUNT: u64 = 20_000;
const SEED: u32 = 5;
/// Frames of a path.
const FRAMES: u32 = 7;
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

/// The plane by every flake, its texture moved.
fn renderer(uv: [f32; 2]) -> Result<Renderer, StabilityError> {
    let plane = Plane { half: 40.0, uv, light: Some(SUN.normalize()), environment: None };
    let [count, alpha, gamma, seed] =
        [COUNT as f64, ALPHA, GAMMA_DEG, f64::from(SEED)].map(|number| number.to_string());
    let settings =
        [("count", count.as_str()), ("alpha", &alpha), ("gamma_deg", &gamma), ("seed", &seed), ("most", "500")];
    plane.renderer("flakes", &settings)
}

/// Makes the random numbers those of a frame.
fn seed_by_frame(renderer: &mut Renderer, frame: u32) -> Result<(), StabilityError> {
    Ok(renderer.set(None, "seed", &(SEED + frame).to_string())?)
}

fn camera(eye: DVec3, target: DVec3) -> Camera {
    Camera::looking_at("eye", eye, target, FOV, 0.01)
}

/// The same frame over and over again.
fn repeated(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let frames = laboratory.inputs(8, 1000) as u32;
    let view = View::new(camera(EYE, DVec3::ZERO), SIZE);
    let mut share_changed = |by_frame: bool| -> Result<f64, StabilityError> {
        let mut renderer = renderer([0.0; 2])?;
        let first = radiance(laboratory, &mut renderer, &view)?;
        let mut differing = 0;
        for frame in 1..frames {
            if by_frame {
                seed_by_frame(&mut renderer, frame)?;
            }
            let again = radiance(laboratory, &mut renderer, &view)?;
            differing += first.iter().zip(&again).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
        }
        Ok(differing as f64 / (f64::from(frames - 1) * first.len() as f64))
    };
    Ok(Check {
        what: "the same frame, again and again".to_owned(),
        error_of: "share of pixels with other bits than in the first frame".to_owned(),
        inputs: u64::from(frames),
        naive: Form::new("flakes by hashes of their place and of the frame's number", share_changed(true)?),
        stable: Form::new("flakes by hashes of their place", share_changed(false)?),
        tolerance: 0.0,
    })
}

/// Paths of less than a pixel a frame: how pixels change, against how they do where each flake is followed in f64.
fn moved(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let pan = |frame: f64| DQuat::from_rotation_y((0.01 * frame).to_radians());
    // A fifth of the width of the pixel in the middle.
    let step = 0.2 * EYE.length() * 2.0 * (0.5 * FOV).tan() / f64::from(SIZE[1]);
    let aside = |frame: f64| step * frame * DVec3::X;
    let frames = || (0..FRAMES).map(f64::from);
    let dolly: Path = frames().map(|frame| (EYE * (1.0 - 0.001 * frame), DVec3::ZERO)).collect();
    let track: Path = frames().map(|frame| (EYE + aside(frame), aside(frame))).collect();
    let pan: Path = frames().map(|frame| (EYE, EYE + pan(frame) * -EYE)).collect();
    let by_frame = "flakes by hashes of their place and of the frame's number";
    let by_pixel = "flakes by hashes of the pixel they are seen in";
    let mut checks = Vec::new();
    for (what, path, naive) in [
        ("a dolly by .1 % of the distance a frame", dolly, by_frame),
        ("a pan by .01 degrees a frame", pan, by_frame),
        ("a track by a fifth of a pixel a frame", track, by_pixel),
    ] {
        let truth: Vec<Vec<f64>> = path.iter().map(|(eye, target)| expected(*eye, *target)).collect();
        let mut seen = |form: &str| -> Result<Vec<Vec<f64>>, StabilityError> {
            let mut kept = renderer([0.0; 2])?;
            let mut pictures = Vec::new();
            for ((eye, target), frame) in path.iter().zip(0..) {
                if form == by_pixel {
                    // The texture goes with the camera: a pixel shows the same flakes in each frame.
                    kept = renderer([-target.x as f32, -target.z as f32])?;
                } else if form == by_frame {
                    seed_by_frame(&mut kept, frame)?;
                }
                pictures.push(radiance(laboratory, &mut kept, &View::new(camera(*eye, *target), SIZE))?);
            }
            Ok(pictures)
        };
        let [naive_seen, stable_seen] = [naive, "flakes by hashes of their place"].map(&mut seen);
        checks.push(Check {
            what: what.to_owned(),
            error_of: "energy of what frames change by beside the flakes in f64, over that of what those do".to_owned(),
            inputs: u64::from(FRAMES * SIZE[0] * SIZE[1]),
            naive: Form::new(naive, strayed(&naive_seen?, &truth)),
            stable: Form::new("flakes by hashes of their place", strayed(&stable_seen?, &truth)),
            // A fifth of what the list of cases allows. Flakes at edges may be on either side of them in f32.
            tolerance: 0.02,
        });
    }
    Ok(checks)
}

/// Where the eye is in each frame, and what it looks at.
type Path = Vec<(DVec3, DVec3)>;

/// The sum of squares of how a picture's change from frame to frame differs from the truth's, over that of the truth's.
fn strayed(pictures: &[Vec<f64>], truth: &[Vec<f64>]) -> f64 {
    let (mut beside, mut own) = (0.0, 0.0);
    for (pictures, truth) in pictures.windows(2).zip(truth.windows(2)) {
        for pixel in 0..truth[0].len() {
            let [seen, known] = [pictures, truth].map(|of| of[1][pixel] - of[0][pixel]);
            beside += (seen - known).powi(2);
            own += known.powi(2);
        }
    }
    beside / own
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
