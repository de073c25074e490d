//! Environments made by formula: skies and a studio, in linear radiance for an exposure of 1.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

use crate::scene::EquirectMap;

/// Name and description of every procedural environment.
pub const NAMES: &[(&str, &str)] = &[
    ("overcast", "CIE overcast sky of zenith radiance 1 over grey ground; no shadows, no sun"),
    ("clear", "CIE clear sky with a sun of physical contrast 32 degrees high, over dry ground"),
    ("studio", "dark room with four soft boxes, large to small and warm to cool, and a dim fill"),
    ("dusk", "deep blue sky over a warm horizon; the sun's own disc is left to the scene's lights"),
];

/// Angular radius of the sun, radians: 0.2665 degrees, as seen from the earth on average.
pub const SUN_ANGULAR_RADIUS: f64 = 0.2665 * PI / 180.0;
/// Towards the sun of `clear`, unit: 32 degrees high, 24 degrees to the right of -Z.
pub const SUN_DIRECTION: DVec3 = DVec3::new(0.344_932_236, 0.529_919_264, -0.774_730_486);
/// What the sun of `clear` gives a surface that faces it, linear RGB.
pub const SUN_IRRADIANCE: DVec3 = DVec3::new(4.4, 4.0, 3.35);

/// Horizontal irradiance of the sky of `clear` without its sun, as luminance.
const CLEAR_SKY_IRRADIANCE: f64 = 1.0;
/// Azimuth of the glow of `dusk`, unit and level: 30 degrees to the left of -Z.
const DUSK_GLOW: DVec3 = DVec3::new(-0.5, 0.0, -0.866_025_4);

/// The environment of that name, or `None` when [`NAMES`] does not list it. Pure: the same texels every time.
pub fn environment(name: &str) -> Option<EquirectMap> {
    match name {
        "overcast" => Some(paint(512, 256, overcast)),
        "clear" => Some(clear()),
        "studio" => Some(paint(1024, 512, studio)),
        "dusk" => Some(paint(512, 256, dusk)),
        _ => None,
    }
}

/// Evaluates a radiance at every texel's centre.
fn paint(width: u32, height: u32, radiance: impl Fn(DVec3) -> DVec3) -> EquirectMap {
    let mut texels = Vec::with_capacity((width * height) as usize);
    let azimuths: Vec<_> = (0..width).map(|x| ((f64::from(x) + 0.5) / f64::from(width) - 0.5) * TAU).collect();
    let azimuths: Vec<_> = azimuths.into_iter().map(f64::sin_cos).collect();
    for y in 0..height {
        let (ring, up) = ((f64::from(y) + 0.5) / f64::from(height) * PI).sin_cos();
        for (sin, cos) in &azimuths {
            texels.push(radiance(DVec3::new(ring * sin, up, -ring * cos)).as_vec3().to_array());
        }
    }
    EquirectMap { width, height, texels }
}

/// Solid angle of a texel of row `y`, steradians.
fn texel_solid_angle(width: u32, height: u32, y: u32) -> f64 {
    let edge = |row: u32| (f64::from(row) / f64::from(height) * PI).cos();
    TAU / f64::from(width) * (edge(y) - edge(y + 1))
}

fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Sky above and ground below, met in a degree of haze so that the horizon does not alias.
fn over_ground(direction: DVec3, sky: DVec3, ground: DVec3) -> DVec3 {
    ground.lerp(sky, smoothstep(-0.01, 0.01, direction.y))
}

/// Moon and Spencer's overcast sky, (1 + 2 sin(elevation)) / 3 of the zenith (CIE S 011, type 1 in its old form). Its
/// horizontal irradiance is 7 pi / 9, of which the ground returns a fifth.
fn overcast(direction: DVec3) -> DVec3 {
    let tint = DVec3::new(0.97, 1.0, 1.05);
    let sky = tint * ((1.0 + 2.0 * direction.y.max(0.0)) / 3.0);
    over_ground(direction, sky, DVec3::new(0.21, 0.20, 0.185) * (7.0 / 9.0))
}

/// Relative radiance of the CIE standard clear sky, type 12 (CIE S 011/E:2003, low turbidity): gradation by the cosine
/// of the zenith angle, times indicatrix by the angle to the sun in radians. Not normalised.
fn cie_clear(cos_zenith: f64, sun_angle: f64) -> f64 {
    let gradation = 1.0 - (-0.32 / cos_zenith.max(0.01)).exp();
    let indicatrix = 1.0 + 10.0 * ((-3.0 * sun_angle).exp() - (-1.5 * PI).exp()) + 0.45 * sun_angle.cos().powi(2);
    gradation * indicatrix
}

