//! A hierarchy over boxes: splits by the surface area heuristic in bins, halves where depth runs short.
//!
//! Wald 2007, "On fast construction of SAH-based bounding volume hierarchies". The result does not depend on the
//! number of threads: threads build disjoint ranges, and nodes are laid out depth first, first child first.

use super::{Bounds, leaf, moved, node_over, renamed};
use mica_shaders::constants::BVH_NOTHING;
use mica_shaders::types::BvhNode;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Candidate planes an axis, plus one.
const BINS: usize = 16;

/// Few primitives have no use for that many, and most nodes are over few.
const BINS_A_PRIMITIVE: usize = 2;

/// A visit of a node in tests of a triangle. On lavapipe 0.3, 1 and 2 are within 10 % of each other, and 1 is the fastest.
const VISIT_COST: f64 = 1.0;

/// Ranges longer than this are built by two threads, and those up to it are reported as done.
const PARALLEL_PRIMITIVES: usize = 4096;

/// Longer lists are gone through in parts of this length by several threads: whatever their number, the parts are the
/// same, and so is the sum over them.
const PART: usize = 32 * 1024;

/// One box to be enclosed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Primitive {
    pub bounds: Bounds,
    /// Which one it is for the caller.
    pub index: u32,
}

/// How large and how deep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Primitives in a leaf.
    pub leaf: usize,
    /// Nodes on a path.
    pub levels: u32,
}

/// A hierarchy. Its leaves refer to positions in the primitives as the build reordered them.
#[derive(Debug)]
pub(super) struct Tree {
    pub nodes: Vec<BvhNode>,
    pub root: u32,
    pub bounds: Bounds,
    /// The most primitives, more than a leaf takes, that no plane separates because their centres are the same.
    pub most_in_one_place: usize,
}

/// What all parts of a build share.
struct Build<'a> {
    leaf: usize,
    placed: Option<&'a AtomicU64>,
    most_in_one_place: AtomicUsize,
}

/// Builds over `primitives` and puts them in the order of the leaves. There may be any number that fits
/// `limits.leaf << limits.levels`. Their number is added to `placed` as they find their places.
pub(super) fn build(primitives: &mut [Primitive], limits: Limits, placed: Option<&AtomicU64>) -> Tree {
    let mut nodes = Vec::with_capacity(primitives.len() / 2);
    debug_assert!(primitives.len() <= limits.leaf << limits.levels);
    if primitives.is_empty() {
        return Tree { nodes, root: BVH_NOTHING, bounds: Bounds::EMPTY, most_in_one_place: 0 };
    }
    let build = Build { leaf: limits.leaf, placed, most_in_one_place: AtomicUsize::new(0) };
    let (root, bounds) = build.reported(primitives, 0, limits.levels, &mut nodes);
    Tree { nodes, root, bounds, most_in_one_place: build.most_in_one_place.into_inner() }
}

