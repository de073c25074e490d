//! What values of options mean: numbers within bounds, places, sizes, lights.

use glam::DVec3;
use mica_render::scene::Light;
use std::ops::RangeInclusive;

/// A corner and two sides, as (u, v) each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram(pub [f64; 6]);

/// Degrees from the normal, and about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles(pub [f64; 2]);

/// Where to look from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraChoice {
    /// Metres.
    pub eye: DVec3,
    /// Metres; not at the eye.
    pub target: DVec3,
    /// From bottom to top, within 0 and 180.
    pub vertical_fov_deg: f64,
}

/// Most pixels along a side: what every device with Vulkan 1.3 can be expected to stop at.
const LARGEST_SIDE: u32 = 16384;
/// Roughnesses, and half-angles of cones in degrees, that flakes may have.
pub const ALPHAS: RangeInclusive<f64> = 0.001..=1.0;
pub const GAMMAS_DEG: RangeInclusive<f64> = 0.01..=30.0;
/// Coordinates beyond this are meaningless in metres, and their squares leave f32.
pub const LARGEST_COORDINATE: f64 = 1e9;

pub fn size(text: &str) -> Result<[u32; 2], String> {
    let wanted = || format!("expected WIDTHxHEIGHT, each 1 to {LARGEST_SIDE}, such as 1920x1080");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wanted)?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=LARGEST_SIDE).contains(side)).ok_or_else(wanted);
    Ok([side(width)?, side(height)?])
}

pub fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(|| "expected a finite number".into())
}

pub fn exposure(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|stops| stops.abs() <= 32.0).ok_or_else(|| "expected stops from -32 to 32".into())
}

pub fn alpha(text: &str) -> Result<f64, String> {
    let accepted = |alpha: &f64| ALPHAS.contains(alpha);
    finite(text).ok().filter(accepted).ok_or_else(|| format!("expected {} to {}", ALPHAS.start(), ALPHAS.end()))
}

pub fn gamma_deg(text: &str) -> Result<f64, String> {
    let accepted = |gamma: &f64| GAMMAS_DEG.contains(gamma);
    let wanted = || format!("expected degrees from {} to {}", GAMMAS_DEG.start(), GAMMAS_DEG.end());
    finite(text).ok().filter(accepted).ok_or_else(wanted)
}

pub fn count(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|count| (0.0..=1e12).contains(count)).ok_or_else(|| "expected 0 to 1e12".into())
}

pub fn footprint(text: &str) -> Result<Parallelogram, String> {
    let fits = |numbers: &[f64; 6]| numbers.iter().all(|number| number.abs() <= LARGEST_COORDINATE);
    let wanted = || format!("expected six numbers PU,PV,E1U,E1V,E2U,E2V up to {LARGEST_COORDINATE:e}");
    numbers(text).filter(fits).map(Parallelogram).ok_or_else(wanted)
}

pub fn angles(text: &str) -> Result<Angles, String> {
    let wanted = || "expected THETA,PHI in degrees, THETA from -180 to 180".to_owned();
    numbers(text).filter(|[theta, _]: &[f64; 2]| theta.abs() <= 180.0).map(Angles).ok_or_else(wanted)
}

/// So many finite numbers between commas.
pub fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(finite).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

fn point(text: &str) -> Option<DVec3> {
    numbers::<3>(text).map(DVec3::from).filter(|point| point.abs().max_element() <= LARGEST_COORDINATE)
}

/// A radiance, intensity or irradiance: three numbers that are not negative and fit an f32 with room for sums.
pub fn power(rgb: [f64; 3]) -> Option<[f32; 3]> {
    rgb.iter().all(|channel| (0.0..=1e12).contains(channel)).then(|| rgb.map(|channel| channel as f32))
}

pub fn light(text: &str) -> Result<Light, String> {
    let wanted = || "expected point:X,Y,Z,R,G,B or dir:X,Y,Z,R,G,B, with R, G and B from 0 to 1e12".to_owned();
    let (kind, rest) = text.split_once(':').ok_or_else(wanted)?;
    let [x, y, z, r, g, b] = numbers(rest).ok_or_else(wanted)?;
    let power = power([r, g, b]).ok_or_else(wanted)?;
    let place = DVec3::new(x, y, z);
    if place.abs().max_element() > LARGEST_COORDINATE {
        return Err(format!("expected coordinates up to {LARGEST_COORDINATE:e}"));
    }
    match kind {
        "point" => Ok(Light::Point { position: place, radiant_intensity: power, range: None }),
        "dir" => {
            let direction =
                place.try_normalize().ok_or("expected the direction in which the light travels, not 0,0,0")?;
            Ok(Light::Directional { direction, irradiance: power })
        }
        _ => Err(wanted()),
    }
}

pub fn camera(text: &str) -> Result<CameraChoice, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [eye, target, fov] = parts[..] else { return Err("expected EYE:TARGET:FOV_DEG, as X,Y,Z:X,Y,Z:F".into()) };
    let eye = point(eye).ok_or("EYE: expected three numbers X,Y,Z, in metres")?;
    let target = point(target).ok_or("TARGET: expected three numbers X,Y,Z, in metres")?;
    let vertical_fov_deg = finite(fov)
        .ok()
        .filter(|degrees| (0.01..=179.0).contains(degrees))
        .ok_or("FOV_DEG: expected degrees from 0.01 to 179")?;
    if (target - eye).try_normalize().is_none() {
        return Err("EYE and TARGET are one point; expected two".into());
    }
    Ok(CameraChoice { eye, target, vertical_fov_deg })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_two_sides_of_at_least_a_pixel() {
        assert_eq!(size("1920x1080"), Ok([1920, 1080]));
        for bad in ["", "x", "0x0", "5x0", "-1x4", "1e3x4", "640", "640x480x1", "16385x1", "99999999999x1", " 4x4"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn cameras_look_somewhere() {
        let camera = camera("-1,2,3.5:0,0,0:40").expect("a camera");
        assert_eq!((camera.eye, camera.vertical_fov_deg), (DVec3::new(-1.0, 2.0, 3.5), 40.0));
        for bad in
            ["", "0,0,0", "0,0,0:0,0,0:40", "1,0,0:0,0:40", "NaN,0,0:0,0,0:40", "1,0,0:0,0,0:180", "inf,0,0:1,1,1:4"]
        {
            assert!(super::camera(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lights_have_a_kind_a_place_and_a_power() {
        let Ok(Light::Directional { direction, irradiance }) = light("dir:0,-2,0,1,2,3") else { panic!("no light") };
        assert_eq!((direction, irradiance), (DVec3::NEG_Y, [1.0, 2.0, 3.0]));
        assert!(matches!(light("point:0,1,0,4,4,4"), Ok(Light::Point { .. })));
        for bad in [
            "",
            "point",
            "spot:0,0,0,1,1,1",
            "dir:0,0,0,1,1,1",
            "point:0,0,0,1,1",
            "point:0,0,0,-1,1,1",
            "point:0,nan,0,1,1,1",
        ] {
            assert!(light(bad).is_err(), "{bad}");
        }
    }
}