/// The clear sky with its sun. The disc's texels get its radiance times the part of them that it covers, and then the
/// common factor that makes their sum the intended irradiance, so the energy is right whatever the resolution.
fn clear() -> EquirectMap {
    let (width, height) = (1024, 512);
    // Horizontal irradiance of the relative sky: a sum over rings and sectors, smooth enough for few of them.
    let (rings, sectors) = (64, 64);
    let mut relative_irradiance = 0.0;
    for ring in 0..rings {
        // Equal steps of the squared sine are equal steps of projected solid angle.
        let sin2 = (f64::from(ring) + 0.5) / f64::from(rings);
        for sector in 0..sectors {
            let (sin, cos) = ((f64::from(sector) + 0.5) / f64::from(sectors) * TAU).sin_cos();
            let d = DVec3::new(sin2.sqrt() * sin, (1.0 - sin2).sqrt(), sin2.sqrt() * cos);
            relative_irradiance += cie_clear(d.y, d.angle_between(SUN_DIRECTION)) * PI / f64::from(rings * sectors);
        }
    }
    let scale = CLEAR_SKY_IRRADIANCE / relative_irradiance;
    let ground_irradiance = SUN_IRRADIANCE * SUN_DIRECTION.y + DVec3::new(0.75, 1.0, 1.6) * CLEAR_SKY_IRRADIANCE;
    let ground = ground_irradiance * DVec3::new(0.22, 0.19, 0.15) / PI;
    let mut map = paint(width, height, |d| {
        let sun_angle = d.dot(SUN_DIRECTION).clamp(-1.0, 1.0).acos();
        // Scattering by air is blue, by haze (at the horizon and about the sun) nearly white.
        let haze = ((1.0 - d.y.max(0.0)).powi(5) * 0.75 + 0.8 * (-7.0 * sun_angle).exp()).min(1.0);
        let tint = DVec3::new(0.52, 0.98, 2.05).lerp(DVec3::new(0.96, 1.0, 1.08), haze);
        over_ground(d, tint * (cie_clear(d.y, sun_angle) * scale), ground)
    });
    add_disc(&mut map, SUN_DIRECTION, SUN_ANGULAR_RADIUS, SUN_IRRADIANCE);
    map
}

/// Adds a disc of even radiance about a unit direction, in all giving `irradiance` to a surface that faces it.
fn add_disc(map: &mut EquirectMap, towards: DVec3, angular_radius: f64, irradiance: DVec3) {
    const SUBSAMPLES: u32 = 16;
    let cos_radius = angular_radius.cos();
    let mut covered = Vec::new();
    let mut total = 0.0;
    for y in 0..map.height {
        let elevation = PI / 2.0 - (f64::from(y) + 0.5) / f64::from(map.height) * PI;
        if (elevation - towards.y.asin()).abs() > angular_radius + PI / f64::from(map.height) {
            continue;
        }
        for x in 0..map.width {
            let mut inside = 0;
            for sub in 0..SUBSAMPLES * SUBSAMPLES {
                let at = |whole: u32, part: u32| f64::from(whole) + (f64::from(part) + 0.5) / f64::from(SUBSAMPLES);
                let azimuth = (at(x, sub % SUBSAMPLES) / f64::from(map.width) - 0.5) * TAU;
                let (ring, up) = (at(y, sub / SUBSAMPLES) / f64::from(map.height) * PI).sin_cos();
                let d = DVec3::new(ring * azimuth.sin(), up, -ring * azimuth.cos());
                inside += u32::from(d.dot(towards) >= cos_radius);
            }
            if inside > 0 {
                let coverage = f64::from(inside) / f64::from(SUBSAMPLES * SUBSAMPLES);
                covered.push((y * map.width + x, coverage));
                total += coverage * texel_solid_angle(map.width, map.height, y);
            }
        }
    }
    for (index, coverage) in covered {
        let radiance = irradiance * (coverage / total);
        let texel = &mut map.texels[index as usize];
        for (channel, added) in texel.iter_mut().zip(radiance.to_array()) {
            *channel += added as f32;
        }
    }
}

