//! Directional albedo of the microfacet lobe: what it reflects of a constant environment, integral f(i, o)(i.n) di.
//!
//! With di = 4 (o.h) dh and slopes (r cos phi, r sin phi) of h, and with o in the azimuth phi = 0,
//!
//! ```text
//! E(o) = G1(o)/(o.n) integral P22(r) (cos_o + r cos(phi) sin_o) G1(i) F(i.h) r dr dphi,   i = reflect(o, h)
//! ```
//!
//! whose domain, i above the horizon, is the disc of centre (tan_o, 0) and radius 1/cos_o. The origin is always inside,
//! so each azimuth is one interval, and r = alpha tan(psi) makes the integrand alike at every roughness. Nothing is
//! singular at grazing view, where the disc becomes a half-plane.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::microfacet::{Microfacets, schlick_weight};
use crate::quadrature::integrate;

/// Albedo split by Schlick's Fresnel term: with reflectance F0 the albedo is `f0 * scale + bias`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Albedo {
    /// The factor of F0.
    pub scale: f64,
    /// The part that does not depend on F0.
    pub bias: f64,
}

impl Albedo {
    /// The albedo of perfect mirrors (F = 1).
    pub fn of_mirrors(&self) -> f64 {
        self.scale + self.bias
    }

    /// The albedo of a conductor with reflectance `f0` at normal incidence, per channel.
    pub fn of_conductor(&self, f0: [f64; 3]) -> [f64; 3] {
        f0.map(|f0| f0 * self.scale + self.bias)
    }
}

/// Directional albedo for view direction `o` (local frame); accurate to 1e-6, in practice to 1e-9.
/// 0 below the horizon.
pub fn directional_albedo(facets: &Microfacets, o: DVec3) -> Albedo {
    if o.z < 0.0 {
        return Albedo { scale: 0.0, bias: 0.0 };
    }
    albedo_at(facets, o.z.min(1.0), o.x.hypot(o.y))
}

/// The albedo at a view angle given by cosine and sine.
fn albedo_at(facets: &Microfacets, cos: f64, sin: f64) -> Albedo {
    let [scale, bias] = reflected_by_slopes(facets, cos, sin).map(|v| v * facets.g1_over_cos_at(cos, sin));
    Albedo { scale, bias }
}

/// The integral of the module's formula without its factor G1(o)/(o.n): (scale, bias).
fn reflected_by_slopes(facets: &Microfacets, cos: f64, sin: f64) -> [f64; 2] {
    let alpha = facets.alpha();
    let by_azimuth = |phi: f64| {
        let tilt = phi.cos() * sin;
        let by_slope = |psi: f64| {
            let tan_psi = psi.tan();
            let r = alpha * tan_psi;
            let facing = cos + r * tilt;
            let cos_i = 2.0 * facing / (1.0 + r * r) - cos;
            if cos_i <= 0.0 || facing <= 0.0 {
                return [0.0; 2];
            }
            let sin_i = ((1.0 - cos_i) * (1.0 + cos_i)).max(0.0).sqrt();
            // P22 r dr over the azimuth's share 1/(2 pi) of the circle, doubled for the mirror image in phi.
            let density = 2.0 * r * facets.slope_density(r * r) * alpha * (1.0 + tan_psi * tan_psi);
            let reflected = density * facing * cos_i * facets.g1_over_cos_at(cos_i, sin_i);
            let weight = schlick_weight(facing / (1.0 + r * r).sqrt());
            [reflected * (1.0 - weight), reflected * weight]
        };
        integrate(by_slope, &[0.0, (horizon_slope(phi, cos, sin) / alpha).atan()], 1e-10)
    };
    integrate(by_azimuth, &[0.0, PI / 2.0, PI], 1e-9)
}

