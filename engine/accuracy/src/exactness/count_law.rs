//! The rungs of the count law: how many of the n flakes in a footprint are lit, each with probability p.

use super::kernel::{Amount, Rung, answers, costs, upload};
use super::{Chart, Clock, Effort, ExactnessError, ExactnessLine, about, quantile, sorted};
use crate::{Estimate, Machine};
use mica_gpu::Executor;
use mica_graph::{Buffer, Extent, Graph};
use mica_oracle::binomial::Binomial;
use mica_oracle::statistics::{Moments, normal_p_value};
use mica_render::Progress;
use mica_shaders::exact_count as kernel;
use mica_shaders::types::CountDraw;

/// Flakes.
const FLAKES: [u32; 6] = [1, 4, 16, 100, 10_000, 1_000_000];
/// Of them, lit on average.
const LIT: [f64; 8] = [0.1, 0.3, 1.0, 2.0, 5.0, 12.0, 30.0, 100.0];
/// Draws from each law.
const DRAWS: u32 = 1 << 16;
/// Draws from each law when rungs are timed.
const TIMED_DRAWS: u32 = 1 << 13;

/// What of a law is wrong.
pub(super) const CASES: [(&str, &str); 4] = [
    ("mean", "|mean of the count / n p - 1|"),
    ("variance", "|variance of the count / n p (1 - p) - 1|"),
    ("dark pixels", "|share of draws with none lit - (1 - p)^n|"),
    ("distribution", "Wasserstein-1 distance from the binomial law over n p"),
];

/// One rung for each file in `rungs/count`.
fn rungs<'a>(draws: &'a Buffer, laws: &'a Buffer) -> Vec<Rung<'a>> {
    macro_rules! rung {
        ($module:ident, $word:literal, $what:literal) => {
            Rung {
                word: $word,
                what: $what,
                declare: Box::new(move |g: &mut Graph, answers: &mut Buffer, amount: Amount| {
                    let bind = kernel::$module::Bind { count_draws: draws, count_laws: laws, answers };
                    let params = kernel::$module::Params { count_of_draws: amount.questions, unread: 0 };
                    g.pass(bind, params, Extent::new(amount.questions, amount.rows));
                }),
            }
        };
    }
    vec![
        rung!(mean, "mean alone", "n p, as a surface without flakes has it."),
        rung!(
            gated,
            "gated Gaussian",
            "A soft gate and a rounded normal number, as Deliot and Belcour 2023 print it; their normal number is read from a \
             map, which is not counted here."
        ),
        rung!(
            gated_repaired,
            "gated Gaussian, repaired",
            "The same with the chance of any lit flake by series, and less than one flake taken for what it is."
        ),
        rung!(
            blended,
            "blended inversion",
            "Zirr and Kaplanyan 2016: inversion blended between two probabilities up to 5 lit, then a normal number that \
             lacks sqrt 2; both draw their numbers themselves."
        ),
        rung!(blended_root_two, "blended, sqrt 2 restored", "The same with the factor that the normal number lacks."),
        rung!(
            without_loop,
            "three thresholds",
            "Exact thresholds for none, one and two lit, above them a matched normal number: no loop."
        ),
        rung!(
            inversion,
            "exact inversion",
            "Inversion step by step below a mean of 16, a normal number matched to the third cumulant above it."
        ),
    ]
}

/// Measures every rung over all laws.
pub(super) fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let laws = laws();
    let exact =
        laws.iter().map(|[n, p]| Binomial::new(*n as u64, f64::from(*p))).collect::<Result<Vec<Binomial>, _>>()?;
    let draws = upload(executor, "draws", &draws())?;
    let of_laws = upload(executor, "laws", &laws)?;
    let rungs = rungs(&draws, &of_laws);
    let once = Amount { questions: DRAWS, rows: laws.len() as u32, evaluations: 1 };
    let mut errors = Vec::new();
    for (index, rung) in (0..).zip(&rungs) {
        progress("the rungs of the count law", index, rungs.len() as u64);
        errors.push(errors_of(&answers(executor, rung, once)?, &exact)?);
    }
    let nothing = Box::new(|g: &mut Graph, answers: &mut Buffer, amount: Amount| {
        let bind = kernel::nothing::Bind { count_draws: &draws, count_laws: &of_laws, answers };
        let params = kernel::nothing::Params { count_of_draws: amount.questions, unread: 0 };
        g.pass(bind, params, Extent::new(amount.questions, amount.rows));
    });
    let timed = if Clock::of(executor) == Clock::Processor { TIMED_DRAWS } else { DRAWS };
    let costs = costs(executor, effort, &(nothing as _), &rungs, Amount { questions: timed, ..once })?;
    let mut lines = Vec::new();
    for (case, (word, error_of)) in CASES.into_iter().enumerate() {
        for ((rung, errors), ns) in rungs.iter().zip(&errors).zip(&costs) {
            lines.push(ExactnessLine {
                case: word.to_owned(),
                error_of: format!("{error_of}: median over {} laws, the same, greatest", laws.len()),
                error: errors[case],
                ns: *ns,
                ..about(Chart::CountLaw, rung, Clock::of(executor), machine)
            });
        }
    }
    Ok(lines)
}

/// n and p of each law, p being at most 1/2.
fn laws() -> Vec<[f32; 2]> {
    let all = FLAKES.iter().flat_map(|n| LIT.map(|lit| [*n as f32, (lit / f64::from(*n)) as f32]));
    all.filter(|[_, p]| *p <= 0.5).collect()
}

/// Words, uniform and normal numbers that are spread evenly, so that what is wrong is the law's and not the draws': the
/// Hammersley set, its second number through the inverse of the normal law.
fn draws() -> Vec<CountDraw> {
    let draw = |index: u32| {
        let even = (f64::from(index) + 0.5) / f64::from(DRAWS);
        let other = (f64::from(index.reverse_bits()) + 0.5) / 4_294_967_296.0;
        CountDraw {
            word: (even * 4_294_967_296.0) as u32,
            uniform_number: even as f32,
            normal_number: normal(other) as f32,
        }
    };
    (0..DRAWS).map(draw).collect()
}

/// The standard normal number that is not exceeded with this probability, by bisection.
fn normal(probability: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let tail = 0.5 * normal_p_value(middle);
        let below = if middle < 0.0 { tail } else { 1.0 - tail };
        if below < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// For each of [`CASES`], the errors of counts over all laws.
fn errors_of(counts: &[f64], laws: &[Binomial]) -> Result<[Estimate; 4], ExactnessError> {
    let mut errors: [Vec<f64>; 4] = Default::default();
    for (counts, law) in counts.chunks(DRAWS as usize).zip(laws) {
        let moments = Moments::of(counts)?;
        let none = counts.iter().filter(|count| **count < 1e-6).count() as f64 / counts.len() as f64;
        errors[0].push((moments.mean / law.mean() - 1.0).abs());
        errors[1].push((moments.variance / law.variance() - 1.0).abs());
        errors[2].push((none - law.probability_of_none()).abs());
        errors[3].push(law.distance(counts)? / law.mean());
    }
    Ok(errors.map(|errors| {
        let errors = sorted(&errors);
        let median = quantile(&errors, 0.5);
        Estimate { value: median, low: median, high: errors[errors.len() - 1] }
    }))
}
