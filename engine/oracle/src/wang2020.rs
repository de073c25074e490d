//! The tables of Wang, Deng and Holzschuch 2020 as printed, to hold the renderer's tables against.
//!
//! "Real-time glints rendering with prefiltered discrete stochastic microfacets". Where the paper needs repair (no
//! cosine in Eq. 16, a probability that is a solid angle in Eq. 17) it is not repaired here.
//!
//! The functions take the probability that a flake is lit as a closure, so that a table can stand in for the truth.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use glam::DVec3;

use crate::albedo::{horizon_slope, reflects_above_horizon};
use crate::lit_probability::{cone_solid_angle, lit_probability};
use crate::microfacet::{Conductor, Microfacets, half_vector, schlick};
use crate::quadrature::gauss_legendre;

/// Entries of the directional table along theta_o, theta_i and delta_phi: whole degrees from 0.
pub const DPF_SIZE: [usize; 3] = [90, 90, 180];

/// How the cone's half-angle becomes a range of whole-degree entries; the paper does not say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccumulationRule {
    /// Every offset within half of gamma, both ends included: 2 floor(gamma/2) + 1 entries an axis.
    Closed,
    /// As many entries an axis as gamma has degrees, to the nearest; an even number begins at -gamma/2.
    Rounded,
}

impl AccumulationRule {
    /// Offsets in degrees that are added along each axis.
    pub fn offsets(self, gamma_degrees: f64) -> RangeInclusive<i32> {
        match self {
            Self::Closed => {
                let reach = (gamma_degrees / 2.0).floor() as i32;
                -reach..=reach
            }
            Self::Rounded => {
                let count = (gamma_degrees.round() as i32).max(1);
                -(count / 2)..=(count - 1) / 2
            }
        }
    }
}

/// One entry of the 1-degree table: the probability that a flake of `facets` reflects light from the polar angle and
/// azimuth of `entry` \[theta_o, theta_i, delta_phi\], whole degrees, into the cone of half-angle 1 degree.
pub fn one_degree_entry(facets: &Microfacets, entry: [usize; 3]) -> f64 {
    let [o, i] = directions_of(entry);
    lit_probability(facets, i, o, 1f64.to_radians())
}

/// View and light direction (local frame) of an entry \[theta_o, theta_i, delta_phi\] in degrees.
pub fn directions_of(entry: [usize; 3]) -> [DVec3; 2] {
    let [theta_o, theta_i, delta_phi] = entry.map(|degrees| (degrees as f64).to_radians());
    let direction = |theta: f64, phi: f64| DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
    [direction(theta_o, 0.0), direction(theta_i, delta_phi)]
}

/// The table widened from 1 degree to gamma (section 4.2): the sum of `table` over whole-degree `offsets` of theta_i and
/// delta_phi about `entry`. delta_phi is folded into the table's half turn; theta_i beyond the table is left out, as
/// in the program of Wang et al. 2018.
pub fn accumulated(table: impl Fn([usize; 3]) -> f64, entry: [usize; 3], offsets: RangeInclusive<i32>) -> f64 {
    let [theta_o, theta_i, delta_phi] = entry;
    let rows = offsets.clone().filter_map(|offset| theta_i.checked_add_signed(offset as isize));
    rows.filter(|row| *row < DPF_SIZE[1])
        .flat_map(|row| offsets.clone().map(move |offset| (row, delta_phi as i32 + offset)))
        .map(|(row, column)| {
            let turned = column.unsigned_abs() as usize % 360;
            let folded = turned.min(360 - turned).min(DPF_SIZE[2] - 1);
            table([theta_o, row, folded])
        })
        .sum()
}

/// M(i, o) = (i.h) F G / ((i.n)(o.n)), per channel; finite up to the horizon and 0 below it.
pub fn reflected_weight(conductor: &Conductor, i: DVec3, o: DVec3) -> [f64; 3] {
    if half_vector(i, o).is_none() {
        return [0.0; 3];
    }
    let cos = (i + o).length() / 2.0;
    let facets = &conductor.microfacets;
    let weight = cos * (facets.g1_over_cos(i) * facets.g1_over_cos(o));
    schlick(conductor.f0, cos).map(|fresnel| fresnel * weight)
}