/// A lamp behind a stretched cloth: a rectangle one unit away in direction `towards`.
struct SoftBox {
    towards: DVec3,
    /// Half width and half height at unit distance.
    half: DVec2,
    /// Turned about its own axis, radians.
    roll: f64,
    /// In its middle; it falls to 70 % towards the corners, as the cloth of a real one does.
    radiance: DVec3,
}

const SOFT_BOXES: [SoftBox; 4] = [
    // Key: large and warm, high to the left of the camera.
    SoftBox {
        towards: DVec3::new(-0.62, 0.60, 0.50),
        half: DVec2::new(0.42, 0.30),
        roll: 0.0,
        radiance: DVec3::new(6.2, 5.8, 5.1),
    },
    // Strip: tall, narrow and cool, to the right.
    SoftBox {
        towards: DVec3::new(0.93, 0.25, 0.25),
        half: DVec2::new(0.10, 0.55),
        roll: 0.12,
        radiance: DVec3::new(6.0, 7.0, 8.4),
    },
    // Top: overhead, a little behind.
    SoftBox {
        towards: DVec3::new(0.12, 0.94, -0.32),
        half: DVec2::new(0.38, 0.20),
        roll: 0.3,
        radiance: DVec3::new(4.2, 4.2, 4.4),
    },
    // Rim: small and hot, behind to the left; what jewellery sparkles by.
    SoftBox {
        towards: DVec3::new(-0.45, 0.42, -0.79),
        half: DVec2::new(0.09, 0.09),
        roll: 0.0,
        radiance: DVec3::new(34.0, 31.0, 26.0),
    },
];

/// Soft boxes in a room whose ceiling is a little lighter than its floor.
fn studio(direction: DVec3) -> DVec3 {
    let fill = DVec3::new(0.055, 0.058, 0.066) * (1.0 + 0.9 * direction.y);
    SOFT_BOXES.iter().fold(fill, |radiance, lamp| radiance + lamp.radiance * soft_box(lamp, direction))
}

/// What part of a soft box's middle radiance is seen along a direction.
fn soft_box(lamp: &SoftBox, direction: DVec3) -> f64 {
    let towards = lamp.towards.normalize();
    let facing = direction.dot(towards);
    if facing <= 0.1 {
        return 0.0;
    }
    let level = towards.cross(DVec3::Y).normalize();
    let upright = level.cross(towards);
    let (sin, cos) = lamp.roll.sin_cos();
    let plane = DVec2::new(direction.dot(level), direction.dot(upright)) / facing;
    let at = DVec2::new(plane.x * cos + plane.y * sin, plane.y * cos - plane.x * sin);
    let edge = 0.12 * lamp.half.min_element();
    let inside = |x: f64, half: f64| 1.0 - smoothstep(half - edge, half + edge, x.abs());
    let relative = at / lamp.half;
    let falloff = 1.0 - 0.15 * relative.length_squared().min(2.0);
    inside(at.x, lamp.half.x) * inside(at.y, lamp.half.y) * falloff
}

