//! A field of drifted snow at the end of the day: a bare tree, a fence half buried, boulders under white caps.

use glam::{DVec2, DVec3};

use crate::glb::{Document, Glint, Material, Placement};
use crate::maths::{self, TAU, bell, hash, mix, noise, noise2, smoothstep};
use crate::parts;
use crate::surface::{Grid, Mesh, even};

/// One UV square is a square metre: a flake in each pixel close by, a hundred where the drifts end.
const UV_PER_METRE: f64 = 1.0;
/// Where the camera stands, metres; the field fans out from under it.
const EYE: DVec3 = DVec3::new(0.0, 1.55, 0.0);

/// Height of the snow, metres.
fn height(p: DVec2) -> f64 {
    let distance = p.length();
    // Drifts: a wave whose crests lean away from the wind, bent and broken up by slow noise.
    let warp = DVec2::new(noise2(p / 5.3, 1), noise2(p / 5.3, 2));
    let phase = TAU / 7.5 * (0.42 * p.x + 0.91 * p.y) + 1.7 * warp.x;
    let crest = maths::sin(phase + 0.55 * maths::sin(phase));
    let drifts = 0.26 * crest * (0.65 + 0.35 * warp.y);
    let mounds = 0.42 * noise2(p / 8.1, 3) + 0.10 * noise2(p / 2.6, 4);
    // Ripples that the wind drew along itself, only on what it could reach.
    let ripples = 0.012 * noise2(DVec2::new(p.x * 2.1 + p.y * 0.9, p.y * 0.75), 5) * smoothstep(-0.5, 0.8, crest);
    let hills = smoothstep(45.0, 190.0, distance) * (9.0 + 8.0 * noise2(p / 71.0, 6) + 2.0 * noise2(p / 23.0, 7));
    let level = 1.0 - 0.55 * bell(distance, 0.0, 3.0);
    (drifts + mounds) * level + ripples + hills
}

fn on_snow(x: f64, z: f64) -> DVec3 {
    DVec3::new(x, height(DVec2::new(x, z)), z)
}

/// The field: a fan of rows whose spacing grows with the distance, as the picture wants it.
fn field() -> Mesh {
    let surface = |s: f64, t: f64| {
        let distance = 0.9 * maths::exp(5.6 * t);
        on_snow((2.0 * s - 1.0) * (0.85 * distance + 1.2), EYE.z + 0.4 - distance)
    };
    let grid = Grid::sample(surface, &even(110), &even(136));
    let uvs = grid.positions.iter().map(|p| DVec2::new(p.x, -p.z) * UV_PER_METRE).collect();
    Grid { uvs, ..grid }.into_mesh()
}

/// A boulder of about unit radius: a sphere pushed in and out by noise, the more angular the finer.
fn boulder(seed: f64, direction: DVec3) -> DVec3 {
    let offset = DVec3::splat(17.0 * seed);
    let coarse = noise(direction * 1.1 + offset);
    let fold = noise(direction * 2.3 + offset);
    let ridged = 1.0 - (fold * fold + 0.01).sqrt();
    direction
        * DVec3::new(1.25, 0.8, 1.0)
        * (0.8 + 0.28 * coarse + 0.16 * ridged + 0.03 * noise(direction * 9.0 + offset))
}

fn on_sphere(s: f64, colatitude: f64) -> DVec3 {
    let ring = maths::sin(colatitude);
    DVec3::new(ring * maths::cos(TAU * s), maths::cos(colatitude), -ring * maths::sin(TAU * s))
}

/// A cap of snow whose last row is its pole, laid flat from there.
fn white_cap(grid: Grid) -> Mesh {
    let run = |column: usize, row: usize| {
        let step = |r: usize| grid.positions[grid.index(column, r)].distance(grid.positions[grid.index(column, r + 1)]);
        (row..grid.rows - 1).map(step).sum::<f64>()
    };
    let uvs = (0..grid.rows * grid.columns).map(|i| {
        let (column, row) = (i % grid.columns, i / grid.columns);
        let angle = TAU * column as f64 / (grid.columns - 1) as f64;
        run(column, row) * DVec2::new(maths::cos(angle), maths::sin(angle))
    });
    let uvs = uvs.collect();
    Grid { uvs, ..grid }.relax_uvs(200).scale_uvs(UV_PER_METRE).into_mesh()
}

/// A boulder's stone and the snow that lies on it.
fn capped_boulder(seed: f64, place: DVec2, size: f64) -> (Mesh, Mesh) {
    let base = on_snow(place.x, place.y) + DVec3::Y * 0.12 * size;
    let stone = |s: f64, t: f64| base + boulder(seed, on_sphere(s, mix(2.6, 0.0, t))) * size;
    let cap = |s: f64, t: f64| {
        let rim = 1.0 + 0.16 * maths::sin(TAU * s * 2.0 + seed) + 0.09 * maths::sin(TAU * s * 5.0 + 2.0 * seed);
        let direction = on_sphere(s, mix(rim, 0.0, t));
        let thickness = 0.17 * maths::pow(smoothstep(0.0, 0.75, t), 0.7) - 0.03;
        base + (boulder(seed, direction) + DVec3::new(0.25, 1.0, 0.25) * direction * thickness) * size
    };
    let stone = Grid::sample(stone, &even(36), &even(20)).lay_out(0, 0).into_mesh();
    (stone, white_cap(Grid::sample(cap, &even(36), &even(12))))
}

