//! A coupe in metallic paint under clear lacquer: its body and cabin are splines through two nets of points.

use glam::{DVec2, DVec3};

use crate::glb::{Clearcoat, Document, Glint, Material, Placement};
use crate::maths::{self, PI, Spline, TAU, mix};
use crate::parts;
use crate::surface::{Grid, Mesh, even, span};

/// UV squares per metre of paint: some ten flakes a pixel from the camera's place.
const UV_PER_METRE: f64 = 0.8;
/// Where the wheels stand, metres; +X is forward.
const AXLES: [f64; 2] = [-1.36, 1.40];
const WHEEL_RADIUS: f64 = 0.345;
const ARCH_RADIUS: f64 = 0.405;

/// Points of the left half of a shell, from the middle of the top outward and down, station by station from the rear to
/// the front: x forward, y up, z to the side, metres.
type Net<const N: usize> = [[[f64; 3]; N]];

const BODY: &Net<7> = &[
    [
        [-2.20, 0.26, 0.00],
        [-2.19, 0.26, 0.38],
        [-2.14, 0.26, 0.62],
        [-2.07, 0.26, 0.76],
        [-1.99, 0.25, 0.83],
        [-1.90, 0.24, 0.87],
        [-1.78, 0.21, 0.885],
    ],
    [
        [-2.24, 0.46, 0.00],
        [-2.23, 0.46, 0.40],
        [-2.18, 0.46, 0.66],
        [-2.10, 0.46, 0.80],
        [-2.00, 0.43, 0.88],
        [-1.90, 0.37, 0.91],
        [-1.76, 0.22, 0.895],
    ],
    [
        [-2.26, 0.72, 0.00],
        [-2.25, 0.72, 0.40],
        [-2.20, 0.72, 0.66],
        [-2.11, 0.71, 0.81],
        [-1.98, 0.62, 0.90],
        [-1.86, 0.45, 0.925],
        [-1.70, 0.22, 0.895],
    ],
    [
        [-2.22, 0.90, 0.00],
        [-2.21, 0.895, 0.38],
        [-2.14, 0.89, 0.63],
        [-2.02, 0.865, 0.79],
        [-1.86, 0.70, 0.915],
        [-1.74, 0.47, 0.935],
        [-1.60, 0.22, 0.895],
    ],
    [
        [-1.92, 0.93, 0.00],
        [-1.91, 0.925, 0.37],
        [-1.86, 0.925, 0.62],
        [-1.76, 0.905, 0.80],
        [-1.66, 0.73, 0.935],
        [-1.60, 0.48, 0.95],
        [-1.52, 0.22, 0.90],
    ],
    [
        [-1.36, 0.92, 0.00],
        [-1.36, 0.925, 0.37],
        [-1.36, 0.93, 0.63],
        [-1.36, 0.905, 0.82],
        [-1.36, 0.73, 0.955],
        [-1.36, 0.48, 0.955],
        [-1.36, 0.22, 0.90],
    ],
    [
        [-0.75, 0.88, 0.00],
        [-0.75, 0.885, 0.38],
        [-0.75, 0.90, 0.66],
        [-0.75, 0.86, 0.825],
        [-0.75, 0.67, 0.925],
        [-0.75, 0.43, 0.905],
        [-0.75, 0.20, 0.865],
    ],
    [
        [0.00, 0.86, 0.00],
        [0.00, 0.865, 0.38],
        [0.00, 0.875, 0.67],
        [0.00, 0.835, 0.82],
        [0.00, 0.645, 0.905],
        [0.00, 0.41, 0.88],
        [0.00, 0.19, 0.85],
    ],
    [
        [0.75, 0.85, 0.00],
        [0.75, 0.85, 0.38],
        [0.75, 0.85, 0.66],
        [0.75, 0.815, 0.82],
        [0.75, 0.645, 0.905],
        [0.75, 0.42, 0.89],
        [0.75, 0.19, 0.86],
    ],
    [
        [1.40, 0.775, 0.00],
        [1.40, 0.765, 0.38],
        [1.40, 0.78, 0.62],
        [1.40, 0.785, 0.79],
        [1.40, 0.66, 0.925],
        [1.40, 0.45, 0.935],
        [1.40, 0.20, 0.885],
    ],
    [
        [1.86, 0.685, 0.00],
        [1.85, 0.675, 0.38],
        [1.82, 0.68, 0.60],
        [1.78, 0.685, 0.765],
        [1.72, 0.60, 0.895],
        [1.69, 0.43, 0.925],
        [1.64, 0.20, 0.885],
    ],
    [
        [2.14, 0.595, 0.00],
        [2.12, 0.59, 0.38],
        [2.06, 0.595, 0.60],
        [1.97, 0.60, 0.755],
        [1.87, 0.53, 0.865],
        [1.80, 0.40, 0.905],
        [1.73, 0.20, 0.88],
    ],
    [
        [2.27, 0.47, 0.00],
        [2.245, 0.47, 0.38],
        [2.165, 0.47, 0.61],
        [2.06, 0.46, 0.755],
        [1.94, 0.42, 0.845],
        [1.86, 0.35, 0.885],
        [1.78, 0.20, 0.875],
    ],
    [
        [2.265, 0.33, 0.00],
        [2.24, 0.33, 0.38],
        [2.165, 0.33, 0.61],
        [2.065, 0.32, 0.75],
        [1.96, 0.305, 0.835],
        [1.88, 0.28, 0.875],
        [1.80, 0.20, 0.87],
    ],
    [
        [2.20, 0.20, 0.00],
        [2.18, 0.20, 0.37],
        [2.11, 0.20, 0.59],
        [2.02, 0.20, 0.725],
        [1.94, 0.20, 0.81],
        [1.88, 0.20, 0.85],
        [1.82, 0.19, 0.865],
    ],
];

