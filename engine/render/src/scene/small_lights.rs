//! Small bright lights of an environment, apart from the rest of it: a sun is a light, and not something to be sampled with
//! the sky.

use super::environment::EquirectMap;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Texels this many times as bright as the mean over the sphere may belong to a light.
const BRIGHT: f64 = 50.0;
/// A light is no larger than this, in steradians: a disc 2 degrees in radius.
const LARGEST: f64 = 0.004;
/// Lights that are parted from a map at most, the strongest first; the others stay in it.
const MOST_LIGHTS: usize = 16;
/// Pieces that a light is split into at least: texels are no rectangles, and edges of wide cones not straight across them.
const FEWEST_PIECES: f64 = 64.0;

/// What a light has of a texel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    texel: usize,
    /// What of the texel's radiance is the light's.
    above: [f64; 3],
}

/// A small bright light of an environment.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallLight {
    /// Towards it, unit, in the frame of the map.
    pub direction: DVec3,
    /// On a surface that faces it.
    pub irradiance: [f64; 3],
    /// All of it lies within this angle about its direction.
    pub radius_radians: f64,
    /// Size of the map that it was found in.
    size: [u32; 2],
    parts: Vec<Part>,
}

/// A part of a light that is small against the cone that it is held against.
struct Piece {
    towards: DVec3,
    /// Unit and across `towards`: along the row, and down the column.
    sides: [DVec3; 2],
    /// Half of its extent along these, radians.
    half: [f64; 2],
    irradiance: [f64; 3],
}

impl Piece {
    /// What part of its area lies within `angle` about an axis. The cone's edge is straight across a piece.
    fn part_within(&self, axis: DVec3, angle: f64) -> f64 {
        let chord = (self.towards - axis).length();
        let inside = angle - 2.0 * (0.5 * chord).min(1.0).asin();
        let outwards = self.towards - axis;
        let outwards = (outwards - outwards.dot(self.towards) * self.towards).normalize_or(self.sides[0]);
        // Half of what each side spans across the edge.
        let [a, b] = [0, 1].map(|side| self.half[side] * outwards.dot(self.sides[side]).abs());
        let reach = a + b;
        if inside.abs() >= reach {
            return f64::from(inside > 0.0);
        }
        let [a, b] = [a, b].map(|half| half.max(1e-4 * reach));
        // A box of width 2a blurred by one of width 2b, summed up to the edge.
        let ramp = |x: f64| x.max(0.0).powi(2);
        (ramp(inside + a + b) - ramp(inside + a - b) - ramp(inside - a + b) + ramp(inside - a - b)) / (8.0 * a * b)
    }
}

/// What cones about directions near a light hold of it, as radiance: the mean over the cone.
///
/// A table by azimuth about the light and by distance from it. Distances are chords between unit vectors, from
/// [`inner_chord`](Self::inner_chord), up to which a cone holds the light wholly, to [`outer_chord`](Self::outer_chord), from which
/// it holds nothing.
pub struct LightRing {
    /// Unit, across the light's direction: azimuth 0. That of a quarter turn is `direction.cross(tangent)`.
    pub tangent: DVec3,
    /// Chord of the first row.
    pub inner_chord: f64,
    /// Chord of the last row.
    pub outer_chord: f64,
    /// Rows by distance, columns by azimuth: column `j` is in the middle of its share of the turn.
    pub radiance: Vec<[f32; 3]>,
}

