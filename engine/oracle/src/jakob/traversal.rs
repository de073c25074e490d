//! The tree over position and direction, and the traversal that counts in it.

use glam::{DVec2, DVec3};

use super::overlap::{Cone, Overlap, node_overlap, vector};
use super::triangles::{Triangle, TriangleTable, WHOLE};
use crate::OracleError;
use crate::error::in_range;
use crate::flake_set::{Footprint, MAX_COUNT, children_of, draw, half_of, hash2, hash3, leaf_level, mixed};

/// A node with at most so many flakes holds them one by one.
const FEW: u64 = 8;
/// The words of binomial 0 of a node begin here; each binomial has 64, two for a bit.
const FIRST_BINOMIAL_DRAW: u32 = 64;
/// The words of flake 0 begin here; each flake has 64.
const FIRST_FLAKE_DRAW: u32 = 1024;
/// From here on texture coordinates have no fraction, and a repetition cannot be told from the next.
const FARTHEST_UV: f64 = 4_503_599_627_370_496.0;

/// What the tree of a material follows from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeSettings {
    /// Flakes in each square of texture space.
    pub count: u64,
    /// Chooses the flakes.
    pub seed: u32,
    /// Half-angle of the reflection cone, in radians.
    pub gamma_radians: f64,
    /// q_A, the footprint area that nodes are shaped for, in squares of texture space; 1e-5 in the paper's code.
    pub mean_area: f64,
}

/// What is asked of the tree: a pixel's footprint, the direction of the light and that of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Where flakes count.
    pub footprint: Footprint,
    /// Unit direction of the light about +Z.
    pub i: DVec3,
    /// Unit direction of the view about +Z.
    pub o: DVec3,
}

/// A flake of the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeFlake {
    /// Its place in the unit square.
    pub uv: DVec2,
    /// Its normal about +Z: the very f32 numbers, not normalised.
    pub normal: DVec3,
}

/// The flakes of one material, never made in memory but counted as they are asked for.
#[derive(Clone, Copy, Debug)]
pub struct Tree<'a> {
    table: &'a TriangleTable,
    settings: TreeSettings,
    leaf_level: u32,
    /// q_omega / q_A, rounded to f32 once.
    split_ratio: f32,
}

/// A square and a triangle, and the flakes in both.
#[derive(Clone, Copy)]
struct Node {
    level: u32,
    x: u32,
    y: u32,
    /// Index of its triangle in the table.
    triangle: usize,
    flakes: u64,
}

/// How a node is looked into.
enum Split {
    Flakes,
    Space,
    Direction,
}

/// A query in the unit square, and what the traversal has found so far.
struct Search<'q> {
    footprint: Footprint,
    cone: &'q Cone,
    epsilon: f64,
    sum: f64,
}

