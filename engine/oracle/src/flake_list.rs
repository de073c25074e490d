//! Flakes given one by one, as another program made them, in a texture that repeats.

use glam::{DVec2, DVec3};

use crate::OracleError;
use crate::discrete::Flakes;
use crate::flake_set::{Flake, Footprint};

/// Flakes of a cell on average.
const FLAKES_A_CELL: usize = 4;
/// Most cells along a side of the texture.
const MOST_CELLS: usize = 2048;
/// Texture coordinates beyond this have no digits left for a place in the texture.
const LARGEST_COORDINATE: f64 = 1e9;

/// Explicit flakes, in a grid over the square of texture that repeats.
#[derive(Clone, Debug)]
pub struct FlakeList {
    /// By cells, row after row.
    flakes: Vec<Flake>,
    /// Where each cell's flakes begin; one more entry ends the last.
    starts: Vec<usize>,
    /// Cells along a side.
    side: usize,
}

impl FlakeList {
    /// Flakes from rows (u, v, mx, my, mz): a place in the texture, in any of its repetitions, and a normal about +Z, of
    /// any length.
    ///
    /// # Errors
    /// When a number is not finite, a place is too far away, or a normal does not point above the surface.
    pub fn new(rows: &[[f64; 5]]) -> Result<Self, OracleError> {
        let mut flakes = Vec::with_capacity(rows.len());
        for (row, &[u, v, mx, my, mz]) in rows.iter().enumerate() {
            let wrong = |what| Err(OracleError::Flake { row, what });
            if ![u, v, mx, my, mz].into_iter().all(f64::is_finite) {
                return wrong("holds a number that is not finite");
            }
            if u.abs().max(v.abs()) > LARGEST_COORDINATE {
                return wrong("lies beyond 1e9 squares of texture");
            }
            // Scaled first: squares of tiny or huge components would leave the range of an f64.
            let normal = DVec3::new(mx, my, mz);
            let normal = (normal / normal.abs().max_element()).normalize();
            if !(normal.is_finite() && normal.z > 0.0) {
                return wrong("has a normal that does not point above the surface; expected mz > 0");
            }
            flakes.push(Flake { uv: DVec2::new(u, v), normal });
        }
        let side = (((flakes.len() / FLAKES_A_CELL) as f64).sqrt() as usize).clamp(1, MOST_CELLS);
        let cell = |flake: &Flake| {
            let place = flake.uv - flake.uv.floor();
            let [x, y] = [place.x, place.y].map(|place| ((place * side as f64) as usize).min(side - 1));
            y * side + x
        };
        flakes.sort_by_cached_key(cell);
        let mut starts = vec![0; side * side + 1];
        for flake in &flakes {
            starts[cell(flake) + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        Ok(Self { flakes, starts, side })
    }

    /// Visits the flakes of one square of texture, `tile`, that lie in `footprint`.
    fn visit_square(&self, footprint: &Footprint, tile: DVec2, visit: &mut impl FnMut(DVec3, u64)) {
        let local = footprint.moved(-tile);
        let cells = self.side as f64;
        // One more on every side, for what rounding may move over a cell's edge.
        let [first, last] =
            local.bounds().map(|corner| (corner * cells).clamp(DVec2::splat(-1.0), DVec2::splat(cells)));
        let from = |at: f64| (at - 1.0).max(0.0) as usize;
        let to = |at: f64| ((at + 2.0) as usize).min(self.side);
        for y in from(first.y)..to(last.y) {
            for x in from(first.x)..to(last.x) {
                let held = self.starts[y * self.side + x]..self.starts[y * self.side + x + 1];
                let low = DVec2::new(x as f64, y as f64);
                if held.is_empty() || !local.may_meet([low / cells, (low + 1.0) / cells]) {
                    continue;
                }
                for flake in &self.flakes[held] {
                    if footprint.contains_moved(flake.uv, tile - flake.uv.floor()) {
                        visit(flake.normal, 1);
                    }
                }
            }
        }
    }
}

impl Flakes for FlakeList {
    fn count(&self) -> u64 {
        self.flakes.len() as u64
    }

    fn visit(&self, footprint: &Footprint, mut visit: impl FnMut(DVec3, u64)) {
        let mut whole = 0;
        for square in footprint.squares() {
            if footprint.holds_square(square) {
                whole += 1;
            } else {
                self.visit_square(footprint, square, &mut visit);
            }
        }
        if whole > 0 {
            self.flakes.iter().for_each(|flake| visit(flake.normal, whole));
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;

    fn counted(list: &FlakeList, footprint: &Footprint) -> u64 {
        let mut count = 0;
        list.visit(footprint, |_, times| count += times);
        count
    }

    /// The definition, flake by flake and repetition by repetition.
    fn counted_one_by_one(rows: &[[f64; 5]], footprint: &Footprint) -> u64 {
        let [e1, e2] = footprint.sides;
        let determinant = e1.x * e2.y - e1.y * e2.x;
        let mut count = 0;
        for (shift_x, shift_y) in (-12..=12).flat_map(|x| (-12..=12).map(move |y| (f64::from(x), f64::from(y)))) {
            for [u, v, ..] in rows {
                let (x, y) = (u + shift_x - footprint.corner.x, v + shift_y - footprint.corner.y);
                let (a, b) = ((x * e2.y - y * e2.x) / determinant, (e1.x * y - e1.y * x) / determinant);
                count += u64::from((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
            }
        }
        count
    }

    #[test]
    fn the_grid_finds_what_a_search_of_all_flakes_finds() {
        let mut random = Pcg64::seed_from_u64(12);
        let mut unit = || f64::from(random.next_u32()) / 2.0_f64.powi(32);
        let rows: Vec<[f64; 5]> = (0..500).map(|_| [3.0 * unit() - 1.0, 3.0 * unit() - 1.0, 0.0, 0.0, 1.0]).collect();
        for length in [1, 7, 500] {
            let list = FlakeList::new(&rows[..length]).expect("flakes");
            for size in [0.01, 0.3, 2.0, 8.0] {
                for _ in 0..20 {
                    let mut point = |size: f64| DVec2::new(size * (unit() - 0.5), size * (unit() - 0.5));
                    let footprint = Footprint { corner: point(3.0), sides: [point(size), point(size)] };
                    let expected = counted_one_by_one(&rows[..length], &footprint);
                    assert_eq!(counted(&list, &footprint), expected, "{length} {footprint:?}");
                }
            }
        }
    }

    #[test]
    fn flakes_on_edges_belong_to_the_low_one_in_every_repetition() {
        // A lattice of quarters, on and off the edges of cells, squares and footprints alike.
        let quarters = |k: i32| f64::from(k) / 4.0;
        let rows: Vec<[f64; 5]> =
            (0..16).map(|k| [quarters(k % 4) - 7.0, quarters(k / 4) + 2.0, 0.0, 0.0, 1.0]).collect();
        let list = FlakeList::new(&rows).expect("flakes");
        for (corner, sides, expected) in [
            ([0.0, 0.0], [[1.0, 0.0], [0.0, 1.0]], 16),
            ([0.25, 0.5], [[0.25, 0.0], [0.0, 0.25]], 1),
            ([-3.75, 6.25], [[2.5, 0.0], [0.0, 1.75]], 70),
            ([0.5, 0.5], [[-0.5, 0.0], [0.0, -0.5]], 4),
            ([0.0, 0.0], [[0.5, 0.5], [-0.5, 0.5]], 8),
            ([0.25, 0.25], [[0.125, 0.0], [0.0, 0.125]], 1),
            ([0.125, 0.125], [[0.125, 0.0], [0.0, 0.125]], 0),
            ([1e6 + 0.25, -1e6], [[0.5, 0.0], [0.0, 3.0]], 24),
        ] {
            let footprint = Footprint { corner: corner.into(), sides: sides.map(DVec2::from) };
            assert_eq!(counted(&list, &footprint), expected, "{footprint:?}");
        }
    }

    #[test]
    fn what_cannot_be_a_flake_is_named_by_its_row() {
        let good = [0.5, 0.5, 1e-300, 0.0, 1e-300];
        assert!(FlakeList::new(&[good, [0.0, 0.0, 1e300, 1e300, 1e300]]).is_ok());
        for (bad, words) in [
            ([f64::NAN, 0.0, 0.0, 0.0, 1.0], "finite"),
            ([0.0, f64::INFINITY, 0.0, 0.0, 1.0], "finite"),
            ([0.0, 1e30, 0.0, 0.0, 1.0], "1e9"),
            ([0.0, 0.0, 0.0, 0.0, 0.0], "mz > 0"),
            ([0.0, 0.0, 1.0, 0.0, 0.0], "mz > 0"),
            ([0.0, 0.0, 0.0, 0.0, -1.0], "mz > 0"),
        ] {
            let error = FlakeList::new(&[good, bad]).expect_err("must be refused").to_string();
            assert!(error.starts_with("flake 1, counted from 0, ") && error.contains(words), "{error}");
        }
        assert_eq!(
            counted(
                &FlakeList::new(&[]).expect("no flakes"),
                &Footprint { corner: DVec2::ZERO, sides: [DVec2::X, DVec2::Y] }
            ),
            0
        );
    }
}