impl SmallLight {
    /// Of cones of this half-angle, no smaller than the light's radius, at `columns` azimuths and `rows` distances.
    pub fn ring(&self, half_angle_radians: f64, [columns, rows]: [u32; 2]) -> LightRing {
        let tangent = self.direction.any_orthonormal_vector();
        let bitangent = self.direction.cross(tangent);
        let pieces = self.pieces(half_angle_radians / 16.0);
        let solid_angle = 4.0 * PI * (0.5 * half_angle_radians).sin().powi(2);
        let chord = |angle: f64| 2.0 * (0.5 * angle.clamp(0.0, PI)).sin();
        let inner_chord = chord(half_angle_radians - self.radius_radians);
        let outer_chord = chord(half_angle_radians + self.radius_radians);
        let at = |row: u32, column: u32| {
            let along = f64::from(row) / f64::from(rows - 1);
            let angle = 2.0 * (0.5 * (inner_chord + along * (outer_chord - inner_chord))).asin();
            let (sin, cos) = ((f64::from(column) + 0.5) / f64::from(columns) * TAU).sin_cos();
            let axis = angle.cos() * self.direction + angle.sin() * (cos * tangent + sin * bitangent);
            let mut sum = [0.0; 3];
            for piece in &pieces {
                let part = piece.part_within(axis, half_angle_radians) / solid_angle;
                sum = std::array::from_fn(|c| sum[c] + part * piece.irradiance[c]);
            }
            // All of it and nothing at the ends, whatever was rounded.
            match row {
                0 => self.irradiance.map(|c| (c / solid_angle) as f32),
                row if row + 1 == rows => [0.0; 3],
                _ => sum.map(|c| c as f32),
            }
        };
        let radiance = (0..rows).flat_map(|row| (0..columns).map(move |column| at(row, column))).collect();
        LightRing { tangent, inner_chord, outer_chord, radiance }
    }

    /// Its texels, each split into pieces of no more than about this size, and into several where they are few.
    fn pieces(&self, largest_radians: f64) -> Vec<Piece> {
        let [width, height] = self.size.map(f64::from);
        let few = (FEWEST_PIECES / self.parts.len() as f64).sqrt();
        let parts_of_side = (PI / height / largest_radians).max(few).ceil() as u32;
        let mut pieces = Vec::with_capacity(self.parts.len() * (parts_of_side * parts_of_side) as usize);
        for Part { texel, above } in &self.parts {
            let (column, row) = (*texel as u32 % self.size[0], *texel as u32 / self.size[0]);
            let place = |at: u32, sub: u32| f64::from(at) + (f64::from(sub) + 0.5) / f64::from(parts_of_side);
            for sub in 0..parts_of_side * parts_of_side {
                let [u, v] = [place(column, sub % parts_of_side) / width, place(row, sub / parts_of_side) / height];
                let half_down = 0.5 * PI / (height * f64::from(parts_of_side));
                let (sin_polar, cos_polar) = (v * PI).sin_cos();
                let (sin_azimuth, cos_azimuth) = ((u - 0.5) * TAU).sin_cos();
                let half_across = PI / (width * f64::from(parts_of_side));
                // Of the band, exactly: the sum over pieces is the light.
                let solid_angle = 4.0 * half_across * sin_polar * half_down.sin();
                pieces.push(Piece {
                    towards: EquirectMap::direction_from_uv([u, v]),
                    sides: [
                        DVec3::new(cos_azimuth, 0.0, sin_azimuth),
                        DVec3::new(cos_polar * sin_azimuth, -sin_polar, -cos_polar * cos_azimuth),
                    ],
                    half: [half_across * sin_polar, half_down],
                    irradiance: above.map(|c| c * solid_angle),
                });
            }
        }
        pieces
    }
}

fn luminance(radiance: [f64; 3]) -> f64 {
    0.2126 * radiance[0] + 0.7152 * radiance[1] + 0.0722 * radiance[2]
}

