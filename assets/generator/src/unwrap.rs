//! Texture coordinates with little stretch: every edge of the grid is a spring that wants its own length in the plane.

use glam::DVec2;

use crate::maths;
use crate::surface::Grid;

impl Grid {
    /// Lays the grid out by arc length, in metres: `u` along each row from the column `spine`, `v` along each column from
    /// the row `belt`. Exact where rows or columns are parallel; a start for [`Grid::relax_uvs`] elsewhere.
    pub fn lay_out(mut self, spine: usize, belt: usize) -> Self {
        let along = |count: usize, origin: usize, index: &dyn Fn(usize) -> usize| {
            let mut run = vec![0.0; count];
            for i in 1..count {
                run[i] = run[i - 1] + self.positions[index(i)].distance(self.positions[index(i - 1)]);
            }
            let start = run[origin];
            run.into_iter().map(move |r| r - start).collect::<Vec<_>>()
        };
        let rows: Vec<_> = (0..self.rows).map(|r| along(self.columns, spine, &|c| self.index(c, r))).collect();
        let columns: Vec<_> = (0..self.columns).map(|c| along(self.rows, belt, &|r| self.index(c, r))).collect();
        self.uvs = (0..self.rows)
            .flat_map(|r| (0..self.columns).map(move |c| (c, r)))
            .map(|(c, r)| DVec2::new(rows[r][c], columns[c][r]))
            .collect();
        self
    }

    /// Lays the grid out as a fan: rows become arcs of their own length about one apex, chosen so that the first and the
    /// last row open by the same angle. Exact for cones; a start for [`Grid::relax_uvs`] for skirts. Units: metres.
    pub fn lay_out_as_fan(self, spine: usize) -> Self {
        let mut grid = self.lay_out(spine, 0);
        let last = grid.rows - 1;
        let length = |row: usize| grid.uvs[grid.index(grid.columns - 1, row)].x - grid.uvs[grid.index(0, row)].x;
        let climb = (0..grid.columns).map(|c| grid.uvs[grid.index(c, last)].y).sum::<f64>() / grid.columns as f64;
        let opening = (length(0) - length(last)) / climb;
        if opening != 0.0 {
            let outer = length(0) / opening;
            for uv in &mut grid.uvs {
                let radius = outer - uv.y;
                let angle = uv.x / radius;
                *uv = DVec2::new(radius * maths::sin(angle), outer - radius * maths::cos(angle));
            }
        }
        grid
    }

    /// Takes texture coordinates from a function of column and row, in metres.
    pub fn lay_out_by(mut self, uv: impl Fn(usize, usize) -> DVec2) -> Self {
        for row in 0..self.rows {
            for column in 0..self.columns {
                let index = self.index(column, row);
                self.uvs[index] = uv(column, row);
            }
        }
        self
    }

    /// Evens out the scale of the texture coordinates, in metres: `rounds` times over, every edge and diagonal of the
    /// grid moves its two ends towards its length on the surface. Fixed order, so the same bits every time.
    pub fn relax_uvs(mut self, rounds: usize) -> Self {
        let mut springs = Vec::new();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let here = self.index(column, row);
                let mut join = |c: usize, r: usize| {
                    if c < self.columns && r < self.rows {
                        let there = self.index(c, r);
                        springs.push((here, there, self.positions[here].distance(self.positions[there])));
                    }
                };
                join(column + 1, row);
                join(column, row + 1);
                join(column + 1, row + 1);
                if column > 0 {
                    join(column - 1, row + 1);
                }
            }
        }
        for _ in 0..rounds {
            for &(a, b, length) in &springs {
                let apart = self.uvs[b] - self.uvs[a];
                let now = apart.length();
                if now > 0.0 {
                    let pull = apart * (0.5 * (now - length) / now);
                    self.uvs[a] += pull;
                    self.uvs[b] -= pull;
                }
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use crate::maths;
    use crate::surface::{Grid, even};
    use glam::DVec3;

    #[test]
    fn relaxing_a_disturbed_cylinder_finds_its_lengths_again() {
        let cylinder = |s: f64, t: f64| DVec3::new(maths::cos(3.0 * s), t, maths::sin(3.0 * s));
        let grid = Grid::sample(cylinder, &even(12), &even(6)).lay_out(0, 0);
        let bent = grid.uvs.iter().map(|uv| *uv * glam::DVec2::new(1.1, 0.9)).collect();
        let grid = Grid { uvs: bent, ..grid }.relax_uvs(400);
        for row in 0..grid.rows {
            for column in 1..grid.columns {
                let [a, b] = [grid.index(column - 1, row), grid.index(column, row)];
                let ratio = grid.uvs[a].distance(grid.uvs[b]) / grid.positions[a].distance(grid.positions[b]);
                assert!((ratio - 1.0).abs() < 0.01, "ratio {ratio} at column {column}, row {row}");
            }
        }
    }
}
