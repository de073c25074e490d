//! Microfacet terms in f64: the normal distributions of Beckmann and GGX, Smith's masking of each, Schlick's Fresnel.
//!
//! Sources: Walter, Marschner, Li, Torrance 2007, "Microfacet models for refraction through rough surfaces" (Eqs. 20,
//! 25, 27, 33, 34, and the rational fit under Eq. 27); Heitz 2014, "Understanding the masking-shadowing function"
//! (Eqs. 61, 65, 71, 72).
//!
//! All directions are in the local frame. Slopes are written as the point (x, y) where the facet normal pierces the
//! plane z = 1, so m is parallel to (x, y, 1); the distributions are isotropic and the sign does not matter.

use std::f64::consts::PI;

use glam::DVec3;

use crate::OracleError;
use crate::error::in_range;

/// The shape of the normal distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ndf {
    /// Gaussian slopes, variance alpha^2/2 on each axis.
    Beckmann,
    /// Trowbridge and Reitz's distribution, with its long tail.
    Ggx,
}

/// How Smith's masking of Beckmann is evaluated. GGX has an algebraic form, which is exact under either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SmithFit {
    /// The integral itself, with erf.
    Exact,
    /// The rational fit that Walter et al. print and the discrete stochastic papers use; up to 0.31 % off. The fit
    /// passes 1 by 6e-5 just below a = 1.6, and is cut off at 1 here.
    Rational,
}

/// A rough surface of microscopic mirrors: a distribution of normals and its masking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    ndf: Ndf,
    alpha: f64,
    smith: SmithFit,
}

impl Microfacets {
    /// A surface of roughness `alpha` (dimensionless, the slope where Beckmann's density has fallen to 1/e).
    ///
    /// # Errors
    /// When `alpha` is not a positive finite number.
    pub fn new(ndf: Ndf, alpha: f64, smith: SmithFit) -> Result<Self, OracleError> {
        in_range("alpha", alpha, alpha > 0.0 && alpha.is_finite(), "positive and finite")?;
        Ok(Self { ndf, alpha, smith })
    }

    /// The distribution's shape.
    pub const fn ndf(&self) -> Ndf {
        self.ndf
    }

    /// The roughness, dimensionless.
    pub const fn alpha(&self) -> f64 {
        self.alpha
    }

    /// Density of slopes (per unit of slope plane) at squared distance `radius_squared` from the origin; integrates
    /// to 1 over the plane.
    pub fn slope_density(&self, radius_squared: f64) -> f64 {
        let t = radius_squared / (self.alpha * self.alpha);
        let peak = 1.0 / (PI * self.alpha * self.alpha);
        match self.ndf {
            Ndf::Beckmann => peak * (-t).exp(),
            Ndf::Ggx => peak / ((1.0 + t) * (1.0 + t)),
        }
    }

    /// Probability that the slope lies in the ring from `inner_squared` to `inner_squared + width_squared` (squared
    /// radii, the second possibly infinite). Exact, and without cancellation for a thin ring far out.
    pub fn ring_probability(&self, inner_squared: f64, width_squared: f64) -> f64 {
        let alpha_squared = self.alpha * self.alpha;
        let (inner, width) = (inner_squared / alpha_squared, width_squared / alpha_squared);
        match self.ndf {
            Ndf::Beckmann => (-inner).exp() * -(-width).exp_m1(),
            Ndf::Ggx => 1.0 / ((1.0 + inner) * (1.0 + (1.0 + inner) / width)),
        }
    }