impl EquirectMap {
    /// The small bright lights of a map, the strongest first, and what is left: there the mean of the texels around each light.
    /// The integral of radiance over both is the map's.
    pub fn part_small_lights(&self) -> (Vec<SmallLight>, EquirectMap) {
        let radiance = |texel: usize| self.texels[texel].map(f64::from);
        let row = |texel: usize| texel as u32 / self.width;
        let mean = luminance(self.integral()) / (4.0 * PI);
        let is_bright = |texel: usize| luminance(radiance(texel)) > BRIGHT * mean;
        let mut lights = Vec::new();
        let mut visited = vec![false; self.texels.len()];
        for start in 0..self.texels.len() {
            if visited[start] || !is_bright(start) {
                continue;
            }
            visited[start] = true;
            // Everything bright that hangs together, and the texels around it.
            let (mut members, mut around) = (vec![start], Vec::new());
            let mut next = 0;
            while let Some(&texel) = members.get(next) {
                next += 1;
                for neighbour in self.neighbours(texel) {
                    if !is_bright(neighbour) {
                        around.push(neighbour);
                    } else if !std::mem::replace(&mut visited[neighbour], true) {
                        members.push(neighbour);
                    }
                }
            }
            let size: f64 = members.iter().map(|texel| self.solid_angle(row(*texel))).sum();
            if size <= LARGEST && !around.is_empty() {
                let sum = |c: usize| around.iter().map(|texel| radiance(*texel)[c]).sum::<f64>();
                let ground: [f64; 3] = std::array::from_fn(|c| sum(c) / around.len() as f64);
                lights.push(self.light_of(&members, ground));
            }
        }
        lights.sort_by(|a, b| luminance(b.irradiance).total_cmp(&luminance(a.irradiance)));
        lights.truncate(MOST_LIGHTS);
        let rest = self.without(&lights);
        (lights, rest)
    }