const CABIN: &Net<5> = &[
    [[-2.02, 0.915, 0.00], [-2.00, 0.915, 0.32], [-1.92, 0.915, 0.55], [-1.80, 0.91, 0.68], [-1.62, 0.905, 0.765]],
    [[-1.58, 1.055, 0.00], [-1.56, 1.050, 0.31], [-1.49, 1.025, 0.51], [-1.40, 0.975, 0.64], [-1.28, 0.905, 0.785]],
    [[-1.02, 1.210, 0.00], [-1.01, 1.200, 0.29], [-0.97, 1.150, 0.49], [-0.92, 1.045, 0.63], [-0.86, 0.895, 0.80]],
    [[-0.42, 1.272, 0.00], [-0.42, 1.260, 0.29], [-0.41, 1.200, 0.495], [-0.40, 1.065, 0.645], [-0.39, 0.880, 0.805]],
    [[0.06, 1.235, 0.00], [0.05, 1.223, 0.29], [0.04, 1.165, 0.50], [0.03, 1.040, 0.65], [0.02, 0.870, 0.805]],
    [[0.58, 1.055, 0.00], [0.55, 1.045, 0.31], [0.48, 1.005, 0.535], [0.43, 0.945, 0.67], [0.38, 0.862, 0.80]],
    [[1.12, 0.805, 0.00], [1.08, 0.810, 0.33], [0.98, 0.815, 0.57], [0.88, 0.825, 0.69], [0.74, 0.840, 0.785]],
];

/// A spline surface through a net: `q` counts points from the middle, negative to the right; `station` from the rear.
struct Shell {
    rows: Vec<[Spline; 3]>,
    outermost: f64,
    stations: f64,
}

impl Shell {
    fn new<const N: usize>(net: &Net<N>) -> Self {
        let rows = (0..N).map(|point| {
            [0, 1, 2].map(|axis| {
                Spline::new(&net.iter().enumerate().map(|(i, s)| (i as f64, s[point][axis])).collect::<Vec<_>>())
            })
        });
        Self { rows: rows.collect(), outermost: (N - 1) as f64, stations: (net.len() - 1) as f64 }
    }