/// The last light: bands of colour by elevation, warmer and brighter towards the glow.
fn dusk(direction: DVec3) -> DVec3 {
    let elevation = direction.y.max(0.0);
    let level = DVec3::new(direction.x, 0.0, direction.z).normalize_or_zero();
    let towards = 0.5 + 0.5 * level.dot(DUSK_GLOW);
    let zenith = DVec3::new(0.10, 0.17, 0.36);
    let middle = DVec3::new(0.22, 0.30, 0.50).lerp(DVec3::new(0.52, 0.46, 0.50), towards.powi(2));
    let horizon = DVec3::new(0.40, 0.38, 0.52).lerp(DVec3::new(1.9, 1.02, 0.48), towards.powi(3));
    let upper = middle.lerp(zenith, smoothstep(0.12, 0.85, elevation));
    let sky = horizon.lerp(upper, 1.0 - (-elevation / 0.11).exp());
    // The glow proper, about where the sun stands behind its veil.
    let sun = (DUSK_GLOW + DVec3::Y * 0.2).normalize();
    let glow = DVec3::new(3.4, 2.1, 1.0) * (-direction.dot(sun).clamp(-1.0, 1.0).acos() * 5.5).exp();
    over_ground(direction, sky + glow, DVec3::new(0.17, 0.17, 0.21))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral over the sphere of radiance times `weight(direction)`.
    fn integral(map: &EquirectMap, weight: impl Fn(DVec3) -> f64) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for y in 0..map.height {
            let solid_angle = texel_solid_angle(map.width, map.height, y);
            let (ring, up) = ((f64::from(y) + 0.5) / f64::from(map.height) * PI).sin_cos();
            for x in 0..map.width {
                let (sin, cos) = (((f64::from(x) + 0.5) / f64::from(map.width) - 0.5) * TAU).sin_cos();
                let texel = map.texels[(y * map.width + x) as usize];
                let radiance = DVec3::new(texel[0].into(), texel[1].into(), texel[2].into());
                sum += radiance * solid_angle * weight(DVec3::new(ring * sin, up, -ring * cos));
            }
        }
        sum
    }

    fn luminance(rgb: DVec3) -> f64 {
        rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
    }

    #[test]
    fn every_named_environment_exists_and_holds_only_light() {
        for (name, _) in NAMES {
            let map = environment(name).expect("a listed environment exists");
            assert_eq!(map.texels.len(), (map.width * map.height) as usize, "{name}");
            assert!(map.texels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "{name}");
            let irradiance = luminance(integral(&map, |d| d.y.max(0.0)));
            assert!((0.7..6.0).contains(&irradiance), "{name}: {irradiance} is no light for an exposure of 1");
        }
        assert!(environment("noon").is_none());
    }

    #[test]
    fn overcast_has_the_irradiance_of_its_formula() {
        let map = environment("overcast").expect("listed");
        let green = integral(&map, |d| d.y.max(0.0)).y;
        assert!((green / (7.0 * PI / 9.0) - 1.0).abs() < 0.005, "{green}");
    }

    #[test]
    fn the_sun_has_its_energy_and_its_contrast() {
        let map = environment("clear").expect("listed");
        let near = |d: DVec3| d.angle_between(SUN_DIRECTION) < 0.02;
        let disc = integral(&map, |d| f64::from(near(d)));
        // The sky behind the disc is in the integral too: its radiance times the solid angle looked at.
        let sky = integral(&map, |d| {
            let angle = d.angle_between(SUN_DIRECTION);
            f64::from((0.02..0.04).contains(&angle))
        }) / 3.0;
        let ratio = (disc - sky) / SUN_IRRADIANCE;
        assert!((ratio - DVec3::ONE).abs().max_element() < 0.01, "{ratio}");
        let brightest = map.texels.iter().map(|t| f64::from(t[1])).fold(0.0, f64::max);
        let away = SUN_DIRECTION * DVec3::new(-1.0, 1.0, -1.0);
        let opposite = integral(&map, |d| f64::from(d.angle_between(away) < 0.1)).y / (PI * 0.01);
        assert!((1e4..1e6).contains(&(brightest / opposite)), "contrast {}", brightest / opposite);
    }

    #[test]
    fn the_sun_outshines_its_sky_three_to_five_times() {
        let map = environment("clear").expect("listed");
        let sky = luminance(integral(&map, |d| d.y.max(0.0) * f64::from(d.angle_between(SUN_DIRECTION) > 0.02)));
        assert!((3.0..5.0).contains(&(luminance(SUN_IRRADIANCE) / sky)), "sky {sky}");
    }

    #[test]
    fn a_disc_keeps_its_energy_at_any_resolution_and_place() {
        for height in [16, 64, 250] {
            for towards in [SUN_DIRECTION, DVec3::NEG_Z, DVec3::Z, DVec3::new(0.1, 0.99, 0.05).normalize()] {
                let mut map = paint(2 * height, height, |_| DVec3::ZERO);
                add_disc(&mut map, towards, 0.02, DVec3::new(1.0, 2.0, 3.0));
                let energy = integral(&map, |_| 1.0) / DVec3::new(1.0, 2.0, 3.0);
                assert!((energy - DVec3::ONE).abs().max_element() < 1e-4, "{energy} at {towards}, {height} rows");
            }
        }
    }

    #[test]
    fn soft_boxes_stand_where_they_are_said_to() {
        let map = environment("studio").expect("listed");
        for lamp in &SOFT_BOXES {
            let towards = lamp.towards.normalize();
            let u = 0.5 + f64::atan2(towards.x, -towards.z) / TAU;
            let v = towards.y.acos() / PI;
            let index = (v * f64::from(map.height)) as u32 * map.width + (u * f64::from(map.width)) as u32;
            let seen = f64::from(map.texels[index as usize][1]);
            assert!((seen / lamp.radiance.y - 1.0).abs() < 0.05, "{seen} towards {towards}");
        }
    }
}
