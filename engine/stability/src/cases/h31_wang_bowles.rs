//! H31. Sparkle of Wang and Bowles: levels, normalisation, normal incidence.

use crate::random::turned;
use crate::stage::{Plane, radiance};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_difference, worst_ratio};
use glam::DVec3;
use mica_render::View;
use mica_render::scene::Camera;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![distances(laboratory)?, shifts(laboratory)?, stretches(laboratory)?, motion(laboratory)?])
}

fn four(v: DVec3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

/// The distances that stand for levels: as printed, that of the nearest is about -1e-8, and the grid infinitely fine.
fn distances(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let levels = 1..=40_i32;
    let operands: Vec<Operands> =
        levels.clone().map(|level| Operands { a: [level as f32, 0.0, 0.0, 0.0], b: [0.0; 4], c: [0.0; 4] }).collect();
    let truth: Vec<f64> = levels.map(|level| 0.1 * f64::powi(2.0, level.max(2)) - 0.2).collect();
    let naive = laboratory.floats(&operands, arithmetic!(sparkle_distance_printed))?;
    let stable = laboratory.floats(&operands, arithmetic!(sparkle_distance))?;
    Ok(Check {
        what: "distances of levels 1 to 40".to_owned(),
        error_of: "|distance / that of level 2 or above in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("0.1 * 1.3^(k / log2 1.3) - 0.2", worst_ratio(&naive, &truth)),
        stable: Form::new("0.1 * 2^max(k, 2) - 0.2, 2^k exact", worst_ratio(&stable, &truth)),
        tolerance: 3e-7,
    })
}

/// The view's shift of the grid is a unit vector, also where all of the view's components times the distance are whole.
fn shifts(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(31);
    let whole = |level: i32| 0.1 * f64::powi(2.0, level) - 0.2;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    // Along the axes the distances 3 and 51 of levels 5 and 9 are whole, and so are many of a triple of Pythagoras.
    let views = axes.chain([DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, -0.28, 0.96)]);
    let mut operands: Vec<Operands> = views
        .flat_map(|view| (2..=20).map(whole).chain((1..=100).map(f64::from)).map(move |distance| (view, distance)))
        .map(|(view, distance)| Operands { a: four(view, distance), b: [0.0; 4], c: [0.0; 4] })
        .collect();
    operands.extend((0..laboratory.inputs(50_000, 10_000_000)).map(|_| {
        let level = 2 + (random.bits() % 19) as i32;
        Operands { a: four(random.direction_about(DVec3::Z, PI), whole(level)), b: [0.0; 4], c: [0.0; 4] }
    }));
    let truth = vec![0.0; operands.len()];
    let naive = laboratory.floats(&operands, arithmetic!(sparkle_shift_printed))?;
    let stable = laboratory.floats(&operands, arithmetic!(sparkle_shift))?;
    Ok(Check {
        what: "shifts by views along the axes and any others".to_owned(),
        error_of: "|length - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("normalize(fract(v z))", worst_difference(&naive, &truth)),
        stable: Form::new("the view itself where its fractions vanish", worst_difference(&stable, &truth)),
        // inversesqrt and length are within 2 and 4 ulp.
        tolerance: 5e-7,
    })
}

/// The stretch by which sparkles look round, from normal incidence to the horizon.
fn stretches(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(32);
    let operands: Vec<Operands> = (0..laboratory.inputs(50_000, 10_000_000))
        .map(|index| {
            let normal = random.direction_about(DVec3::Z, PI);
            let angle = if index % 50 == 0 { 0.0 } else { random.log_between(1e-5, 1.57) };
            Operands {
                a: four(turned(normal, angle, random.between(0.0, TAU)), 0.0),
                b: four(normal, 0.0),
                c: [0.0; 4],
            }
        })
        .collect();
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let [view, normal] = [of.a, of.b].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()).normalize());
            -1.0 / (1.0 + view.dot(normal).abs())
        })
        .collect();
    let naive = laboratory.floats(&operands, arithmetic!(sparkle_stretch_printed))?;
    let stable = laboratory.floats(&operands, arithmetic!(sparkle_stretch))?;
    Ok(Check {
        what: "stretches of sparkles, 0 to 90 degrees from the normal".to_owned(),
        error_of: "|stretch / stretch in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("(|c| - 1) / |v - c n|^2", worst_ratio(&naive, &truth)),
        stable: Form::new("-1 / (1 + |c|)", worst_ratio(&stable, &truth)),
        tolerance: 5e-7,
    })
}

/// Sparkles from a little nearer, across the distance where the level changes. The view does not turn the grid here,
/// as its fract jumps by design.
fn motion(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const SIDE: u32 = 48;
    // 0.3 z + 3 is 64 in units of a centimetre; the plane is straight below, at one distance from the eye within 1e-4.
    let switch = 0.01 * (64.0 - 3.0) / 0.3;
    let plane =
        Plane { half: 2.0, uv: [0.0; 2], light: Some(DVec3::new(0.1, 1.0, 0.2).normalize()), environment: None };
    let mut change_of = |repaired: &str, distances: [f64; 2]| {
        let settings = [("repaired", repaired), ("twinkle", "0"), ("sparkle_size", "0.6"), ("count", "1e7")];
        let mut renderer = plane.renderer("wang_bowles", &settings)?;
        let pictures = distances.map(|distance| {
            let camera = Camera::looking_at("above", DVec3::Y * distance, DVec3::ZERO, 0.02, 0.01);
            radiance(laboratory, &mut renderer, &View::new(camera, [SIDE; 2]))
        });
        let [before, after] = pictures;
        let (before, after) = (before?, after?);
        let change: f64 = before.iter().zip(&after).map(|(before, after)| (before - after).abs()).sum();
        Ok::<f64, StabilityError>(change / before.iter().sum::<f64>())
    };
    let across = [1.0 + 5e-5, 1.0 - 5e-5].map(|factor| factor * switch);
    Ok(Check {
        what: "a dolly by 1e-4 of the distance across a change of level".to_owned(),
        error_of: "sum of |change of a pixel| / sum of the pixels".to_owned(),
        inputs: u64::from(SIDE * SIDE),
        naive: Form::new("one level at a time", change_of("false", across)?),
        stable: Form::new("two levels blended", change_of("true", across)?),
        // A sparkle is as wide as some pixels: one that moves by 2e-3 of a pixel changes by as much.
        tolerance: 0.02,
    })
}