    fn at(&self, q: f64, station: f64) -> DVec3 {
        let last = self.rows.len() as isize - 1;
        // The section is splined over both halves, so that its curvature goes on across the middle.
        let axis = |axis: usize| {
            let knots: Vec<_> = (-last..=last)
                .map(|k| {
                    let value = self.rows[k.unsigned_abs()][axis].at(station);
                    (k as f64, if axis == 2 && k < 0 { -value } else { value })
                })
                .collect();
            Spline::new(&knots).at(q)
        };
        DVec3::new(axis(0), axis(1), axis(2))
    }

    fn normal(&self, q: f64, station: f64) -> DVec3 {
        let h = 1e-4;
        let along_q = self.at(q + h, station) - self.at(q - h, station);
        along_q.cross(self.at(q, station + h) - self.at(q, station - h)).normalize()
    }

    /// A patch that lies on the shell, `lift` metres above it in its middle: lamps, grilles.
    fn patch(&self, centre: DVec2, radii: DVec2, lean: f64, lift: f64) -> Mesh {
        let surface = |s: f64, t: f64| {
            let (angle, r) = (TAU * s, 1.0 - t);
            let (c, d) = (maths::cos(angle), maths::sin(angle));
            let offset = DVec2::new(maths::signed_pow(c, 0.8), maths::signed_pow(d, 0.8)) * radii * r;
            let (q, station) = (centre.x + offset.x, centre.y + offset.y + lean * offset.x);
            self.at(q, station) + self.normal(q, station) * (0.0015 + lift * (1.0 - r * r))
        };
        Grid::sample(surface, &even(40), &even(8)).lay_out(0, 0).into_mesh()
    }

    /// A dark joint along a line of (q, station) points on the shell.
    fn joint(&self, points: &[(f64, f64)]) -> Mesh {
        let knot = |i: usize| i as f64 / (points.len() - 1) as f64;
        let q = Spline::new(&points.iter().enumerate().map(|(i, p)| (knot(i), p.0)).collect::<Vec<_>>());
        let station = Spline::new(&points.iter().enumerate().map(|(i, p)| (knot(i), p.1)).collect::<Vec<_>>());
        parts::tube(|t| self.at(q.at(t), station.at(t)), |_| 0.0032, 6, 9 * (points.len() - 1))
    }
}

/// The painted body, cut out round the wheels.
fn body(shell: &Shell) -> Grid {
    // Rows stand close where an arch begins and ends, which is where its edge is upright.
    let mut stations = span(0.0, shell.stations, 130);
    for axle in AXLES {
        for side in [-1.0, 1.0] {
            for inset in [-0.001, 0.001, 0.006, 0.02, 0.05] {
                let x = axle + side * (ARCH_RADIUS - inset);
                let (mut low, mut high) = (0.0, shell.stations);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if shell.at(4.6, middle).x < x { low = middle } else { high = middle }
                }
                stations.push(low);
            }
        }
    }
    stations.sort_by(f64::total_cmp);
    let outside = |q: f64, station: f64| {
        let p = shell.at(q, station);
        AXLES.iter().all(|axle| maths::hypot(p.x - axle, p.y - WHEEL_RADIUS) > ARCH_RADIUS)
    };
    let edges: Vec<f64> = stations
        .iter()
        .map(|&station| {
            let first = (0..=80).map(|i| 3.0 + 3.0 * f64::from(i) / 80.0).find(|&q| !outside(q, station));
            first.map_or(shell.outermost, |q| {
                let (mut low, mut high) = (q - 3.0 / 80.0, q);
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    if outside(middle, station) { low = middle } else { high = middle }
                }
                low
            })
        })
        .collect();
    let columns = 81;
    let parameters = |column: usize, row: usize| {
        let s = 2.0 * column as f64 / (columns - 1) as f64 - 1.0;
        (s * edges[row], stations[row])
    };
    let reach = shell.outermost;
    // Counted from the right to the left (+Z), so that outside is out.
    Grid::sample_at(
        |s, t| shell.at(s, t),
        (-reach, reach),
        (0.0, shell.stations),
        (columns, stations.len()),
        parameters,
    )
}

