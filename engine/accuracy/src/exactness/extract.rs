//! Small bright lights taken out of an environment: a sun is a light, and not something to be averaged with the sky.

use glam::{DQuat, DVec3};
use mica_render::scene::{EquirectMap, Light};
use std::f64::consts::{PI, TAU};

/// Texels this many times as bright as the mean over the sphere may belong to a light.
const BRIGHT: f64 = 50.0;
/// A light is no larger than this, in steradians: a disc 2 degrees in radius.
const LARGEST: f64 = 0.004;

/// What was taken out of an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtractedLight {
    /// Towards it, unit.
    pub direction: DVec3,
    /// On a surface that faces it.
    pub irradiance: [f64; 3],
}

impl ExtractedLight {
    /// As a light of a scene whose environment is turned about +Y.
    pub fn turned(&self, rotation_radians: f64) -> Light {
        let direction = DQuat::from_rotation_y(rotation_radians) * -self.direction;
        Light::Directional { direction, irradiance: self.irradiance.map(|c| c as f32) }
    }
}

fn luminance(radiance: [f64; 3]) -> f64 {
    0.2126 * radiance[0] + 0.7152 * radiance[1] + 0.0722 * radiance[2]
}

/// Solid angle of a texel of a row, steradians.
fn solid_angle(map: &EquirectMap, row: u32) -> f64 {
    let edge = |row: u32| (PI * f64::from(row) / f64::from(map.height)).cos();
    TAU / f64::from(map.width) * (edge(row) - edge(row + 1))
}

/// The small bright lights of a map, and what is left: there the mean of the texels around each light. The integral of
/// radiance over both is the map's.
pub fn extract_lights(map: &EquirectMap) -> (Vec<ExtractedLight>, EquirectMap) {
    let radiance = |texel: usize| map.texels[texel].map(f64::from);
    let mean = luminance(map.integral()) / (4.0 * PI);
    let mut rest = map.clone();
    let mut lights = Vec::new();
    let mut visited = vec![false; map.texels.len()];
    for start in 0..map.texels.len() {
        let is_bright = |texel: usize| luminance(radiance(texel)) > BRIGHT * mean;
        if visited[start] || !is_bright(start) {
            continue;
        }
        visited[start] = true;
        // Everything bright that hangs together, and the texels around it.
        let (mut members, mut around) = (vec![start], Vec::new());
        let mut next = 0;
        while let Some(&texel) = members.get(next) {
            next += 1;
            for neighbour in neighbours(map, texel) {
                if !is_bright(neighbour) {
                    around.push(neighbour);
                } else if !std::mem::replace(&mut visited[neighbour], true) {
                    members.push(neighbour);
                }
            }
        }
        let row = |texel: usize| texel as u32 / map.width;
        let size: f64 = members.iter().map(|texel| solid_angle(map, row(*texel))).sum();
        if size > LARGEST || around.is_empty() {
            continue;
        }
        let ground: [f64; 3] =
            std::array::from_fn(|c| around.iter().map(|texel| radiance(*texel)[c]).sum::<f64>() / around.len() as f64);
        let (mut direction, mut irradiance) = (DVec3::ZERO, [0.0; 3]);
        for &texel in &members {
            let above: [f64; 3] =
                std::array::from_fn(|c| (radiance(texel)[c] - ground[c]) * solid_angle(map, row(texel)));
            direction += luminance(above) * centre(map, texel);
            irradiance = std::array::from_fn(|c| irradiance[c] + above[c]);
            rest.texels[texel] = ground.map(|c| c as f32);
        }
        lights.push(ExtractedLight { direction: direction.normalize(), irradiance });
    }
    (lights, rest)
}

/// The direction of a texel's centre.
fn centre(map: &EquirectMap, texel: usize) -> DVec3 {
    let (column, row) = (texel as u32 % map.width, texel as u32 / map.width);
    let place = |at: u32, size: u32| (f64::from(at) + 0.5) / f64::from(size);
    EquirectMap::direction_from_uv([place(column, map.width), place(row, map.height)])
}

/// The texels beside one: around the horizon without end, up to the first and the last row.
fn neighbours(map: &EquirectMap, texel: usize) -> impl Iterator<Item = usize> {
    let (width, height) = (map.width as i64, map.height as i64);
    let (column, row) = (texel as i64 % width, texel as i64 / width);
    let all = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))).filter(|step| *step != (0, 0));
    all.filter(move |(_, y)| (0..height).contains(&(row + y)))
        .map(move |(x, y)| ((row + y) * width + (column + x).rem_euclid(width)) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_render::scene::procedural;

    #[test]
    fn the_sun_is_a_light_and_soft_boxes_are_not() {
        let clear = procedural::environment("clear").expect("an environment");
        let (lights, rest) = extract_lights(&clear);
        let [sun] = lights[..] else { panic!("{lights:?}") };
        assert!(sun.direction.angle_between(procedural::SUN_DIRECTION) < 1e-3, "{}", sun.direction);
        for (found, made) in sun.irradiance.iter().zip(procedural::SUN_IRRADIANCE.to_array()) {
            assert!((found / made - 1.0).abs() < 0.01, "{found} {made}");
        }
        let (before, after) = (clear.integral(), rest.integral());
        for c in 0..3 {
            assert!(
                (after[c] + sun.irradiance[c] - before[c]).abs() < 1e-4 * before[c],
                "light is neither made nor lost"
            );
        }
        assert_eq!(extract_lights(&rest).0, [], "nothing is left of it");
        for name in ["studio", "overcast"] {
            assert_eq!(extract_lights(&procedural::environment(name).expect("an environment")).0, [], "{name}");
        }
        assert_eq!(extract_lights(&EquirectMap::constant([1.0; 3])).0, []);
    }
}