impl Build<'_> {
    /// A subtree; one that a single thread builds is reported once it is whole, seldom enough not to be felt.
    fn reported(
        &self,
        primitives: &mut [Primitive],
        first: u32,
        levels: u32,
        nodes: &mut Vec<BvhNode>,
    ) -> (u32, Bounds) {
        let made = self.subtree(primitives, first, levels, nodes);
        if let Some(placed) = self.placed.filter(|_| primitives.len() <= PARALLEL_PRIMITIVES) {
            placed.fetch_add(primitives.len() as u64, Ordering::Relaxed);
        }
        made
    }

    /// Appends the nodes over `primitives`, which start at position `first` of all and may take so many `levels`; returns
    /// the reference and the box.
    fn subtree(
        &self,
        primitives: &mut [Primitive],
        first: u32,
        levels: u32,
        nodes: &mut Vec<BvhNode>,
    ) -> (u32, Bounds) {
        let count = primitives.len();
        let extent = Extent::of(primitives);
        let parallel = count > PARALLEL_PRIMITIVES;
        let reference = match self.split(primitives, &extent, levels) {
            None => leaf(first, count as u32),
            Some(middle) => {
                let (left, right) = primitives.split_at_mut(middle);
                let right_first = first + middle as u32;
                let levels = levels - 1;
                let node = nodes.len();
                nodes.push(BvhNode::default());
                let children = if parallel {
                    let mut right_nodes = Vec::with_capacity(right.len() / 2);
                    let (left, (right, right_bounds)) = rayon::join(
                        || self.reported(left, first, levels, nodes),
                        || self.reported(right, right_first, levels, &mut right_nodes),
                    );
                    let base = nodes.len() as u32;
                    nodes.extend(right_nodes.iter().map(|node| renamed(node, |reference| moved(reference, base, 0))));
                    [left, (moved(right, base, 0), right_bounds)]
                } else {
                    [self.subtree(left, first, levels, nodes), self.subtree(right, right_first, levels, nodes)]
                };
                nodes[node] = node_over(children);
                node as u32
            }
        };
        (reference, extent.bounds)
    }

    /// Reorders `primitives` so that they split at the returned position; `None` where they should be a leaf.
    fn split(&self, primitives: &mut [Primitive], extent: &Extent, levels: u32) -> Option<usize> {
        let count = primitives.len();
        if count == 1 {
            return None;
        }
        let best = best_plane(primitives, &extent.doubled_centres);
        if count <= self.leaf {
            let area = extent.bounds.half_area();
            let cheaper = |plane: &Plane| plane.cost + VISIT_COST * area < area * count as f64;
            if levels == 0 || !best.as_ref().is_some_and(cheaper) {
                return None;
            }
        } else if best.is_none() {
            self.most_in_one_place.fetch_max(count, Ordering::Relaxed);
        }
        let affordable = |part: usize| levels_needed(part, self.leaf) < levels;
        if let Some(plane) = best.filter(|plane| affordable(plane.left) && affordable(count - plane.left)) {
            return Some(partition(primitives, |primitive| plane.bin.of(primitive) < plane.first_right));
        }
        let Bounds { lower, upper } = extent.doubled_centres;
        let width = |axis: usize| upper[axis] - lower[axis];
        let axis = (0..3).fold(0, |widest, axis| if width(axis) > width(widest) { axis } else { widest });
        let middle = count / 2;
        primitives.select_nth_unstable_by(middle, |a, b| {
            let [a_centre, b_centre] = [a, b].map(|primitive| primitive.bounds.doubled_centre()[axis]);
            a_centre.total_cmp(&b_centre).then(a.index.cmp(&b.index))
        });
        Some(middle)
    }
}

/// Where primitives are.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Bounds,
    doubled_centres: Bounds,
}

impl Extent {
    fn of(primitives: &[Primitive]) -> Self {
        let nothing = Self { bounds: Bounds::EMPTY, doubled_centres: Bounds::EMPTY };
        let union = |a: Self, b: Self| Self {
            bounds: a.bounds.union(b.bounds),
            doubled_centres: a.doubled_centres.union(b.doubled_centres),
        };
        let of_one = |primitive: &Primitive| Self {
            bounds: primitive.bounds,
            doubled_centres: Bounds::of_point(primitive.bounds.doubled_centre()),
        };
        summed(primitives, |part| part.iter().map(of_one).fold(nothing, union), union)
    }
}

/// A sum over parts of `primitives`, taken by several threads where they are many. The parts and the order in which they
/// are added do not depend on the number of threads.
fn summed<T: Send>(primitives: &[Primitive], of_part: impl Fn(&[Primitive]) -> T + Sync, add: impl Fn(T, T) -> T) -> T {
    if primitives.len() <= PART {
        return of_part(primitives);
    }
    let (first, rest) = primitives.split_at(PART);
    let (first, rest): (T, Vec<T>) = rayon::join(|| of_part(first), || rest.par_chunks(PART).map(&of_part).collect());
    rest.into_iter().fold(first, add)
}