    /// D(m), density of facet area per steradian and unit of surface, normalised by integral D (m.n) dm = 1.
    /// 0 for `m` at or below the horizon. Kept in logarithms, so that neither a tiny roughness nor grazing overflows.
    pub fn d(&self, m: DVec3) -> f64 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let (alpha_squared, cos_squared) = (self.alpha * self.alpha, m.z * m.z);
        let sin_squared = m.x * m.x + m.y * m.y;
        match self.ndf {
            Ndf::Beckmann => {
                (-sin_squared / cos_squared / alpha_squared - 2.0 * cos_squared.ln() - (PI * alpha_squared).ln()).exp()
            }
            Ndf::Ggx => {
                let spread = sin_squared + alpha_squared * cos_squared;
                alpha_squared / (PI * spread * spread)
            }
        }
    }

    /// Smith's Lambda of `v`: G1 = 1 / (1 + Lambda). Infinite at or below the horizon.
    pub fn lambda(&self, v: DVec3) -> f64 {
        if v.z <= 0.0 { f64::INFINITY } else { 1.0 / self.g1(v) - 1.0 }
    }

    /// Smith's masking of `v`: the visible share of the facets that face it. 0 at or below the horizon.
    pub fn g1(&self, v: DVec3) -> f64 {
        (v.z.max(0.0) * self.g1_over_cos(v)).min(1.0)
    }

    /// G1(v) / (v.n), finite up to the horizon; 0 below it, as G1 is.
    pub fn g1_over_cos(&self, v: DVec3) -> f64 {
        if v.z < 0.0 { 0.0 } else { self.g1_over_cos_at(v.z, v.x.hypot(v.y)) }
    }

    /// G1 / cos at an angle given by its cosine (not negative) and sine.
    ///
    /// The quotient is formed with a = cos / (alpha sin) multiplied out, so that nothing divides by the cosine: with
    /// erf it is 2 / (cos (1 + erf a) + alpha sin exp(-a^2) / sqrt(pi)), whose limit at the horizon is
    /// 2 sqrt(pi) / alpha.
    pub(crate) fn g1_over_cos_at(&self, cos: f64, sin: f64) -> f64 {
        let alpha_sin = self.alpha * sin;
        let a = if alpha_sin > 0.0 { cos / alpha_sin } else { f64::INFINITY };
        match (self.ndf, self.smith) {
            (Ndf::Ggx, _) => 2.0 / (cos + cos.hypot(alpha_sin)),
            (Ndf::Beckmann, SmithFit::Exact) => {
                2.0 / (cos * (1.0 + libm::erf(a)) + alpha_sin * (-a * a).exp() / PI.sqrt())
            }
            (Ndf::Beckmann, SmithFit::Rational) if a < 1.6 => {
                let fit = (3.535 + 2.181 * a) / (alpha_sin * (1.0 + 2.276 * a + 2.577 * a * a));
                if cos > 0.0 { fit.min(1.0 / cos) } else { fit }
            }
            (Ndf::Beckmann, SmithFit::Rational) => 1.0 / cos,
        }
    }

    /// Separable Smith shadowing and masking, G1(i) G1(o).
    pub fn smith_g(&self, i: DVec3, o: DVec3) -> f64 {
        self.g1(i) * self.g1(o)
    }

    /// The microfacet BRDF of perfect mirrors (F = 1), D(h) G(i, o) / (4 (i.n)(o.n)), per steradian.
    /// Reciprocal; 0 when either direction is below the horizon or the two are opposite.
    pub fn brdf(&self, i: DVec3, o: DVec3) -> f64 {
        match half_vector(i, o) {
            Some(h) => self.d(h) * (self.g1_over_cos(i) * self.g1_over_cos(o)) / 4.0,
            None => 0.0,
        }
    }
}

/// The unit half vector of two unit directions; `None` where they are opposite to within rounding.
pub fn half_vector(i: DVec3, o: DVec3) -> Option<DVec3> {
    let sum = i + o;
    (sum.length_squared() > 1e-24).then(|| sum.normalize())
}

/// The share of Schlick's Fresnel term that does not depend on F0: (1 - cos)^5, with cos clamped to \[0, 1\].
pub fn schlick_weight(cos: f64) -> f64 {
    (1.0 - cos.clamp(0.0, 1.0)).powi(5)
}

/// Schlick's Fresnel reflectance F0 + (1 - F0)(1 - cos)^5 of each channel.
pub fn schlick(f0: [f64; 3], cos: f64) -> [f64; 3] {
    let weight = schlick_weight(cos);
    f0.map(|f0| f0 + (1.0 - f0) * weight)
}

