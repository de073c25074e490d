//! One-dimensional quadrature: Gauss-Legendre rules of any order, and globally adaptive Gauss-Kronrod.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Nodes and weights of the `count`-point Gauss-Legendre rule on `[a, b]`, as (node, weight) in ascending order.
/// Exact for polynomials of degree `2 count - 1`.
pub(crate) fn gauss_legendre(count: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    let (middle, half) = ((a + b) / 2.0, (b - a) / 2.0);
    let n = count as f64;
    (0..count)
        .rev()
        .map(|k| {
            // Newton from Tricomi's estimate converges in three steps at any order.
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (value, derivative) = legendre(count, x);
                slope = derivative;
                x -= value / derivative;
            }
            (middle + half * x, half * 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The Legendre polynomial of the given degree and its derivative at `x` in (-1, 1).
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for k in 2..=degree {
        let k = k as f64;
        (previous, current) = (current, ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k);
    }
    (current, degree as f64 * (x * current - previous) / (x * x - 1.0))
}

/// Positive abscissae of the 15-point Kronrod rule (QUADPACK's qk15), outermost first; the last is the centre.
const KRONROD_NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
/// Weights of [`KRONROD_NODES`].
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Weights of the embedded 7-point Gauss rule, at the odd entries of [`KRONROD_NODES`].
const GAUSS_WEIGHTS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// Refinement stops at this many panels: an integrand that needs more has a singularity that should be removed first.
const MAX_PANELS: usize = 3000;

struct Panel<const N: usize> {
    a: f64,
    b: f64,
    value: [f64; N],
    error: f64,
}

impl<const N: usize> PartialEq for Panel<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl<const N: usize> Eq for Panel<N> {}
impl<const N: usize> PartialOrd for Panel<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl<const N: usize> Ord for Panel<N> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

/// The integral of the vector-valued `f` over the panels between consecutive `breakpoints` (ascending), refined until
/// the estimated error is below `relative_tolerance` times the largest component.
pub(crate) fn integrate<const N: usize>(
    f: impl Fn(f64) -> [f64; N],
    breakpoints: &[f64],
    relative_tolerance: f64,
) -> [f64; N] {
    let mut panels: BinaryHeap<Panel<N>> =
        breakpoints.windows(2).filter(|ends| ends[1] > ends[0]).map(|ends| panel(&f, ends[0], ends[1])).collect();
    let sum = |panels: &BinaryHeap<Panel<N>>| {
        let mut total = [0.0; N];
        for panel in panels {
            for (t, v) in total.iter_mut().zip(panel.value) {
                *t += v;
            }
        }
        total
    };
    // Running totals steer the refinement; the answer is summed afresh.
    let mut total = sum(&panels);
    let mut error: f64 = panels.iter().map(|p| p.error).sum();
    while panels.len() < MAX_PANELS {
        let scale = total.iter().fold(0.0_f64, |largest, t| largest.max(t.abs()));
        if error.is_nan() || error <= relative_tolerance * scale || error < f64::MIN_POSITIVE {
            break;
        }
        let Some(worst) = panels.pop() else { break };
        let middle = (worst.a + worst.b) / 2.0;
        if middle <= worst.a || middle >= worst.b {
            panels.push(Panel { error: 0.0, ..worst });
            error -= worst.error;
            continue;
        }
        let halves = [panel(&f, worst.a, middle), panel(&f, middle, worst.b)];
        for (k, t) in total.iter_mut().enumerate() {
            *t += halves[0].value[k] + halves[1].value[k] - worst.value[k];
        }
        error += halves[0].error + halves[1].error - worst.error;
        panels.extend(halves);
    }
    sum(&panels)
}

/// One Gauss-Kronrod evaluation of `f` on `[a, b]` with QUADPACK's error estimate.
fn panel<const N: usize>(f: &impl Fn(f64) -> [f64; N], a: f64, b: f64) -> Panel<N> {
    let (middle, half) = ((a + b) / 2.0, (b - a) / 2.0);
    let values: [[f64; N]; 15] = std::array::from_fn(|k| match k {
        0..=6 => f(middle - half * KRONROD_NODES[k]),
        7 => f(middle),
        _ => f(middle + half * KRONROD_NODES[14 - k]),
    });
    let mut value = [0.0; N];
    let mut error = 0.0_f64;
    for component in 0..N {
        let (mut kronrod, mut gauss) = (0.0, 0.0);
        for (k, sample) in values.iter().enumerate() {
            let fold = k.min(14 - k);
            kronrod += KRONROD_WEIGHTS[fold] * sample[component];
            if fold % 2 == 1 {
                gauss += GAUSS_WEIGHTS[fold / 2] * sample[component];
            }
        }
        let mean = kronrod / 2.0;
        let spread: f64 = values
            .iter()
            .enumerate()
            .map(|(k, sample)| KRONROD_WEIGHTS[k.min(14 - k)] * (sample[component] - mean).abs())
            .sum();
        // The difference of the rules is the error of the Gauss one; the Kronrod one is far better when both resolve
        // the integrand.
        let difference = (kronrod - gauss).abs();
        let scaled = if spread > 0.0 { spread * (200.0 * difference / spread).powf(1.5).min(1.0) } else { difference };
        value[component] = half * kronrod;
        error = error.max(half.abs() * scaled);
    }
    Panel { a, b, value, error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_legendre_is_exact_up_to_its_degree_and_not_beyond() {
        for count in [1, 2, 5, 16, 64] {
            let rule = gauss_legendre(count, 0.0, 2.0);
            let moment = |power: i32| rule.iter().map(|(x, w)| w * x.powi(power)).sum::<f64>();
            for power in 0..(2 * count as i32) {
                let exact = 2f64.powi(power + 1) / f64::from(power + 1);
                assert!((moment(power) / exact - 1.0).abs() < 1e-12, "{count} points, degree {power}");
            }
            if count <= 5 {
                let power = 2 * count as i32;
                let exact = 2f64.powi(power + 1) / f64::from(power + 1);
                assert!((moment(power) / exact - 1.0).abs() > 1e-9, "{count} points cannot do degree {power}");
            }
        }
    }

    #[test]
    fn the_kronrod_rule_is_exact_to_degree_22_and_its_gauss_rule_to_13() {
        for power in 0..=22 {
            let exact = 1.0 / f64::from(power + 1);
            let whole = panel(&|x: f64| [x.powi(power)], 0.0, 1.0);
            assert!((whole.value[0] - exact).abs() < 1e-15, "degree {power}: {}", whole.value[0] - exact);
            assert!(power > 13 || whole.error < 1e-15, "degree {power} error {}", whole.error);
        }
    }

    #[test]
    fn adaptive_integration_resolves_a_narrow_peak_and_a_root_singularity() {
        let peak = integrate(|x: f64| [1.0 / (1e-6 + x * x)], &[-1.0, 0.3, 1.0], 1e-12)[0];
        let exact = 2.0 * 1e3 * (1e3_f64).atan();
        assert!((peak / exact - 1.0).abs() < 1e-12, "{}", peak / exact - 1.0);
        let root = integrate(|x: f64| [x.sqrt(), 1.0 / x.sqrt()], &[0.0, 1.0], 1e-10);
        assert!((root[0] - 2.0 / 3.0).abs() < 1e-9 && (root[1] - 2.0).abs() < 1e-6, "{root:?}");
    }
}
