//! The flakes: how many lie in each node of a quadtree over a square of texture space, where, and with which normal.
//!
//! The set is defined in `engine/design/0007-flake-set.md`, by integers and by sums and products of f32 that are rounded
//! one by one. The renderer derives the same flakes from the same definition, bit for bit: nothing here may be
//! contracted (`mul_add`), reordered or left to a library function.

use glam::{DVec2, DVec3};

use crate::OracleError;
use crate::discrete::Flakes;
use crate::error::in_range;
pub use crate::footprint::Footprint;

/// Leaves are on the first level where a node has at most so many flakes on average.
const FLAKES_A_LEAF: u64 = 4;
/// Up to so many flakes are parted by a bit each, more by a rounded normal number.
const EXACT_HALVING: u64 = 64;
/// A leaf's first words belong to its split; each flake takes four after that.
const FIRST_FLAKE_DRAW: u32 = 6;
/// The most flakes in a square of texture space.
pub const MAX_COUNT: u64 = 1_000_000_000_000;

/// One full mixer of a word (Wellons's lowbias32).
pub fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Two words mixed into one; their order matters.
pub fn hash2(a: u32, b: u32) -> u32 {
    mixed(a.wrapping_add(mixed(b)))
}

/// Three words mixed into one; their order matters.
pub fn hash3(a: u32, b: u32, c: u32) -> u32 {
    mixed(a.wrapping_add(hash2(b, c)))
}

/// Names the node in column `x` and row `y` of a level of the quadtree; its random words are drawn from the name.
pub fn node_key(level: u32, x: u32, y: u32, seed: u32) -> [u32; 2] {
    [hash3(x, y, hash2(level, seed)), hash3(y, x, hash2(level, !seed))]
}

/// Random word `index` of a node.
pub fn draw(key: [u32; 2], index: u32) -> u32 {
    mixed(key[0].wrapping_add(mixed(key[1].wrapping_add(index))))
}

/// A polynomial by Horner's rule, its highest coefficient first; each sum and each product is rounded.
fn polynomial(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().skip(1).fold(coefficients[0], |value, coefficient| value * x + coefficient)
}

/// -ln(word / 2^32) within 1e-7 relative, 0 taken as 1.
#[expect(clippy::excessive_precision, clippy::approx_constant, reason = "the definition gives these decimals")]
fn minus_log(word: u32) -> f32 {
    const SERIES: [f32; 10] = [
        -0.07638592,
        0.1291417,
        -0.13240843,
        0.14180079,
        -0.16609127,
        0.20002072,
        -0.25001585,
        0.33333324,
        -0.49999988,
        1.0,
    ];
    let bits = word.max(1);
    let mut exponent = 31 - bits.leading_zeros();
    // 1 <= mantissa < 2, the upper 24 bits.
    let mut mantissa = ((bits << (31 - exponent)) >> 8) as f32 * (1.0 / 8_388_608.0);
    if mantissa > 1.41421354 {
        mantissa *= 0.5;
        exponent += 1;
    }
    let x = mantissa - 1.0;
    let log_mantissa = polynomial(&SERIES, x) * x;
    ((32 - exponent) as f32 * 0.6931472 - log_mantissa).max(0.0)
}

/// 1 / sqrt(x) for positive normal x: four steps of Newton from the exponent halved.
fn inverse_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    let half_x = 0.5 * x;
    for _ in 0..4 {
        y *= 1.5 - half_x * (y * y);
    }
    y
}

/// Two independent normal numbers of mean 0 and variance 1 (Box and Muller 1958): the first word gives the radius, the
/// second the angle, in its upper three bits the eighth of the turn and in the next 24 the place in it.
pub fn normal_pair(radius_word: u32, angle_word: u32) -> [f32; 2] {
    const SINE: [f32; 4] = [-1.9503963e-4, 8.332036e-3, -0.1666665, 1.0];
    const COSINE: [f32; 5] = [2.437988e-5, -1.3886619e-3, 4.1666617e-2, -0.5, 1.0];
    let squared = 2.0 * minus_log(radius_word);
    let radius = if squared > 1e-12 { squared * inverse_root(squared) } else { 0.0 };
    // In units of pi/4 / 2^24.
    let angle = (((angle_word >> 5) & 0xff_ffff) as f32 + 0.5) * 4.6816675e-8;
    let z = angle * angle;
    let sine = polynomial(&SINE, z) * angle;
    let cosine = polynomial(&COSINE, z);
    let eighth = angle_word >> 29;
    let (x, y) = if eighth & 1 != 0 { (sine, cosine) } else { (cosine, sine) };
    let (x, y) = (radius * x, radius * y);
    [if eighth & 2 != 0 { -x } else { x }, if eighth & 4 != 0 { -y } else { y }]
}

