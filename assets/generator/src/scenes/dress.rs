//! An evening gown on a dressmaker's form: a sequinned bodice over a wide skirt that falls in folds.

use glam::DVec3;

use crate::glb::{Document, Glint, Material};
use crate::maths::{self, PI, Spline, TAU, bell, mix, smoothstep};
use crate::parts;
use crate::surface::{Grid, Mesh, even};

/// UV squares per metre of the bodice and of the skirt: a few flakes a pixel each.
const BODICE_UV_PER_METRE: f64 = 1.5;
const SKIRT_UV_PER_METRE: f64 = 4.0;
/// Height of the waist, metres.
const WAIST: f64 = 1.02;
/// Height of the skirt's hem, metres.
const HEM: f64 = 0.012;

/// The dressmaker's form. Angle 0 faces the camera (+Z), a quarter turn is the left side (+X).
struct Form {
    half_width: Spline,
    half_depth: Spline,
    middle: Spline,
}

impl Form {
    fn new() -> Self {
        let heights = [0.94, WAIST, 1.10, 1.19, 1.26, 1.33, 1.39, 1.43, 1.465, 1.49, 1.52, 1.56, 1.60];
        let spline = |values: [f64; 13]| Spline::new(&heights.into_iter().zip(values).collect::<Vec<_>>());
        Self {
            half_width: spline([
                0.150, 0.118, 0.128, 0.148, 0.160, 0.166, 0.170, 0.158, 0.115, 0.075, 0.056, 0.051, 0.050,
            ]),
            half_depth: spline([
                0.110, 0.088, 0.093, 0.102, 0.108, 0.104, 0.092, 0.080, 0.066, 0.057, 0.051, 0.049, 0.048,
            ]),
            middle: spline([0.0, 0.0, 0.002, 0.004, 0.004, 0.0, -0.008, -0.014, -0.016, -0.014, -0.008, 0.0, 0.004]),
        }
    }

    /// A point of the form, `clear` metres outside it.
    fn at(&self, angle: f64, height: f64, clear: f64) -> DVec3 {
        let (sin, cos) = (maths::sin(angle), maths::cos(angle));
        let bust = [-0.46, 0.46].map(|side| bell(angle, side, 0.33)).iter().sum::<f64>() * bell(height, 1.255, 0.055);
        let back = (1.0 - maths::cos(angle)) * 0.5;
        let hollow = 0.010 * bell(angle.abs(), PI, 0.25) * bell(height, 1.22, 0.15);
        let depth = self.half_depth.at(height) * mix(1.0, 0.92, back) + 0.055 * bust - hollow + clear;
        let width = self.half_width.at(height) + 0.010 * bust + clear;
        DVec3::new(width * sin, height, self.middle.at(height) + depth * cos)
    }
}

/// The skirt: the waist's ellipse widening to the floor, with folds that deepen downward and a short train.
fn skirt_surface(form: &Form, angle: f64, t: f64) -> DVec3 {
    let flare = mix(0.42 * t, t * t * (1.8 - 0.8 * t), 0.45) + 0.09 * smoothstep(0.0, 0.16, t);
    let back = 0.5 - 0.5 * maths::cos(angle);
    let radius = flare * (0.62 + 0.20 * back * back * t);
    // Folds: one main frequency whose phase and depth wander round the waist, and a finer one in between.
    let wander =
        0.9 * maths::sin(2.0 * angle + 0.7) + 0.6 * maths::sin(5.0 * angle + 1.9) + 0.35 * t * maths::sin(3.0 * angle);
    let main = maths::sin(15.0 * angle + 1.6 * wander);
    let fine = maths::sin(31.0 * angle - 2.1 * wander + 1.0 + 0.8 * t);
    let depth = 1.0 + 0.35 * maths::sin(4.0 * angle + 2.0) * maths::sin(angle * 3.0);
    // Crests rounder than valleys, as cloth has it.
    let crest = main + 0.24 * (main * main - 0.5);
    let open = 0.05 * t + 0.95 * smoothstep(-0.15, 1.0, t) * t;
    let folds = open * (0.066 * depth * crest + 0.009 * fine);
    let waist = form.at(angle, WAIST, 0.006);
    let out = DVec3::new(maths::sin(angle), 0.0, maths::cos(angle));
    let height = mix(WAIST, HEM, t) + 0.006 * t * (1.0 - main);
    (waist * mix(1.0, 0.75, t)).with_y(0.0) + out * (radius + folds) + DVec3::Y * height
}

fn skirt(form: &Form) -> Mesh {
    let surface = |s: f64, t: f64| skirt_surface(form, TAU * (s - 0.5), 1.0 - t);
    let columns = 256;
    let grid = Grid::sample(surface, &even(columns), &even(56)).lay_out_as_fan(columns / 2);
    grid.relax_uvs(600).scale_uvs(SKIRT_UV_PER_METRE).into_mesh()
}