/// The slope radius, in azimuth `phi` from the view, at which the reflection of the view meets the horizon.
pub(crate) fn horizon_slope(phi: f64, cos: f64, sin: f64) -> f64 {
    // The root of r^2 cos_o - 2 r cos(phi) sin_o - cos_o = 0, in the form that does not cancel.
    let tilt = phi.cos() * sin;
    let root = tilt.hypot(cos);
    if tilt > 0.0 { (tilt + root) / cos } else { cos / (root - tilt) }
}

/// V(o): the probability that a facet, drawn from the slope distribution, reflects `o` (local frame) above the
/// horizon. Accurate to 1e-10; 0 for `o` at or below the horizon.
pub fn reflects_above_horizon(facets: &Microfacets, o: DVec3) -> f64 {
    if o.z <= 0.0 {
        return 0.0;
    }
    let (cos, sin) = (o.z.min(1.0), o.x.hypot(o.y));
    let by_azimuth = |phi: f64| [facets.ring_probability(0.0, horizon_slope(phi, cos, sin).powi(2))];
    integrate(by_azimuth, &[0.0, PI / 2.0, PI], 1e-12)[0] / PI
}

/// Directional albedo tabulated over the view angle, for images: interpolation error below 1e-6.
#[derive(Clone, Debug)]
pub struct AlbedoTable {
    facets: Microfacets,
    /// The slope integral at the Chebyshev points of each panel of [`AlbedoTable::coordinate`].
    panels: Vec<[[f64; 2]; NODES]>,
}

/// Chebyshev points a panel, both ends included.
const NODES: usize = 9;
/// Panels over the whole range of view angles.
const PANELS: usize = 12;

impl AlbedoTable {
    /// Tabulates `facets`; some milliseconds a hundred entries, in parallel.
    pub fn new(facets: &Microfacets) -> Self {
        let panels = (0..PANELS)
            .into_par_iter()
            .map(|panel| {
                std::array::from_fn(|node| {
                    let coordinate = (panel as f64 + chebyshev(node)) / PANELS as f64;
                    let cos = Self::cosine(facets.alpha(), coordinate);
                    reflected_by_slopes(facets, cos, ((1.0 - cos) * (1.0 + cos)).sqrt())
                })
            })
            .collect();
        Self { facets: *facets, panels }
    }

    /// The albedo at a view direction with (o.n) = `cos`, in \[0, 1\]; beyond that it is clamped.
    pub fn at(&self, cos: f64) -> Albedo {
        let cos = cos.clamp(0.0, 1.0);
        let position = Self::coordinate(self.facets.alpha(), cos) * PANELS as f64;
        let panel = (position as usize).min(PANELS - 1);
        let x = position - panel as f64;
        let values = &self.panels[panel];
        // Barycentric interpolation (Berrut and Trefethen 2004, Eq. 4.2 with the weights of Eq. 5.4).
        let (mut numerator, mut denominator) = ([0.0; 2], 0.0);
        for (node, value) in values.iter().enumerate() {
            let distance = x - chebyshev(node);
            if distance == 0.0 {
                (numerator, denominator) = (*value, 1.0);
                break;
            }
            let sign = if node % 2 == 0 { 1.0 } else { -1.0 };
            let end = if node == 0 || node == NODES - 1 { 0.5 } else { 1.0 };
            let weight = sign * end / distance;
            denominator += weight;
            for (n, v) in numerator.iter_mut().zip(value) {
                *n += weight * v;
            }
        }
        // The factor in front varies fastest near grazing, and is known exactly.
        let factor = self.facets.g1_over_cos_at(cos, ((1.0 - cos) * (1.0 + cos)).sqrt());
        let [scale, bias] = numerator.map(|v| v / denominator * factor);
        Albedo { scale, bias }
    }

    /// The table's coordinate in \[0, 1\] of a cosine: fine where the cosine is comparable to the roughness.
    fn coordinate(alpha: f64, cos: f64) -> f64 {
        ((cos / alpha).ln_1p() / (1.0 / alpha).ln_1p()).clamp(0.0, 1.0)
    }

