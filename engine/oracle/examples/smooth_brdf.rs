//! Prints the smooth BRDF over a grid of directions, for programs that share nothing with this one to check
//! (`tests/cross_check/smooth_brdf_mitsuba.py`).
//!
//! A line for each pair of directions: distribution, roughness, then x, y, z of the light's and of the view's direction
//! about the normal +Z, then the BRDF of mirrors in 1/sr, with Smith's masking exactly and by the rational fit.

use glam::DVec3;
use mica_oracle::OracleError;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};

fn main() -> Result<(), OracleError> {
    let direction = |theta_deg: f64, phi_deg: f64| {
        let (sin, cos) = theta_deg.to_radians().sin_cos();
        let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
        DVec3::new(sin * cos_phi, sin * sin_phi, cos)
    };
    let thetas_deg = [0.0, 5.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0];
    let phis_deg = [0.0, 20.0, 60.0, 90.0, 135.0, 170.0, 180.0];
    println!("ndf alpha ix iy iz ox oy oz exact rational");
    for (name, ndf) in [("beckmann", Ndf::Beckmann), ("ggx", Ndf::Ggx)] {
        for alpha in [0.1, 0.3, 0.5] {
            let exact = Microfacets::new(ndf, alpha, SmithFit::Exact)?;
            let rational = Microfacets::new(ndf, alpha, SmithFit::Rational)?;
            for theta_i in thetas_deg {
                for theta_o in thetas_deg {
                    for phi in phis_deg {
                        let (i, o) = (direction(theta_i, 0.0), direction(theta_o, phi));
                        let brdf = [exact.brdf(i, o), rational.brdf(i, o)];
                        let [i, o] = [i, o].map(|v| format!("{:e} {:e} {:e}", v.x, v.y, v.z));
                        println!("{name} {alpha} {i} {o} {:e} {:e}", brdf[0], brdf[1]);
                    }
                }
            }
        }
    }
    Ok(())
}
