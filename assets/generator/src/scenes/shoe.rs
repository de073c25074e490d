//! A pair of glittering pumps, lofted round a last; the second is the first one mirrored.

use glam::{DVec2, DVec3};

use crate::glb::{Document, Glint, Material, Placement};
use crate::maths::{self, PI, Spline, TAU, bell, mix};
use crate::parts;
use crate::surface::{Grid, Mesh, even, span};

/// UV squares per metre: about five flakes in a pixel of a 1080-line picture from where the camera stands.
const UV_PER_METRE: f64 = 10.0;
/// Heel to toe along the ground, metres.
const LENGTH: f64 = 0.226;
/// Thickness of the upper, metres.
const UPPER: f64 = 0.0013;

/// The last: the form that a shoemaker builds the shoe around. The toe points to +X, the heel stands near x = 0,
/// and angle 0 round it is the tip of the toe, pi the back of the heel.
struct Last {
    half_width: Spline,
    centre: Spline,
    bottom: Spline,
    opening_half_width: Spline,
    opening_height: Spline,
}

impl Last {
    fn new() -> Self {
        Self {
            // Over the cosine of the angle, from the back of the heel to the tip of the toe.
            half_width: Spline::new(&[
                (-1.0, 0.0300),
                (-0.75, 0.0275),
                (-0.4, 0.0255),
                (-0.1, 0.0275),
                (0.2, 0.0350),
                (0.45, 0.0425),
                (0.7, 0.0430),
                (0.88, 0.0350),
                (1.0, 0.0235),
            ]),
            centre: Spline::new(&[(0.0, 0.0), (0.06, 0.001), (0.12, -0.002), (0.17, 0.001), (0.226, 0.006)]),
            // Height of the insole over x.
            bottom: Spline::new(&[
                (0.0, 0.0870),
                (0.025, 0.0850),
                (0.05, 0.0780),
                (0.08, 0.0590),
                (0.11, 0.0345),
                (0.135, 0.0165),
                (0.16, 0.0072),
                (0.185, 0.0056),
                (0.21, 0.0078),
                (0.226, 0.0105),
            ]),
            opening_half_width: Spline::new(&[
                (-1.0, 0.0235),
                (-0.6, 0.0255),
                (-0.2, 0.0260),
                (0.2, 0.0290),
                (0.6, 0.0315),
                (1.0, 0.0300),
            ]),
            // Height of the opening's edge above the insole under it.
            opening_height: Spline::new(&[
                (-1.0, 0.0540),
                (-0.75, 0.0500),
                (-0.35, 0.0370),
                (0.1, 0.0330),
                (0.5, 0.0345),
                (0.8, 0.0370),
                (1.0, 0.0385),
            ]),
        }
    }

    /// The edge of the insole; `shrink` 1 is the edge, 0 the middle line.
    fn insole(&self, angle: f64, shrink: f64) -> DVec3 {
        let along = maths::cos(angle);
        let x = LENGTH * 0.5 * (1.0 + along);
        let z = self.centre.at(x) + shrink * maths::sin(angle) * self.half_width.at(along);
        DVec3::new(x, self.bottom.at(x), z)
    }

    /// The edge of the opening that the foot goes in by.
    fn opening(&self, angle: f64) -> DVec3 {
        let along = maths::cos(angle);
        let x = mix(0.0030, 0.1600, 0.5 * (1.0 + along));
        let z = self.centre.at(x) + maths::sin(angle) * self.opening_half_width.at(along);
        DVec3::new(x, self.bottom.at(x) + self.opening_height.at(along), z)
    }

    /// The upper: `t` climbs from the insole's edge at 0 to the opening at 1 along a cubic that leaves upright and a
    /// little outward, and arrives along the foot.
    fn upper(&self, angle: f64, t: f64) -> DVec3 {
        let (from, to) = (self.insole(angle, 1.0), self.opening(angle));
        let h = 1e-4;
        let around = self.insole(angle + h, 1.0) - self.insole(angle - h, 1.0);
        let outward = DVec3::new(around.z, 0.0, -around.x).normalize();
        let outward = if outward.dot(from - to) < 0.0 && maths::cos(angle) > 0.5 { -outward } else { outward };
        let height = to.y - from.y;
        let reach = (from - to).with_y(0.0);
        let heel = bell(angle.abs(), PI, 0.6);
        let leave = DVec3::Y * height * mix(0.42, 0.40, heel) + outward * mix(0.0035, 0.0075, heel);
        let arrive =
            reach * 0.52 - DVec3::Y * height * mix(0.22, 0.42, 1.0 - bell(angle, 0.0, 0.9)) + outward * heel * 0.004;
        let (a, b, c, d) = (from, from + leave, to + arrive, to);
        let u = 1.0 - t;
        a * (u * u * u) + b * (3.0 * u * u * t) + c * (3.0 * u * t * t) + d * (t * t * t)
    }
}

