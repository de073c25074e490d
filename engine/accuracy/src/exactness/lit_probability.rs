//! The rungs of P(i, o, gamma), the probability that a flake is lit.

use super::kernel::{Amount, Rung, answers, costs, upload};
use super::{Chart, Clock, Effort, ExactnessError, ExactnessLine, about, error_of_ratios};
use crate::Machine;
use glam::DVec3;
use mica_gpu::{Executor, Timing};
use mica_graph::{Buffer, Extent, Graph};
use mica_oracle::lit_probability::lit_probability;
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::{Progress, lit_probability_table};
use mica_shaders::exact_probability as kernel;
use mica_shaders::types::ProbabilityQuestion;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// Roughness and half-angle of the cone in degrees: a cone narrow beside the lobe, as wide, and wider.
pub(super) const CASES: [(f64, f64); 3] = [(0.5, 2.0), (0.1, 6.0), (0.02, 6.0)];
/// Roughnesses of the tables of Wang, Deng and Holzschuch 2020 on both sides of .5.
const TABULATED: [f32; 2] = [0.4, 0.6];
/// Greatest angle of light and view from the normal, degrees.
const GRAZING_DEG: f64 = 80.0;
/// Questions of which the truth is computed.
const JUDGED: usize = 2048;
/// Questions in a row: more than the pixels of a small picture, so that tables are read from all over.
const ASKED: usize = 1 << 16;

/// One rung for each file in `rungs/probability`, and the table twice where it has to interpolate between roughnesses.
fn rungs<'a>(questions: &'a Buffer, own_table: &'a Buffer, between: Option<&'a Buffer>) -> Vec<Rung<'a>> {
    macro_rules! rung {
        ($module:ident, $word:literal, $what:literal $(, $table:expr)?) => {
            Rung {
                word: $word,
                what: $what,
                declare: Box::new(move |g: &mut Graph, answers: &mut Buffer, amount: Amount| {
                    let bind = kernel::$module::Bind {
                        probability_questions: questions,
                        answers,
                        $(accumulated: $table,)?
                    };
                    let params = kernel::$module::Params { count: amount.questions, unread: 0 };
                    g.pass(bind, params, Extent::new(amount.questions, amount.rows));
                }),
            }
        };
    }
    let mut rungs = vec![
        rung!(small_cone, "small cone", "D(h) (h.n) sigma / (4 i.h): the density at the cone's axis for all of it."),
        rung!(
            gaussian,
            "widened Gaussian",
            "The Gaussian of slopes, its covariance widened by that of the cone in slope space."
        ),
        rung!(
            equal_area_box,
            "equal-area box",
            "The ellipse that the cone becomes in slope space as a box of its area: a product of error functions."
        ),
        rung!(
            cubature,
            "cap cubature",
            "Seven densities over the cone: at its axis and six on a ring (Abramowitz and Stegun 1964, 25.4.61)."
        ),
        rung!(
            strips,
            "6 strips",
            "The ellipse in slope space in six strips by Gauss and Chebyshev, error functions along them."
        ),
        rung!(legendre_8, "8 nodes", "Gauss-Legendre with 8 nodes over the exact ellipse, error functions across."),
        rung!(legendre_16, "16 nodes", "Gauss-Legendre with 16 nodes over the exact ellipse, error functions across."),
        rung!(legendre_32, "32 nodes", "Gauss-Legendre with 32 nodes over the exact ellipse, error functions across."),
        rung!(
            table,
            "table",
            "A trilinear look-up in the 5.8 MB table of Wang, Deng and Holzschuch 2020 (sections 4.1 and 4.2), made at this \
             very roughness and widened to this cone.",
            own_table
        ),
    ];
    if let Some(between) = between {
        rungs.push(rung!(
            table,
            "table between roughnesses",
            "The same, made of the tables at the roughnesses .4 and .6, as the paper interpolates.",
            between
        ));
    }
    rungs
}

