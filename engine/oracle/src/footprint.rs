//! What a pixel sees of texture space: a parallelogram with half-open edges.

use glam::DVec2;

/// The parallelogram `corner` + a `sides[0]` + b `sides[1]` with 0 <= a, b < 1, in UV units of texture space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Where both sides begin; the only corner that belongs to it.
    pub corner: DVec2,
    /// Two sides that begin there; they may turn either way.
    pub sides: [DVec2; 2],
}

impl Footprint {
    /// Its area, in squares of texture space.
    pub fn area(&self) -> f64 {
        self.sides[0].perp_dot(self.sides[1]).abs()
    }

    /// Whether `point` lies in it, as if computed without rounding: what is on a low edge is in, on a high one out, so
    /// that footprints that share corners count each point once. Nothing lies in a footprint without area.
    pub fn contains(&self, point: DVec2) -> bool {
        self.contains_moved(point, DVec2::ZERO)
    }

    /// Whether `point` + `shift` lies in it, the sum not rounded either.
    pub(crate) fn contains_moved(&self, point: DVec2, shift: DVec2) -> bool {
        let [e1, e2] = self.sides;
        // a = (to x e2) / (e1 x e2) and b = (e1 x to) / (e1 x e2), compared without the division. First with rounded
        // numbers, which are wrong by less than `doubt` of the sides' lengths.
        let to = point - self.corner + shift;
        let (whole, turn) = (e1.perp_dot(e2).abs(), e1.perp_dot(e2).signum());
        let numbers = point.abs() + self.corner.abs() + shift.abs() + e1.abs() + e2.abs();
        let doubt = 4e-15 * numbers.max_element();
        let clearly = |share: f64, side: DVec2| {
            let doubt = doubt * side.abs().element_sum();
            let inside = share > doubt && share < whole - doubt;
            let outside = share < -doubt || share > whole + doubt;
            (inside || outside).then_some(inside)
        };
        match (clearly(turn * to.perp_dot(e2), e2), clearly(turn * e1.perp_dot(to), e1)) {
            (Some(false), _) | (_, Some(false)) => false,
            (Some(true), Some(true)) => true,
            _ => self.contains_exactly(point, shift),
        }
    }

    fn contains_exactly(&self, point: DVec2, shift: DVec2) -> bool {
        let [e1, e2] = self.sides;
        let to = Difference::new(point, self.corner).plus(shift);
        let whole = Exact::cross(Difference::from(e1), e2);
        if whole.sign() == 0.0 {
            return false;
        }
        let within =
            |share: Exact| share.sign() * whole.sign() >= 0.0 && share.minus(whole).sign() * whole.sign() < 0.0;
        within(Exact::cross(to, e2)) && within(Exact::cross(to, e1).negated())
    }

    /// The same footprint, moved.
    pub fn moved(&self, by: DVec2) -> Self {
        Self { corner: self.corner + by, ..*self }
    }

    /// The least and greatest coordinates of its corners.
    pub fn bounds(&self) -> [DVec2; 2] {
        let [e1, e2] = self.sides;
        let corners = [self.corner, self.corner + e1, self.corner + e2, self.corner + e1 + e2];
        corners.into_iter().fold([self.corner; 2], |[low, high], corner| [low.min(corner), high.max(corner)])
    }

    /// The squares of texture space that it may meet, row after row, each named by its lowest corner.
    pub(crate) fn squares(&self) -> impl Iterator<Item = DVec2> {
        let within = *self;
        let [low, high] = self.bounds().map(DVec2::floor);
        // One more on each side: rounding may move a corner over an edge.
        let [columns, rows] = [high.x - low.x, high.y - low.y].map(|extent| extent as i64);
        let finite = self.area() > 0.0 && low.is_finite() && high.is_finite();
        let rows = if finite { -1..rows + 2 } else { 0..0 };
        rows.flat_map(move |y| (-1..=columns + 1).map(move |x| low + DVec2::new(x as f64, y as f64)))
            .filter(move |square| within.may_meet([*square, square + 1.0]))
    }

