//! H19. Singular tangent frames, and triangles without area.

use crate::random::turned;
use crate::{Check, Form, Laboratory, Random, StabilityError, bits};
use glam::{DMat3, DVec3, Vec3};
use mica_render::scene::Scene;
use mica_shaders::types::Words;
use std::f64::consts::{PI, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(19);
    let count = laboratory.inputs(30_000, 10_000_000);
    let normals: Vec<DVec3> = (0..count).map(|k| normal(&mut random, k)).collect();
    let about: Vec<Words> = normals
        .iter()
        .flat_map(|normal| [0, 1, 2].map(|column| Words { a: words(*normal, 0), b: [column, 0, 0, 0] }))
        .collect();
    let along: Vec<Words> = normals
        .iter()
        .flat_map(|normal| {
            let tangent = tangent(&mut random, *normal);
            [0, 1, 2].map(|column| Words { a: words(*normal, column), b: words(tangent, 0) })
        })
        .collect();
    let slivers = slivers(&mut random, laboratory.inputs(20_000, 1_000_000))?;
    let check = |what: &str, tolerance: f64, naive: Form, stable: Form| Check {
        what: what.to_owned(),
        error_of: "largest element of |transposed x frame - identity|".to_owned(),
        inputs: count as u64,
        naive,
        stable,
        tolerance,
    };
    Ok(vec![
        check(
            "frames about directions everywhere, along the axes and close to them",
            // The row's: 2.5 units in the last place of a quotient below 1.
            3e-7,
            Form::new("Frisvad 2012", worst(&laboratory.words(&about, bits!(frame_one_pole))?)),
            Form::new("Duff et al. 2017", worst(&laboratory.words(&about, bits!(frame_sign))?)),
        ),
        check(
            "frames along tangents, down to none across the normal",
            // A length after normalize is off by 2.5 units in the last place, and its square by twice that.
            1e-6,
            Form::new("t - (n.t) n", worst(&laboratory.words(&along, bits!(tangent_once))?)),
            Form::new("the same twice, or a frame about n", worst(&laboratory.words(&along, bits!(tangent_twice))?)),
        ),
        slivers,
    ])
}

/// Triangles that the loader drops for having no area beside their longest edge, told apart by the host. Their corners are
/// whole numbers times a power of two, so that integers say without any rounding what they are.
fn slivers(random: &mut Random, count: usize) -> Result<Check, StabilityError> {
    let slivers: Vec<Sliver> = (0..count).map(|_| Sliver::new(random)).collect();
    let triangles: Vec<[Vec3; 3]> = slivers.iter().map(Sliver::corners).collect();
    let has_area_in_f32 = |[a, b, c]: &[Vec3; 3]| {
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        (b - a).cross(c - a).length() > 1e-10 * longest * longest
    };
    let scene = Scene::from_glb_bytes("slivers", &glb(&triangles))?;
    // Those that are kept stay in order, each with corners of its own.
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| Vec3::from(scene.meshes[0].positions[corner as usize]));
    let mut kept = scene.meshes.iter().flat_map(|mesh| mesh.indices.as_chunks::<3>().0).map(corners).peekable();
    let (mut naive, mut stable) = (0, 0);
    for (sliver, triangle) in slivers.iter().zip(&triangles) {
        let is_kept = kept.next_if_eq(triangle).is_some();
        stable += usize::from(is_kept != sliver.has_area());
        naive += usize::from(has_area_in_f32(triangle) != sliver.has_area());
    }
    // What is kept and none of these would be wrong, too.
    stable += kept.count();
    Ok(Check {
        what: "triangles 1e-15 to 1e11 large, from on a line to wide".to_owned(),
        error_of: "share of them that the loader keeps or drops otherwise than integers say".to_owned(),
        inputs: count as u64,
        naive: Form::new("the same in f32", naive as f64 / count as f64),
        stable: Form::new("|e1 x e2| beside the longest edge's square, in f64", stable as f64 / count as f64),
        tolerance: 0.0,
    })
}

/// A triangle of whole coordinates, of which twice the area was drawn first.
struct Sliver {
    /// Where its corners are in a plane of two axes.
    at: [[i64; 2]; 3],
    twice_area: u64,
    /// What coordinates are multiples of: a power of two.
    unit: f32,
    /// The first axis of its plane.
    axis: usize,
}

impl Sliver {
    fn new(random: &mut Random) -> Self {
        let mut below = |most: u64| (random.bits() % most) as i64;
        // Two edges (p, q) and (u, v) with p v - q u as drawn: nothing, or anything up to what a wide triangle has.
        let (p, q, y) = loop {
            let [p, q] = [(); 2].map(|()| (1 << 21) + below(1 << 21));
            if let Some(y) = inverse(q, p) {
                break (p, q, y);
            }
        };
        let digits = 1 + below(12) as u32;
        let twice_area = if below(4) == 0 { 0 } else { 1 + below(10_u64.pow(digits)) };
        // q u = -twice_area modulo p, and v is what that leaves.
        let u = (-i128::from(y) * i128::from(twice_area)).rem_euclid(p.into()) as i64;
        let v = (twice_area + q * u) / p;
        // Wherever f32 still has every whole number.
        let [x0, y0] = [(); 2].map(|()| below(1 << 23));
        let unit = 2_f32.powi(below(86) as i32 - 72);
        let at = [[x0, y0], [x0 + p, y0 + q], [x0 + u, y0 + v]];
        Self { at, twice_area: twice_area as u64, unit, axis: below(3) as usize }
    }

