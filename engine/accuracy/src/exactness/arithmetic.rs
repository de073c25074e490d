//! Formulas written naively and stably, where f32 loses digits.

use super::kernel::{Amount, Declare, Rung, answers, costs, upload};
use super::{Chart, Clock, Effort, ExactnessError, ExactnessLine, about, error_of_ratios};
use crate::{Estimate, Machine};
use glam::{DMat2, DVec2, DVec3};
use mica_gpu::Executor;
use mica_graph::{Buffer, Extent, Graph};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::Progress;
use mica_shaders::exact_arithmetic as kernel;
use mica_shaders::types::Operands;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::{PI, TAU};

/// Operands of each formula.
const COUNT: usize = 4096;
/// Evaluations of each when rungs are timed.
const EVALUATIONS: u32 = 256;

/// The pass of a file in `rungs/arithmetic`.
macro_rules! declare {
    ($operands:expr, $module:ident) => {{
        let operands = $operands;
        Box::new(move |g: &mut Graph, answers: &mut Buffer, amount: Amount| {
            let bind = kernel::$module::Bind { operand_list: operands, answers };
            let params = kernel::$module::Params { count: amount.questions, evaluations: amount.evaluations };
            g.pass(bind, params, Extent::new(amount.questions, amount.rows));
        })
    }};
}
/// A formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Formula {
    /// Whether a flake is lit, asked within 20 % of the edge of a cone of this half-angle in degrees.
    Membership(f64),
    /// G1 / cos of Beckmann near the horizon.
    Masking,
    /// D of Beckmann at this roughness.
    Beckmann(f64),
    /// The determinant of a matrix whose axes are as 10,000 to 1.
    Determinant,
    /// The chance of any success among many that are rare.
    AnySuccess,
    /// i.h where light and view are nearly opposite.
    HalfCosine,
    /// The angle between directions that are nearly the same.
    Angle,
    /// The solid angle of a narrow cone.
    SolidAngle,
    /// The shorter axis of a long ellipse.
    MinorAxis,
}

/// All that are measured.
pub(super) const FORMULAS: [Formula; 11] = [
    Formula::Membership(1.0),
    Formula::Membership(0.01),
    Formula::Masking,
    Formula::Beckmann(0.1),
    Formula::Beckmann(0.001),
    Formula::Determinant,
    Formula::AnySuccess,
    Formula::HalfCosine,
    Formula::Angle,
    Formula::SolidAngle,
    Formula::MinorAxis,
];

impl Formula {
    fn case(self) -> String {
        match self {
            Self::Membership(gamma_deg) => format!("cone membership, gamma {gamma_deg} deg"),
            Self::Masking => "G1 / cos, cos 1e-7 to .1".to_owned(),
            Self::Beckmann(alpha) => format!("Beckmann D, alpha {alpha}"),
            Self::Determinant => "2 x 2 determinant, 10,000 to 1".to_owned(),
            Self::AnySuccess => "1 - (1 - p)^n, p 1e-8 to 1e-3".to_owned(),
            Self::HalfCosine => "i.h, half-angle pi/2 - .001".to_owned(),
            Self::Angle => "angle of .001".to_owned(),
            Self::SolidAngle => "solid angle, gamma .01 to 1 deg".to_owned(),
            Self::MinorAxis => "shorter axis, 100 to 10,000 to 1".to_owned(),
        }
    }

    /// Numbers that it reads: four, eight or twelve.
    fn reads(self) -> u32 {
        match self {
            Self::Membership(_) => 12,
            Self::Beckmann(_) | Self::HalfCosine | Self::Angle => 8,
            Self::Masking | Self::Determinant | Self::AnySuccess | Self::SolidAngle | Self::MinorAxis => 4,
        }
    }

    /// Operands where it is hard.
    fn operands(self) -> Vec<Operands> {
        let mut random = Random(Pcg64::seed_from_u64(44));
        (0..COUNT).map(|_| self.operand(&mut random)).collect()
    }