/// Angles round the last, from the back of the heel over the outer side to the back again; closer about the toe.
fn angles(n: usize) -> Vec<f64> {
    even(n).into_iter().map(|s| TAU * (s - 0.5)).map(|a| a - 0.35 * maths::sin(a)).collect()
}

/// The glittering upper, unrolled as a shoemaker would cut it: a horseshoe with its seam at the back of the heel.
fn upper(last: &Last) -> Mesh {
    let columns = angles(200);
    // Angles run clockwise seen from above, so that the outside is out.
    let grid = Grid::sample(|angle, t| last.upper(-angle, t), &columns, &even(36));
    let (middle, top) = (grid.columns / 2, grid.rows - 1);
    let climb = |column: usize, row: usize| {
        let step = |r: usize| grid.positions[grid.index(column, r)].distance(grid.positions[grid.index(column, r - 1)]);
        (1..=row).map(step).sum::<f64>()
    };
    // A start for the springs without folds: two nested horseshoes as long as the upper's edges, and straight between.
    let (outer, inner) = (horseshoe(&grid, 0, 0.062), horseshoe(&grid, top, 0.026));
    let back = DVec2::new(climb(middle, top), 0.0);
    let starts: Vec<DVec2> = (0..grid.rows * grid.columns)
        .map(|i| {
            let (column, row) = (i % grid.columns, i / grid.columns);
            outer[column].lerp(inner[column] - back, climb(column, row) / climb(column, top))
        })
        .collect();
    Grid { uvs: starts, ..grid }.relax_uvs(1500).scale_uvs(UV_PER_METRE).into_mesh()
}

/// An edge of the upper laid flat at its own length: round at the toe, then straight back, `half_width` to either side.
fn horseshoe(grid: &Grid, row: usize, half_width: f64) -> Vec<DVec2> {
    let middle = grid.columns / 2;
    let mut points = vec![DVec2::ZERO; grid.columns];
    for side in [-1_isize, 1] {
        let (mut run, mut x) = (0.0, 0.0);
        for step in 1..=middle as isize {
            let column = |step: isize| (middle as isize + side * step) as usize;
            let length = grid.positions[grid.index(column(step), row)]
                .distance(grid.positions[grid.index(column(step - 1), row)]);
            let across = |run: f64| half_width * run / maths::hypot(run, half_width);
            let y = across(run + length) - across(run);
            x -= (length * length - y * y).max(0.0).sqrt();
            run += length;
            points[column(step)] = DVec2::new(x, side as f64 * across(run));
        }
    }
    points
}

/// The lining: the upper again, a leather's thickness further in.
fn lining(last: &Last) -> Mesh {
    let mut grid = Grid::sample(|a, t| last.upper(-a, t), &angles(120), &even(20)).lay_out(0, 0);
    for (position, normal) in grid.positions.iter_mut().zip(&grid.normals) {
        *position -= *normal * UPPER;
    }
    grid.into_mesh().flipped()
}

/// What the foot stands on.
fn insole(last: &Last) -> Mesh {
    let surface = |t: f64, side: f64| {
        let angle = PI * (1.0 - t);
        let edge = last.insole(angle, side * 0.985);
        // A dished leather: lowest along its middle.
        edge + DVec3::Y * (0.0012 + 0.002 * side * side)
    };
    Grid::sample(surface, &even(60), &span(-1.0, 1.0, 12)).lay_out(0, 0).into_mesh().flipped()
}

/// The sole: its rim stands out a little from the upper, its underside is flat across.
fn sole(last: &Last) -> Mesh {
    let thickness = |x: f64| mix(0.0022, 0.0042, maths::smoothstep(0.10, 0.16, x));
    let point = |angle: f64, out: f64, down: f64| {
        let edge = last.insole(angle, 1.0);
        let h = 1e-4;
        let around = last.insole(angle + h, 1.0) - last.insole(angle - h, 1.0);
        let mut outward = DVec3::new(around.z, 0.0, -around.x).normalize();
        if outward.dot(edge - DVec3::new(0.113, 0.0, 0.0)) < 0.0 && maths::sin(angle).abs() < 0.1 {
            outward = -outward;
        }
        edge + outward * out - DVec3::Y * down * thickness(edge.x)
    };
    let rim = |angle: f64, t: f64| {
        let bulge = maths::sin(PI * t);
        point(-angle, 0.0004 + 0.0011 * bulge, 1.0 - t * 1.1)
    };
    let mut mesh = Grid::sample(rim, &angles(140), &even(6)).lay_out(0, 0).into_mesh();
    let under = |t: f64, side: f64| {
        let edge = last.insole(PI * (1.0 - t), side);
        edge - DVec3::Y * thickness(edge.x)
    };
    mesh.append(&Grid::sample(under, &even(60), &span(-1.0, 1.0, 8)).lay_out(0, 0).into_mesh());
    mesh
}