/// A five-spoked wheel and its tyre about the Z axis, outer side to +Z.
fn wheel() -> (Mesh, Mesh) {
    let tyre = |s: f64, t: f64| {
        let (angle, round) = (-TAU * s, PI * t);
        let radius = 0.245 + (WHEEL_RADIUS - 0.245) * maths::pow(maths::sin(round), 0.35);
        let z = -0.118 * maths::signed_pow(maths::cos(round), 0.55);
        DVec3::new(radius * maths::cos(angle), radius * maths::sin(angle), z)
    };
    let tyre = Grid::sample(tyre, &even(64), &even(20)).lay_out(0, 0).into_mesh().flipped();
    let rim = |s: f64, t: f64| {
        let (angle, radius) = (TAU * s, 0.262 * (1.0 - t));
        let share = radius / 0.262;
        let spoke = maths::smoothstep(-0.25, 0.35, maths::cos(5.0 * angle) - 0.9 * (share - 0.55));
        let lip = maths::smoothstep(0.88, 0.95, share);
        let hub = 1.0 - maths::smoothstep(0.16, 0.26, share);
        let face = spoke.max(lip).max(hub);
        let dish = 0.045 * (1.0 - share * share);
        let z = mix(0.015, 0.108 - dish, face);
        DVec3::new(radius * maths::cos(angle), radius * maths::sin(angle), z)
    };
    let rim = Grid::sample(rim, &even(120), &even(22)).lay_out(0, 0).into_mesh();
    (tyre, rim)
}