/// Binomial(n, 1/2) from two random words. Beyond 64 a normal number, its kurtosis corrected (Cornish and Fisher 1938)
/// and its variance less the 1/12 that rounding adds (Sheppard 1898).
pub fn half_of(n: u64, first_word: u32, second_word: u32) -> u64 {
    if n <= EXACT_HALVING {
        let bits = u64::from(first_word) | u64::from(second_word) << 32;
        let taken = if n == 64 { u64::MAX } else { (1 << n) - 1 };
        return u64::from((bits & taken).count_ones());
    }
    let variance = 0.25 * n as f32 - 0.083333336;
    let over_deviation = inverse_root(variance);
    let deviation = variance * over_deviation;
    let [z, _] = normal_pair(first_word, second_word);
    let excess = z * z - 3.0;
    let correction = excess * (over_deviation * over_deviation);
    let correction = 1.0 - correction * 0.020833334; // 1/48
    let from_middle = deviation * z * correction + if n % 2 == 1 { 1.0 } else { 0.5 };
    (n / 2).saturating_add_signed(from_middle.floor() as i64)
}

/// The flakes of a node's four children, in the order (0,0), (1,0), (0,1), (1,1) of (x, y).
pub fn children_of(n: u64, key: [u32; 2]) -> [u64; 4] {
    let low_x = half_of(n, draw(key, 0), draw(key, 1));
    let high_x = n - low_x;
    let low_x_low_y = half_of(low_x, draw(key, 2), draw(key, 3));
    let high_x_low_y = half_of(high_x, draw(key, 4), draw(key, 5));
    [low_x_low_y, high_x_low_y, low_x - low_x_low_y, high_x - high_x_low_y]
}

/// The level of the leaves of a square with `count` flakes: the first with at most four a node on average.
pub fn leaf_level(count: u64) -> u32 {
    (0..).find(|level| count.div_ceil(FLAKES_A_LEAF) <= 1 << (2 * level)).unwrap_or(0)
}

/// A flake that a footprint holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flake {
    /// Where it is in texture space, in the repetition of the texture that the footprint covers.
    pub uv: DVec2,
    /// Its normal about +Z, (slope x, slope y, 1): the very f32 numbers, not normalised.
    pub normal: DVec3,
}

impl Flake {
    /// 1 / (m.n) for the unit normal m: what a flake drawn from the slope distribution counts for.
    pub fn weight(&self) -> f64 {
        self.normal.length() / self.normal.z
    }
}

/// Whether a flake reflects light from `i` into the cone about `o`: |2 (i.m) m - i - o|^2 <= 4 sin^2(gamma/2) and
/// i.m > 0 for the unit normal m, multiplied out so that `normal` may have any length. `i` and `o` are unit vectors.
pub fn is_lit(normal: DVec3, i: DVec3, o: DVec3, sin2_half_gamma: f64) -> bool {
    let i_m = i.dot(normal);
    let square = normal.length_squared();
    let chord = 2.0 * i_m * normal - square * (i + o);
    i_m > 0.0 && chord.length_squared() <= 4.0 * sin2_half_gamma * (square * square)
}

/// All flakes of a texture that repeats in every square of texture space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlakeSet {
    count: u64,
    seed: u32,
    /// alpha / sqrt 2, rounded to f32 once.
    slope_deviation: f32,
    leaf_level: u32,
}

impl Flakes for FlakeSet {
    fn count(&self) -> u64 {
        self.count
    }

    fn visit(&self, footprint: &Footprint, mut visit: impl FnMut(DVec3, u64)) {
        let mut whole = 0;
        for square in footprint.squares() {
            if footprint.holds_square(square) {
                whole += 1;
            } else {
                self.visit_square(footprint, square, &mut |flake| visit(flake.normal, 1));
            }
        }
        if whole > 0 {
            let square = Footprint { corner: DVec2::ZERO, sides: [DVec2::X, DVec2::Y] };
            self.visit_square(&square, DVec2::ZERO, &mut |flake| visit(flake.normal, whole));
        }
    }
}