impl<'a> Tree<'a> {
    /// The tree of a material whose triangles are `table`.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(table: &'a TriangleTable, settings: TreeSettings) -> Result<Self, OracleError> {
        let TreeSettings { count, gamma_radians, mean_area, .. } = settings;
        in_range("count", count as f64, count <= MAX_COUNT, "0 to 1e12")?;
        let acute = gamma_radians > 0.0 && gamma_radians < std::f64::consts::FRAC_PI_2;
        in_range("gamma_radians", gamma_radians, acute, "in (0, pi / 2)")?;
        in_range("mean_area", mean_area, mean_area > 0.0 && mean_area.is_finite(), "positive and finite")?;
        // q_omega = pi (1 - cos gamma) / 2.
        let mean_solid_angle = std::f64::consts::PI * (gamma_radians / 2.0).sin().powi(2);
        let split_ratio = (mean_solid_angle / mean_area) as f32;
        Ok(Self { table, settings, leaf_level: leaf_level(count), split_ratio })
    }

    /// Flakes in each square of texture space.
    pub const fn count(&self) -> u64 {
        self.settings.count
    }

    /// The number of lit flakes in the footprint. With `epsilon` = 0 it is exact and whole; above, nodes that the
    /// query cuts are taken at their expectation once that is certain enough: sqrt(n p (1 - p)) <= epsilon times what
    /// has been counted so far (criterion (10)).
    pub fn lit(&self, query: &Query, epsilon: f64) -> f64 {
        let cone = self.cone(query);
        let mut sum = 0.0;
        for_each_repetition(&query.footprint, |footprint| {
            let mut search = Search { footprint, cone: &cone, epsilon, sum };
            self.visit(self.root(), Overlap::Partial, &mut search);
            sum = search.sum;
        });
        sum
    }

    /// The count if place and direction were independent in the very flakes counted: N times the share of the flakes
    /// in the footprint times the share in the cone.
    pub fn lit_as_product(&self, query: &Query) -> f64 {
        let mut within = 0;
        for_each_repetition(&query.footprint, |footprint| within += self.in_footprint(self.root(), &footprint));
        match self.settings.count {
            0 => 0.0,
            count => within as f64 / count as f64 * self.in_cone(self.root(), &self.cone(query)),
        }
    }

    /// All flakes of one square, listed: what every count can be checked against.
    pub fn flakes(&self) -> Vec<TreeFlake> {
        let mut flakes = Vec::new();
        let mut open = vec![self.root()];
        while let Some(node) = open.pop() {
            match self.split(&node) {
                Split::Flakes => {
                    flakes.extend(
                        self.each_flake(&node).map(|flake| TreeFlake { uv: flake.uv(), normal: flake.normal() }),
                    );
                }
                Split::Space => open.extend(self.space_children(&node)),
                Split::Direction => open.extend(self.direction_children(&node)),
            }
        }
        flakes
    }

    fn cone(&self, query: &Query) -> Cone {
        Cone::new(query.i, query.o, self.settings.gamma_radians)
    }

    const fn root(&self) -> Node {
        Node { level: 0, x: 0, y: 0, triangle: 0, flakes: self.settings.count }
    }

    fn triangle(&self, node: &Node) -> &Triangle {
        &self.table.entries()[node.triangle]
    }

    /// Depth first, children in order. `place` is how the parent's square lies in the footprint.
    fn visit(&self, node: Node, place: Overlap, search: &mut Search) {
        if node.flakes == 0 {
            return;
        }
        // The cheaper test first.
        let direction = search.cone.overlap(self.triangle(&node));
        if direction == Overlap::Disjoint {
            return;
        }
        let place = match place {
            Overlap::Partial => node_overlap(&search.footprint, node.corners()),
            certain => certain,
        };
        if place == Overlap::Disjoint {
            return;
        }
        if place == Overlap::Inside && direction == Overlap::Inside {
            search.sum += node.flakes as f64;
            return;
        }
        if let Some(expected) = self.accepted(&node, direction, search) {
            search.sum += expected;
            return;
        }
        match self.split(&node) {
            Split::Flakes => {
                let lit = self.each_flake(&node).filter(|flake| {
                    (place == Overlap::Inside || search.footprint.contains(flake.uv()))
                        && search.cone.lights(flake.normal())
                });
                search.sum += lit.count() as f64;
            }
            Split::Space => self.space_children(&node).into_iter().for_each(|child| self.visit(child, place, search)),
            Split::Direction => {
                self.direction_children(&node).into_iter().for_each(|child| self.visit(child, place, search));
            }
        }
    }

    /// What a partial node adds by criterion (10), when that holds.
    fn accepted(&self, node: &Node, direction: Overlap, search: &Search) -> Option<f64> {
        let triangle = self.triangle(node);
        if search.epsilon <= 0.0 || search.sum <= 0.0 {
            return None;
        }
        let of_direction = match direction {
            Overlap::Inside => 1.0,
            _ if triangle.is_leaf() => search.cone.share_of(triangle)?,
            _ => return None,
        };
        let p = of_direction * search.footprint.share_of(node.corners());
        let n = node.flakes as f64;
        ((n * p * (1.0 - p)).sqrt() <= search.epsilon * search.sum).then_some(n * p)
    }

    /// Splitting space or direction depends on the node alone, so that its flakes do.
    fn split(&self, node: &Node) -> Split {
        let triangle = self.triangle(node);
        let (last_square, last_triangle) = (node.level == self.leaf_level, triangle.is_leaf());
        // A power of two: the product is exact, and compared alike everywhere.
        let area = 0.25_f32.powi(node.level as i32);
        match (last_square, last_triangle) {
            _ if node.flakes <= FEW => Split::Flakes,
            (true, true) => Split::Flakes,
            (false, true) => Split::Space,
            (true, false) => Split::Direction,
            (false, false) if self.split_ratio * area > triangle.solid_angle => Split::Space,
            (false, false) => Split::Direction,
        }
    }

    /// Names a node; its random words are drawn from the name.
    fn key(&self, node: &Node) -> [u32; 2] {
        let (Node { level, x, y, .. }, id, seed) = (*node, self.triangle(node).id, self.settings.seed);
        [hash3(x, y, hash2(level, hash2(id, seed))), hash3(y, x, hash2(id, hash2(level, !seed)))]
    }

    fn space_children(&self, node: &Node) -> [Node; 4] {
        let counts = children_of(node.flakes, self.key(node));
        std::array::from_fn(|child| Node {
            level: node.level + 1,
            x: 2 * node.x + (child as u32 & 1),
            y: 2 * node.y + (child as u32 >> 1),
            flakes: counts[child],
            ..*node
        })
    }

    fn direction_children(&self, node: &Node) -> [Node; 4] {
        let (key, triangle) = (self.key(node), self.triangle(node));
        let mut left = node.flakes;
        std::array::from_fn(|child| {
            let flakes = match triangle.splits.get(child) {
                Some(split) => binomial(left, *split, key, FIRST_BINOMIAL_DRAW * (1 + child as u32)),
                None => left,
            };
            left -= flakes;
            Node { triangle: triangle.first_child as usize + child, flakes, ..*node }
        })
    }

    fn each_flake(&self, node: &Node) -> impl Iterator<Item = Draws<'_>> {
        let (key, node) = (self.key(node), *node);
        let first = |flake: u64| FIRST_FLAKE_DRAW.wrapping_add((flake as u32).wrapping_mul(64));
        (0..node.flakes).map(move |flake| Draws { table: self.table, node, key, first: first(flake) })
    }

    /// The flakes of a node of the hemisphere that are in a footprint, splitting space alone.
    fn in_footprint(&self, node: Node, footprint: &Footprint) -> u64 {
        match node_overlap(footprint, node.corners()) {
            _ if node.flakes == 0 => 0,
            Overlap::Disjoint => 0,
            Overlap::Inside => node.flakes,
            Overlap::Partial if node.flakes <= FEW || node.level == self.leaf_level => {
                self.each_flake(&node).filter(|flake| footprint.contains(flake.uv())).count() as u64
            }
            Overlap::Partial => {
                self.space_children(&node).into_iter().map(|child| self.in_footprint(child, footprint)).sum()
            }
        }
    }

    /// The flakes of a node of the whole square that are lit, splitting direction alone; the flakes of a leaf that the
    /// cone cuts, which may be billions, are taken at their expectation.
    fn in_cone(&self, node: Node, cone: &Cone) -> f64 {
        let triangle = self.triangle(&node);
        match cone.overlap(triangle) {
            _ if node.flakes == 0 => 0.0,
            Overlap::Disjoint => 0.0,
            Overlap::Inside => node.flakes as f64,
            Overlap::Partial if node.flakes <= FEW => {
                self.each_flake(&node).filter(|flake| cone.lights(flake.normal())).count() as f64
            }
            Overlap::Partial if triangle.is_leaf() => node.flakes as f64 * cone.share_of(triangle).unwrap_or(0.5),
            Overlap::Partial => self.direction_children(&node).into_iter().map(|child| self.in_cone(child, cone)).sum(),
        }
    }
}