/// L-hat of Eq. 16 in the limit of many samples: integral Li(i) P(i, o) M(i, o) di over the hemisphere.
///
/// `environment` is the incident radiance and `lit` the probability P(i, o), both by directions in the local frame.
/// `order` nodes along the slope radius and twice as many about the normal; 48 give five digits when the environment
/// is smooth. With `f0` = 1 the Fresnel term drops out.
pub fn prefiltered_radiance(
    conductor: &Conductor,
    o: DVec3,
    environment: impl Fn(DVec3) -> [f64; 3],
    lit: impl Fn(DVec3, DVec3) -> f64,
    order: usize,
) -> [f64; 3] {
    if o.z <= 0.0 {
        return [0.0; 3];
    }
    let alpha = conductor.microfacets.alpha();
    let (cos, sin) = (o.z.min(1.0), o.x.hypot(o.y));
    let view_azimuth = o.y.atan2(o.x);
    let unit = gauss_legendre(order, 0.0, 1.0);
    let azimuths = 2 * order;
    let mut sum = [0.0; 3];
    for k in 0..azimuths {
        let phi = 2.0 * PI * (k as f64 + 0.5) / azimuths as f64;
        let along = DVec3::new((phi + view_azimuth).cos(), (phi + view_azimuth).sin(), 0.0);
        // Facet slopes r = alpha tan(psi), out to where the reflection meets the horizon.
        let end = (horizon_slope(phi, cos, sin) / alpha).atan();
        for (x, weight) in &unit {
            let psi = x * end;
            let r = alpha * psi.tan();
            let m = (r * along + DVec3::Z).normalize();
            let o_m = o.dot(m);
            let i = 2.0 * o_m * m - o;
            let p = lit(i, o);
            // di = 4 (o.m) dm and dm = m.z^3 r dr dphi.
            let measure = weight * end * alpha / psi.cos().powi(2) * r * 4.0 * o_m * m.z.powi(3);
            let (radiance, reflected) = (environment(i), reflected_weight(conductor, i, o));
            for channel in 0..3 {
                sum[channel] += measure * p * radiance[channel] * reflected[channel];
            }
        }
    }
    sum.map(|s| s * 2.0 * PI / azimuths as f64)
}