/// Height of the bodice's upper edge: a heart in front, straight behind.
fn neckline(angle: f64) -> f64 {
    let front = bell(angle, -0.42, 0.30) + bell(angle, 0.42, 0.30);
    1.262 + 0.046 * front + 0.012 * bell(angle, 0.0, 1.6) + 0.02 * bell(angle.abs(), 1.45, 0.35)
        - 0.028 * bell(angle.abs(), PI, 0.7)
}

fn bodice(form: &Form) -> Mesh {
    let surface = |s: f64, t: f64| {
        let angle = TAU * (s - 0.5);
        form.at(angle, mix(WAIST - 0.02, neckline(angle), t), 0.0045)
    };
    let grid = Grid::sample(surface, &even(112), &even(48)).lay_out_as_fan(56);
    grid.relax_uvs(600).scale_uvs(BODICE_UV_PER_METRE).into_mesh()
}

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("dress", "studio");
    let sequins = Material::dielectric("sequins", [0.10, 0.055, 0.012], 0.0).double_sided();
    let sequins = scene.material(sequins.with_glint(Glint {
        count: 1e6,
        alpha: 0.1,
        gamma_deg: 6.0,
        seed: 6,
        color: [1.0, 0.78, 0.40],
    }));
    let tulle = Material::dielectric("midnight tulle", [0.006, 0.010, 0.050], 0.0).double_sided();
    let tulle = scene.material(tulle.with_glint(Glint {
        count: 1e5,
        alpha: 0.5,
        gamma_deg: 2.0,
        seed: 7,
        color: [0.16, 0.24, 0.62],
    }));
    let satin = scene.material(Material::dielectric("satin ribbon", [0.03, 0.035, 0.10], 0.4));
    let linen = scene.material(Material::dielectric("linen", [0.62, 0.55, 0.46], 0.9));
    let brass = scene.material(Material::metal("brass", [0.88, 0.66, 0.36], 0.25));
    let paper = scene.material(Material::dielectric("paper moon", [0.40, 0.17, 0.13], 0.9));
    let stage = scene.material(Material::dielectric("stage", [0.20, 0.17, 0.175], 0.85));

    let form = Form::new();
    let body = |s: f64, t: f64| form.at(TAU * (s - 0.5), mix(0.95, 1.60, t), 0.0);
    let body = Grid::sample(body, &even(56), &even(44)).lay_out(0, 0).into_mesh();
    let edge = parts::ring(
        |s| {
            let angle = TAU * (s - 0.5);
            form.at(angle, neckline(angle), 0.0045)
        },
        0.0035,
        DVec3::Y,
        6,
        112,
    );
    let ribbon = |s: f64, t: f64| {
        let (angle, bulge) = (TAU * (s - 0.5), maths::sin(PI * t));
        form.at(angle, WAIST + mix(-0.024, 0.022, t), 0.004 + 0.007 * maths::pow(bulge, 0.4))
    };
    let ribbon = Grid::sample(ribbon, &even(64), &even(8)).lay_out(0, 0).into_mesh();
    let finial = Spline::new(&[
        (0.0, 0.053),
        (0.12, 0.056),
        (0.2, 0.050),
        (0.3, 0.014),
        (0.4, 0.012),
        (0.55, 0.026),
        (0.8, 0.022),
        (1.0, 0.0),
    ]);
    let finial = parts::turned(|t| glam::DVec2::new(finial.at(t).max(0.0), 1.597 + 0.095 * t), 32, &even(32));
    let finial = finial.moved(DVec3::Z * 0.004);
    scene.add("gown", &[(&bodice(&form), sequins), (&skirt(&form), tulle), (&ribbon, satin), (&edge, satin)]);
    scene.add("form", &[(&body, linen), (&finial, brass)]);
    // A disc of paper stands behind, as a moon.
    let moon = |s: f64, t: f64| {
        let (angle, radius) = (TAU * s, 0.86 * (1.0 - t));
        DVec3::new(0.42 + radius * maths::cos(angle), 1.02 + radius * maths::sin(angle), -1.05)
    };
    let moon = Grid::sample(moon, &even(96), &even(4)).lay_out(0, 0).into_mesh();
    scene.add("stage", &[(&parts::sweep(8.0, 5.0, -1.6, 1.2, 5.0), stage), (&moon, paper)]);
    scene.point_light("key", DVec3::new(-1.6, 2.3, 2.2), [5.0, 4.6, 4.0]);
    scene.camera(DVec3::new(0.5, 1.12, 4.5), DVec3::new(0.16, 0.82, 0.0), 24.5);
    scene
}
