//! Jakob, Hasan, Yan, Lawrence, Ramamoorthi, Marschner 2014, "Discrete Stochastic Microfacet Models", ACM Transactions
//! on Graphics 33 (4).
//!
//! N mirror flakes lie in each square of texture space, their normals drawn from the distribution of normals. A
//! hierarchy over position and direction at once counts those that lie in a footprint and reflect the light into a
//! cone about the view, without ever listing them all. This is the paper's method in f64, with flakes of its own: how
//! they follow from (N, alpha, gamma, seed) is defined in `engine/design/0008-tree-of-jakob.md`, bit for bit, so that
//! with epsilon = 0 the renderer's `jakob` counts the very same.
//!
//! What is the paper's, and what is not:
//! - The triangles and their ids, the choice between splitting space and direction, the conic of a query and the error
//!   criterion (10) are the paper's.
//! - Counts are split by three exact binomials, where the paper rounds a Gaussian and repairs its sum.
//! - Nodes are classified by chords, safely for a query inside a node too, where the paper intersects arcs with the
//!   conic.
//! - The triangles end at leaves over which D is nearly linear, with a density that is; the paper's go on for ever.
//! - Flakes drawn with density D / S_D weigh S_D each. The authors' code leaves that out and draws with D cos, which
//!   darkens oblique half vectors by their cosine; `weighted = false` leaves S_D out here too.
//! - Known fault: criterion (10) as printed takes the flakes of a node as spread evenly over it, in direction by solid
//!   angle, although D may vary by any factor over a large triangle: counts are off by 13 % on the average at epsilon
//!   = 0.1. Here it is asked only where the share is what it says, in leaves and inside the cone: 1.3 %.
//! - `product` is a student's simplification: the share of the flakes in the footprint times the share in the cone.
//!   Its mean is right and its variance far too small, as it averages over flakes that are not there.

mod overlap;
mod traversal;
mod triangles;

use std::f64::consts::PI;

use glam::DVec3;

pub use self::traversal::{Query, Tree, TreeFlake, TreeSettings};
pub use self::triangles::{Triangle, TriangleTable, WHOLE, facet_area};
use crate::OracleError;
use crate::error::in_range;
use crate::lit_probability::cone_solid_angle;
use crate::microfacet::{Microfacets, half_vector};
use crate::quadrature::integrate;

/// How a count is made and what it counts for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Relative error at which criterion (10) accepts a node; 0 is exact.
    pub epsilon: f64,
    /// Place and direction counted apart and multiplied; `epsilon` is then not used.
    pub product: bool,
    /// Whether each flake weighs S_D, as it must for the smooth limit.
    pub weighted: bool,
}

impl Default for Estimate {
    /// The paper's epsilon = 0.1, and the weight.
    fn default() -> Self {
        Self { epsilon: 0.1, product: false, weighted: true }
    }
}

/// The BRDF of one material, F = 1.
#[derive(Clone, Copy, Debug)]
pub struct DiscreteBrdf<'a> {
    tree: Tree<'a>,
    facets: Microfacets,
    gamma_radians: f64,
    facet_area: f64,
}

impl<'a> DiscreteBrdf<'a> {
    /// The BRDF of the flakes that follow from `settings`, which are distributed as `table`, made for `facets`, has
    /// it.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(table: &'a TriangleTable, facets: Microfacets, settings: TreeSettings) -> Result<Self, OracleError> {
        let tree = Tree::new(table, settings)?;
        Ok(Self { tree, facets, gamma_radians: settings.gamma_radians, facet_area: facet_area(&facets) })
    }

    /// Its flakes.
    pub const fn tree(&self) -> &Tree<'a> {
        &self.tree
    }

    /// The paper's multiscale BRDF with F = 1, per steradian: (i.h) Dhat G / (a sigma (i.n)(o.n)), where Dhat is the
    /// weight of the lit flakes in the footprint over N, a the footprint's area and sigma the cone's solid angle. 0
    /// below the horizon and where the footprint has no area.
    ///
    /// # Errors
    /// When epsilon is negative or not finite.
    pub fn value(&self, query: &Query, estimate: &Estimate) -> Result<f64, OracleError> {
        let Estimate { epsilon, product, weighted } = *estimate;
        in_range("epsilon", epsilon, epsilon >= 0.0 && epsilon.is_finite(), "0 or positive, and finite")?;
        let (area, Query { i, o, .. }) = (query.footprint.area(), *query);
        if self.tree.count() == 0 || !(area > 0.0 && i.z > 0.0 && o.z > 0.0) {
            return Ok(0.0);
        }
        let lit = if product { self.tree.lit_as_product(query) } else { self.tree.lit(query, epsilon) };
        let weight = if weighted { self.facet_area } else { 1.0 };
        let dhat = weight * lit / self.tree.count() as f64;
        // i.h = |i + o| / 2, and G / ((i.n)(o.n)) with the cosines cancelled.
        let facing = (i + o).length() / 2.0;
        let masking = self.facets.g1_over_cos(i) * self.facets.g1_over_cos(o);
        Ok(facing * dhat * masking / (area * cone_solid_angle(self.gamma_radians)))
    }
}