    fn operand(self, random: &mut Random) -> Operands {
        let vector = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let [mut b, mut c] = [[0.0; 4]; 2];
        let a = match self {
            Self::Membership(gamma_deg) => {
                let gamma = gamma_deg.to_radians();
                let (i, o) = (random.direction_about(DVec3::Z, 1.2), random.direction_about(DVec3::Z, 1.2));
                let mirrored = turned(o, gamma * random.between(0.8, 1.2), random.between(0.0, TAU));
                b = vector(o, gamma.cos());
                c = vector((i + mirrored).normalize(), 0.0);
                vector(i, (0.5 * gamma).sin().powi(2))
            }
            Self::Masking => [random.log_between(1e-7, 0.1) as f32, 0.1, 0.0, 0.0],
            Self::Beckmann(alpha) => {
                let normal = random.direction_about(DVec3::Z, PI);
                let slope = alpha * (-(1.0 - random.between(0.0, 1.0)).ln()).sqrt();
                b = vector(normal, 0.0);
                vector(turned(normal, slope.atan(), random.between(0.0, TAU)), alpha)
            }
            Self::Determinant => random.ellipse(1e4),
            Self::MinorAxis => {
                let aspect = random.log_between(1e2, 1e4);
                random.ellipse(aspect)
            }
            Self::AnySuccess => {
                let (p, lit) = (random.log_between(1e-8, 1e-3), random.log_between(1e-3, 5.0));
                [(lit / p).ceil() as f32, p as f32, 0.0, 0.0]
            }
            Self::HalfCosine => {
                let i = random.direction_about(DVec3::Z, PI);
                b = vector(turned(-i, 2e-3, random.between(0.0, TAU)), 0.0);
                vector(i, 0.0)
            }
            Self::Angle => {
                let direction = random.direction_about(DVec3::Z, PI);
                b = vector(turned(direction, 1e-3, random.between(0.0, TAU)), 0.0);
                vector(direction, 0.0)
            }
            Self::SolidAngle => [random.log_between(0.01, 1.0).to_radians() as f32, 0.0, 0.0, 0.0],
        };
        Operands { a, b, c }
    }

    /// Its value in f64 for the operands as the device has them, their directions made unit vectors.
    fn truth(self, operands: &Operands) -> Result<f64, ExactnessError> {
        let [a, b, c] = [operands.a, operands.b, operands.c].map(|v| v.map(f64::from));
        let unit = |v: [f64; 4]| DVec3::new(v[0], v[1], v[2]).normalize();
        let beckmann = |alpha| Microfacets::new(Ndf::Beckmann, alpha, SmithFit::Rational);
        Ok(match self {
            Self::Membership(gamma_deg) => {
                let (i, o, m) = (unit(a), unit(b), unit(c));
                let chord = (2.0 * i.dot(m) * m - i - o).length();
                f64::from(u8::from(chord <= 2.0 * (0.5 * gamma_deg.to_radians()).sin() && i.dot(m) > 0.0))
            }
            Self::Masking => beckmann(a[1])?.g1_over_cos(DVec3::new((1.0 - a[0] * a[0]).sqrt(), 0.0, a[0])),
            Self::Beckmann(_) => {
                let (h, n) = (unit(a), unit(b));
                beckmann(a[3])?.d(DVec3::new(h.cross(n).length(), 0.0, h.dot(n)))
            }
            Self::Determinant => a[0] * a[3] - a[1] * a[2],
            Self::AnySuccess => -(a[0] * (-a[1]).ln_1p()).exp_m1(),
            Self::HalfCosine => 0.5 * (unit(a) + unit(b)).length(),
            Self::Angle => unit(a).cross(unit(b)).length().atan2(unit(a).dot(unit(b))),
            Self::SolidAngle => 4.0 * PI * (0.5 * a[0]).sin().powi(2),
            Self::MinorAxis => {
                let (x, y) = (DVec2::new(a[0], a[1]), DVec2::new(a[2], a[3]));
                let both = DVec2::new(x.x + y.y, x.y - y.x).length() + DVec2::new(x.x - y.y, x.y + y.x).length();
                x.perp_dot(y).abs() / (0.5 * both)
            }
        })
    }