/// P-hat of Eq. 17 as printed: 2 pi / B times the sum of `lit` over B = 36 x 9 uniform directions, here 36 azimuths
/// from 0 at the middles of 9 equal steps of the cosine.
pub fn sampled_probability(o: DVec3, lit: impl Fn(DVec3, DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for step in 0..9 {
        let cos = (f64::from(step) + 0.5) / 9.0;
        let sin = (1.0 - cos * cos).sqrt();
        for turn in 0..36 {
            let phi = 2.0 * PI * f64::from(turn) / 36.0;
            sum += lit(DVec3::new(sin * phi.cos(), sin * phi.sin(), cos), o);
        }
    }
    2.0 * PI / 324.0 * sum
}

/// What Eq. 17 tends to with many directions: 4 pi sin^2(gamma/2) V(o), a solid angle, in steradians. Exact but for
/// the cone's softening of the horizon, which is of the order of gamma squared.
pub fn expected_probability(facets: &Microfacets, o: DVec3, gamma_radians: f64) -> f64 {
    cone_solid_angle(gamma_radians) * reflects_above_horizon(facets, o)
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::microfacet::{Ndf, SmithFit};
    use crate::statistics::{Moments, z_test};

    fn facets(alpha: f64) -> Microfacets {
        Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Rational).expect("a valid roughness")
    }

    fn view(theta_degrees: f64, phi: f64) -> DVec3 {
        let theta = theta_degrees.to_radians();
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    #[test]
    fn the_two_rules_differ_at_even_gammas_only() {
        let counts = |rule: AccumulationRule| [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 10.0].map(|g| rule.offsets(g).count());
        assert_eq!(counts(AccumulationRule::Closed), [1, 3, 3, 5, 5, 7, 11]);
        assert_eq!(counts(AccumulationRule::Rounded), [1, 2, 3, 4, 5, 6, 10]);
        assert_eq!(AccumulationRule::Rounded.offsets(6.0), -3..=2);
        assert_eq!(AccumulationRule::Rounded.offsets(0.1), 0..=0);
    }

    #[test]
    fn accumulation_folds_the_azimuth_and_drops_rows_beyond_the_table() {
        let visited = |entry: [usize; 3], offsets: RangeInclusive<i32>| {
            let seen = RefCell::new(Vec::new());
            let record = |at: [usize; 3]| {
                seen.borrow_mut().push(at);
                1.0
            };
            let sum = accumulated(record, entry, offsets);
            let seen = seen.into_inner();
            assert_eq!(sum, seen.len() as f64);
            seen
        };
        assert_eq!(visited([7, 0, 0], -1..=1), [[7, 0, 1], [7, 0, 0], [7, 0, 1], [7, 1, 1], [7, 1, 0], [7, 1, 1]]);
        assert_eq!(visited([0, 89, 179], 0..=2), [[0, 89, 179], [0, 89, 179], [0, 89, 179]]);
        assert_eq!(visited([0, 40, 178], 5..=5), [[0, 45, 177]]);
    }

    /// Rounded, snow's and cloth's tables are right and shoe's is 11 % high; closed, they are 125 % and 50 % high.
    #[test]
    fn accumulation_errs_as_much_as_the_rule_says() {
        let error = |alpha: f64, gamma_degrees: f64, rule: AccumulationRule| {
            let (facets, entry) = (facets(alpha), [30, 30, 179]);
            let [o, i] = directions_of(entry);
            let sum = accumulated(|at| one_degree_entry(&facets, at), entry, rule.offsets(gamma_degrees));
            sum / lit_probability(&facets, i, o, gamma_degrees.to_radians()) - 1.0
        };
        let near = |value: f64, expected: f64| assert!((value - expected).abs() < 0.01, "{value} is not {expected}");
        near(error(0.5, 2.0, AccumulationRule::Rounded), 0.0);
        near(error(0.1, 6.0, AccumulationRule::Rounded), 0.12);
        near(error(0.5, 2.0, AccumulationRule::Closed), 1.25);
        near(error(0.1, 6.0, AccumulationRule::Closed), 0.52);
    }

    #[test]
    fn the_weight_is_reciprocal_and_is_the_brdf_over_the_density_of_facets() {
        let conductor = Conductor { microfacets: facets(0.3), f0: [0.9, 0.5, 0.2] };
        let (i, o) = (view(70.0, 2.0), view(25.0, 0.4));
        assert_eq!(reflected_weight(&conductor, i, o), reflected_weight(&conductor, o, i));
        let h = half_vector(i, o).expect("not opposite");
        let facet_density = conductor.microfacets.d(h) / (4.0 * i.dot(h));
        for (weight, brdf) in reflected_weight(&conductor, i, o).into_iter().zip(conductor.smooth_brdf(i, o)) {
            assert!((weight * facet_density / brdf - 1.0).abs() < 1e-12);
        }
        let horizon = reflected_weight(&conductor, DVec3::X, o);
        assert!(horizon.iter().all(|v| v.is_finite() && *v > 0.0), "{horizon:?}");
        assert_eq!(reflected_weight(&conductor, DVec3::X, -DVec3::X), [0.0; 3]);
    }

    fn sky(i: DVec3) -> [f64; 3] {
        [1.0, 1.0 + i.z, (3.0 * i.x + i.y).exp()]
    }

    #[test]
    fn prefiltering_converges_and_turns_with_the_frame() {
        for (alpha, gamma_degrees, theta) in [(0.1, 6.0, 40.0), (0.5, 2.0, 10.0), (0.5, 2.0, 70.0), (0.02, 6.0, 30.0)] {
            let conductor = Conductor { microfacets: facets(alpha), f0: [1.0, 0.5, 0.1] };
            let gamma = f64::to_radians(gamma_degrees);
            let at = |order: usize, turn: f64| {
                let lit = |i: DVec3, o: DVec3| lit_probability(&conductor.microfacets, i, o, gamma);
                let turned = |i: DVec3| sky(glam::DQuat::from_rotation_z(-turn) * i);
                prefiltered_radiance(&conductor, view(theta, turn), turned, lit, order)
            };
            let (coarse, fine) = (at(24, 0.0), at(48, 0.9));
            for channel in 0..3 {
                let ratio = coarse[channel] / fine[channel];
                assert!((ratio - 1.0).abs() < 1e-3, "{alpha} {gamma_degrees} {theta}: {coarse:?} {fine:?}");
            }
        }
    }

    /// Smallest bias caught: 5 standard errors of 20,000 samples, 0.5 to 2 %.
    #[test]
    fn it_is_the_expectation_of_the_sampled_sum_of_equation_16() {
        let mut random = Pcg64::seed_from_u64(9);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        for (alpha, gamma_degrees, theta) in [(0.1, 6.0, 50.0), (0.5, 2.0, 20.0), (0.5, 2.0, 75.0)] {
            let conductor = Conductor { microfacets: facets(alpha), f0: [0.9, 0.6, 0.3] };
            let (o, gamma) = (view(theta, 0.7), f64::to_radians(gamma_degrees));
            let lit = |i: DVec3, o: DVec3| lit_probability(&conductor.microfacets, i, o, gamma);
            let expected = prefiltered_radiance(&conductor, o, sky, lit, 32);
            let mut samples = [const { Vec::new() }; 3];
            for _ in 0..20_000 {
                let (r, phi) = (alpha * (-(1.0 - uniform()).ln()).sqrt(), 2.0 * PI * uniform());
                let h = DVec3::new(r * phi.cos(), r * phi.sin(), 1.0).normalize();
                let o_h = o.dot(h);
                let i = 2.0 * o_h * h - o;
                let mut term = [0.0; 3];
                if o_h > 0.0 && i.z > 0.0 {
                    let pdf = conductor.microfacets.d(h) * h.z / (4.0 * o_h);
                    let (p, weight, radiance) = (lit(i, o), reflected_weight(&conductor, i, o), sky(i));
                    term = std::array::from_fn(|channel| radiance[channel] * p * weight[channel] / pdf);
                }
                for (list, value) in samples.iter_mut().zip(term) {
                    list.push(value);
                }
            }
            let moments = samples.map(|list| Moments::of(&list).expect("samples"));
            let verdict = z_test(&moments, &expected, 1e-3).expect("a verdict");
            assert!(verdict.accepted(), "{alpha} {gamma_degrees} {theta}: {moments:?} {expected:?}");
            let biased = expected.map(|v| 1.04 * v);
            assert!(!z_test(&moments, &biased, 1e-3).expect("a verdict").accepted(), "a bias of 4 % must show");
        }
    }

    /// Root mean square of the relative error over views up to 60 degrees from the normal.
    fn error_of_equation_17(alpha: f64, gamma_degrees: f64) -> f64 {
        let (facets, gamma) = (facets(alpha), f64::to_radians(gamma_degrees));
        let mut random = Pcg64::seed_from_u64(4);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let errors = (0..40).map(|_| {
            let cos = 0.5 + 0.5 * uniform();
            let o = view(cos.acos().to_degrees(), 2.0 * PI * uniform());
            let printed = sampled_probability(o, |i, o| lit_probability(&facets, i, o, gamma));
            (printed / expected_probability(&facets, o, gamma) - 1.0).powi(2)
        });
        (errors.sum::<f64>() / 40.0).sqrt()
    }

    #[test]
    fn equation_17_is_good_for_rough_surfaces_and_useless_for_smooth_ones() {
        assert!((sampled_probability(DVec3::Z, |_, _| 1.0) - 2.0 * PI).abs() < 1e-12, "all of the hemisphere");
        let errors = [(0.5, 2.0), (0.1, 6.0), (0.1, 1.0), (0.02, 1.0)].map(|(a, g)| error_of_equation_17(a, g));
        assert!(errors[0] < 0.005, "{errors:?}");
        assert!((0.01..0.05).contains(&errors[1]) && (0.01..0.1).contains(&errors[2]), "{errors:?}");
        assert!(errors[3] > 1.0, "{errors:?}");
    }
}
