//! H30. Environments: a sun in one texel, bad texels, poles, the seam.

use crate::stage::{Plane, local, radiance};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage};
use glam::{DMat3, DVec3};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::scene::{Camera, EquirectMap};
use mica_render::{Environment, View};
use mica_shaders::types::Operands;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::io::Cursor;

/// Pixels along each side of a picture, and the angle that it covers, in radians.
const SIDE: u32 = 48;
const FOV: f64 = 0.2;
/// Roughness and half-angle of the cone, in degrees: of 100 flakes 97 mirror the sun.
const ALPHA: f64 = 0.08;
const GAMMA_DEG: f64 = 20.0;
/// Radiance of the sun, where all else is dark.
const SUN: f32 = 1e6;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![
        sun_in_a_texel(laboratory)?,
        integral(laboratory),
        bad_texels(laboratory)?,
        poles(laboratory)?,
        rows(laboratory)?,
    ])
}

/// A map with a sun in one texel of a sky.
fn sunny([width, height]: [u32; 2], [column, row]: [u32; 2], sky: f32) -> EquirectMap {
    let mut map = EquirectMap { width, height, texels: vec![[sky; 3]; (width * height) as usize] };
    map.texels[(row * width + column) as usize] = [SUN; 3];
    map
}

/// The light of a map, its texels being what two meridians and two circles of latitude bound: by Archimedes as large as the
/// height between the circles.
fn light_of(map: &EquirectMap) -> f64 {
    let height = |row: usize| (PI * row as f64 / f64::from(map.height)).cos();
    let rows = map.texels.chunks_exact(map.width as usize).enumerate();
    let of_row = |(row, texels): (usize, &[[f32; 3]])| {
        texels.iter().map(|texel| f64::from(texel[1])).sum::<f64>() * (height(row) - height(row + 1))
    };
    rows.map(of_row).sum::<f64>() * TAU / f64::from(map.width)
}

/// Towards the middle of a texel: rows begin straight up, and columns at +Z, from where they turn by -X to -Z and +X.
fn middle_of([width, height]: [u32; 2], [column, row]: [u32; 2]) -> DVec3 {
    let turn = DMat3::from_rotation_y(-TAU * (f64::from(column) + 0.5) / f64::from(width));
    let down = DMat3::from_rotation_x(PI * (f64::from(row) + 0.5) / f64::from(height));
    turn * down * DVec3::Y
}

/// A square of texture with so many flakes, seen from straight above.
fn seen(
    laboratory: &mut Laboratory,
    method: &str,
    map: EquirectMap,
    own: &[(&str, &str)],
) -> Result<Vec<f64>, StabilityError> {
    let width = 2.0 * (0.5 * FOV).tan();
    let [scale, alpha, gamma] = [1.0 / width, ALPHA, GAMMA_DEG].map(|number| number.to_string());
    let all = [("uv_scale", scale.as_str()), ("alpha", &alpha), ("gamma_deg", &gamma), ("seed", "1")];
    let environment = Some(Environment { map, rotation_radians: 0.0 });
    let plane = Plane { half: 1.0, uv: [0.0; 2], light: None, environment };
    let mut renderer = plane.renderer(method, &[&all, own].concat())?;
    let camera = Camera::looking_at("above", DVec3::Y, DVec3::ZERO, FOV, 0.1);
    radiance(laboratory, &mut renderer, &View::new(camera, [SIDE; 2]))
}

/// The mean over flakes that see a small sun of this irradiance, each in f64: where it mirrors the view is within the cone about the
/// sun, or not.
fn mean_of_flakes(sun: DVec3, irradiance: f64) -> Result<f64, StabilityError> {
    const VIEWS: u32 = 6;
    const NORMALS: u32 = 300;
    let facets = Microfacets::new(Ndf::Beckmann, ALPHA, SmithFit::Rational)?;
    let gamma = GAMMA_DEG.to_radians();
    let solid_angle = 4.0 * PI * (0.5 * gamma).sin().powi(2);
    let sun = local(sun);
    let of_view = |view: u32| {
        let [x, z] = [view % VIEWS, view / VIEWS].map(|at| ((f64::from(at) + 0.5) / f64::from(VIEWS) - 0.5) * 2.0);
        let [x, z] = [x, z].map(|at| at * (0.5 * FOV).tan());
        let o = local(DVec3::new(-x, 1.0, -z).normalize());
        let mut sum = 0.0;
        for (ring, sector) in (0..NORMALS).flat_map(|ring| (0..NORMALS).map(move |sector| (ring, sector))) {
            // Of equal probability each.
            let share = (f64::from(ring) + 0.5) / f64::from(NORMALS);
            let slope = ALPHA * (-(1.0 - share).ln()).sqrt();
            let (sin, cos) = (TAU * (f64::from(sector) + 0.5) / f64::from(NORMALS)).sin_cos();
            let facet = DVec3::new(slope * cos, slope * sin, 1.0);
            let (weight, facet) = (facet.length(), facet.normalize());
            let mirrored = 2.0 * o.dot(facet) * facet - o;
            if mirrored.z > 0.0 && mirrored.angle_between(sun) <= gamma {
                let masking = facets.g1_over_cos(mirrored) * mirrored.z * facets.g1_over_cos(o);
                sum += weight * o.dot(facet) * masking;
            }
        }
        sum / f64::from(NORMALS * NORMALS)
    };
    let sum: f64 = (0..VIEWS * VIEWS).into_par_iter().map(of_view).sum();
    Ok(sum / f64::from(VIEWS * VIEWS) * irradiance / solid_angle)
}