/// The probability that a flake drawn with density D / S_D reflects light from `i` into the cone of half-angle
/// `gamma_radians` about `o` (unit vectors, local frame): the integral of D over the paper's Omega_h, over S_D. By
/// quadrature over the reflected directions, for which dm = dr / (4 i.m), to about 1e-7.
pub fn lit_share(facets: &Microfacets, i: DVec3, o: DVec3, gamma_radians: f64) -> f64 {
    let (x, y) = o.any_orthonormal_pair();
    // The lobe is densest about the mirror image of the light in n.
    let mirrored = DVec3::new(-i.x, -i.y, i.z);
    let (x_part, y_part) = (mirrored.dot(x), mirrored.dot(y));
    let (peak_angle, peak_phi) = (x_part.hypot(y_part).atan2(mirrored.dot(o)), y_part.atan2(x_part));
    let ring = |angle: f64| {
        let around = |phi: f64| {
            let r = angle.cos() * o + angle.sin() * (phi.cos() * x + phi.sin() * y);
            let density = half_vector(i, r).map_or(0.0, |m| facets.d(m) / (4.0 * i.dot(m)));
            [density * angle.sin()]
        };
        let width = facets.alpha() / angle.sin().max(facets.alpha());
        integrate(around, &graded(peak_phi, width, [peak_phi - PI, peak_phi + PI]), 1e-9)
    };
    let range = [0.0, gamma_radians];
    let rings = graded(peak_angle.min(gamma_radians), facets.alpha(), range);
    integrate(ring, &rings, 1e-8)[0] / facet_area(facets)
}