/// Measures every rung in every case.
pub(super) fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let mut lines = Vec::new();
    for (index, (alpha, gamma_deg)) in (0..).zip(CASES) {
        progress("the rungs of the lit probability", index, CASES.len() as u64);
        let asked = questions(alpha, gamma_deg, ASKED);
        let truth = truth(&asked[..JUDGED], alpha)?;
        let buffer = upload(executor, "questions", &asked)?;
        let own = table(executor, &[alpha as f32], alpha, gamma_deg)?;
        let is_between = f64::from(TABULATED[0]) < alpha && alpha < f64::from(TABULATED[1]);
        let between = is_between.then(|| table(executor, &TABULATED, alpha, gamma_deg)).transpose()?;
        let rungs = rungs(&buffer, &own, between.as_ref());
        let nothing = Box::new(|g: &mut Graph, answers: &mut Buffer, amount: Amount| {
            let bind = kernel::nothing::Bind { probability_questions: &buffer, answers };
            g.pass(
                bind,
                kernel::nothing::Params { count: amount.questions, unread: 0 },
                Extent::new(amount.questions, amount.rows),
            );
        });
        let once = Amount { questions: JUDGED as u32, rows: 1, evaluations: 1 };
        let errors = rungs
            .iter()
            .map(|rung| Ok(error_of_ratios(&answers(executor, rung, once)?, &truth)))
            .collect::<Result<Vec<_>, ExactnessError>>()?;
        // A device with thousands of lanes has to be given work for them.
        let filled = if Clock::of(executor) == Clock::Processor { 1 } else { 64 };
        let amount = Amount { questions: ASKED as u32, rows: filled, evaluations: 1 };
        let costs = costs(executor, effort, &(nothing as _), &rungs, amount)?;
        for ((rung, error), ns) in rungs.iter().zip(errors).zip(costs) {
            lines.push(ExactnessLine {
                case: format!("alpha {alpha}, gamma {gamma_deg} deg"),
                error_of: "|P / P in f64 - 1|: median, the same, 95th percentile".to_owned(),
                error,
                ns,
                ..about(Chart::LitProbability, rung, Clock::of(executor), machine)
            });
        }
    }
    Ok(lines)
}

/// P(i, o, gamma) of one roughness as `wang2020` looks it up.
fn table(executor: &mut Executor, alphas: &[f32], alpha: f64, gamma_deg: f64) -> Result<Buffer, ExactnessError> {
    let mut g = Graph::new();
    let table = lit_probability_table(&mut g, alphas, alpha, gamma_deg);
    executor.run(g, Timing::Overlapped)?;
    Ok(table)
}

/// Where light is seen: views by solid angle, a flake for each, and a light in the cone about where that mirrors the view; the
/// more probable it is that a flake is lit, the more often it is asked.
fn questions(alpha: f64, gamma_deg: f64, count: usize) -> Vec<ProbabilityQuestion> {
    let mut random = Pcg64::seed_from_u64(20_200_601);
    let mut uniform = move || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let grazing = GRAZING_DEG.to_radians().cos();
    let sin2_half_gamma = (0.5 * gamma_deg.to_radians()).sin().powi(2);
    let mut questions = Vec::with_capacity(count);
    while questions.len() < count {
        let o = around(DVec3::Z, (1.0 - grazing) * uniform(), TAU * uniform());
        let (radius, turn) = (alpha * (-(1.0 - uniform()).ln()).sqrt(), TAU * uniform());
        let m = DVec3::new(radius * turn.cos(), radius * turn.sin(), 1.0).normalize();
        let mirrored = 2.0 * o.dot(m) * m - o;
        let i = around(mirrored, 2.0 * sin2_half_gamma * uniform(), TAU * uniform());
        if o.dot(m) > 0.0 && i.z > grazing {
            questions.push(ProbabilityQuestion {
                i: i.as_vec3().to_array(),
                alpha: alpha as f32,
                o: o.as_vec3().to_array(),
                sin2_half_gamma: sin2_half_gamma as f32,
            });
        }
    }
    questions
}

/// The direction whose cosine with `axis` is so much less than 1, turned about it.
fn around(axis: DVec3, from_axis: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let sine = (from_axis * (2.0 - from_axis)).sqrt();
    (1.0 - from_axis) * axis + sine * (turn.cos() * x + turn.sin() * y)
}

/// P in f64 of the questions as the device is asked.
fn truth(questions: &[ProbabilityQuestion], alpha: f64) -> Result<Vec<f64>, ExactnessError> {
    let facets = Microfacets::new(Ndf::Beckmann, f64::from(alpha as f32), SmithFit::Rational)?;
    let unit = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).normalize();
    let of = |question: &ProbabilityQuestion| {
        let gamma = 2.0 * f64::from(question.sin2_half_gamma).sqrt().asin();
        lit_probability(&facets, unit(question.i), unit(question.o), gamma)
    };
    Ok(questions.iter().map(of).collect())
}