/// The sun is a light of its own, and every flake that mirrors it shows it.
fn sun_in_a_texel(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    const SIZE: [u32; 2] = [512, 256];
    let place = [256, 5];
    let map = sunny(SIZE, place, 0.0);
    let truth = mean_of_flakes(middle_of(SIZE, place), light_of(&map))?;
    let count = (32 * SIDE * SIDE).to_string();
    let off = |pixels: Vec<f64>| (pixels.iter().sum::<f64>() / pixels.len() as f64 / truth - 1.0).abs();
    let own = [("count", count.as_str()), ("most", "200")];
    let stable = off(seen(laboratory, "flakes", map.clone(), &own)?);
    let own = [("count", count.as_str()), ("dpf", "closed"), ("samples", "1")];
    let naive = off(seen(laboratory, "wang2018", map, &own)?);
    Ok(Check {
        what: "a sun of radiance 1e6 in one texel of 512 x 256, all else dark".to_owned(),
        error_of: "|mean radiance / mean over flakes in f64 - 1|".to_owned(),
        inputs: u64::from(SIDE * SIDE),
        naive: Form::new("a direction drawn for each pixel", naive),
        stable: Form::new("parted from the map, a light", stable),
        // Of 74,000 flakes 3 % do not mirror the sun: .06 % by chance.
        tolerance: 5e-3,
    })
}

/// What is parted from a map and what is left hold its light; what is cut off at a bound is lost.
fn integral(laboratory: &Laboratory) -> Check {
    let mut random = Random::new(30);
    let (mut naive, mut stable): (f64, f64) = (0.0, 0.0);
    let maps = laboratory.inputs(20, 200);
    for _ in 0..maps {
        let mut map = sunny([128, 64], [0, 0], 1.0);
        for _ in 0..random.bits() % 5 {
            let texel = random.bits() as usize % map.texels.len();
            map.texels[texel] = [random.log_between(1e3, 1e6) as f32; 3];
        }
        let whole = light_of(&map);
        let (lights, rest) = map.part_small_lights();
        let sum = light_of(&rest) + lights.iter().map(|light| light.irradiance[1]).sum::<f64>();
        stable = stable.max((sum / whole - 1.0).abs());
        map.texels.iter_mut().for_each(|texel| *texel = texel.map(|channel| channel.min(1e3)));
        naive = naive.max((light_of(&map) / whole - 1.0).abs());
    }
    Check {
        what: "maps with one to five suns, at the seam and beside a pole too".to_owned(),
        error_of: "|light of the parts / light of the map - 1|".to_owned(),
        inputs: maps as u64,
        naive: Form::new("radiance above 1000 cut off", naive),
        stable: Form::new("suns and the rest", stable),
        tolerance: 1e-6,
    }
}

/// A file with texels that are not a number, infinite and negative, against the same map without repair.
fn bad_texels(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut map = sunny([64, 32], [32, 3], 0.5);
    map.texels[64] = [f32::NAN, 1.0, 1.0];
    map.texels[65] = [1.0, f32::NAN, -1.0];
    map.texels[700] = [f32::INFINITY; 3];
    let mut bytes = Vec::new();
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = map.texels[at.y() * 64 + at.x()];
        (r, g, b)
    });
    let written = Image::from_channels((64, 32), channels).write().to_buffered(Cursor::new(&mut bytes));
    written.map_err(|error| StabilityError::Missing(format!("an OpenEXR file in memory: {error}")))?;
    let (repaired, report) = EquirectMap::from_file_bytes("bad.exr", &bytes)?;
    // A pixel is wrong if it is no number, and all are if the texels were not counted.
    let counted = (report.nan_texels, report.infinite_texels, report.negative_texels, report.first_changed);
    let wrong = |pixels: &[f64]| pixels.iter().filter(|pixel| !pixel.is_finite()).count() as f64 / pixels.len() as f64;
    let own = [("count", "1000"), ("most", "0")];
    let stable = wrong(&seen(laboratory, "flakes", repaired, &own)?);
    // As it is, a texel spreads to all levels that are made from it.
    while map.width > 8 {
        map = map.half();
    }
    let naive = wrong(&map.texels.iter().map(|texel| f64::from(texel[0])).collect::<Vec<f64>>());
    Ok(Check {
        what: "a map with texels that are negative, infinite or not a number".to_owned(),
        error_of:
            "share of pixels (naive: of texels, three levels up) that are no number, or 1 if the texels are not told of"
                .to_owned(),
        inputs: u64::from(SIDE * SIDE),
        naive: Form::new("as it is", naive),
        stable: Form::new(
            "repaired and counted as it is loaded",
            if counted == (2, 1, 1, Some([0, 1])) { stable } else { 1.0 },
        ),
        tolerance: 0.0,
    })
}