/// Adds a branch and, while it is thick enough, the branches that it parts into.
fn grow(tree: &mut Mesh, from: DVec3, towards: DVec3, length: f64, radius: f64, seed: i64) {
    let random = |k: i64| hash(seed, k, 91);
    let bend = DVec3::new(random(1) - 0.5, 0.35 * random(2), random(3) - 0.5) * 0.5 * length;
    let tip = from + towards * length + bend * 0.6;
    let middle = from + towards * length * 0.5 - bend * 0.35;
    let curve = |t: f64| from * ((1.0 - t) * (1.0 - t)) + middle * (2.0 * t * (1.0 - t)) + tip * (t * t);
    let thin = radius < 0.022;
    let end = if thin { 0.25 } else { 0.68 };
    let (around, along) = if thin { (3, 2) } else { (6, 4) };
    tree.append(&parts::tube(curve, |t| radius * mix(1.0, end, t), around, along));
    if radius < 0.0135 {
        return;
    }
    let forward = (tip - middle).normalize();
    let side = forward.any_orthonormal_vector();
    let other = forward.cross(side);
    let turn = TAU * random(4);
    let twigs = if radius > 0.06 { 3 } else { 2 + i64::from(random(5) > 0.6) };
    for k in 0..twigs {
        let angle = turn + TAU * (k as f64 + 0.35 * random(10 + k)) / twigs as f64;
        let spread = mix(0.42, 0.95, random(20 + k));
        let out = side * maths::cos(angle) + other * maths::sin(angle);
        let direction = (forward + out * spread + DVec3::Y * 0.18).normalize();
        let start = curve(if k == 0 { 0.99 } else { mix(0.62, 0.98, random(30 + k)) });
        let scale = mix(0.62, 0.86, random(40 + k));
        grow(tree, start, direction, length * scale, radius * mix(0.55, 0.7, random(50 + k)), seed * 7 + k + 1);
    }
}

/// A leaning post with a cap of snow, and the way from one to the next.
fn fence() -> (Mesh, Mesh) {
    let (mut wood, mut snow) = (Mesh::default(), Mesh::default());
    let place = |i: f64| DVec2::new(-2.7 + 0.34 * i + 0.085 * i * i, -5.2 - 2.3 * i);
    let top = |i: i64| {
        let p = place(i as f64);
        let lean = DVec3::new(hash(i, 3, 5) - 0.5, 0.0, hash(i, 4, 5) - 0.5) * 0.14;
        (on_snow(p.x, p.y) - DVec3::Y * 0.3, DVec3::Y * (1.12 + 0.16 * hash(i, 1, 5)) + lean)
    };
    for i in 0..10 {
        let (foot, up) = top(i);
        let round = |t: f64| 0.052 * if t > 0.985 { 0.9 } else { 1.0 } * (1.0 + 0.06 * maths::sin(9.0 * t + i as f64));
        wood.append(&parts::tube(|t| foot + up * t, round, 10, 10));
        let head = foot + up;
        let cap = |s: f64, t: f64| {
            head + on_sphere(s, mix(1.45, 0.0, t)) * DVec3::new(0.074, 0.085, 0.074) + DVec3::Y * 0.008
        };
        snow.append(&white_cap(Grid::sample(cap, &even(14), &even(7))));
        if i < 9 {
            let (next_foot, next_up) = top(i + 1);
            for at in [0.52, 0.84] {
                let (a, b) = (foot + up * at, next_foot + next_up * (at + 0.06 * (hash(i, 7, 5) - 0.5)));
                let sag = 0.05 + 0.05 * hash(i, 8, 5);
                let rail = |t: f64| a.lerp(b, mix(-0.04, 1.04, t)) + DVec3::new(0.055, -sag * 4.0 * t * (1.0 - t), 0.0);
                wood.append(&parts::tube(rail, |t| 0.026 + 0.004 * maths::sin(12.0 * t), 7, 8));
            }
        }
    }
    (wood, snow)
}

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("snow", "dusk");
    let snow = scene.material(Material::dielectric("snow", [0.83, 0.85, 0.88], 0.0).with_glint(Glint {
        count: 1e5,
        alpha: 0.5,
        gamma_deg: 2.0,
        seed: 4,
        color: [0.30, 0.31, 0.32],
    }));
    let stone = scene.material(Material::dielectric("stone", [0.055, 0.052, 0.055], 0.8));
    let bark = scene.material(Material::dielectric("bark", [0.040, 0.030, 0.026], 0.85));
    let wood = scene.material(Material::dielectric("weathered wood", [0.085, 0.070, 0.060], 0.8));

    scene.add("field", &[(&field(), snow)]);
    let (mut stones, mut caps) = (Mesh::default(), Mesh::default());
    for (seed, x, z, size) in
        [(1.0, 2.3, -6.6, 0.55), (2.0, 3.3, -7.6, 0.33), (3.0, -4.4, -12.0, 0.8), (4.0, 1.15, -5.6, 0.2)]
    {
        let (stone, cap) = capped_boulder(seed, DVec2::new(x, z), size);
        stones.append(&stone);
        caps.append(&cap);
    }
    scene.add("boulders", &[(&stones, stone), (&caps, snow)]);
    let (posts, heads) = fence();
    scene.add("fence", &[(&posts, wood), (&heads, snow)]);
    let mut tree = Mesh::default();
    grow(&mut tree, DVec3::new(0.0, -0.25, 0.0), DVec3::new(-0.05, 1.0, 0.03).normalize(), 1.45, 0.13, 5);
    let tree = scene.mesh("tree", &[(&tree, bark)]);
    scene.place("tree", tree, Placement::at(on_snow(3.7, -12.0)));
    scene.place("far tree", tree, Placement::at(on_snow(-9.5, -38.0)).turned(DVec3::Y, 130.0));
    scene.directional_light("sun", DVec3::new(-0.47, 0.20, -0.86), [2.5, 1.7, 1.02]);
    scene.camera(EYE, DVec3::new(0.25, 1.05, -8.0), 38.0);
    scene
}