    /// Whether all of a square of texture space lies in it, edges included.
    pub(crate) fn holds_square(&self, square: DVec2) -> bool {
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].into_iter().all(|corner| self.contains_moved(corner, square))
    }

    /// The share of the area of the box from `low` to `high` that it covers.
    pub fn share_of(&self, [low, high]: [DVec2; 2]) -> f64 {
        let [e1, e2] = self.sides;
        // Relative to the box, so that no digits are lost far from the origin.
        let corner = self.corner - low;
        let size = high - low;
        let mut polygon = vec![corner, corner + e1, corner + e1 + e2, corner + e2];
        for axis in [0, 1] {
            polygon = clipped(&polygon, |point| point[axis]);
            polygon = clipped(&polygon, |point| size[axis] - point[axis]);
        }
        let twice: f64 = (0..polygon.len()).map(|k| polygon[k].perp_dot(polygon[(k + 1) % polygon.len()])).sum();
        (twice.abs() / 2.0 / (size.x * size.y)).min(1.0)
    }

    /// Whether it may meet the box from `low` to `high`: never false when it does.
    pub(crate) fn may_meet(&self, [low, high]: [DVec2; 2]) -> bool {
        let [e1, e2] = self.sides;
        let [least, greatest] = self.bounds();
        // Rounding of what follows, with much to spare.
        let slack = 1e-13 * (self.corner.abs() + e1.abs() + e2.abs() + high.abs()).max_element();
        if least.x > high.x + slack
            || least.y > high.y + slack
            || greatest.x < low.x - slack
            || greatest.y < low.y - slack
        {
            return false;
        }
        // Across each side: the parallelogram spans 0 to `whole`, the box its middle and reach.
        let (middle, reach) = ((low + high) / 2.0 - self.corner, (high - low) / 2.0);
        [(e1, e2), (e2, e1)].into_iter().all(|(along, other)| {
            let whole = along.perp_dot(other);
            let (from, to) = (whole.min(0.0), whole.max(0.0));
            let at = along.perp_dot(middle);
            let half = along.x.abs() * reach.y + along.y.abs() * reach.x + slack * along.abs().element_sum();
            at + half >= from && at - half <= to
        })
    }
}

/// The part of a convex polygon where `height`, which is linear, is not negative (Sutherland and Hodgman 1974).
fn clipped(polygon: &[DVec2], height: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, &from) in polygon.iter().enumerate() {
        let to = polygon[(k + 1) % polygon.len()];
        let (at_from, at_to) = (height(from), height(to));
        if at_from >= 0.0 {
            kept.push(from);
        }
        if (at_from >= 0.0) != (at_to >= 0.0) {
            kept.push(from + (to - from) * (at_from / (at_from - at_to)));
        }
    }
    kept
}

/// The difference of two points, without rounding: in each coordinate a rounded value and what it lacks.
#[derive(Clone, Copy)]
struct Difference {
    rounded: DVec2,
    rest: DVec2,
}

impl Difference {
    fn new(a: DVec2, b: DVec2) -> Self {
        let (x, y) = (two_sum(a.x, -b.x), two_sum(a.y, -b.y));
        Self { rounded: DVec2::new(x.0, y.0), rest: DVec2::new(x.1, y.1) }
    }

    fn plus(self, shift: DVec2) -> Self {
        let (x, y) = (two_sum(self.rounded.x, shift.x), two_sum(self.rounded.y, shift.y));
        Self { rounded: DVec2::new(x.0, y.0), rest: self.rest + DVec2::new(x.1, y.1) }
    }
}

impl From<DVec2> for Difference {
    fn from(value: DVec2) -> Self {
        Self { rounded: value, rest: DVec2::ZERO }
    }
}

/// A sum of two floats, about 106 bits.
#[derive(Clone, Copy)]
struct Exact {
    high: f64,
    low: f64,
}

impl Exact {
    /// a x b. The products are exact; only sums at the 106th bit are rounded.
    fn cross(a: Difference, b: DVec2) -> Self {
        let (plus, minus) = (two_product(a.rounded.x, b.y), two_product(-a.rounded.y, b.x));
        let rest = a.rest.x * b.y - a.rest.y * b.x;
        let (high, error) = two_sum(plus.0, minus.0);
        let (low, lower) = two_sum(plus.1, minus.1);
        let (low, lowest) = two_sum(error + rest, low);
        let (high, low) = two_sum(high, low);
        Self { high, low: low + (lowest + lower) }
    }

    fn negated(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }

    fn minus(self, other: Self) -> Self {
        let (high, error) = two_sum(self.high, -other.high);
        let (low, lower) = two_sum(self.low, -other.low);
        let (low, lowest) = two_sum(error, low);
        let (high, low) = two_sum(high, low);
        Self { high, low: low + (lowest + lower) }
    }

    /// 1, 0 or -1.
    fn sign(self) -> f64 {
        let total = self.high + self.low;
        if total == 0.0 { 0.0 } else { total.signum() }
    }
}