/// Breakpoints on a range, finest within `width` of `middle` and doubling outwards.
fn graded(middle: f64, width: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    let steps = (0..40).map(|k| width * f64::from(k).exp2()).take_while(|step| *step < high - low);
    let mut points: Vec<f64> =
        steps.flat_map(|step| [middle - step, middle + step]).chain([low, middle, high]).collect();
    points.retain(|point| (low..=high).contains(point));
    points.sort_by(f64::total_cmp);
    points
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use rayon::prelude::*;

    use super::*;
    use crate::flake_set::Footprint;
    use crate::lit_probability::lit_probability;
    use crate::microfacet::{Ndf, SmithFit};
    use crate::statistics::Moments;

    fn facets(alpha: f64) -> Microfacets {
        Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact).expect("a valid roughness")
    }

    fn direction(theta_degrees: f64, phi_degrees: f64) -> DVec3 {
        let (theta, phi) = (theta_degrees.to_radians(), phi_degrees.to_radians());
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    }

    fn query(i: DVec3, o: DVec3) -> Query {
        let sides = [DVec2::new(0.02, 0.01), DVec2::new(-0.01, 0.03)];
        Query { footprint: Footprint { corner: DVec2::new(0.3, 0.9), sides }, i, o }
    }

    #[test]
    fn the_share_of_lit_flakes_is_the_lit_probability_without_its_cosine() {
        for (alpha, gamma, theta) in [(0.5, 0.02_f64, 70.0), (0.1, 0.5, 20.0), (0.02, 1.0, 50.0), (0.02, 6.0, 3.0)] {
            let (facets, gamma) = (facets(alpha), gamma.to_radians());
            let (i, o) = (direction(theta, 10.0), direction(theta - 2.0, 185.0));
            let cos = half_vector(i, o).map_or(0.0, |h| h.z);
            let with_cos = lit_probability(&facets, i, o, gamma) / facet_area(&facets);
            let ratio = lit_share(&facets, i, o, gamma) * cos / with_cos;
            // The cosine varies over the cone by tan(theta_h) gamma / 2.
            assert!((ratio - 1.0).abs() < 1e-3, "alpha {alpha} gamma {gamma} theta {theta}: {ratio}");
        }
        // The whole lobe, also where it is a speck in the cone or at its edge.
        for (alpha, gamma, aside) in [(0.3, PI, 0.0), (0.001, 1.0, 50.0), (0.001, 0.1, 2.0), (0.02, 1.0, 10.0)] {
            let all = lit_share(&facets(alpha), direction(aside, 20.0), DVec3::Z, gamma);
            assert!((all - 1.0).abs() < 1e-6, "alpha {alpha}: {all}");
        }
    }

    /// The smooth BRDF is the limit of the mean for a narrow cone; without the weight S_D it is missed by 1 / S_D,
    /// which is 0.90 at alpha 0.5. Measured: off by 0.05 % or less, as the product, of little noise, shows best.
    #[test]
    fn the_mean_value_is_the_smooth_brdf_if_flakes_are_weighted() {
        for (alpha, theta_i, theta_o, azimuth) in
            [(0.5, 20.0, 50.0, 160.0), (0.5, 70.0, 60.0, 170.0), (0.2, 10.0, 5.0, 90.0)]
        {
            let facets = facets(alpha);
            let table = TriangleTable::new(&facets);
            let query = query(direction(theta_i, 0.0), direction(theta_o, azimuth));
            let smooth = facets.brdf(query.i, query.o);
            let brdf = |seed| {
                let gamma_radians = 0.5_f64.to_radians();
                let settings = TreeSettings { count: 10_000_000_000, seed, gamma_radians, mean_area: 1e-5 };
                DiscreteBrdf::new(&table, facets, settings).expect("valid settings")
            };
            let exact = Estimate { epsilon: 0.0, ..Estimate::default() };
            for estimate in [exact, Estimate::default(), Estimate { product: true, ..exact }] {
                let value = |seed, estimate| brdf(seed).value(&query, &estimate).expect("a value");
                let values: Vec<f64> = (0..150).into_par_iter().map(|seed| value(seed, estimate)).collect();
                let moments = Moments::of(&values).expect("values");
                let (off, error) = (moments.mean / smooth - 1.0, moments.standard_error() / smooth);
                assert!(error < 0.01 && off.abs() < 4.0 * error + 0.005, "{estimate:?}: {off} +- {error}");
                let bare = value(0, Estimate { weighted: false, ..estimate });
                assert!((bare * facet_area(&facets) / values[0] - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_value_is_nothing_where_there_is_nothing_and_a_bad_epsilon_is_refused() {
        let facets = facets(0.3);
        let table = TriangleTable::new(&facets);
        let settings = TreeSettings { count: 1_000_000, seed: 3, gamma_radians: 0.1, mean_area: 1e-5 };
        let brdf = DiscreteBrdf::new(&table, facets, settings).expect("valid settings");
        let (i, o) = (direction(30.0, 0.0), direction(35.0, 175.0));
        let exact = Estimate { epsilon: 0.0, ..Estimate::default() };
        let value = brdf.value(&query(i, o), &exact);
        assert!(value.as_ref().is_ok_and(|value| *value > 0.0 && value.is_finite()));
        assert_eq!(brdf.value(&query(o, i), &exact), value, "light and view exchanged");
        for (i, o) in [(i, -o), (-i, o), (DVec3::X, o), (i, DVec3::NEG_X)] {
            assert_eq!(brdf.value(&query(i, o), &exact), Ok(0.0));
        }
        let flat = Query { footprint: Footprint { corner: DVec2::ZERO, sides: [DVec2::X; 2] }, i, o };
        assert_eq!(brdf.value(&flat, &exact), Ok(0.0));
        let none = DiscreteBrdf::new(&table, facets, TreeSettings { count: 0, ..settings }).expect("valid settings");
        assert_eq!(none.value(&query(i, o), &exact), Ok(0.0));
        for epsilon in [-0.1, f64::NAN, f64::INFINITY] {
            let error = brdf.value(&query(i, o), &Estimate { epsilon, ..exact }).expect_err("must be refused");
            assert!(error.to_string().starts_with("epsilon is "), "{error}");
        }
    }
}
