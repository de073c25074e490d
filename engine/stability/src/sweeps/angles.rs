//! Angles: of the light to 89.99 degrees from the normal, of the cone from .01 to 30.

use super::{Sweep, errors, greatest, log, log_spaced};
use crate::random::{Random, turned};
use crate::{Laboratory, StabilityError, arithmetic};
use glam::DVec3;
use mica_gpu::Timing;
use mica_graph::{Buffer, Extent, Graph};
use mica_oracle::lit_probability::lit_probability;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_shaders::exact_probability as probability;
use mica_shaders::types::{Operands, ProbabilityQuestion};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Masking over the cosine, as light reaches the horizon.
///
/// # Errors
/// Those of the device.
pub fn grazing(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    const ALPHA: f32 = 0.1;
    let above_horizon = log_spaced(0.01, 60.0, 400);
    let operands: Vec<Operands> = above_horizon
        .iter()
        .map(|degrees| Operands { a: [degrees.to_radians().sin() as f32, ALPHA, 0.0, 0.0], b: [0.0; 4], c: [0.0; 4] })
        .collect();
    let facets = Microfacets::new(Ndf::Beckmann, f64::from(ALPHA), SmithFit::Rational)?;
    let truth: Vec<f64> = operands
        .iter()
        .map(|of| {
            let cosine = f64::from(of.a[0]);
            facets.g1_over_cos(DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine))
        })
        .collect();
    let off = |values: Vec<f32>| -> Vec<f64> {
        values.iter().zip(&truth).map(|(value, truth)| (f64::from(*value) / truth - 1.0).abs()).collect()
    };
    let naive = off(laboratory.floats(&operands, arithmetic!(masking_tangent))?);
    let stable = off(laboratory.floats(&operands, arithmetic!(masking_cancelled))?);
    let over = |errors: &[f64]| above_horizon.iter().copied().zip(errors.iter().copied()).collect::<Vec<_>>();
    Ok(Sweep {
        name: "grazing".to_owned(),
        title: "Light and view at grazing angles".to_owned(),
        x: log("degrees above the horizon"),
        y: log("relative error of G1 / cos, alpha .1"),
        series: vec![errors("cosine cancelled by hand", over(&stable)), errors("tangent of acos", over(&naive))],
        claim: "Masking over the cosine keeps six digits to 89.99 degrees from the normal.".to_owned(),
        worst: greatest(stable),
        // Two divisions and a square root of 2.5 ulp each, and their products.
        tolerance: 2e-6,
    })
}

/// P over the half-angle of the cone.
///
/// # Errors
/// Those of the device.
pub fn gamma(laboratory: &mut Laboratory) -> Result<Sweep, StabilityError> {
    const ALPHA: f32 = 0.5;
    const QUESTIONS: usize = 24;
    let degrees = log_spaced(0.01, 30.0, laboratory.inputs(60, 300));
    let mut random = Random::new(8);
    let facets = Microfacets::new(Ndf::Beckmann, f64::from(ALPHA), SmithFit::Exact)?;
    let mut questions = Vec::new();
    for gamma in degrees.iter().map(|degrees| degrees.to_radians()) {
        for _ in 0..QUESTIONS {
            // A view, a flake of the distribution, and light anywhere in the cone about where it mirrors.
            let (i, o) = loop {
                let o = random.direction_about(DVec3::Z, 1.2);
                let slope = f64::from(ALPHA) * (-(1.0 - random.between(0.0, 1.0)).ln()).sqrt();
                let flake = turned(DVec3::Z, slope.atan(), random.between(0.0, TAU));
                let mirrored = 2.0 * o.dot(flake) * flake - o;
                let i = random.direction_about(mirrored, gamma);
                // Neither nearer the horizon than the cone is wide, where its ellipse of slopes opens.
                if o.dot(flake) > 0.0 && i.z.min(o.z) > (1.1 * gamma).sin().max(0.1) {
                    break (i, o);
                }
            };
            questions.push(ProbabilityQuestion {
                i: i.as_vec3().to_array(),
                alpha: ALPHA,
                o: o.as_vec3().to_array(),
                sin2_half_gamma: (0.5 * gamma).sin().powi(2) as f32,
            });
        }
    }
    let truth: Vec<f64> = questions
        .par_iter()
        .map(|of| {
            let [i, o] = [of.i, of.o].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()).normalize());
            lit_probability(&facets, i, o, 2.0 * f64::from(of.sin2_half_gamma).sqrt().min(1.0).asin())
        })
        .collect();
    let mut worst_of = |declare: &dyn Fn(&mut Graph, &Buffer, &mut Buffer, u32)| -> Result<Vec<f64>, StabilityError> {
        let mut graph = Graph::new();
        let mut asked = graph.buffer("questions", size_of_val(questions.as_slice()) as u64);
        graph.upload(&mut asked, bytemuck::cast_slice::<_, u8>(&questions));
        let mut answers = graph.buffer("answers", (size_of::<f32>() * questions.len()) as u64);
        declare(&mut graph, &asked, &mut answers, questions.len() as u32);
        let download = graph.download(&answers);
        let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        let off: Vec<f64> =
            values.iter().zip(&truth).map(|(value, truth)| (f64::from(*value) / truth - 1.0).abs()).collect();
        Ok(off.chunks(QUESTIONS).map(|of_cone| greatest(of_cone.iter().copied())).collect())
    };
    let stable = worst_of(&|g, probability_questions, answers, count| {
        let bind = probability::legendre_16::Bind { probability_questions, answers };
        g.pass(bind, probability::legendre_16::Params { count, unread: 0 }, Extent::new(count, 1));
    })?;
    let naive = worst_of(&|g, probability_questions, answers, count| {
        let bind = probability::small_cone::Bind { probability_questions, answers };
        g.pass(bind, probability::small_cone::Params { count, unread: 0 }, Extent::new(count, 1));
    })?;
    let over = |errors: &[f64]| degrees.iter().copied().zip(errors.iter().copied()).collect::<Vec<_>>();
    Ok(Sweep {
        name: "gamma".to_owned(),
        title: "Cones from .01 to 30 degrees".to_owned(),
        x: log("half-angle of the cone in degrees"),
        y: log("relative error of P, alpha .5, the worst of 24 views"),
        series: vec![
            errors("quadrature over the ellipse", over(&stable)),
            errors("density times solid angle", over(&naive)),
        ],
        claim: "P keeps four digits for cones of .01 to 30 degrees.".to_owned(),
        worst: greatest(stable),
        // As shared/lit_probability.glsl has it, several times over.
        tolerance: 1e-4,
    })
}