/// The scene.
pub fn scene() -> Document {
    let mut scene = Document::new("car", "studio");
    let paint = Material::dielectric("flake paint", [0.004, 0.010, 0.045], 0.0).with_glint(Glint {
        count: 1e6,
        alpha: 0.15,
        gamma_deg: 4.0,
        seed: 8,
        color: [0.16, 0.34, 0.80],
    });
    let paint = scene.material(Material { clearcoat: Some(Clearcoat { factor: 1.0, roughness: 0.03 }), ..paint });
    let glass = scene.material(Material::dielectric("dark glass", [0.006, 0.007, 0.008], 0.05));
    let rubber = scene.material(Material::dielectric("rubber", [0.018, 0.018, 0.019], 0.75));
    let alloy = scene.material(Material::metal("alloy", [0.78, 0.79, 0.81], 0.3));
    let black = scene.material(Material::dielectric("black", [0.008, 0.008, 0.009], 0.6).double_sided());
    let lamp = scene.material(Material { emissive: [1.0, 0.97, 0.9], ..Material::dielectric("lamp", [0.6; 3], 0.1) });
    let tail = Material::dielectric("tail lamp", [0.25, 0.004, 0.006], 0.1);
    let tail = scene.material(Material { emissive: [0.55, 0.01, 0.012], ..tail });
    let floor = scene.material(Material::dielectric("stage", [0.16, 0.165, 0.175], 0.55));

    let shell = Shell::new(BODY);
    let body = body(&shell);
    let (spine, belt) = (body.columns / 2, body.rows / 2);
    let body = body.lay_out(spine, belt).relax_uvs(1500).scale_uvs(UV_PER_METRE).into_mesh();

    let cabin = Shell::new(CABIN);
    let (reach, length) = (cabin.outermost, cabin.stations);
    let (columns, rows) = (span(-reach, reach, 64), span(0.0, length, 72));
    let grid =
        Grid::sample_at(|q, t| cabin.at(q, t), (-reach, reach), (0.0, length), (65, 73), |c, r| (columns[c], rows[r]));
    let grid = grid.lay_out(32, 36).relax_uvs(600).scale_uvs(UV_PER_METRE);
    let glazed = |column: usize, row: usize| {
        let q = 0.5 * (columns[column] + columns[column + 1]).abs();
        let station = 0.5 * (rows[row] + rows[row + 1]);
        let front = station > 4.3 && q < 1.9;
        let back = (0.35..1.9).contains(&station) && q < 1.7;
        let side = (2.35..3.95).contains(&q) && (1.45..5.75).contains(&station);
        front || back || side
    };
    let windows = grid.part(glazed);
    let roof = grid.part(|column, row| !glazed(column, row));
    scene.add("shell", &[(&body, paint), (&roof, paint), (&windows, glass)]);

    let mut lamps = Mesh::default();
    let mut tails = Mesh::default();
    let mut dark = Mesh::default();
    for side in [-1.0, 1.0] {
        lamps.append(&shell.patch(DVec2::new(side * 3.05, 11.35), DVec2::new(0.62, 0.20), side * -0.25, 0.006));
        tails.append(&shell.patch(DVec2::new(side * 2.2, 2.35), DVec2::new(1.15, 0.17), side * 0.05, 0.006));
        for line in [
            &[(2.6, 8.55), (3.5, 8.6), (4.6, 8.55), (5.6, 8.35)][..],
            &[(2.6, 6.35), (3.5, 6.3), (4.6, 6.35), (5.6, 6.7)],
            &[(5.6, 8.35), (5.65, 7.5), (5.6, 6.7)],
            &[(2.1, 8.9), (2.35, 9.8), (2.5, 10.6), (2.3, 11.2), (1.2, 11.35), (0.0, 11.4)],
        ] {
            let line: Vec<_> = line.iter().map(|(q, station)| (side * q, *station)).collect();
            dark.append(&shell.joint(&line));
        }
    }
    dark.append(&shell.patch(DVec2::new(0.0, 12.75), DVec2::new(2.3, 0.62), 0.0, 0.001));
    dark.append(&shell.patch(DVec2::new(0.0, 0.55), DVec2::new(2.6, 0.38), 0.0, 0.001));
    // What is seen under the car and behind the wheels.
    let tunnel = parts::soft_box(DVec3::new(2.02, 0.18, 0.60), 0.25, 32).moved(DVec3::new(0.0, 0.36, 0.0));
    dark.append(&tunnel);
    for axle in AXLES {
        let liner = |s: f64, t: f64| {
            let angle = PI * (1.15 - 1.3 * s);
            let r = ARCH_RADIUS + 0.004;
            DVec3::new(axle + r * maths::cos(angle), WHEEL_RADIUS + r * maths::sin(angle), mix(-0.89, 0.89, t))
        };
        dark.append(&Grid::sample(liner, &even(32), &even(2)).lay_out(0, 0).into_mesh());
    }
    scene.add("fittings", &[(&dark, black), (&lamps, lamp), (&tails, tail)]);

    let mut mirrors = Mesh::default();
    let mirror = parts::soft_box(DVec3::new(0.075, 0.062, 0.105), 0.75, 32).moved(DVec3::new(0.52, 0.925, 0.955));
    mirrors.append(&mirror);
    mirrors.append(&mirror.mirrored_in_z());
    scene.add("mirrors", &[(&mirrors, glass)]);

    let (tyre, rim) = wheel();
    let wheel = scene.mesh("wheel", &[(&tyre, rubber), (&rim, alloy)]);
    for (name, x, z) in [
        ("rear left wheel", AXLES[0], 0.80),
        ("front left wheel", AXLES[1], 0.79),
        ("rear right wheel", AXLES[0], -0.80),
        ("front right wheel", AXLES[1], -0.79),
    ] {
        let placement = Placement::at(DVec3::new(x, WHEEL_RADIUS, z));
        let turned = if z > 0.0 { placement } else { placement.turned(DVec3::Y, 180.0) };
        scene.place(name, wheel, turned);
    }
    let stage = scene.mesh("stage", &[(&parts::sweep(14.0, 9.0, -5.0, 2.5, 7.0), floor)]);
    scene.place("stage", stage, Placement::IDENTITY.turned(DVec3::Y, 40.0));
    scene.point_light("key", DVec3::new(3.0, 4.5, 4.0), [9.0, 9.0, 9.0]);
    scene.camera(DVec3::new(4.3, 1.35, 5.1), DVec3::new(0.12, 0.52, 0.0), 25.0);
    scene
}