/// A square of the quadtree and the flakes in it.
#[derive(Clone, Copy)]
struct Node {
    level: u32,
    x: u32,
    y: u32,
    flakes: u64,
}

impl Node {
    /// Its lowest and highest corner in the unit square.
    fn corners(&self) -> [DVec2; 2] {
        let side = 0.5_f64.powi(self.level as i32);
        let low = DVec2::new(f64::from(self.x), f64::from(self.y));
        [low * side, (low + 1.0) * side]
    }
}

impl FlakeSet {
    /// `count` flakes in each square, their slopes drawn from Beckmann's distribution of roughness `alpha`.
    ///
    /// # Errors
    /// When there are too many flakes, or `alpha` is not a positive finite number.
    pub fn new(count: u64, alpha: f64, seed: u32) -> Result<Self, OracleError> {
        in_range("count", count as f64, count <= MAX_COUNT, "0 to 1e12")?;
        in_range("alpha", alpha, alpha > 0.0 && alpha.is_finite(), "positive and finite")?;
        let slope_deviation = (alpha / 2.0_f64.sqrt()) as f32;
        Ok(Self { count, seed, slope_deviation, leaf_level: leaf_level(count) })
    }

    /// Visits each flake in `footprint` once, in every repetition of the texture.
    pub fn for_each_in(&self, footprint: &Footprint, mut visit: impl FnMut(Flake)) {
        for square in footprint.squares() {
            self.visit_square(footprint, square, &mut visit);
        }
    }

    /// Visits the flakes of one square of texture, `tile`, that lie in `footprint`.
    fn visit_square(&self, footprint: &Footprint, tile: DVec2, visit: &mut impl FnMut(Flake)) {
        let local = footprint.moved(-tile);
        let mut open = vec![Node { level: 0, x: 0, y: 0, flakes: self.count }];
        while let Some(node) = open.pop() {
            if node.flakes == 0 || !local.may_meet(node.corners()) {
                continue;
            }
            let key = node_key(node.level, node.x, node.y, self.seed);
            if node.level == self.leaf_level {
                for flake in (0..node.flakes).map(|flake| self.flake(&node, key, flake as u32)) {
                    if footprint.contains_moved(flake.uv, tile) {
                        visit(Flake { uv: flake.uv + tile, ..flake });
                    }
                }
                continue;
            }
            for (child, flakes) in (0..).zip(children_of(node.flakes, key)) {
                let (x, y) = (2 * node.x + (child & 1), 2 * node.y + (child >> 1));
                open.push(Node { level: node.level + 1, x, y, flakes });
            }
        }
    }