    /// The cosine at a coordinate of the table.
    fn cosine(alpha: f64, coordinate: f64) -> f64 {
        (alpha * (coordinate * (1.0 / alpha).ln_1p()).exp_m1()).clamp(0.0, 1.0)
    }
}

/// Chebyshev's extreme points on \[0, 1\], ascending.
fn chebyshev(node: usize) -> f64 {
    (1.0 - (PI * node as f64 / (NODES - 1) as f64).cos()) / 2.0
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;
    use crate::microfacet::{Conductor, Ndf, SmithFit};
    use crate::quadrature::gauss_legendre;
    use crate::statistics::Moments;

    fn facets(ndf: Ndf, alpha: f64, smith: SmithFit) -> Microfacets {
        Microfacets::new(ndf, alpha, smith).expect("a valid roughness")
    }

    fn view(theta_degrees: f64) -> DVec3 {
        let theta = theta_degrees.to_radians();
        DVec3::new(theta.sin(), 0.0, theta.cos())
    }

    /// The definition, over light directions, by a product rule in (cos theta, phi).
    fn albedo_over_directions(conductor: &Conductor, o: DVec3, count: usize) -> f64 {
        let azimuths = gauss_legendre(count, 0.0, PI);
        let mut total = 0.0;
        for (theta, w) in gauss_legendre(count, 0.0, PI / 2.0) {
            for &(phi, v) in &azimuths {
                let i = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                total += 2.0 * w * v * theta.sin() * i.z * conductor.smooth_brdf(i, o)[0];
            }
        }
        total
    }

    #[test]
    fn it_is_the_integral_of_the_brdf_over_light_directions() {
        for (ndf, alpha, smith) in [
            (Ndf::Beckmann, 0.2, SmithFit::Exact),
            (Ndf::Beckmann, 0.5, SmithFit::Rational),
            (Ndf::Beckmann, 1.0, SmithFit::Exact),
            (Ndf::Ggx, 0.5, SmithFit::Exact),
        ] {
            let facets = facets(ndf, alpha, smith);
            for theta in [0.0, 35.0, 70.0, 85.0] {
                let albedo = directional_albedo(&facets, view(theta));
                for f0 in [1.0, 0.3] {
                    let conductor = Conductor { microfacets: facets, f0: [f0; 3] };
                    let coarse = albedo_over_directions(&conductor, view(theta), 160);
                    let fine = albedo_over_directions(&conductor, view(theta), 320);
                    let value = albedo.of_conductor([f0; 3])[0];
                    // Doubled nodes say how well the product rule itself has converged.
                    let tolerance = 1e-6_f64.max(2.0 * (fine - coarse).abs());
                    assert!(tolerance < 4e-5, "the product rule fails at {facets:?} {theta}: {}", fine - coarse);
                    assert!((value - fine).abs() < tolerance, "{facets:?} {theta} F0 {f0}: {value} {fine}");
                }
            }
        }
    }

    #[test]
    fn at_normal_incidence_it_is_a_single_integral() {
        for alpha in [0.001, 0.03, 0.3, 1.0] {
            for smith in [SmithFit::Exact, SmithFit::Rational] {
                let facets = facets(Ndf::Beckmann, alpha, smith);
                let rings = |r: f64| {
                    let tan_i = 2.0 * r / (1.0 - r * r);
                    let i = DVec3::new(tan_i, 0.0, 1.0).normalize();
                    [2.0 * PI * r * facets.slope_density(r * r) * facets.g1(i)]
                };
                let single = integrate(rings, &[0.0, (alpha).min(0.5), (5.0 * alpha).min(0.9), 1.0], 1e-12)[0];
                let value = directional_albedo(&facets, DVec3::Z).of_mirrors();
                assert!((value - single).abs() < 1e-8, "alpha {alpha}: {value} {single}");
            }
        }
    }

    #[test]
    fn it_tends_to_one_for_a_mirror_and_never_passes_one() {
        for ndf in [Ndf::Beckmann, Ndf::Ggx] {
            for alpha in [0.001, 0.01, 0.1, 0.3, 0.6, 1.0] {
                let facets = facets(ndf, alpha, SmithFit::Exact);
                for theta in [0.0, 30.0, 60.0, 80.0, 88.0, 89.9, 90.0] {
                    let value = directional_albedo(&facets, view(theta)).of_mirrors();
                    assert!(value > 0.25 && value <= 1.0 + 1e-9, "{facets:?} {theta}: {value}");
                    assert!(alpha > 0.001 || theta > 61.0 || value > 0.9999, "{facets:?} {theta}: {value}");
                }
            }
        }
    }

    /// Smallest bias caught: 4 standard errors of 200,000 facets, 0.2 to 1 %.
    #[test]
    fn random_facets_agree_within_their_standard_error() {
        let mut random = Pcg64::seed_from_u64(7);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        for (alpha, theta) in [(0.001, 45.0), (0.05, 89.0), (0.1, 80.0), (0.5, 20.0), (0.5, 75.0), (1.0, 60.0)] {
            let facets = facets(Ndf::Beckmann, alpha, SmithFit::Rational);
            let o = view(theta);
            let samples: Vec<f64> = (0..200_000)
                .map(|_| {
                    let (r, phi) = (alpha * (-(1.0 - uniform()).ln()).sqrt(), 2.0 * PI * uniform());
                    let m = DVec3::new(r * phi.cos(), r * phi.sin(), 1.0);
                    let facing = m.dot(o);
                    let i = 2.0 * facing / m.length_squared() * m - o;
                    if facing > 0.0 && i.z > 0.0 { facets.g1_over_cos(o) * facing * facets.g1(i) } else { 0.0 }
                })
                .collect();
            let moments = Moments::of(&samples).expect("samples");
            let value = directional_albedo(&facets, o).of_mirrors();
            let z = (moments.mean - value) / moments.standard_error();
            assert!(z.abs() < 4.0, "alpha {alpha} theta {theta}: {value} against {} ({z})", moments.mean);
            let biased = (moments.mean - 1.01 * value) / moments.standard_error();
            assert!(alpha < 0.01 || biased.abs() > 4.0, "a bias of 1 % must show: {biased}");
        }
    }

    #[test]
    fn the_table_interpolates_below_one_in_a_million() {
        for (ndf, alpha, smith) in [
            (Ndf::Beckmann, 0.001, SmithFit::Rational),
            (Ndf::Beckmann, 0.1, SmithFit::Rational),
            (Ndf::Beckmann, 0.5, SmithFit::Exact),
            (Ndf::Ggx, 1.0, SmithFit::Exact),
        ] {
            let facets = facets(ndf, alpha, smith);
            let table = AlbedoTable::new(&facets);
            for k in 0..=60 {
                let cos = (f64::from(k) / 60.0).powi(3);
                let (fast, slow) = (table.at(cos), albedo_at(&facets, cos, (1.0 - cos * cos).sqrt()));
                let error = (fast.scale - slow.scale).abs().max((fast.bias - slow.bias).abs());
                assert!(error < 1e-6, "{facets:?} at {cos}: {fast:?} {slow:?}");
            }
        }
    }

    #[test]
    fn the_share_reflected_above_the_horizon_falls_to_half_at_grazing() {
        let facets = facets(Ndf::Beckmann, 0.3, SmithFit::Exact);
        let at_normal = reflects_above_horizon(&facets, DVec3::Z);
        assert!((at_normal - (1.0 - (-1.0 / 0.09_f64).exp())).abs() < 1e-12, "facets up to 45 degrees: {at_normal}");
        let grazing = reflects_above_horizon(&facets, view(89.999));
        assert!((grazing - 0.5).abs() < 1e-3, "{grazing}");
        assert_eq!(reflects_above_horizon(&facets, -DVec3::Z), 0.0);
    }
}
