//! P(i, o, gamma): the probability that a flake, its slope drawn from the distribution, reflects light from i into the
//! cone of half-angle gamma about o.
//!
//! P = integral of D(m)(m.n) over the reflecting set of Jakob et al. 2014. In the slope plane that is the mass of an
//! isotropic density over a convex set, whose mass along each ray from the origin is a difference of two exponentials
//! (Beckmann) or fractions (GGX). What remains is one smooth integral over the ray's angle, which serves ellipse,
//! hyperbola and wedge alike, at any gamma and any grazing angle.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use crate::OracleError;
use crate::error::in_range;
use crate::microfacet::{Microfacets, Ndf, SmithFit, half_vector};
use crate::quadrature::integrate;
use crate::reflecting_set::{ReflectingSet, Span};

/// Relative tolerance of the integral over the angle.
const TOLERANCE: f64 = 1e-11;
/// Exponent beyond which the rest of a Gaussian tail is dropped: exp(-60) is 1e-26.
const NEGLIGIBLE_EXPONENT: f64 = 60.0;

/// Solid angle of a cone of half-angle `gamma_radians`, in steradians: 4 pi sin^2(gamma/2), exact for small cones too.
pub fn cone_solid_angle(gamma_radians: f64) -> f64 {
    4.0 * PI * (gamma_radians / 2.0).sin().powi(2)
}

/// Exponent at which exp(-x) is 0 in f64.
const UNDERFLOW_EXPONENT: f64 = 746.0;

/// The probability that a flake drawn from the slope distribution reflects light from `i` into the cone of half-angle
/// `gamma_radians` about `o` (unit vectors, local frame), facing both. Reciprocal in `i` and `o`. Relative accuracy
/// 1e-8 or better; 0 when `gamma_radians` is not positive; half-angles above pi count as pi.
pub fn lit_probability(facets: &Microfacets, i: DVec3, o: DVec3, gamma_radians: f64) -> f64 {
    if gamma_radians.is_nan() || gamma_radians <= 0.0 {
        return 0.0;
    }
    let set = ReflectingSet::new(i, o, gamma_radians.min(PI));
    let mass = |u: DVec2| {
        set.along(u).map_or(0.0, |interval| facets.ring_probability(interval.begin_squared, interval.width_squared))
    };
    let turns = match set.span() {
        Span::Turn(angles) => integrate(|phi| [mass(DVec2::from_angle(phi))], &angles, TOLERANCE)[0],
        Span::Sector { middle, half_width } => {
            // phi = middle + half_width sin t removes the root singularities at the tangent rays.
            let ray = |t: f64| DVec2::from_angle(middle + half_width * t.sin());
            let breakpoints = graded_breakpoints(facets, |t| {
                set.along(ray(t)).map_or(f64::INFINITY, |interval| interval.begin_squared)
            });
            integrate(|t| [half_width * t.cos() * mass(ray(t))], &breakpoints, TOLERANCE)[0]
        }
    };
    turns / (2.0 * PI)
}

/// Breakpoints on [-pi/2, pi/2] about the nearest point of a convex set that does not hold the origin, whose squared
/// distance along ray t is `begin_squared(t)`: finest at that point, doubling outwards, and for Beckmann ending
/// where the density has become negligible. None at all where it is 0 throughout.
pub(crate) fn graded_breakpoints(facets: &Microfacets, begin_squared: impl Fn(f64) -> f64) -> Vec<f64> {
    // Distance to a convex set is quasi-convex in the angle: golden-section search finds its least value.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (-FRAC_PI_2, FRAC_PI_2);
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_a, mut at_b) = (begin_squared(a), begin_squared(b));
    for _ in 0..40 {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - GOLDEN * (high - low);
            at_a = begin_squared(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + GOLDEN * (high - low);
            at_b = begin_squared(b);
        }
    }
    let nearest = (low + high) / 2.0;
    let alpha_squared = facets.alpha() * facets.alpha();
    if facets.ndf() == Ndf::Beckmann && begin_squared(nearest) > UNDERFLOW_EXPONENT * alpha_squared {
        return Vec::new();
    }
    let exponent = |t: f64| (begin_squared(t) - begin_squared(nearest)) / alpha_squared;
    // The farthest t from the nearest point, towards `end`, where the exponent is still below `level`.
    let reach = |end: f64, level: f64| {
        if exponent(end) <= level {
            return end;
        }
        let (mut inside, mut outside) = (nearest, end);
        for _ in 0..20 {
            let middle = (inside + outside) / 2.0;
            if exponent(middle) <= level { inside = middle } else { outside = middle }
        }
        outside
    };
    let side = |end: f64| {
        let limit = match facets.ndf() {
            Ndf::Beckmann => reach(end, NEGLIGIBLE_EXPONENT),
            Ndf::Ggx => end,
        };
        let first = reach(end, 1.0) - nearest;
        let steps = (0..).map(move |k| nearest + first * f64::from(1u32 << k));
        let inner: Vec<f64> =
            steps.take(31).take_while(|t| first != 0.0 && (t - nearest).abs() < (limit - nearest).abs()).collect();
        (inner, limit)
    };
    let (left, left_limit) = side(-FRAC_PI_2);
    let (right, right_limit) = side(FRAC_PI_2);
    let mut points = vec![left_limit];
    points.extend(left.into_iter().rev());
    points.push(nearest);
    points.extend(right);
    points.push(right_limit);
    points
}