impl Node {
    /// The lowest and highest corner of its square in the unit square.
    fn corners(&self) -> [DVec2; 2] {
        let side = 0.5_f64.powi(self.level as i32);
        let low = DVec2::new(f64::from(self.x), f64::from(self.y));
        [low * side, (low + 1.0) * side]
    }
}

/// The footprint as each repetition of the texture that it may touch sees it, row by row.
fn for_each_repetition(footprint: &Footprint, mut visit: impl FnMut(Footprint)) {
    let [low, high] = footprint.bounds().map(DVec2::floor);
    let reach = low.abs().max(high.abs()).max_element();
    if !(footprint.area() > 0.0 && footprint.corner.is_finite() && reach < FARTHEST_UV) {
        return;
    }
    let mut repetition = low;
    while repetition.y <= high.y {
        repetition.x = low.x;
        while repetition.x <= high.x {
            visit(footprint.moved(-repetition));
            repetition.x += 1.0;
        }
        repetition.y += 1.0;
    }
}

/// Whether a random word is below a 32-bit fraction.
fn is_below(word: u32, fraction: u32) -> bool {
    word < fraction || fraction == WHOLE
}

/// How many of `n` random fractions are below `fraction`, their bits drawn for all of them at once from the highest:
/// where the fraction has a 1, those with a 0 are below it; where it has a 0, those with a 1 are not; the others stay
/// open.
fn binomial(n: u64, fraction: u32, key: [u32; 2], first_word: u32) -> u64 {
    if fraction == WHOLE {
        return n;
    }
    let (mut open, mut below) = (n, 0);
    for step in 0..32 {
        if open == 0 {
            break;
        }
        let word = first_word + 2 * step;
        let low = half_of(open, draw(key, word), draw(key, word + 1));
        if fraction >> (31 - step) & 1 == 1 {
            below += low;
            open -= low;
        } else {
            open = low;
        }
    }
    below
}