    /// Flake number `flake` of a leaf, in the unit square.
    fn flake(&self, leaf: &Node, key: [u32; 2], flake: u32) -> Flake {
        let word = |k: u32| draw(key, FIRST_FLAKE_DRAW.wrapping_add(flake.wrapping_mul(4)).wrapping_add(k));
        // At most 19 + 32 bits and the half: exact.
        let unit = 0.5_f64.powi(32 + self.leaf_level as i32);
        let place = |cell: u32, word: u32| ((u64::from(cell) << 32 | u64::from(word)) as f64 + 0.5) * unit;
        let uv = DVec2::new(place(leaf.x, word(0)), place(leaf.y, word(1)));
        let slopes = normal_pair(word(2), word(3)).map(|normal| self.slope_deviation * normal);
        Flake { uv, normal: DVec3::new(f64::from(slopes[0]), f64::from(slopes[1]), 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::statistics::{chi_square, normal_p_value};

    fn set(count: u64, alpha: f64, seed: u32) -> FlakeSet {
        FlakeSet::new(count, alpha, seed).expect("a valid set")
    }

    fn square(corner: DVec2, side: f64) -> Footprint {
        Footprint { corner, sides: [DVec2::X * side, DVec2::Y * side] }
    }

    fn flakes(set: &FlakeSet, footprint: &Footprint) -> Vec<Flake> {
        let mut flakes = Vec::new();
        set.for_each_in(footprint, |flake| flakes.push(flake));
        flakes
    }

    /// In the order of their places, so that lists can be compared.
    fn sorted(mut flakes: Vec<Flake>) -> Vec<Flake> {
        flakes.sort_by(|a, b| a.uv.x.total_cmp(&b.uv.x).then(a.uv.y.total_cmp(&b.uv.y)));
        flakes
    }

    #[test]
    fn no_flake_is_lost_or_made_in_a_split() {
        let around = |n: u64| [n - 1, n, n + 1];
        let counts = [[0, 1, 2], [3, 64, 65], around(1 << 24), around(1 << 32), around(MAX_COUNT - 1)];
        for n in counts.concat() {
            for seed in 0..200 {
                let children = children_of(n, node_key(3, 1, 2, seed));
                assert_eq!(children.iter().sum::<u64>(), n, "{children:?}");
                assert!(children.iter().all(|child| *child <= n));
            }
        }
    }

    #[test]
    fn leaves_are_where_four_flakes_share_a_node() {
        let levels = [0, 4, 5, 16, 17, 65, 1_000_000, MAX_COUNT].map(leaf_level);
        assert_eq!(levels, [0, 0, 1, 1, 2, 3, 9, 19]);
    }

    /// Smallest bias caught: a variance 5 % off, a mean 1.5 % of a standard deviation off, in 100,000 halvings.
    #[test]
    fn halves_have_the_mean_and_variance_of_a_binomial() {
        for n in [1, 2, 3, 31, 32, 33, 64, 65, 66, 1000, (1 << 24) + 1, (1 << 32) - 1, MAX_COUNT] {
            let draws: u32 = 100_000;
            let (expected, deviation) = (n as f64 / 2.0, (n as f64).sqrt() / 2.0);
            let standard = |k: u32| {
                let key = node_key(5, k, 7, 11);
                let low = half_of(n, draw(key, 0), draw(key, 1));
                (low as f64 - expected) / deviation
            };
            let (sum, squares) = (0..draws).map(standard).fold((0.0, 0.0), |(s, q), d| (s + d, q + d * d));
            let (mean, square) = (sum / f64::from(draws), squares / f64::from(draws));
            // The square of one standard normal varies by 2, that of a coin's deviation not at all.
            let p_values = |bias: f64, factor: f64| {
                let of_mean = normal_p_value((mean + bias) * f64::from(draws).sqrt());
                let of_square = normal_p_value((factor * square - 1.0) * (f64::from(draws) / 2.0).sqrt());
                of_mean.min(of_square)
            };
            assert!(p_values(0.0, 1.0) > 1e-4, "{n}: mean {mean} variance {square}");
            assert!(p_values(0.015, 1.0) < 1e-3 || p_values(-0.015, 1.0) < 1e-3, "{n}: a biased mean must show");
            assert!(p_values(0.0, 1.05) < 1e-4, "{n}: a biased variance must show");
        }
    }

    /// The halves of 65 flakes against the exact law: the corrected normal is good from the first count it is used for.
    /// Smallest bias caught, in two million halvings: the law of 66 flakes; a variance larger by the 1/12 of the rounding,
    /// .5 %.
    #[test]
    fn rounded_normals_follow_the_binomial_law() {
        let draws = 2_000_000;
        let mut observed = vec![0.0; 67];
        for k in 0..draws {
            let key = node_key(9, 5, k, 2);
            observed[half_of(65, draw(key, 2), draw(key, 3)) as usize] += 1.0;
        }
        let law = |n: f64| -> Vec<f64> {
            let logarithm = |k: f64| libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
            (0..67).map(|k| f64::from(draws) * (logarithm(f64::from(k)) - n * 2.0_f64.ln()).exp()).collect()
        };
        // Up to 32 below and above the middle, beyond which the law holds 1e-15.
        let test = chi_square(&observed[1..65], &law(65.0)[1..65]).expect("a test");
        assert!(test.p_value > 1e-4, "{test:?}");
        assert!(chi_square(&observed[1..65], &law(66.0)[1..65]).expect("a test").p_value < 1e-12);
        let square = |(k, times): (usize, &f64)| times * (k as f64 - 32.5).powi(2);
        let variance = observed.iter().enumerate().map(square).sum::<f64>() / f64::from(draws);
        let p_value = |law: f64| normal_p_value((variance / law - 1.0) * (f64::from(draws) / 2.0).sqrt());
        assert!(p_value(65.0 / 4.0) > 1e-4, "{variance}");
        assert!(p_value(65.0 / 4.0 + 1.0 / 12.0) < 1e-4 && p_value(65.0 / 4.0 - 1.0 / 12.0) < 1e-4, "{variance}");
    }

    #[test]
    fn normal_pairs_are_those_of_box_and_muller() {
        let mut random = Pcg64::seed_from_u64(4);
        for _ in 0..100_000 {
            let (radius_word, angle_word) = (random.next_u32() >> (random.next_u32() % 32), random.next_u32());
            let radius = (-2.0 * (f64::from(radius_word.max(1)) / 2.0_f64.powi(32)).ln()).sqrt();
            let [x, y] = normal_pair(radius_word, angle_word).map(f64::from);
            assert!((x.hypot(y) - radius).abs() < 2e-6, "{radius_word:x}: {} {radius}", x.hypot(y));
        }
        assert_eq!(normal_pair(0, 77), normal_pair(1, 77), "zero is taken as one");
        assert!(normal_pair(u32::MAX, 0)[0].abs() < 1e-3);
    }

    /// Smallest bias caught: positions squeezed by 0.2 % towards the corner, slopes 1 % too steep; a million flakes.
    #[test]
    fn places_are_uniform_and_slopes_are_of_beckmann() {
        let count = 1_000_000;
        let alpha = 0.3;
        let flakes = flakes(&set(count, alpha, 5), &square(DVec2::ZERO, 1.0));
        assert_eq!(flakes.len() as u64, count);
        let p_value = |cell_of: &dyn Fn(&Flake) -> Option<usize>, cells: usize| {
            let mut observed = vec![0.0; cells];
            for cell in flakes.iter().filter_map(cell_of) {
                observed[cell] += 1.0;
            }
            let expected = vec![count as f64 / cells as f64; cells];
            chi_square(&observed, &expected).expect("a test").p_value
        };
        // Cells that no level of the tree knows.
        let place = |factor: f64| {
            move |flake: &Flake| {
                let at = (flake.uv * factor * 37.0).floor();
                (at.max_element() < 37.0).then_some(at.y as usize * 37 + at.x as usize)
            }
        };
        assert!(p_value(&place(1.0), 37 * 37) > 1e-4);
        assert!(p_value(&place(0.998), 37 * 37) < 1e-6, "squeezed places must show");
        // exp(-slope^2 / alpha^2) is uniform for Beckmann, and so is the azimuth.
        let slope = |alpha: f64| {
            move |flake: &Flake| {
                let (x, y) = (flake.normal.x, flake.normal.y);
                let ring = ((-(x * x + y * y) / (alpha * alpha)).exp() * 40.0).min(39.0) as usize;
                let sector = ((y.atan2(x) / (2.0 * std::f64::consts::PI)).rem_euclid(1.0) * 24.0).min(23.0) as usize;
                Some(ring * 24 + sector)
            }
        };
        assert!(p_value(&slope(alpha), 40 * 24) > 1e-4);
        assert!(p_value(&slope(0.99 * alpha), 40 * 24) < 1e-6, "steep slopes must show");
    }

    #[test]
    fn slopes_do_not_follow_places() {
        let flakes = flakes(&set(200_000, 0.5, 1), &square(DVec2::ZERO, 1.0));
        let n = flakes.len() as f64;
        for (place, slope) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let products: f64 =
                flakes.iter().map(|flake| (flake.uv[place] - 0.5) * flake.normal[slope]).sum::<f64>() / n;
            let correlation = products / ((1.0 / 12.0_f64).sqrt() * 0.5 / 2.0_f64.sqrt());
            assert!(normal_p_value(correlation * n.sqrt()) > 1e-4, "{place} {slope}: {correlation}");
        }
    }

    #[test]
    fn parts_of_a_footprint_hold_what_the_whole_holds() {
        let mut random = Pcg64::seed_from_u64(9);
        let mut unit = || f64::from(random.next_u32() >> 8) / f64::from(1 << 24);
        for (count, seed) in [(1, 1), (700, 2), (100_000, 3)] {
            let set = set(count, 0.2, seed);
            for _ in 0..20 {
                let side = DVec2::new(unit() - 0.5, unit() - 0.5);
                let other = DVec2::new(unit() - 0.5, unit() - 0.5);
                let corner = DVec2::new(8.0 * unit() - 4.0, 8.0 * unit() - 4.0);
                let whole = Footprint { corner, sides: [side, other] };
                let (across, along) = (unit(), unit());
                let parts = [(0.0, across), (across, 1.0)].into_iter().flat_map(|(a0, a1)| {
                    [(0.0, along), (along, 1.0)].map(|(b0, b1)| Footprint {
                        corner: corner + a0 * side + b0 * other,
                        sides: [(a1 - a0) * side, (b1 - b0) * other],
                    })
                });
                let parts: Vec<Flake> = parts.flat_map(|part| flakes(&set, &part)).collect();
                assert_eq!(sorted(parts), sorted(flakes(&set, &whole)), "{whole:?}");
            }
        }
    }

    #[test]
    fn every_square_of_texture_space_holds_the_same_flakes() {
        let set = set(3000, 0.2, 8);
        let footprint =
            Footprint { corner: DVec2::new(0.7, 0.2), sides: [DVec2::new(0.6, 0.1), DVec2::new(-0.2, 0.9)] };
        let here = sorted(flakes(&set, &footprint));
        assert!(here.len() > 1000);
        for shift in [DVec2::new(1.0, 0.0), DVec2::new(-3.0, 7.0), DVec2::new(1e6, -1e6)] {
            let there = sorted(flakes(&set, &footprint.moved(shift)));
            assert_eq!(there.len(), here.len());
            for (a, b) in here.iter().zip(&there) {
                assert_eq!(a.normal, b.normal);
                assert!((b.uv - a.uv - shift).length() < 1e-9);
            }
        }
        // Whole repetitions hold exactly N each, wherever they begin.
        let four = square(DVec2::new(-0.3, 5.6), 2.0);
        assert_eq!(flakes(&set, &four).len(), 4 * 3000);
    }

    #[test]
    fn flakes_of_a_square_of_a_trillion_are_found_where_they_are() {
        let set = set(MAX_COUNT, 0.1, 3);
        let side = 2e-6;
        let found = flakes(&set, &square(DVec2::new(0.3, 0.9), side)).len() as f64;
        let expected = MAX_COUNT as f64 * side * side;
        assert!((found - expected).abs() < 5.0 * expected.sqrt(), "{found} of about {expected}");
    }

    #[test]
    fn nothing_is_found_where_there_is_nothing() {
        assert!(flakes(&set(0, 0.1, 1), &square(DVec2::ZERO, 3.0)).is_empty());
        let thin = Footprint { corner: DVec2::ZERO, sides: [DVec2::X, DVec2::X] };
        assert!(flakes(&set(1000, 0.1, 1), &thin).is_empty());
        assert!(FlakeSet::new(MAX_COUNT + 1, 0.1, 1).is_err() && FlakeSet::new(1, 0.0, 1).is_err());
    }

    #[test]
    fn a_flake_is_lit_when_its_reflection_is_in_the_cone() {
        let mut random = Pcg64::seed_from_u64(6);
        let mut unit = || f64::from(random.next_u32() >> 8) / f64::from(1 << 24);
        let mut lit = 0;
        for _ in 0..20_000 {
            let mut direction = |reach: f64| {
                let (z, phi) = (1.0 - reach * unit(), 2.0 * std::f64::consts::PI * unit());
                let sin = (1.0 - z * z).sqrt();
                DVec3::new(sin * phi.cos(), sin * phi.sin(), z)
            };
            let (i, o, m) = (direction(0.9), direction(0.9), direction(0.5));
            let gamma = 0.5 * unit();
            let cosine = (2.0 * i.dot(m) * m - i).dot(o);
            let expected = i.dot(m) > 0.0 && cosine >= gamma.cos();
            if (cosine - gamma.cos()).abs() > 1e-12 {
                let scaled = m * (1e-3 + 1e3 * unit());
                assert_eq!(is_lit(scaled, i, o, (gamma / 2.0).sin().powi(2)), expected);
                lit += i32::from(expected);
            }
        }
        assert!(lit > 100, "{lit}");
        assert!(!is_lit(DVec3::Z, -DVec3::Z, -DVec3::Z, 1.0), "a flake has one side");
    }
}
