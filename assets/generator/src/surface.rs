//! Parametric surfaces made into meshes: sampled over a grid, with normals of the surface itself rather than of its facets.

use glam::{DVec2, DVec3};

/// Triangles, counter-clockwise seen from outside; one normal and one UV per vertex.
#[derive(Clone, Default)]
pub struct Mesh {
    /// Metres.
    pub positions: Vec<DVec3>,
    /// Unit, outward.
    pub normals: Vec<DVec3>,
    /// Texture coordinates; one unit is one UV square's side.
    pub uvs: Vec<DVec2>,
    /// Three per triangle.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Adds another mesh's triangles.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|i| i + base));
    }

    /// The same triangles seen from the other side.
    pub fn flipped(mut self) -> Self {
        for triangle in self.indices.chunks_exact_mut(3) {
            triangle.swap(1, 2);
        }
        for normal in &mut self.normals {
            *normal = -*normal;
        }
        self
    }

    /// Every position moved by `by`.
    pub fn moved(mut self, by: DVec3) -> Self {
        for position in &mut self.positions {
            *position += by;
        }
        self
    }

    /// Mirrored in the plane z = 0, still outside out.
    pub fn mirrored_in_z(mut self) -> Self {
        for vector in self.positions.iter_mut().chain(&mut self.normals) {
            vector.z = -vector.z;
        }
        for triangle in self.indices.chunks_exact_mut(3) {
            triangle.swap(1, 2);
        }
        self
    }
}

/// `n + 1` numbers from 0 to 1 in equal steps.
pub fn even(n: usize) -> Vec<f64> {
    span(0.0, 1.0, n)
}

/// `n + 1` numbers from `a` to `b` in equal steps.
pub fn span(a: f64, b: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| a + (b - a) * i as f64 / n as f64).collect()
}

/// A surface sampled at the crossings of its columns (constant `s`) and rows (constant `t`), row by row.
pub struct Grid {
    /// Samples in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Metres.
    pub positions: Vec<DVec3>,
    /// Unit; on the side where `s` turns counter-clockwise into `t`.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, zero until set.
    pub uvs: Vec<DVec2>,
}

impl Grid {
    /// Samples `surface(s, t)` at every pair of the given parameters, both increasing; see [`Grid::sample_at`].
    pub fn sample(surface: impl Fn(f64, f64) -> DVec3, s: &[f64], t: &[f64]) -> Self {
        let (s_range, t_range) = ((s[0], s[s.len() - 1]), (t[0], t[t.len() - 1]));
        Self::sample_at(surface, s_range, t_range, (s.len(), t.len()), |column, row| (s[column], t[row]))
    }

    /// Samples `surface(s, t)`, defined over the two ranges, at the parameters of every column and row. Normals come
    /// from differences in f64, central or at the ranges' ends one-sided; where the surface shrinks to a pole they are
    /// taken beside it.
    pub fn sample_at(
        surface: impl Fn(f64, f64) -> DVec3,
        s_range: (f64, f64),
        t_range: (f64, f64),
        (columns, rows): (usize, usize),
        parameters: impl Fn(usize, usize) -> (f64, f64),
    ) -> Self {
        let (width, height) = (s_range.1 - s_range.0, t_range.1 - t_range.0);
        // Both tangents per whole range, so that their lengths can be compared.
        let tangents = |s: f64, t: f64| {
            let (hs, ht) = (1e-5 * width, 1e-5 * height);
            let (s0, s1) = ((s - hs).max(s_range.0), (s + hs).min(s_range.1));
            let (t0, t1) = ((t - ht).max(t_range.0), (t + ht).min(t_range.1));
            let along_s = (surface(s1, t) - surface(s0, t)) / (s1 - s0) * width;
            let along_t = (surface(s, t1) - surface(s, t0)) / (t1 - t0) * height;
            (along_s, along_t)
        };
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for row in 0..rows {
            for column in 0..columns {
                let (s, t) = parameters(column, row);
                positions.push(surface(s, t));
                let (mut a, mut b) = tangents(s, t);
                if a.length_squared() < 1e-10 * b.length_squared() || b.length_squared() < 1e-10 * a.length_squared() {
                    let beside = |x: f64, (from, to): (f64, f64)| x + 1e-3 * (0.5 * (from + to) - x);
                    (a, b) = tangents(beside(s, s_range), beside(t, t_range));
                }
                normals.push(a.cross(b).normalize_or(DVec3::Y));
            }
        }
        let uvs = vec![DVec2::ZERO; positions.len()];
        Self { columns, rows, positions, normals, uvs }
    }

    /// The index of a crossing.
    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }

    /// Multiplies every texture coordinate.
    pub fn scale_uvs(mut self, factor: f64) -> Self {
        for uv in &mut self.uvs {
            *uv *= factor;
        }
        self
    }

    /// Two triangles a cell, cut along the shorter diagonal; those without area, at poles, are left out.
    pub fn into_mesh(self) -> Mesh {
        self.part(|_, _| true)
    }

    /// The mesh of those cells, named by their lower column and row, that are wanted.
    pub fn part(&self, wanted: impl Fn(usize, usize) -> bool) -> Mesh {
        let mut indices = Vec::new();
        let p = &self.positions;
        for row in 0..self.rows - 1 {
            for column in (0..self.columns - 1).filter(|&column| wanted(column, row)) {
                let [a, b] = [self.index(column, row), self.index(column + 1, row)];
                let [d, c] = [self.index(column, row + 1), self.index(column + 1, row + 1)];
                let triangles = if p[a].distance_squared(p[c]) <= p[b].distance_squared(p[d]) {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                };
                for [i, j, k] in triangles {
                    let apart = |x: usize, y: usize| p[x].distance_squared(p[y]) > 1e-16;
                    if apart(i, j) && apart(j, k) && apart(k, i) {
                        indices.extend([i, j, k]);
                    }
                }
            }
        }
        // Vertices in the order of their first use; those of unwanted cells are not carried along.
        let mut mesh = Mesh::default();
        let mut renamed = vec![u32::MAX; p.len()];
        for index in indices {
            if renamed[index] == u32::MAX {
                renamed[index] = mesh.positions.len() as u32;
                mesh.positions.push(p[index]);
                mesh.normals.push(self.normals[index]);
                mesh.uvs.push(self.uvs[index]);
            }
            mesh.indices.push(renamed[index]);
        }
        mesh
    }
}