/// The levels that halving alone needs for `count` primitives.
fn levels_needed(count: usize, leaf: usize) -> u32 {
    count.div_ceil(leaf).next_power_of_two().ilog2()
}

/// Which bin of an axis a primitive falls into.
#[derive(Clone, Copy)]
struct Bin {
    axis: usize,
    origin: f32,
    bins_per_unit: f32,
    used: usize,
}

impl Bin {
    fn of(&self, primitive: &Primitive) -> usize {
        let bounds = &primitive.bounds;
        let centre = bounds.lower[self.axis] + bounds.upper[self.axis];
        // An extent so small that its inverse is infinite gives NaN here, which the conversion makes bin 0.
        (((centre - self.origin) * self.bins_per_unit) as usize).min(self.used - 1)
    }
}

/// A plane between two bins.
struct Plane {
    bin: Bin,
    /// The first bin on its far side.
    first_right: usize,
    /// Primitives on its near side: neither none nor all.
    left: usize,
    /// Sum over both sides of half area times primitives.
    cost: f64,
}

impl Plane {
    /// Whether it is cheaper, or as cheap and nearer to a half: boxes without area are all as cheap.
    fn beats(&self, other: &Self, count: usize) -> bool {
        let larger_side = |plane: &Self| plane.left.max(count - plane.left);
        (self.cost, larger_side(self)) < (other.cost, larger_side(other))
    }
}

/// What falls into each bin of an axis: the box around it, and its number.
type Bins = [(Bounds, usize); BINS];

/// The cheapest plane of all axes; `None` where no plane separates the centres, as where all are the same.
fn best_plane(primitives: &[Primitive], doubled_centres: &Bounds) -> Option<Plane> {
    let count = primitives.len();
    let used = (BINS_A_PRIMITIVE * count).min(BINS);
    let axes: [Option<Bin>; 3] = std::array::from_fn(|axis| {
        let origin = doubled_centres.lower[axis];
        let extent = doubled_centres.upper[axis] - origin;
        (extent > 0.0).then(|| Bin { axis, origin, bins_per_unit: used as f32 / extent, used })
    });
    let mut best: Option<Plane> = None;
    for bin in axes.into_iter().flatten() {
        let bins = binned(primitives, bin);
        let mut right_costs = [0.0; BINS];
        let (mut right, mut right_count) = (Bounds::EMPTY, 0);
        for first_right in (1..used).rev() {
            right = right.union(bins[first_right].0);
            right_count += bins[first_right].1;
            right_costs[first_right] = right.half_area() * right_count as f64;
        }
        let (mut left_bounds, mut left) = (Bounds::EMPTY, 0);
        for first_right in 1..used {
            left_bounds = left_bounds.union(bins[first_right - 1].0);
            left += bins[first_right - 1].1;
            let cost = left_bounds.half_area() * left as f64 + right_costs[first_right];
            let plane = Plane { bin, first_right, left, cost };
            if left > 0 && left < count && best.as_ref().is_none_or(|best| plane.beats(best, count)) {
                best = Some(plane);
            }
        }
    }
    best
}

/// The primitives in bins of an axis.
fn binned(primitives: &[Primitive], bin: Bin) -> Bins {
    let of_part = |part: &[Primitive]| {
        let mut bins = [(Bounds::EMPTY, 0); BINS];
        for primitive in part {
            let (bounds, inside) = &mut bins[bin.of(primitive)];
            *bounds = bounds.union(primitive.bounds);
            *inside += 1;
        }
        bins
    };
    let add = |a: Bins, b: Bins| std::array::from_fn(|bin| (a[bin].0.union(b[bin].0), a[bin].1 + b[bin].1));
    summed(primitives, of_part, add)
}

/// Moves the primitives that `belongs_left` to the front; returns how many they are.
fn partition(primitives: &mut [Primitive], belongs_left: impl Fn(&Primitive) -> bool) -> usize {
    let mut left = 0;
    for position in 0..primitives.len() {
        if belongs_left(&primitives[position]) {
            primitives.swap(left, position);
            left += 1;
        }
    }
    left
}