/// Straight up and down, about the poles, at the seam, anywhere.
fn poles(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(33);
    let mut directions = Vec::new();
    for (y, zero) in [1.0, -1.0].into_iter().flat_map(|y| [0.0_f32, -0.0].map(|zero| (y, zero))) {
        directions.extend([[zero, y, 0.0], [zero, y, -0.0]]);
        // The seam, from both sides, and the centre of a row.
        directions.extend([[zero, 0.1 * y, 1.0], [zero, 0.1 * y, -1.0]]);
    }
    directions.extend((0..laboratory.inputs(50_000, 10_000_000)).map(|index| {
        if index % 2 == 0 {
            random.direction_about(DVec3::Z, PI).as_vec3().to_array()
        } else {
            let (turn, away) = (random.between(0.0, TAU), random.log_between(1e-11, 1.0));
            [(away * turn.cos()) as f32, 1.0, (away * turn.sin()) as f32]
        }
    }));
    let operands: Vec<Operands> =
        directions.iter().map(|&[x, y, z]| Operands { a: [x, y, z, 0.0], b: [0.0; 4], c: [0.0; 4] }).collect();
    // What an answer says is looked along, and held against the direction: around the horizon there is no end.
    let off = |values: Vec<f32>| {
        let apart = values.iter().zip(&directions).map(|(value, direction)| {
            let [x, _, z] = direction.map(f64::from);
            let (sin, cos) = (TAU * f64::from(*value)).sin_cos();
            // -Z is the middle, at half a turn; its right quarter, at three quarters, is +X.
            let (ahead, aside) = (cos * z - sin * x, cos * x + sin * z);
            if x == 0.0 && z == 0.0 { (f64::from(*value) - 0.5).abs() } else { aside.atan2(ahead).abs() / TAU }
        });
        apart.fold(0.0, |worst: f64, off| if off.is_nan() { f64::INFINITY } else { worst.max(off) })
    };
    let naive = off(laboratory.floats(&operands, arithmetic!(equirect_plain))?);
    let stable = off(laboratory.floats(&operands, arithmetic!(equirect_by_rule))?);
    Ok(Check {
        what: "where directions lie along a map: the poles, about them, the seam, anywhere".to_owned(),
        error_of: "turns between the direction and that of the answer in f64, the poles at half a turn by rule"
            .to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("atan(x, -z)", naive),
        stable: Form::new("a rule for the poles", stable),
        // 4096 ulp of up to half a turn, as Vulkan promises.
        tolerance: 2.5e-4,
    })
}

/// How far down the map directions lie, about the poles, where a cosine says little.
fn rows(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(34);
    let away: Vec<(f64, [f32; 3])> = (0..laboratory.inputs(50_000, 10_000_000))
        .map(|_| {
            let (turn, away) = (random.between(0.0, TAU), random.log_between(1e-6, 1.5));
            let direction = [away.sin() * turn.cos(), away.cos(), away.sin() * turn.sin()].map(|c| c as f32);
            // Of what f32 has: the angle from straight up by the half-angle formula, sqrt((1 - cos) / (1 + cos)).
            let at = DVec3::from(direction.map(f64::from));
            let horizontal = at.x.hypot(at.z);
            (2.0 * (horizontal / (at.length() + at.y)).atan() / PI, direction)
        })
        .collect();
    let operands: Vec<Operands> =
        away.iter().map(|(_, [x, y, z])| Operands { a: [*x, *y, *z, 0.0], b: [0.0; 4], c: [0.0; 4] }).collect();
    let truth: Vec<f64> = away.into_iter().map(|(truth, _)| truth).collect();
    let naive = worst_ratio(&laboratory.floats(&operands, arithmetic!(equirect_row_acos))?, &truth);
    let stable = worst_ratio(&laboratory.floats(&operands, arithmetic!(equirect_row))?, &truth);
    Ok(Check {
        what: "how far down a map directions lie, 1e-6 radians from straight up and more".to_owned(),
        error_of: "|place / place in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("acos(y) / pi", naive),
        stable: Form::new("atan(|xz|, y) / pi", stable),
        // 4096 ulp, as Vulkan promises of atan.
        tolerance: 5e-4,
    })
}