    /// What texels have above the ground, channel by channel.
    fn light_of(&self, members: &[usize], ground: [f64; 3]) -> SmallLight {
        let above = |texel: usize| -> [f64; 3] {
            // What is left is a number of 32 bits, so that nothing is lost.
            std::array::from_fn(|c| {
                f64::from(self.texels[texel][c]) - f64::from(self.texels[texel][c].min(ground[c] as f32))
            })
        };
        let parts: Vec<Part> = members.iter().map(|&texel| Part { texel, above: above(texel) }).collect();
        let (mut direction, mut irradiance) = (DVec3::ZERO, [0.0; 3]);
        for part in &parts {
            let solid_angle = self.solid_angle(part.texel as u32 / self.width);
            direction += luminance(part.above) * solid_angle * self.place(part.texel, [0.5, 0.5]);
            irradiance = std::array::from_fn(|c| irradiance[c] + part.above[c] * solid_angle);
        }
        let direction = direction.normalize();
        let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];
        let to_corner = |part: &Part| corners.map(|corner| direction.angle_between(self.place(part.texel, corner)));
        let radius_radians = parts.iter().flat_map(to_corner).fold(0.0, f64::max);
        SmallLight { direction, irradiance, radius_radians, size: [self.width, self.height], parts }
    }

    /// The map that is left when lights that were found in it are taken out.
    pub fn without<'a>(&self, lights: impl IntoIterator<Item = &'a SmallLight>) -> EquirectMap {
        let mut rest = self.clone();
        for part in lights.into_iter().flat_map(|light| &light.parts) {
            let texel = &mut rest.texels[part.texel];
            *texel = std::array::from_fn(|c| (f64::from(texel[c]) - part.above[c]) as f32);
        }
        rest
    }

    /// The direction of a place in a texel.
    fn place(&self, texel: usize, [x, y]: [f64; 2]) -> DVec3 {
        let (column, row) = (texel as u32 % self.width, texel as u32 / self.width);
        let [u, v] = [(f64::from(column) + x) / f64::from(self.width), (f64::from(row) + y) / f64::from(self.height)];
        Self::direction_from_uv([u, v])
    }

    /// The texels beside one: around the horizon without end, up to the first and the last row.
    fn neighbours(&self, texel: usize) -> impl Iterator<Item = usize> {
        let (width, height) = (self.width as i64, self.height as i64);
        let (column, row) = (texel as i64 % width, texel as i64 / width);
        let all = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))).filter(|step| *step != (0, 0));
        all.filter(move |(_, y)| (0..height).contains(&(row + y)))
            .map(move |(x, y)| ((row + y) * width + (column + x).rem_euclid(width)) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural;
    use glam::DQuat;

    #[test]
    fn the_sun_is_a_light_and_soft_boxes_are_not() {
        let clear = procedural::environment("clear").expect("an environment");
        let (lights, rest) = clear.part_small_lights();
        let [sun] = &lights[..] else { panic!("{lights:?}") };
        assert!(sun.direction.angle_between(procedural::SUN_DIRECTION) < 1e-3, "{}", sun.direction);
        assert!((0.0047..0.02).contains(&sun.radius_radians), "{}", sun.radius_radians);
        for (found, made) in sun.irradiance.iter().zip(procedural::SUN_IRRADIANCE.to_array()) {
            assert!((found / made - 1.0).abs() < 0.01, "{found} {made}");
        }
        assert_eq!(rest.part_small_lights().0, [], "nothing is left of it");
        for name in ["studio", "overcast", "dusk"] {
            let map = procedural::environment(name).expect("an environment");
            assert_eq!(map.part_small_lights(), (Vec::new(), map.clone()), "{name}");
        }
        assert_eq!(EquirectMap::constant([1.0; 3]).part_small_lights().0, []);
    }

    /// Also of a sun in one texel at the seam or beside a pole, of colours that the sky has more of, and of more lights than are parted.
    #[test]
    fn lights_and_the_rest_hold_the_light_of_the_map() {
        let mut maps = vec![procedural::environment("clear").expect("an environment")];
        for suns in
            [vec![[0, 20]], vec![[127, 0]], vec![[5, 5], [6, 6], [100, 40]], (0..60).map(|k| [2 * k, 33]).collect()]
        {
            let mut map = EquirectMap { width: 128, height: 64, texels: vec![[0.1, 0.2, 3.0]; 128 * 64] };
            for [column, row] in suns {
                map.texels[row * 128 + column] = [1e6, 3e5, 1.0];
            }
            maps.push(map);
        }
        for map in maps {
            let (lights, rest) = map.part_small_lights();
            assert!(!lights.is_empty() && lights.len() <= MOST_LIGHTS);
            assert!(rest.texels.iter().flatten().all(|c| *c >= 0.0));
            let (whole, left) = (map.integral(), rest.integral());
            for c in 0..3 {
                let sum = left[c] + lights.iter().map(|light| light.irradiance[c]).sum::<f64>();
                assert!((sum / whole[c] - 1.0).abs() < 1e-6, "{sum} {}", whole[c]);
            }
        }
    }

    /// The ring of the sun, and of lights of one texel, against a count of points of the texels.
    #[test]
    fn a_ring_holds_what_cones_hold_of_the_light() {
        let clear = procedural::environment("clear").expect("an environment");
        let mut one = EquirectMap { width: 128, height: 64, texels: vec![[0.0; 3]; 128 * 64] };
        one.texels[20 * 128 + 3] = [1e3; 3];
        for (map, gamma_deg) in [(clear.clone(), 6.0), (clear, 1.0), (one.clone(), 2.5), (one, 30.0)] {
            let light = map.part_small_lights().0.remove(0);
            let gamma = f64::to_radians(gamma_deg);
            let ring = light.ring(gamma, [16, 33]);
            let cone = 4.0 * PI * (0.5 * gamma).sin().powi(2);
            let points = light.pieces(PI / f64::from(map.height) / 64.0);
            let all: f64 = points.iter().map(|point| point.irradiance[1]).sum();
            assert!((all / light.irradiance[1] - 1.0).abs() < 1e-9, "pieces are the whole");
            let mut worst: f64 = 0.0;
            for (index, shown) in ring.radiance.iter().enumerate() {
                let (row, column) = (index / 16, index % 16);
                let chord = ring.inner_chord + row as f64 / 32.0 * (ring.outer_chord - ring.inner_chord);
                let angle = 2.0 * (0.5 * chord).asin();
                let across = DQuat::from_axis_angle(light.direction, (column as f64 + 0.5) / 16.0 * TAU) * ring.tangent;
                let axis = angle.cos() * light.direction + angle.sin() * across;
                let within = points.iter().filter(|point| point.towards.dot(axis) >= gamma.cos());
                let expected: f64 = within.map(|point| point.irradiance[1]).sum::<f64>() / cone;
                worst = worst.max((f64::from(shown[1]) - expected).abs() * cone / light.irradiance[1]);
            }
            println!("gamma {gamma_deg}: off by {worst:.5} of the light at most");
            assert!(worst < 3e-3, "{worst}");
        }
    }
}