    fn error_of(self) -> &'static str {
        match self {
            Self::Membership(_) => "share of wrong answers within 20 % of the edge, three times the same",
            _ => "|value / value in f64 - 1|: median, the same, 95th percentile",
        }
    }

    fn error(self, answers: &[f64], truth: &[f64]) -> Estimate {
        match self {
            Self::Membership(_) => {
                let wrong = answers.iter().zip(truth).filter(|(answer, truth)| answer != truth).count();
                Estimate::exact(wrong as f64 / truth.len() as f64)
            }
            _ => error_of_ratios(answers, truth),
        }
    }

    /// The files in `rungs/arithmetic` that compute it, the common form first.
    fn rungs(self, operands: &Buffer) -> Vec<Rung<'_>> {
        macro_rules! rung {
            ($module:ident, $word:literal, $what:literal) => {
                Rung { word: $word, what: $what, declare: declare!(operands, $module) }
            };
        }
        match self {
            Self::Membership(_) => vec![
                rung!(
                    membership_matrix,
                    "matrix",
                    "m' C m <= 0 with the matrix of Jakob et al. 2014 assembled from i, o and cos gamma."
                ),
                rung!(membership_cosine, "cosine", "2 (i.m) (o.m) - i.o >= cos gamma."),
                rung!(
                    membership_chord,
                    "chord",
                    "|2 (i.m) m - i - o|^2 <= 4 sin^2(gamma / 2), the sine from the host."
                ),
            ],
            Self::Masking => vec![
                rung!(
                    masking_tangent,
                    "tangent",
                    "Walter et al. 2007 with 1 / (alpha tan(acos(cos))), over the cosine."
                ),
                rung!(masking_cancelled, "cancelled", "The same fit with the cosine cancelled by hand."),
            ],
            Self::Beckmann(_) => vec![
                rung!(beckmann_cosine, "cosine", "tan^2 as (1 - cos^2) / cos^2."),
                rung!(beckmann_cross, "cross product", "tan^2 as |h x n|^2 / cos^2."),
                rung!(beckmann_chord, "chord", "sin^2 and cos from |h - n|^2."),
            ],
            Self::Determinant => vec![
                rung!(determinant_plain, "plain", "a d - b c."),
                rung!(
                    determinant_exact_products,
                    "exact products",
                    "The same from products without error (Dekker 1971)."
                ),
            ],
            Self::AnySuccess => vec![
                rung!(any_power, "power", "1 - pow(1 - p, n)."),
                rung!(any_series, "series", "log(1 - p) and 1 - exp by series."),
            ],
            Self::HalfCosine => vec![
                rung!(half_cosine_normalized, "normalized", "i . normalize(i + o)."),
                rung!(half_cosine_length, "length", "|i + o| / 2."),
            ],
            Self::Angle => {
                vec![rung!(angle_acos, "acos", "acos(a.b)."), rung!(angle_chord, "chord", "2 asin(|a - b| / 2).")]
            }
            Self::SolidAngle => vec![
                rung!(solid_angle_cosine, "cosine", "2 pi (1 - cos gamma)."),
                rung!(solid_angle_sine, "sine", "4 pi sin^2(gamma / 2)."),
            ],
            Self::MinorAxis => vec![
                rung!(minor_axis_roots, "roots", "The smaller root of the quadratic of the squared axes."),
                rung!(minor_axis_quotient, "quotient", "|determinant| over the longer axis."),
            ],
        }
    }
}

/// Measures every formula in every form.
pub(super) fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let mut lines = Vec::new();
    for (index, formula) in (0..).zip(FORMULAS) {
        progress("naive and stable arithmetic", index, FORMULAS.len() as u64);
        let operands = formula.operands();
        let truth = operands.iter().map(|operands| formula.truth(operands)).collect::<Result<Vec<_>, _>>()?;
        let buffer = upload(executor, "operands", &operands)?;
        let rungs = formula.rungs(&buffer);
        let nothing: Declare = match formula.reads() {
            4 => declare!(&buffer, reads_4),
            8 => declare!(&buffer, reads_8),
            _ => declare!(&buffer, reads_12),
        };
        // A device with thousands of lanes has to be given work for them.
        let filled = if Clock::of(executor) == Clock::Processor { 1 } else { 256 };
        let amount = Amount { questions: COUNT as u32, rows: filled, evaluations: EVALUATIONS };
        let once = Amount { rows: 1, ..amount };
        let errors = rungs
            .iter()
            .map(|rung| Ok(formula.error(&answers(executor, rung, once)?, &truth)))
            .collect::<Result<Vec<_>, ExactnessError>>()?;
        let costs = costs(executor, effort, &nothing, &rungs, amount)?;
        for ((rung, error), ns) in rungs.iter().zip(errors).zip(costs) {
            lines.push(ExactnessLine {
                case: formula.case(),
                error_of: formula.error_of().to_owned(),
                error,
                ns,
                ..about(Chart::Arithmetic, rung, Clock::of(executor), machine)
            });
        }
    }
    Ok(lines)
}

/// Seeded numbers.
struct Random(Pcg64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// Uniform by solid angle, at most so many radians from the axis.
    fn direction_about(&mut self, axis: DVec3, most: f64) -> DVec3 {
        let angle = (1.0 - self.between(0.0, 1.0) * (1.0 - most.cos())).acos();
        turned(axis, angle, self.between(0.0, TAU))
    }

    /// Sides of a parallelogram in any position, whose ellipse has axes of this ratio, the longer one being 1.
    fn ellipse(&mut self, aspect: f64) -> [f32; 4] {
        let [left, right] = [(); 2].map(|()| DMat2::from_angle(self.between(0.0, TAU)));
        let sides = left * DMat2::from_diagonal(DVec2::new(1.0, 1.0 / aspect)) * right;
        sides.to_cols_array().map(|side| side as f32)
    }
}

/// The direction at an angle from the axis, turned about it.
fn turned(axis: DVec3, angle: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    angle.cos() * axis + angle.sin() * (turn.cos() * x + turn.sin() * y)
}
