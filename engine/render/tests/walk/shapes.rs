//! Meshes that are hard for rays, and seeded random numbers.

use glam::{DAffine3, DQuat, DVec3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

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

/// So many times the same triangle, tilted against all axes.
pub fn identical(count: usize) -> Mesh {
    let triangle = [DVec3::new(-0.6, -0.5, 0.1), DVec3::new(0.7, -0.4, 0.3), DVec3::new(0.1, 0.8, -0.6)];
    Mesh::soup(std::iter::repeat_n(triangle, count))
}

/// Triangles of like size at random places in the cube of half extent 1.
pub fn random_triangles(count: usize, size: f64, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    Mesh::soup((0..count).map(|_| {
        let place = random.point();
        [(); 3].map(|()| place + size * random.point())
    }))
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
