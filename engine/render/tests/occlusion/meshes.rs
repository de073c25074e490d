//! Meshes that are hard to build over or to hit.

use crate::random::Random;
use glam::{DQuat, DVec3};
use std::collections::HashMap;

/// Positions, and indices of three for each triangle.
#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Of triangles that share no vertex.
    pub fn soup(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let positions: Vec<[f32; 3]> =
            triangles.into_iter().flatten().map(|corner| corner.as_vec3().to_array()).collect();
        let indices = (0..positions.len() as u32).collect();
        Self { positions, indices }
    }

    /// This one's triangles, then the other's.
    pub fn and(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.indices.extend(other.indices.iter().map(|vertex| vertex + first));
        self
    }

    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// The corners of a triangle, exactly.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        std::array::from_fn(|k| DVec3::from(self.positions[self.indices[3 * triangle + k] as usize].map(f64::from)))
    }

    /// Each position moved, then rounded to f32.
    pub fn map(mut self, to: impl Fn(DVec3) -> DVec3) -> Self {
        for position in &mut self.positions {
            *position = to(DVec3::from(position.map(f64::from))).as_vec3().to_array();
        }
        self
    }
}

/// Every shape, with a name for messages.
pub fn all() -> Vec<(&'static str, Mesh)> {
    vec![
        ("empty", Mesh::default()),
        ("one", identical(1)),
        ("two", random_triangles(2, 0.8, 3)),
        ("identical", identical(10_000)),
        ("collinear centroids", collinear_centroids(1_000)),
        ("long sticks", long_sticks(2_000)),
        ("shrinking", shrinking(400)),
        ("60 nested boxes", nested_boxes(60)),
        ("stick of 1e6", stick_of_1e6()),
        ("soup", random_triangles(5_000, 0.05, 5)),
        ("icosphere", bumpy_icosphere(4)),
    ]
}

/// A closed sphere of radius about 1 with bumps: 20 * 4^levels triangles.
pub fn bumpy_icosphere(levels: u32) -> Mesh {
    let golden = (1.0 + 5.0f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = Vec::new();
    for (one, long) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        points.extend([DVec3::new(one, long, 0.0), DVec3::new(0.0, one, long), DVec3::new(long, 0.0, one)]);
    }
    // The faces of an icosahedron are the triples of vertices that are all neighbours, at distance 2.
    let near = |a: usize, b: usize| (points[a].distance(points[b]) - 2.0).abs() < 1e-6;
    let mut faces: Vec<[usize; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            faces.extend((b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(a, c)).map(|c| [a, b, c]));
        }
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push(points[a].normalize() + points[b].normalize());
                points.len() - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let positions = points
        .iter()
        .map(|point| {
            let unit = point.normalize();
            let bump = (13.0 * unit.x).sin() * (11.0 * unit.y).sin() * (17.0 * unit.z + 1.0).sin();
            (unit * (1.0 + 0.1 * bump)).as_vec3().to_array()
        })
        .collect();
    Mesh { positions, indices: faces.iter().flatten().map(|&vertex| vertex as u32).collect() }
}

/// Triangles of like size at random places in the cube of half extent 1.
pub fn random_triangles(count: usize, size: f64, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    Mesh::soup((0..count).map(|_| {
        let place = random.point();
        [(); 3].map(|()| place + size * random.point())
    }))
}

/// So many times the same triangle, tilted against all axes.
pub fn identical(count: usize) -> Mesh {
    let triangle = [DVec3::new(-0.6, -0.5, 0.1), DVec3::new(0.7, -0.4, 0.3), DVec3::new(0.1, 0.8, -0.6)];
    Mesh::soup(std::iter::repeat_n(triangle, count))
}

/// Triangles whose centroids lie on a line along x.
pub fn collinear_centroids(count: usize) -> Mesh {
    Mesh::soup((0..count).map(|k| {
        let centre = DVec3::X * (2.0 * k as f64 / count as f64 - 1.0);
        let size = 0.1 + 0.4 * (k % 7) as f64 / 7.0;
        [DVec3::new(0.0, size, 0.0), DVec3::new(0.0, -size / 2.0, size), DVec3::new(0.0, -size / 2.0, -size)]
            .map(|corner| centre + corner)
    }))
}

/// Triangles a thousand times longer than wide, in all directions through the cube.
pub fn long_sticks(count: usize) -> Mesh {
    let mut random = Random::new(11);
    Mesh::soup((0..count).map(|_| {
        let (end, other) = (random.point(), random.point());
        [end, other, end + 1e-3 * random.point()]
    }))
}

/// Triangles in a row towards the origin, over ten octaves of sizes: the heuristic peels off the largest, level by level.
pub fn shrinking(count: usize) -> Mesh {
    Mesh::soup((0..count).map(|k| {
        let size = 2.0 * 0.5f64.powf(10.0 * k as f64 / count as f64);
        [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| size * (DVec3::ONE + 0.2 * corner))
    }))
}

/// A triangle along x, 1e6 long and 1 wide, between small ones at its ends and beside its middle.
pub fn stick_of_1e6() -> Mesh {
    let [left, right] = [-5e5, 5e5].map(|x| x * DVec3::X);
    let beside = |place: DVec3, seed| random_triangles(100, 20.0, seed).map(|corner| place + 40.0 * DVec3::Y + corner);
    let stick = Mesh::soup([[left, right, right + DVec3::Y]]);
    stick.and(beside(left, 61)).and(beside(DVec3::ZERO, 62)).and(beside(right, 63))
}

/// Needles of 1 : 25,000, within the cube of half extent 1.
pub fn needles(count: usize) -> Mesh {
    let mut random = Random::new(5);
    Mesh::soup((0..count).map(|_| {
        let (at, along, across) = (random.point(), random.direction(), random.direction());
        [at, at + 0.5 * along, at + 0.25 * along + 2e-5 * across].map(|corner| 0.5 * corner)
    }))
}