/// One flake of a node, its words not yet drawn.
struct Draws<'a> {
    table: &'a TriangleTable,
    node: Node,
    key: [u32; 2],
    /// Its first word.
    first: u32,
}

impl Draws<'_> {
    fn word(&self, k: u32) -> u32 {
        draw(self.key, self.first.wrapping_add(k))
    }

    /// Anywhere in the node's square. At most 19 + 32 bits and a half: exact.
    fn uv(&self) -> DVec2 {
        let unit = 0.5_f64.powi(32 + self.node.level as i32);
        let place = |cell: u32, word: u32| ((u64::from(cell) << 32 | u64::from(word)) as f64 + 0.5) * unit;
        DVec2::new(place(self.node.x, self.word(0)), place(self.node.y, self.word(1)))
    }

    /// In the node's triangle as D is.
    fn normal(&self) -> DVec3 {
        let mut triangle = &self.table.entries()[self.node.triangle];
        let mut depth = 0;
        while !triangle.is_leaf() {
            let [in_0, in_1, in_2] = triangle.splits;
            let second = self.word(32 + depth);
            let child = match () {
                () if is_below(self.word(2 + depth), in_0) => 0,
                () if is_below(second, in_1) => 1,
                () if is_below(mixed(second), in_2) => 2,
                () => 3,
            };
            triangle = &self.table.entries()[triangle.first_child as usize + child];
            depth += 1;
        }
        self.normal_in_leaf(triangle)
    }

    /// With a density linear in the place on the flat triangle, proportional to D at its corners: of the four spacings
    /// of three uniform numbers in [0, 1), two go to one corner, chosen by its D, and one to each other. Sums and
    /// products of f32, rounded one by one.
    fn normal_in_leaf(&self, leaf: &Triangle) -> DVec3 {
        let mut uniform = [24, 25, 26].map(|k| self.word(k) >> 8);
        uniform.sort_unstable();
        let [_, middle, largest] = uniform;
        let corner = match () {
            () if is_below(self.word(27), leaf.splits[0]) => 0,
            () if is_below(self.word(28), leaf.splits[1]) => 1,
            () => 2,
        };
        let mut share = [0; 3];
        share[corner] = middle;
        share[(corner + 1) % 3] = largest - middle;
        share[(corner + 2) % 3] = (1 << 24) - largest;
        let [u, v] = [share[1], share[2]].map(|share| share as f32 * (1.0 / 16_777_216.0));
        let [v0, v1, v2] = leaf.corners;
        vector([0, 1, 2].map(|axis| (v0[axis] + u * (v1[axis] - v0[axis])) + v * (v2[axis] - v0[axis])))
    }
}

#[cfg(test)]
mod tests;