/// A rough conductor: microscopic mirrors with a coloured Schlick Fresnel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// The distribution of its facets.
    pub microfacets: Microfacets,
    /// Reflectance at normal incidence, linear RGB in \[0, 1\].
    pub f0: [f64; 3],
}

impl Conductor {
    /// The smooth BRDF D F G / (4 (i.n)(o.n)), per steradian and channel; what a surface without glints shows and what
    /// infinitely many flakes converge to.
    pub fn smooth_brdf(&self, i: DVec3, o: DVec3) -> [f64; 3] {
        // i.h = |i + o| / 2 exactly, without the cancellation of a dot product near opposite directions.
        let cos = (i + o).length() / 2.0;
        let brdf = self.microfacets.brdf(i, o);
        schlick(self.f0, cos).map(|fresnel| fresnel * brdf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;

    const ALPHAS: [f64; 5] = [0.001, 0.01, 0.1, 0.5, 1.0];

    fn all(alpha: f64) -> Vec<Microfacets> {
        [(Ndf::Beckmann, SmithFit::Exact), (Ndf::Beckmann, SmithFit::Rational), (Ndf::Ggx, SmithFit::Exact)]
            .map(|(ndf, smith)| Microfacets::new(ndf, alpha, smith).expect("a valid roughness"))
            .to_vec()
    }

    fn direction(theta: f64, phi: f64) -> DVec3 {
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    #[test]
    fn d_times_cosine_integrates_to_one() {
        for facets in ALPHAS.into_iter().flat_map(all) {
            let ring = |theta: f64| {
                let m = direction(theta, 0.3);
                [2.0 * PI * theta.sin() * m.z * facets.d(m)]
            };
            let alpha = facets.alpha();
            let total =
                integrate(ring, &[0.0, alpha.atan(), (4.0 * alpha).atan(), (16.0 * alpha).atan(), PI / 2.0], 1e-12)[0];
            assert!((total - 1.0).abs() < 1e-9, "{facets:?}: {total}");
        }
    }

    #[test]
    fn slope_and_solid_angle_densities_are_the_same_law() {
        for facets in ALPHAS.into_iter().flat_map(all) {
            for theta in [0.0, 1e-4, 0.01, 0.4, 1.2] {
                let m = direction(theta, 1.0);
                let from_slopes = facets.slope_density(theta.tan().powi(2)) / m.z.powi(4);
                assert!((facets.d(m) - from_slopes).abs() <= 1e-11 * from_slopes, "{facets:?} at {theta}");
            }
            let ring = facets.ring_probability(0.01, 0.02);
            let summed = integrate(|r| [2.0 * PI * r * facets.slope_density(r * r)], &[0.1, 0.03_f64.sqrt()], 1e-13)[0];
            assert!((ring - summed).abs() <= 1e-11 * summed, "{facets:?}: {ring} {summed}");
            assert!((facets.ring_probability(0.0, f64::INFINITY) - 1.0).abs() < 1e-15);
            assert_eq!(facets.ring_probability(1.0, 0.0), 0.0);
        }
    }

    /// Smith's masking is the one for which the projected area of the visible facets is the cosine (Heitz 2014, Eq. 14):
    /// G1(o) integral max(o.m, 0) D(m) dm = o.n.
    #[test]
    fn exact_masking_conserves_the_projected_area() {
        for alpha in [0.05, 0.3, 1.0] {
            for facets in all(alpha) {
                let tolerance = if facets.smith == SmithFit::Rational { 3.2e-3 } else { 1e-9 };
                for theta in [0.0, 0.5, 1.2, 1.5] {
                    let o = direction(theta, 0.0);
                    let over_azimuth = |r: f64| {
                        // Facets turn away from the view at this azimuth.
                        let turn = (-o.z / (r * o.x)).max(-1.0).acos();
                        integrate(|phi| [o.z + r * phi.cos() * o.x], &[0.0, turn], 1e-11)[0]
                    };
                    let radial = |psi: f64| {
                        let r = alpha * psi.tan();
                        [2.0 * r * facets.slope_density(r * r) * alpha / psi.cos().powi(2) * over_azimuth(r)]
                    };
                    let facing = integrate(radial, &[0.0, 0.8, PI / 2.0], 1e-10)[0];
                    let ratio = facets.g1(o) * facing / o.z;
                    assert!((ratio - 1.0).abs() < tolerance, "{facets:?} theta {theta}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn the_rational_fit_stays_within_its_stated_error() {
        let exact = Microfacets::new(Ndf::Beckmann, 0.4, SmithFit::Exact).expect("valid");
        let fit = Microfacets::new(Ndf::Beckmann, 0.4, SmithFit::Rational).expect("valid");
        let mut worst = 0.0_f64;
        let mut previous = 0.0;
        for k in 1..10_000 {
            let v = direction(PI / 2.0 * (1.0 - f64::from(k) / 10_000.0), 0.0);
            worst = worst.max((fit.g1(v) / exact.g1(v) - 1.0).abs());
            assert!(fit.g1(v) <= 1.0 && exact.g1(v) <= 1.0);
            assert!(exact.g1(v) >= previous - 1e-15, "masking grows towards the normal");
            previous = exact.g1(v);
        }
        assert!((2.9e-3..3.2e-3).contains(&worst), "{worst}");
    }

    #[test]
    fn masking_over_cosine_has_its_limit_at_the_horizon() {
        for alpha in ALPHAS {
            let limits = [2.0 * PI.sqrt() / alpha, 3.535 / alpha, 2.0 / alpha];
            for (facets, limit) in all(alpha).into_iter().zip(limits) {
                for cos in [1e-12_f64, 1e-45, 1e-300, 0.0] {
                    let v = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                    assert!((facets.g1_over_cos(v) / limit - 1.0).abs() < 1e-8, "{facets:?} cos {cos}");
                }
                assert_eq!(facets.g1_over_cos(DVec3::new(1.0, 0.0, -1e-9)), 0.0);
                assert_eq!(facets.lambda(DVec3::X), f64::INFINITY);
            }
        }
    }

    #[test]
    fn the_brdf_is_reciprocal_and_finite_at_every_extreme() {
        let cosines = [1.0_f64, 0.7, 1e-2, 1e-8, 1e-45, 0.0, -0.0, -0.1];
        for facets in ALPHAS.into_iter().flat_map(all) {
            let conductor = Conductor { microfacets: facets, f0: [0.9, 0.5, 0.0] };
            for (cos_i, cos_o) in cosines.into_iter().flat_map(|a| cosines.map(|b| (a, b))) {
                for azimuth in [0.0, 1.0, PI] {
                    let i = DVec3::new((1.0 - cos_i * cos_i).sqrt(), 0.0, cos_i);
                    let sin_o = (1.0 - cos_o * cos_o).sqrt();
                    let o = DVec3::new(sin_o * azimuth.cos(), sin_o * azimuth.sin(), cos_o);
                    let value = conductor.smooth_brdf(i, o);
                    assert_eq!(value, conductor.smooth_brdf(o, i));
                    assert!(value.iter().all(|v| v.is_finite() && *v >= 0.0), "{facets:?} {i} {o}: {value:?}");
                    assert!(cos_i >= 0.0 && cos_o >= 0.0 || value == [0.0; 3]);
                }
            }
            assert_eq!(facets.brdf(DVec3::X, -DVec3::X), 0.0);
        }
    }

    #[test]
    fn schlick_goes_from_f0_to_one() {
        assert_eq!(schlick([0.2, 0.5, 1.0], 1.0), [0.2, 0.5, 1.0]);
        assert_eq!(schlick([0.2, 0.5, 1.0], 0.0), [1.0; 3]);
        assert!((schlick([0.04; 3], 0.5)[0] - (0.04 + 0.96 / 32.0)).abs() < 1e-16);
    }

    #[test]
    fn a_bad_roughness_is_refused_by_name() {
        for alpha in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact).expect_err("must be refused");
            assert!(error.to_string().starts_with("alpha is "), "{error}");
        }
    }
}
