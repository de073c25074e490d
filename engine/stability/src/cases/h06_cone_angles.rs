//! H06. Cones from nothing to everything: solid angle, P and its limit.
//!
//! The renderer takes half-angles from .01 to 30 degrees; what narrower cones tend to is its formula's limit. Wider ones are refused,
//! as Eq. 17 of Wang, Deng and Holzschuch 2020 is no probability from 32.8 degrees on; the f64 oracle takes them all.

use crate::random::{rounded, turned};
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use glam::DVec3;
use mica_oracle::lit_probability::{cone_solid_angle, lit_density, lit_probability};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_oracle::statistics::normal_p_value;
use mica_oracle::wang2020::expected_probability;
use mica_render::method;
use mica_shaders::types::Operands;
use std::f64::consts::{PI, SQRT_2, TAU};

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![solid_angle(laboratory)?, limit(laboratory)?, refused()?, everything()?])
}

fn beckmann(alpha: f64) -> Result<Microfacets, StabilityError> {
    Ok(Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Exact)?)
}

fn solid_angle(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(6);
    let degrees: Vec<f64> =
        (0..laboratory.inputs(50_000, 5_000_000)).map(|_| random.log_between(1e-4, 180.0)).collect();
    let operands: Vec<Operands> = degrees
        .iter()
        .map(|degrees| {
            let gamma = degrees.to_radians();
            Operands { a: [gamma as f32, (0.5 * gamma).sin().powi(2) as f32, 0.0, 0.0], ..Operands::default() }
        })
        .collect();
    let truth: Vec<f64> = degrees.iter().map(|degrees| cone_solid_angle(degrees.to_radians())).collect();
    let naive = laboratory.floats(&operands, arithmetic!(solid_angle_cosine))?;
    let stable = laboratory.floats(&operands, arithmetic!(solid_angle_host))?;
    Ok(Check {
        what: "solid angle, gamma 1e-4 to 180 degrees".to_owned(),
        error_of: "|value / value in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("2 pi (1 - cos gamma)", worst_ratio(&naive, &truth)),
        stable: Form::new("4 pi sin^2(gamma / 2), the square from the host", worst_ratio(&stable, &truth)),
        tolerance: 16.0 * f64::from(f32::EPSILON),
    })
}

/// P over the solid angle tends to D(h) (h.n) / (4 i.h).
fn limit(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(7);
    let operands: Vec<Operands> = (0..laboratory.inputs(50_000, 5_000_000))
        .map(|_| {
            let gamma = random.log_between(1e-4, 1e-2).to_radians();
            let alpha = random.log_between(0.05, 1.0);
            let slope = alpha * (-random.between(0.01, 1.0).ln()).sqrt();
            let turn = random.between(0.0, TAU);
            let m = DVec3::new(slope * turn.cos(), slope * turn.sin(), 1.0).normalize();
            let i = random.direction_about(DVec3::Z, 1.3);
            let o = 2.0 * i.dot(m) * m - i;
            Operands {
                a: rounded(i, (0.5 * gamma).sin().powi(2)),
                b: rounded(o, alpha),
                c: [gamma.cos() as f32, 0.0, 0.0, 0.0],
            }
        })
        .filter(|of| of.a[2] > 0.05 && of.b[2] > 0.05)
        .collect();
    let truth = operands
        .iter()
        .map(|of| {
            let [i, o] = [of.a, of.b].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
            Ok(lit_density(&beckmann(of.b[3].into())?, i, o))
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    let naive = laboratory.floats(&operands, arithmetic!(lit_density_cosine))?;
    let stable = laboratory.floats(&operands, arithmetic!(lit_density_sine))?;
    Ok(Check {
        what: "P over solid angle, gamma 1e-4 to .01 degrees, alpha .05 to 1".to_owned(),
        error_of: "|value / (D(h) (h.n) / (4 i.h)) - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("P / (2 pi (1 - cos gamma))", worst_ratio(&naive, &truth)),
        stable: Form::new(
            "P / (4 pi sin^2(gamma / 2)), erf over narrow intervals by series",
            worst_ratio(&stable, &truth),
        ),
        // .01 degrees are .0035 of alpha .05, whose square is by how much P leaves its limit.
        tolerance: 1e-4,
    })
}

/// Eq. 17 at the roughness where it is greatest, seen along the normal.
fn refused() -> Result<Check, StabilityError> {
    let facets = beckmann(0.001)?;
    let (mut naive, mut stable) = (0.0_f64, 0.0_f64);
    let degrees: Vec<f64> = (1..=1800).map(|tenths| f64::from(tenths) / 10.0).collect();
    for degrees in &degrees {
        let excess = (expected_probability(&facets, DVec3::Z, degrees.to_radians()) - 1.0).max(0.0);
        naive = naive.max(excess);
        let wang = method("wang2020")?;
        if wang.values().parse(wang.name, "gamma_deg", &degrees.to_string()).is_ok() {
            stable = stable.max(excess);
        }
    }
    Ok(Check {
        what: "P-hat of Wang et al. 2020, Eq. 17, gamma .1 to 180 degrees".to_owned(),
        error_of: "how much it exceeds 1".to_owned(),
        inputs: degrees.len() as u64,
        naive: Form::new("any half-angle", naive),
        stable: Form::new("half-angles that settings accept", stable),
        tolerance: 0.0,
    })
}

/// A cone that is everything lights whatever faces the light: (1 + erf(cot(theta) / alpha)) / 2 where the view is there too.
fn everything() -> Result<Check, StabilityError> {
    let (mut naive, mut stable, mut inputs) = (0.0_f64, 0.0_f64, 0);
    for alpha in [0.1, 0.3, 1.0] {
        let facets = beckmann(alpha)?;
        for theta in [0.0, 0.3, 0.7, 1.1, 1.4, 1.55, 1.6, 1.9_f64] {
            let i = DVec3::new(theta.sin(), 0.0, theta.cos());
            let facing_away = 0.5 * normal_p_value(SQRT_2 * theta.cos().abs() / (alpha * theta.sin()));
            let truth = if theta.cos() > 0.0 { 1.0 - facing_away } else { facing_away };
            naive = naive.max((over_directions(&facets, i, i, PI) - truth).abs());
            stable = stable.max((lit_probability(&facets, i, i, PI) - truth).abs());
            inputs += 1;
        }
    }
    Ok(Check {
        what: "P of a cone of 180 degrees, in the oracle".to_owned(),
        error_of: "|P - the part of the facets that face the light|".to_owned(),
        inputs,
        naive: Form::new("D(h) (h.n) / (4 i.h) over 64 x 64 directions of the cone", naive),
        stable: Form::new("quadrature over the normals, whatever the shape of their set", stable),
        tolerance: 1e-3,
    })
}

/// P as the integral of the density of reflected directions over the cone, in cells of the same solid angle.
fn over_directions(facets: &Microfacets, i: DVec3, o: DVec3, gamma: f64) -> f64 {
    const CELLS: u32 = 64;
    let middle = |cell: u32| (f64::from(cell) + 0.5) / f64::from(CELLS);
    let cells = (0..CELLS).flat_map(|ring| (0..CELLS).map(move |step| (middle(ring), middle(step))));
    let densities = cells.map(|(ring, step)| {
        let angle = (1.0 - ring * (1.0 - gamma.cos())).acos();
        lit_density(facets, i, turned(o, angle, TAU * step))
    });
    cone_solid_angle(gamma) * densities.sum::<f64>() / f64::from(CELLS * CELLS)
}