    fn corners(&self) -> [Vec3; 3] {
        self.at.map(|[x, y]| {
            let mut corner = [0.0; 3];
            corner[self.axis] = x as f32 * self.unit;
            corner[(self.axis + 1) % 3] = y as f32 * self.unit;
            corner.into()
        })
    }

    /// Whether |e1 x e2|^2 > 1e-20 of the longest edge to the fourth power, which is what the loader promises.
    fn has_area(&self) -> bool {
        let square = |a: usize, b: usize| {
            let [x, y] = [0, 1].map(|axis| u128::from(self.at[a][axis].abs_diff(self.at[b][axis])));
            x * x + y * y
        };
        let longest = square(0, 1).max(square(0, 2)).max(square(1, 2));
        // What 128 bits do not hold is more.
        u128::from(self.twice_area).pow(2).checked_mul(10_u128.pow(20)).is_none_or(|area| area > longest * longest)
    }
}

/// The y between 0 and `modulus` for which y x `of` leaves 1 (Euclid), if there is one.
fn inverse(of: i64, modulus: i64) -> Option<i64> {
    let (mut left, mut factors) = ([modulus, of % modulus], [0, 1]);
    while left[1] != 0 {
        let quotient = left[0] / left[1];
        left = [left[1], left[0] - quotient * left[1]];
        factors = [factors[1], factors[0] - quotient * factors[1]];
    }
    (left[0] == 1).then(|| factors[0].rem_euclid(modulus))
}

/// A binary glTF of these triangles.
fn glb(triangles: &[[Vec3; 3]]) -> Vec<u8> {
    let corners = || triangles.iter().flatten();
    let numbers = corners().flat_map(|corner| corner.to_array().map(f32::to_le_bytes));
    let bytes = numbers.flatten().collect::<Vec<u8>>();
    let [low, high] = [
        corners().copied().fold(Vec3::INFINITY, Vec3::min).to_array(),
        corners().copied().fold(Vec3::NEG_INFINITY, Vec3::max).to_array(),
    ];
    let (count, length) = (3 * triangles.len(), bytes.len());
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":{low:?},"max":{high:?}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"buffers":[{{"byteLength":{length}}}]}}"#
    );
    while !json.len().is_multiple_of(4) {
        json.push(' ');
    }
    let mut file = b"glTF".to_vec();
    let word = |number: usize| (number as u32).to_le_bytes();
    file.extend([word(2), word(28 + json.len() + length), word(json.len()), *b"JSON"].concat());
    file.extend(json.as_bytes());
    file.extend([word(length), *b"BIN\0"].concat());
    file.extend(bytes);
    file
}

/// In turn: anywhere, along an axis with zeros of either sign, and 1e-9 to 1 radian from one.
fn normal(random: &mut Random, k: usize) -> DVec3 {
    let axis = DVec3::AXES[k / 2 % 3] * if k.is_multiple_of(2) { -1.0 } else { 1.0 };
    match k % 5 {
        0 => random.direction_about(DVec3::Z, PI),
        1 => axis,
        2 => DVec3::new(0.0, -0.0, if k.is_multiple_of(2) { -1.0 } else { 1.0 }),
        _ => turned(axis, random.log_between(1e-9, 1.0), random.between(0.0, TAU)),
    }
}

/// Of any length, at an angle of 1e-9 to pi / 2 from the normal or the other way; now and then none.
fn tangent(random: &mut Random, normal: DVec3) -> DVec3 {
    let side = if random.between(0.0, 1.0) < 0.5 { normal } else { -normal };
    let length = if random.between(0.0, 1.0) < 0.01 { 0.0 } else { random.log_between(1e-12, 1e12) };
    length * turned(side, random.log_between(1e-9, 0.5 * PI), random.between(0.0, TAU))
}

fn words(of: DVec3, last: u32) -> [u32; 4] {
    let [x, y, z] = of.as_vec3().to_array().map(f32::to_bits);
    [x, y, z, last]
}

/// The worst of all frames, three columns each.
fn worst(columns: &[[u32; 4]]) -> f64 {
    columns.as_chunks::<3>().0.iter().fold(0.0, |worst: f64, columns| {
        let column = |k: usize| {
            let [x, y, z, _] = columns[k].map(|word| f64::from(f32::from_bits(word)));
            DVec3::new(x, y, z)
        };
        let frame = DMat3::from_cols(column(0), column(1), column(2));
        let off = (frame.transpose() * frame - DMat3::IDENTITY).to_cols_array();
        off.into_iter().fold(worst, |worst, of| if of.is_nan() { f64::INFINITY } else { worst.max(of.abs()) })
    })
}