/// a + b as its rounded value and the rounding error (Knuth 1969).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// a b as its rounded value and the rounding error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(corner: [f64; 2], e1: [f64; 2], e2: [f64; 2]) -> Footprint {
        Footprint { corner: corner.into(), sides: [e1.into(), e2.into()] }
    }

    #[test]
    fn low_edges_are_in_and_high_edges_are_out() {
        let upright = footprint([0.25, -0.5], [0.5, 0.0], [0.0, 1.0]);
        for (point, within) in [
            ([0.25, -0.5], true),
            ([0.5, -0.5], true),
            ([0.25, 0.25], true),
            ([0.75, 0.0], false),
            ([0.5, 0.5], false),
            ([0.75, 0.5], false),
            ([0.25_f64.next_down(), 0.0], false),
            ([0.75_f64.next_down(), 0.5_f64.next_down()], true),
        ] {
            assert_eq!(upright.contains(point.into()), within, "{point:?}");
            // Sides exchanged: the same edges, the other way round.
            let turned = Footprint { sides: [upright.sides[1], upright.sides[0]], ..upright };
            assert_eq!(turned.contains(point.into()), within, "{point:?}");
        }
        // A side that points down begins at its upper end.
        let downward = footprint([0.0, 1.0], [1.0, 0.0], [0.0, -1.0]);
        assert!(downward.contains(DVec2::new(0.5, 1.0)) && !downward.contains(DVec2::new(0.5, 0.0)));
        let slanted = footprint([0.0, 0.0], [1.0, 1.0], [-1.0, 1.0]);
        assert!(slanted.contains(DVec2::new(0.5, 0.5)) && !slanted.contains(DVec2::new(0.5, 1.5)));
    }

    #[test]
    fn membership_is_that_of_exact_numbers() {
        // 0.3 - 0.1 is less than 0.2 by less than its last digit.
        let tenths = footprint([0.1, 0.0], [0.2, 0.0], [0.0, 1.0]);
        assert!(tenths.contains(DVec2::new(0.3, 0.5)));
        assert!(!tenths.contains(DVec2::new(0.3_f64.next_up(), 0.5)));
        // So is the sum of a place and a repetition of the texture.
        let (hair, unit) = (2.0_f64.powi(-60), footprint([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]));
        assert!(
            unit.contains_moved(DVec2::new(-hair, 0.5), DVec2::X)
                && !unit.contains_moved(DVec2::new(-hair, 0.5), DVec2::ZERO)
        );
        let next = unit.moved(DVec2::X);
        assert!(
            !next.contains_moved(DVec2::new(-hair, 0.5), DVec2::X)
                && next.contains_moved(DVec2::new(hair, 0.5), DVec2::X)
        );
        // A hair's breadth on a long slanted edge: rounded products would not see it.
        let long = footprint([0.0, 0.0], [1e6, 1e6 + 1.0], [0.0, 1.0]);
        let on_edge = DVec2::new(0.5e6, 0.5e6 + 0.5);
        assert!(long.contains(on_edge));
        assert!(!long.contains(DVec2::new(on_edge.x, on_edge.y.next_down())));
        assert!(!long.contains(DVec2::new(on_edge.x, on_edge.y + 1.0)));
        assert!(long.contains(DVec2::new(on_edge.x, (on_edge.y + 1.0).next_down())));
    }

    #[test]
    fn nothing_lies_in_a_footprint_without_area() {
        for flat in [
            footprint([0.0; 2], [1.0, 2.0], [2.0, 4.0]),
            footprint([0.0; 2], [0.0; 2], [1.0, 0.0]),
            footprint([0.0; 2], [0.0; 2], [0.0; 2]),
        ] {
            assert_eq!(flat.area(), 0.0);
            assert!(!flat.contains(DVec2::ZERO) && !flat.contains(DVec2::new(0.5, 1.0)));
        }
    }

    #[test]
    fn the_share_of_a_box_is_the_area_they_share() {
        let unit = [DVec2::ZERO, DVec2::ONE];
        let diamond = footprint([0.5, -0.5], [1.0, 1.0], [-1.0, 1.0]);
        for (footprint, share) in [
            (footprint([0.25, 0.25], [0.5, 0.0], [0.0, 0.5]), 0.25),
            (footprint([-1.0, -1.0], [3.0, 0.0], [0.0, 3.0]), 1.0),
            (footprint([0.5, 0.5], [0.0, 2.0], [2.0, 0.0]), 0.25),
            (footprint([2.0, 2.0], [1.0, 0.0], [0.0, 1.0]), 0.0),
            (diamond, 1.0),
            (diamond.moved(DVec2::new(0.5, 0.0)), 0.75),
        ] {
            assert!((footprint.share_of(unit) - share).abs() < 1e-15, "{footprint:?}: {}", footprint.share_of(unit));
            let shift = DVec2::new(3.0, -7.0);
            let moved = footprint.moved(shift).share_of(unit.map(|corner| corner + shift));
            assert!((moved - share).abs() < 1e-14);
        }
    }

    #[test]
    fn a_box_that_shares_area_is_never_thought_apart() {
        let mut word = 1_u32;
        let mut unit = || {
            word = crate::flake_set::mixed(word.wrapping_add(0x9e37_79b9));
            f64::from(word) / 2.0_f64.powi(32)
        };
        let (mut meeting, mut apart) = (0, 0);
        for _ in 0..20_000 {
            let mut point = |size: f64| DVec2::new(size * (unit() - 0.5), size * (unit() - 0.5));
            let slim = point(2.0);
            let footprint = Footprint { corner: point(4.0), sides: [slim, 0.01 * slim + point(0.1)] };
            let low = point(3.0);
            let bounds = [low, low + point(1.0).abs()];
            let share = footprint.share_of(bounds);
            assert!(share < 1e-12 || footprint.may_meet(bounds), "{footprint:?} {bounds:?}");
            meeting += i32::from(share > 0.0);
            apart += i32::from(!footprint.may_meet(bounds));
        }
        assert!(meeting > 300 && apart > 10_000, "{meeting} {apart}");
    }
}
