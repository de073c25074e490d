//! Meshes that are hard to build over or to hit, and seeded random numbers.

use glam::{DAffine3, DQuat, DVec3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
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

/// Seeded random numbers.
pub struct Random(Pcg64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// In the cube of half extent 1.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// Uniform on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        loop {
            let point = self.point();
            let length = point.length();
            if (1e-3..1.0).contains(&length) {
                return point / length;
            }
        }
    }
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
        ("soup", random_triangles(5_000, 0.05, 5)),
        ("icosphere", bumpy_icosphere(4)),
    ]
}

/// Twelve placements of one mesh: turned, scaled by different factors along its axes, every third one mirrored.
pub fn twelve_places() -> Vec<(usize, DAffine3)> {
    let mut random = Random::new(7);
    (0..12)
        .map(|k| {
            let mirror = if k % 3 == 0 { -1.0 } else { 1.0 };
            let scale =
                DVec3::new(random.between(0.2, 0.5), mirror * random.between(0.2, 0.5), random.between(0.2, 0.5));
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
            let place = DVec3::new((k % 4) as f64 - 1.5, (k / 4) as f64 - 1.0, random.between(-0.5, 0.5));
            (0, DAffine3::from_scale_rotation_translation(scale, turn, place))
        })
        .collect()
}