/// The limit of P / sigma as the cone closes: D(h)(h.n) / (4 i.h), per steradian. 0 for opposite directions.
pub fn lit_density(facets: &Microfacets, i: DVec3, o: DVec3) -> f64 {
    half_vector(i, o).map_or(0.0, |h| facets.d(h) * h.z / (2.0 * (i + o).length()))
}

/// One cell of the directional distribution table of Wang, Deng and Holzschuch 2020: P for Beckmann slopes, by polar
/// angles of view and light and the azimuth between them, all in radians.
///
/// # Errors
/// When `alpha` or `gamma_radians` is out of range, or an angle is not finite.
pub fn dpf_cell(
    theta_o: f64,
    theta_i: f64,
    delta_phi: f64,
    gamma_radians: f64,
    alpha: f64,
) -> Result<f64, OracleError> {
    for (what, angle) in [("theta_o", theta_o), ("theta_i", theta_i), ("delta_phi", delta_phi)] {
        in_range(what, angle, angle.is_finite(), "finite")?;
    }
    in_range("gamma_radians", gamma_radians, gamma_radians > 0.0 && gamma_radians <= PI, "in (0, pi]")?;
    let facets = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact)?;
    let o = DVec3::new(theta_o.sin(), 0.0, theta_o.cos());
    let i = DVec3::new(theta_i.sin() * delta_phi.cos(), theta_i.sin() * delta_phi.sin(), theta_i.cos());
    Ok(lit_probability(&facets, i, o, gamma_radians))
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::albedo::reflects_above_horizon;
    use crate::quadrature::gauss_legendre;
    use crate::statistics::normal_p_value;

    fn facets(ndf: Ndf, alpha: f64) -> Microfacets {
        Microfacets::new(ndf, alpha, SmithFit::Exact).expect("a valid roughness")
    }

    fn direction(theta_degrees: f64, phi_degrees: f64) -> DVec3 {
        let (theta, phi) = (theta_degrees.to_radians(), phi_degrees.to_radians());
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    fn uniform(random: &mut Pcg64) -> f64 {
        (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The definition of a lit flake.
    fn is_lit(m: DVec3, i: DVec3, o: DVec3, gamma: f64) -> bool {
        i.dot(m) > 0.0 && o.dot(m) > 0.0 && 2.0 * i.dot(m) * o.dot(m) - i.dot(o) >= gamma.cos()
    }

    /// The other formulation: over the cone of reflected directions about o, with dm = dr / (4 i.m).
    fn over_the_cone(facets: &Microfacets, i: DVec3, o: DVec3, gamma: f64, tolerance: f64) -> f64 {
        let (x, y) = o.any_orthonormal_pair();
        let rings = |angle: f64| {
            let around = |phi: f64| {
                let r = angle.cos() * o + angle.sin() * (phi.cos() * x + phi.sin() * y);
                let Some(m) = half_vector(i, r) else { return [0.0] };
                let facing = m.dot(o) > 0.0 && m.z > 0.0;
                [if facing { facets.d(m) * m.z / (4.0 * i.dot(m)) * angle.sin() } else { 0.0 }]
            };
            let turn: Vec<f64> = (0..=12).map(|k| PI * f64::from(k) / 6.0).collect();
            integrate(around, &turn, tolerance)
        };
        let out: Vec<f64> = (0..=6).map(|k| gamma * f64::from(k) / 6.0).collect();
        integrate(rings, &out, tolerance)[0]
    }

    #[test]
    fn it_is_the_integral_over_the_cone_of_reflected_directions() {
        let cases = [
            // (alpha, gamma in degrees, theta_i, theta_o, azimuth, tolerance): lobe wider than the cone, then narrower,
            // off the mirror direction, i = o, grazing.
            (0.5, 2.0, 30.0, 40.0, 170.0, 1e-9),
            (0.5, 0.01, 10.0, 70.0, 120.0, 1e-9),
            (0.1, 6.0, 0.0, 0.0, 0.0, 1e-9),
            (0.1, 6.0, 50.0, 20.0, 90.0, 1e-8),
            (0.1, 1.0, 60.0, 50.0, 150.0, 1e-9),
            (0.05, 6.0, 45.0, 50.0, 178.0, 1e-8),
            (0.5, 6.0, 25.0, 25.0, 0.0, 1e-9),
            (0.3, 10.0, 80.0, 84.0, 175.0, 1e-7),
            (0.6, 40.0, 50.0, 40.0, 60.0, 1e-7),
        ];
        for ndf in [Ndf::Beckmann, Ndf::Ggx] {
            for (alpha, gamma_degrees, theta_i, theta_o, azimuth, tolerance) in cases {
                let (facets, gamma) = (facets(ndf, alpha), f64::to_radians(gamma_degrees));
                let (i, o) = (direction(theta_i, azimuth), direction(theta_o, 0.0));
                let value = lit_probability(&facets, i, o, gamma);
                let other = over_the_cone(&facets, i, o, gamma, tolerance / 10.0);
                assert!(
                    (value / other - 1.0).abs() < tolerance,
                    "{ndf:?} alpha {alpha} gamma {gamma_degrees} at {theta_i} {theta_o} {azimuth}: {value:e} against {other:e}, ratio - 1 = {:e}",
                    value / other - 1.0
                );
            }
        }
    }

    /// Cones that reach the horizon of the half vector, by counting a fine grid of slopes of equal probability.
    #[test]
    fn unbounded_sets_agree_with_a_count_of_slopes() {
        for (alpha, gamma_degrees, theta_i, theta_o, azimuth) in [
            (0.4, 20.0, 88.0, 87.0, 178.0),
            (0.3, 9.0, 80.0, 85.0, 175.0),
            (0.6, 60.0, 80.0, 70.0, 60.0),
            (0.5, 120.0, 60.0, 75.0, 100.0),
            (1.0, 3.0, 89.0, 89.0, 179.0),
        ] {
            let (facets, gamma) = (facets(Ndf::Beckmann, alpha), f64::to_radians(gamma_degrees));
            let (i, o) = (direction(theta_i, azimuth), direction(theta_o, 0.0));
            let side = 1500;
            let mut lit = 0;
            for ring in 0..side {
                let r = alpha * (-(1.0 - (f64::from(ring) + 0.5) / f64::from(side)).ln()).sqrt();
                for step in 0..side {
                    let (sin, cos) = (2.0 * PI * (f64::from(step) + 0.5) / f64::from(side)).sin_cos();
                    lit += i32::from(is_lit(DVec3::new(r * cos, r * sin, 1.0).normalize(), i, o, gamma));
                }
            }
            let counted = f64::from(lit) / f64::from(side * side);
            let value = lit_probability(&facets, i, o, gamma);
            assert!((value - counted).abs() < 5e-5, "alpha {alpha} gamma {gamma_degrees}: {value} against {counted}");
        }
    }

    #[test]
    fn random_geometry_agrees_with_the_cone_to_eight_digits() {
        let mut random = Pcg64::seed_from_u64(3);
        let mut compared = 0;
        while compared < 60 {
            let gamma = (0.2 + 6.0 * uniform(&mut random)).to_radians();
            let facets = facets(Ndf::Beckmann, (1.0 + uniform(&mut random)) * gamma.max(0.04));
            let o = direction(75.0 * uniform(&mut random), 0.0);
            let m = direction(
                (2.0 * facets.alpha()).atan().to_degrees() * uniform(&mut random),
                360.0 * uniform(&mut random),
            );
            let i = 2.0 * o.dot(m) * m - o;
            if i.z < 0.2 {
                continue;
            }
            compared += 1;
            let (value, other) = (lit_probability(&facets, i, o, gamma), over_the_cone(&facets, i, o, gamma, 1e-10));
            assert!((value / other - 1.0).abs() < 1e-8, "{facets:?} {gamma} {i} {o}: {:e}", value / other - 1.0);
        }
    }

    /// Smallest bias caught: 4 standard errors of 400,000 flakes, 1 to 8 %.
    #[test]
    fn random_flakes_are_lit_as_often() {
        let mut random = Pcg64::seed_from_u64(11);
        for (alpha, gamma_degrees, theta_i, theta_o, azimuth) in [
            (0.1, 6.0, 40.0, 45.0, 178.0),
            (0.5, 6.0, 20.0, 20.0, 180.0),
            (0.02, 6.0, 30.0, 33.0, 180.0),
            (0.5, 30.0, 85.0, 80.0, 170.0),
            (0.7, 100.0, 70.0, 60.0, 90.0),
        ] {
            let (facets, gamma) = (facets(Ndf::Beckmann, alpha), f64::to_radians(gamma_degrees));
            let (i, o) = (direction(theta_i, azimuth), direction(theta_o, 0.0));
            let count = 400_000;
            let lit = (0..count)
                .filter(|_| {
                    let (r, phi) =
                        (alpha * (-(1.0 - uniform(&mut random)).ln()).sqrt(), 2.0 * PI * uniform(&mut random));
                    let m = DVec3::new(r * phi.cos(), r * phi.sin(), 1.0).normalize();
                    is_lit(m, i, o, gamma)
                })
                .count();
            let p_value_of = |p: f64| {
                let deviation = lit as f64 - f64::from(count) * p;
                normal_p_value(deviation / (f64::from(count) * p * (1.0 - p)).sqrt())
            };
            let value = lit_probability(&facets, i, o, gamma);
            assert!(p_value_of(value) > 1e-4, "alpha {alpha} gamma {gamma_degrees}: {value} against {lit}");
            assert!(p_value_of(0.9 * value) < 1e-4, "a bias of 10 % must show");
        }
    }

    #[test]
    fn exchanging_light_and_view_changes_nothing() {
        let mut random = Pcg64::seed_from_u64(5);
        for _ in 0..200 {
            let i = direction(90.0 * uniform(&mut random), 360.0 * uniform(&mut random));
            let o = direction(90.0 * uniform(&mut random), 360.0 * uniform(&mut random));
            let gamma = PI * uniform(&mut random).powi(3);
            let facets = facets(Ndf::Beckmann, 0.05 + uniform(&mut random));
            let (there, back) = (lit_probability(&facets, i, o, gamma), lit_probability(&facets, o, i, gamma));
            assert!((there - back).abs() <= 1e-9 * there.max(1e-280), "{facets:?} {i} {o} {gamma}: {there:e} {back:e}");
            assert!((0.0..=1.0 + 1e-12).contains(&there));
        }
    }

    #[test]
    fn it_is_continuous_where_light_meets_view() {
        let facets = facets(Ndf::Beckmann, 0.3);
        let o = direction(35.0, 20.0);
        let at = lit_probability(&facets, o, o, 0.05);
        for shift in [1e-13, 1e-9, 1e-6] {
            let near = lit_probability(&facets, (o + shift * DVec3::Y).normalize(), o, 0.05);
            assert!((near / at - 1.0).abs() < 10.0 * shift + 1e-10, "{shift}: {near} {at}");
        }
    }

    /// Integrated over all light directions P gives the cone's solid angle; over those above the horizon, the solid
    /// angle times the share of facets that reflect the view there, which the cone softens by gamma.
    #[test]
    fn summed_over_light_directions_it_is_the_cone_times_the_share_reflected() {
        for (alpha, gamma_degrees, theta_o) in [(0.1, 6.0, 30.0), (0.5, 2.0, 0.0), (0.3, 4.0, 35.0)] {
            let (facets, gamma) = (facets(Ndf::Beckmann, alpha), f64::to_radians(gamma_degrees));
            let o = direction(theta_o, 0.0);
            let azimuths = gauss_legendre(64, 0.0, PI);
            let sum_over = |from: f64, to: f64| -> f64 {
                let rings = gauss_legendre(96, from, to);
                let cells = rings.iter().flat_map(|ring| azimuths.iter().map(move |azimuth| (ring, azimuth)));
                cells
                    .map(|(&(theta, w), &(phi, v))| {
                        let i = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                        2.0 * w * v * theta.sin() * lit_probability(&facets, i, o, gamma)
                    })
                    .sum()
            };
            let (above, below) = (sum_over(0.0, FRAC_PI_2), sum_over(FRAC_PI_2, PI));
            let cone = cone_solid_angle(gamma);
            let share = reflects_above_horizon(&facets, o);
            assert!(
                ((above + below) / cone - 1.0).abs() < 1e-6,
                "{alpha} {gamma_degrees} {theta_o} all: {}",
                (above + below) / cone
            );
            assert!(
                (above / cone - share).abs() < 1e-3,
                "{alpha} {gamma_degrees} {theta_o} above: {} against {share}",
                above / cone
            );
        }
    }

    #[test]
    fn a_closing_cone_leaves_the_density_and_an_open_one_everything() {
        for ndf in [Ndf::Beckmann, Ndf::Ggx] {
            let facets = facets(ndf, 0.3);
            let (i, o) = (direction(40.0, 160.0), direction(55.0, 0.0));
            for gamma_degrees in [1e-2, 1e-4, 1e-6] {
                let gamma = f64::to_radians(gamma_degrees);
                let ratio =
                    lit_probability(&facets, i, o, gamma) / cone_solid_angle(gamma) / lit_density(&facets, i, o);
                assert!((ratio - 1.0).abs() < 1e-6 + gamma * gamma * 100.0, "{ndf:?} {gamma_degrees}: {ratio}");
            }
            assert_eq!(lit_probability(&facets, i, o, 0.0), 0.0);
            let all = lit_probability(&facets, DVec3::Z, DVec3::Z, PI);
            assert!((all - 1.0).abs() < 1e-10, "every facet faces the normal: {all}");
            let share = lit_probability(&facets, DVec3::X, DVec3::X, PI);
            assert!((share - 0.5).abs() < 1e-9, "half the facets face the horizon: {share}");
        }
    }

    #[test]
    fn the_open_cone_leaves_the_facets_that_face_the_view() {
        for (alpha, theta) in [(0.1, 80.0), (0.5, 60.0), (1.0, 20.0), (0.3, 89.9)] {
            let o = direction(theta, 40.0);
            let value = lit_probability(&facets(Ndf::Beckmann, alpha), o, o, PI);
            // A half-plane of slopes, at distance cot(theta) from the origin.
            let share = 1.0 - 0.5 * libm::erfc(1.0 / f64::to_radians(theta).tan() / alpha);
            assert!((value / share - 1.0).abs() < 1e-10, "alpha {alpha} theta {theta}: {value} {share}");
        }
    }

    #[test]
    fn it_is_continuous_where_the_ellipse_opens() {
        let facets = facets(Ndf::Beckmann, 0.5);
        let (i, o) = (direction(85.0, 170.0), direction(80.0, 0.0));
        let k_vanishes = PI - i.dot(o).acos();
        // Where the slope plane's quadratic form turns from ellipse to hyperbola, both before k vanishes and there.
        let at = |gamma: f64| lit_probability(&facets, i, o, gamma);
        let mut previous = at(0.02);
        for step in 1..400 {
            let gamma = 0.02 + f64::from(step) / 400.0 * k_vanishes;
            let value = at(gamma);
            assert!(value >= previous - 1e-12 && value - previous < 0.02, "gamma {gamma}: {previous} then {value}");
            previous = value;
        }
        let jump = at(k_vanishes + 1e-9) - at(k_vanishes - 1e-9);
        assert!((0.0..1e-5).contains(&jump), "{jump:e}");
    }

    #[test]
    fn extreme_geometry_gives_a_probability() {
        let directions = [
            DVec3::Z,
            DVec3::X,
            -DVec3::X,
            direction(89.999_999, 0.0),
            direction(90.0 - 1e-9, 180.0),
            direction(1e-7, 33.0),
            direction(95.0, 10.0),
            -DVec3::Z,
        ];
        for alpha in [0.001, 0.1, 1.0] {
            for gamma in [1e-9, 1e-3, 0.1, 1.0, 2.0, PI, 4.0, f64::NAN, -1.0] {
                for (i, o) in directions.into_iter().flat_map(|i| directions.map(|o| (i, o))) {
                    let p = lit_probability(&facets(Ndf::Beckmann, alpha), i, o, gamma);
                    assert!((0.0..=1.0 + 1e-9).contains(&p), "alpha {alpha} gamma {gamma} {i} {o}: {p}");
                }
            }
        }
    }

    #[test]
    fn a_table_cell_is_the_same_probability() {
        let cell = dpf_cell(0.5, 0.6, 3.0, 0.1, 0.2).expect("a cell");
        let i = DVec3::new(0.6_f64.sin() * 3.0_f64.cos(), 0.6_f64.sin() * 3.0_f64.sin(), 0.6_f64.cos());
        let o = DVec3::new(0.5_f64.sin(), 0.0, 0.5_f64.cos());
        assert_eq!(cell, lit_probability(&facets(Ndf::Beckmann, 0.2), i, o, 0.1));
        assert!(dpf_cell(0.5, 0.6, 3.0, 0.0, 0.2).is_err());
        assert!(dpf_cell(f64::NAN, 0.6, 3.0, 0.1, 0.2).is_err());
    }
}