/// A floor of large tiles, its lines at coordinates with all their bits in use, turned so that `up` is the axis of its
/// normal. Its boxes end where its seams are.
pub fn tiles(up: usize) -> Mesh {
    let mut random = Random::new(4);
    let mut lines = [0.0; 9];
    for (k, line) in lines.iter_mut().enumerate() {
        *line = f64::from((k as f64 - 4.0 + random.between(-0.3, 0.3)) as f32);
    }
    let turned = |x, y| [DVec3::new(0.0, x, y), DVec3::new(y, 0.0, x), DVec3::new(x, y, 0.0)][up];
    Mesh::soup((0..128).map(|k| {
        let (x, y, upper) = (k / 2 % 8, k / 16, k % 2 == 1);
        let corner = |i: usize, j: usize| turned(lines[x + i], lines[y + j]);
        if upper { [corner(1, 0), corner(1, 1), corner(0, 1)] } else { [corner(0, 0), corner(1, 0), corner(0, 1)] }
    }))
}

/// Triangles of like size at random places in the cube of half extent 1, neighbours near each other: lavapipe's own
/// hierarchy is only as good as the order of the triangles.
pub fn soup(count: usize, size: f64, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut places: Vec<DVec3> = (0..count).map(|_| random.point()).collect();
    // Along Morton's curve: the bits of the three coordinates in turn.
    places.sort_by_cached_key(|place| {
        let cell = ((*place + DVec3::ONE) * 512.0).as_uvec3().to_array();
        (0..10).fold(0u32, |key, bit| (0..3).fold(key, |key, axis| key | (cell[axis] >> bit & 1) << (3 * bit + axis)))
    });
    Mesh::soup(places.into_iter().map(|place| [(); 3].map(|()| place + size * random.point())))
}

/// Closed boxes inside each other, each smaller by a fifth and turned a little against the one around it.
pub fn nested_boxes(count: u32) -> Mesh {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.1);
    let mut mesh = Mesh::default();
    for depth in 0..count {
        // Every other box stands along the axes, so that rays along them graze its sides.
        let turn = if depth % 2 == 0 { DQuat::IDENTITY } else { turn };
        mesh = mesh.and(cube().map(|corner| 0.8f64.powi(depth as i32) * (turn * corner)));
    }
    mesh
}

/// The cube of half extent 1, closed.
pub fn cube() -> Mesh {
    let positions = (0..8).map(|corner| [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 }));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let indices = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
    Mesh { positions: positions.collect(), indices: indices.collect() }
}

/// A square of so many squares a side in the plane z = 0, between -1 and 1.
pub fn grid(side: u32) -> Mesh {
    let place = |k: u32| 2.0 * k as f32 / side as f32 - 1.0;
    let positions = (0..=side).flat_map(|y| (0..=side).map(move |x| [place(x), place(y), 0.0])).collect();
    let square = |x: u32, y: u32| {
        let [a, b] = [y * (side + 1) + x, (y + 1) * (side + 1) + x];
        [a, a + 1, b + 1, a, b + 1, b]
    };
    let indices = (0..side).flat_map(|y| (0..side).flat_map(move |x| square(x, y))).collect();
    Mesh { positions, indices }
}

/// The square from -1 to 1 in the plane z = 0, its middle of squares half as large, so often: sizes halve towards the middle.
pub fn ever_smaller_squares(times: i32) -> Mesh {
    let at = |[x, y]: [f64; 2], size: f64| DVec3::new(x, y, 0.0) * size;
    let square = |x: f64, y: f64, size: f64| {
        let [a, b, c, d] = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]].map(|corner| at(corner, size));
        [[a, b, c], [a, c, d]]
    };
    let side = [-2.0, -1.0, 0.0, 1.0];
    let cells = side.into_iter().flat_map(|y| side.map(|x| (x, y)));
    let outer = cells.filter(|&(x, y)| x == -2.0 || x == 1.0 || y == -2.0 || y == 1.0);
    Mesh::soup((0..times).flat_map(|time| {
        let size = 0.5f64.powi(time + 1);
        outer.clone().flat_map(move |(x, y)| square(x, y, size)).collect::<Vec<_>>()
    }))
}

/// Triangles whose corners are one point, or on a line, between ordinary ones.
pub fn without_area(count: usize) -> Mesh {
    let mut random = Random::new(23);
    Mesh::soup((0..count).map(|k| {
        let (a, b) = (random.point(), random.point());
        match k % 4 {
            0 => [a, a, a],
            1 => [a, b, b],
            2 => [a, b, (a + b) / 2.0],
            _ => [a, a + 0.3 * random.point(), a + 0.3 * random.point()],
        }
    }))
}

/// Triangles of all sizes and places between 1e-4 and 1e6.
pub fn of_all_sizes(count: usize) -> Mesh {
    let mut random = Random::new(29);
    Mesh::soup((0..count).map(|_| {
        let size = 10f64.powf(random.between(-4.0, 6.0));
        let place = size * random.direction();
        [(); 3].map(|()| place + 0.5 * size * random.point())
    }))
}

/// Triangles in one plane that lie over each other, askew to the axes.
pub fn in_one_plane(count: usize) -> Mesh {
    let mut random = Random::new(31);
    let [u, v] = [DVec3::new(0.6, 0.48, 0.64), DVec3::new(-0.8, 0.36, 0.48)];
    Mesh::soup((0..count).map(|_| {
        [(); 3].map(|()| random.between(-1.0, 1.0) * u + random.between(-1.0, 1.0) * v + DVec3::new(0.1, 0.2, 0.3))
    }))
}