/// The heel: the plan of the heel seat, drawn down to a small tip under the back of it.
fn heel(last: &Last) -> Mesh {
    const BREAST: f64 = 0.050;
    // Of the section at each height, 0 the ground and 1 the seat: half width, back and depth, metres.
    let middle = 0.45 * BREAST;
    let plan_half_width = |x: f64| {
        let along = 2.0 * x / LENGTH - 1.0;
        last.half_width.at(along) * (1.0 - along * along).max(0.0).sqrt()
    };
    let seat_half_width = plan_half_width(middle);
    let width = [0.0044, 0.0045, 0.0051, 0.0085, 0.0170, seat_half_width];
    let depth = [0.0088, 0.0092, 0.0108, 0.0170, 0.0330, BREAST];
    let back = [0.0150, 0.0138, 0.0108, 0.0052, 0.0014, 0.0];
    let spline =
        |values: [f64; 6]| Spline::new(&[0.0, 0.25, 0.5, 0.75, 0.92, 1.0].into_iter().zip(values).collect::<Vec<_>>());
    let (width, depth, back) = (spline(width), spline(depth), spline(back));
    let surface = |s: f64, t: f64| {
        let angle = TAU * (s - 0.5);
        let (cos, sin) = (maths::cos(angle), maths::sin(angle));
        // At the back the last's own outline, at the breast a flat front with rounded corners.
        let (x, z) = if cos < 0.0 {
            let x = middle * (1.0 + cos);
            (x, plan_half_width(x).copysign(sin))
        } else {
            let x = middle + (BREAST - middle) * maths::pow(cos, 0.55);
            (x, seat_half_width * maths::signed_pow(sin, 0.55))
        };
        let x = back.at(t) + depth.at(t) * x / BREAST;
        let z = last.centre.at(x) + width.at(t) * z / seat_half_width;
        DVec3::new(x, t * (last.bottom.at(x) - 0.0018), z)
    };
    let mut mesh = Grid::sample(surface, &even(64), &even(40)).lay_out(0, 0).into_mesh().flipped();
    let tip = |s: f64, t: f64| surface(s, 0.0) * (1.0 - t) + DVec3::new(0.019, 0.0, 0.0) * t;
    mesh.append(&Grid::sample(tip, &even(32), &even(1)).lay_out(0, 0).into_mesh().flipped());
    mesh
}

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("shoe", "studio");
    let ruby = scene.material(Material::dielectric("ruby glitter", [0.16, 0.004, 0.012], 0.0).with_glint(Glint {
        count: 1e6,
        alpha: 0.1,
        gamma_deg: 6.0,
        seed: 3,
        color: [0.92, 0.13, 0.14],
    }));
    let leather = scene.material(Material::dielectric("cream leather", [0.62, 0.50, 0.38], 0.55));
    let patent = scene.material(Material::dielectric("black patent", [0.012, 0.011, 0.011], 0.25));
    let gold = scene.material(Material::metal("gold", [0.95, 0.70, 0.42], 0.28));
    let stage = scene.material(Material::dielectric("stage", [0.20, 0.19, 0.205], 0.8));

    let last = Last::new();
    let piping = parts::ring(|s| last.opening(TAU * s) - DVec3::Y * 0.0002, 0.0011, DVec3::Y, 10, 160);
    let shoe = scene.mesh(
        "pump",
        &[
            (&upper(&last), ruby),
            (&lining(&last), leather),
            (&insole(&last), leather),
            (&piping, gold),
            (&sole(&last), patent),
            (&heel(&last), gold),
        ],
    );
    scene.place("standing", shoe, Placement::at(DVec3::new(-0.10, 0.0, 0.02)).turned(DVec3::Y, -28.0));
    scene.place(
        "sister",
        shoe,
        Placement::at(DVec3::new(0.125, 0.0, -0.145)).scaled(DVec3::new(1.0, 1.0, -1.0)).turned(DVec3::Y, 198.0),
    );
    scene.add("stage", &[(&parts::sweep(3.0, 2.0, -0.6, 0.5, 1.6), stage)]);
    scene.point_light("key", DVec3::new(-0.5, 0.9, 0.6), [0.9, 0.85, 0.75]);
    scene.camera(DVec3::new(0.10, 0.19, 0.62), DVec3::new(0.008, 0.056, -0.02), 20.5);
    scene
}
