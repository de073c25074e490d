//! H10. Binomial counts: rare events, moments, no switch between branches.

use crate::count_law::normal_above;
use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, bits, worst_ratio};
use mica_gpu::Timing;
use mica_graph::{Buffer, Extent, Graph};
use mica_oracle::binomial::Binomial;
use mica_oracle::statistics::Moments;
use mica_shaders::exact_count;
use mica_shaders::types::{CountDraw, Operands, Words};
use rayon::prelude::*;

/// Random words, as a power of 2.
const WORDS: f64 = 4_294_967_296.0;
/// Draws from each law, spread evenly.
const DRAWS: u32 = 1 << 16;
/// Flakes.
const FLAKES: [f32; 10] = [1.0, 2.0, 3.0, 4.0, 16.0, 100.0, 1e4, 1e6, 1e9, 1e12];
/// Of them, lit on average: about the switch from inversion to a normal number at 16, too.
const LIT: [f32; 11] = [0.3, 1.0, 2.0, 5.0, 12.0, 15.9, 16.1, 30.0, 100.0, 1e4, 1e6];

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut checks = vec![any_success(laboratory)?];
    checks.extend(moments(laboratory)?);
    checks.push(rarest_words(laboratory)?);
    checks.push(rare_events(laboratory)?);
    checks.push(growth(laboratory)?);
    Ok(checks)
}

/// 1 - (1 - p)^n.
fn any_success(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(10);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let p = random.log_between(1e-12, 0.5);
            let n = (random.log_between(1e-9, 50.0) / p).round().clamp(1.0, 1e12);
            Operands { a: [n as f32, p as f32, 0.0, 0.0], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    let any = |of: &Operands| -(f64::from(of.a[0]) * (-f64::from(of.a[1])).ln_1p()).exp_m1();
    let truth: Vec<f64> = operands.iter().map(any).collect();
    let naive = laboratory.floats(&operands, arithmetic!(any_power))?;
    let stable = laboratory.floats(&operands, arithmetic!(any_series))?;
    Ok(Check {
        what: "the chance that any of n flakes is lit, p from 1e-12, n p from 1e-9".to_owned(),
        error_of: "|chance / chance in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("1 - pow(1 - p, n)", worst_ratio(&naive, &truth)),
        stable: Form::new("series of log(1 - p) and 1 - exp(x)", worst_ratio(&stable, &truth)),
        tolerance: 1.9e-6,
    })
}

/// n and p.
type Law = [f32; 2];

/// All laws of so many flakes of which so many are lit on average, and some of which most are.
fn laws() -> Vec<Law> {
    let all = FLAKES.iter().flat_map(|n| LIT.map(|lit| [*n, lit / *n]));
    let most = [[16.0, 0.7], [100.0, 0.9], [1e4, 0.999]];
    all.filter(|[_, p]| *p < 0.7).chain(most).collect()
}

fn exact(laws: &[Law]) -> Result<Vec<Binomial>, StabilityError> {
    Ok(laws.par_iter().map(|[n, p]| Binomial::new(*n as u64, f64::from(*p))).collect::<Result<_, _>>()?)
}

/// Even words, and pairs of uniform and normal numbers, so that what is wrong is the law's and not the draws': the Hammersley
/// set, its second number through the inverse of the normal law.
fn draws() -> Vec<CountDraw> {
    let draw = |index: u32| {
        let even = (f64::from(index) + 0.5) / f64::from(DRAWS);
        let other = (f64::from(index.reverse_bits()) + 0.5) / WORDS;
        CountDraw {
            word: (even * WORDS) as u32,
            uniform_number: even as f32,
            normal_number: normal_above(other) as f32,
        }
    };
    (0..DRAWS).into_par_iter().map(draw).collect()
}

/// Counts of each law by each draw.
fn counts(
    laboratory: &mut Laboratory,
    laws: &[Law],
    draws: &[CountDraw],
    declare: impl FnOnce(&mut Graph, &Buffer, &Buffer, &mut Buffer, Extent),
) -> Result<Vec<f32>, StabilityError> {
    let mut graph = Graph::new();
    let mut drawn = graph.buffer("draws", size_of_val(draws) as u64);
    graph.upload(&mut drawn, bytemuck::cast_slice::<_, u8>(draws));
    let mut of_laws = graph.buffer("laws", size_of_val(laws) as u64);
    graph.upload(&mut of_laws, bytemuck::cast_slice::<_, u8>(laws));
    let mut answers = graph.buffer("answers", (4 * draws.len() * laws.len()) as u64);
    declare(&mut graph, &drawn, &of_laws, &mut answers, Extent::new(draws.len() as u32, laws.len() as u32));
    let download = graph.download(&answers);
    let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

macro_rules! law {
    ($module:ident) => {
        |graph: &mut Graph, count_draws: &Buffer, count_laws: &Buffer, answers: &mut Buffer, extent: Extent| {
            let bind = exact_count::$module::Bind { count_draws, count_laws, answers };
            let params = exact_count::$module::Params { count_of_draws: DRAWS, unread: 0 };
            graph.pass(bind, params, extent);
        }
    };
}

/// Mean, variance and the whole law.
fn moments(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let (laws, draws) = (laws(), draws());
    let exact = exact(&laws)?;
    let worst_of = |counts: &[f32]| -> Result<[f64; 3], StabilityError> {
        let errors = counts.par_chunks(DRAWS as usize).zip(&exact).map(|(counts, law)| {
            let counts: Vec<f64> = counts.iter().map(|count| f64::from(*count)).collect();
            let found = Moments::of(&counts)?;
            let deviation = law.variance().sqrt().max(1.0);
            Ok([
                (found.mean / law.mean() - 1.0).abs(),
                (found.variance / law.variance() - 1.0).abs(),
                law.distance(&counts)? / deviation,
            ])
        });
        let errors: Vec<[f64; 3]> = errors.collect::<Result<_, StabilityError>>()?;
        Ok(std::array::from_fn(|which| errors.iter().map(|error| error[which]).fold(0.0, f64::max)))
    };
    let naive = worst_of(&counts(laboratory, &laws, &draws, law!(gated))?)?;
    let stable = worst_of(&counts(laboratory, &laws, &draws, law!(inversion))?)?;
    let checks = [
        ("mean of counts of up to 1e12 flakes", "|mean / n p - 1|", 1e-4),
        ("variance of counts of up to 1e12 flakes", "|variance / n p (1 - p) - 1|", 1e-3),
        (
            "law of counts of up to 1e12 flakes",
            "Wasserstein-1 distance from the binomial law, in standard deviations or flakes",
            2e-3,
        ),
    ];
    let check = |(which, (what, error_of, tolerance)): (usize, (&str, &str, f64))| Check {
        what: what.to_owned(),
        error_of: error_of.to_owned(),
        inputs: (laws.len() * draws.len()) as u64,
        naive: Form::new("a gate and a rounded normal number", naive[which]),
        stable: Form::new("inversion, beyond a mean of 16 a matched normal number", stable[which]),
        tolerance,
    };
    Ok(checks.into_iter().enumerate().map(check).collect())
}

/// A question to the rungs of counts.
fn question(word: u32, [n, p]: Law) -> Words {
    Words { a: [word, n.to_bits(), p.to_bits(), 0], b: [0; 4] }
}

fn as_counts(answers: Vec<[u32; 4]>) -> Vec<f64> {
    answers.into_iter().map(|[count, ..]| f64::from(f32::from_bits(count))).collect()
}

/// Words that stand for the outermost counts.
fn rarest_words(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let laws = laws();
    let exact = exact(&laws)?;
    let small: Vec<u32> = (0..16).chain((2..16).flat_map(|bit| [4_u32, 5, 6, 7].map(|at| at << bit))).collect();
    let words: Vec<u32> = small.iter().flat_map(|word| [*word, !*word]).collect();
    let questions: Vec<Words> = laws.iter().flat_map(|law| words.iter().map(|word| question(*word, *law))).collect();
    let naive = as_counts(laboratory.words(&questions, bits!(count_textbook))?);
    let stable = as_counts(laboratory.words(&questions, bits!(count_inverted))?);
    let worst = |counts: &[f64]| -> f64 {
        let of_law = |(counts, law): (&[f64], &Binomial)| -> f64 {
            let deviation = law.variance().sqrt().max(1.0);
            let error = |(count, word): (&f64, &u32)| {
                let truth = law.exceeded_with((f64::from(*word) + 0.5) / WORDS);
                (count - truth as f64).abs() / deviation
            };
            counts.iter().zip(&words).map(error).fold(0.0, f64::max)
        };
        counts.par_chunks(words.len()).zip(&exact).map(of_law).reduce(|| 0.0, f64::max)
    };
    Ok(Check {
        what: "counts of words that are drawn once in 65,000 to 4e9 times".to_owned(),
        error_of: "|count - quantile|, in standard deviations or flakes".to_owned(),
        inputs: questions.len() as u64,
        naive: Form::new("textbook inversion from (1 - p)^n", worst(&naive)),
        stable: Form::new("inversion, beyond a mean of 16 a matched normal number", worst(&stable)),
        // Tails are differences, within 2e-7: for words rarer than that the loop ends where counts are less likely than 1e-10.
        tolerance: 5.0,
    })
}

/// Realised chances of rare events: all words below four times the chance are asked.
fn rare_events(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let laws: Vec<Law> =
        [1e-6, 2.3e-6, 3.7e-6].iter().flat_map(|lit| [1.0, 1e3, 1e6, 1e12].map(|n| [n, lit / n])).collect();
    let mut questions = Vec::new();
    let mut ends = Vec::new();
    for law in &laws {
        let most = (4.0 * f64::from(law[0]) * f64::from(law[1]) * WORDS) as u32;
        questions.extend((0..most).map(|word| question(word, *law)));
        ends.push(questions.len());
    }
    let naive = as_counts(laboratory.words(&questions, bits!(count_textbook))?);
    let stable = as_counts(laboratory.words(&questions, bits!(count_inverted))?);
    let worst = |counts: &[f64]| -> f64 {
        let mut from = 0;
        let of_law = |(law, end): (&Law, &usize)| {
            let hits = counts[from..*end].iter().filter(|count| **count >= 1.0).count();
            from = *end;
            let chance = -(f64::from(law[0]) * (-f64::from(law[1])).ln_1p()).exp_m1();
            (hits as f64 / WORDS / chance - 1.0).abs()
        };
        laws.iter().zip(&ends).map(of_law).fold(0.0, f64::max)
    };
    Ok(Check {
        what: "how often any of n flakes is lit where that is 1e-6 to 4e-6".to_owned(),
        error_of: "|share of words / chance - 1|".to_owned(),
        inputs: questions.len() as u64,
        naive: Form::new("24 bits of the word against (1 - p)^n", worst(&naive)),
        stable: Form::new("32 bits of it against 1 - (1 - p)^n by series", worst(&stable)),
        tolerance: 1e-3,
    })
}

/// Counts of the same words as p grows.
fn growth(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(1010);
    // From a mean of 4 on in steps of .1 %, past the switch at 16.
    let steps: usize = 2500;
    let means: Vec<f64> = (0..steps).map(|step| 4.0 * 1.001_f64.powi(step as i32)).collect();
    let words: Vec<u32> = (0..laboratory.inputs(100, 10_000)).map(|_| (random.bits() >> 32) as u32).collect();
    let flakes = [100.0_f32, 1e4, 1e9];
    let lines = || flakes.iter().flat_map(|n| words.iter().map(move |word| (*n, *word)));
    let (mut naive, mut stable) = (0, 0);
    let mut inputs = 0;
    for chunk in lines().collect::<Vec<_>>().chunks(400) {
        let along = |(n, word): &(f32, u32)| {
            let (n, word) = (*n, *word);
            means.iter().map(move |mean| question(word, [n, (mean / f64::from(n)) as f32])).collect::<Vec<_>>()
        };
        let questions: Vec<Words> = chunk.iter().flat_map(along).collect();
        let falls = |counts: Vec<f64>| {
            let lines = counts.chunks(steps).map(|line| line.windows(2).filter(|pair| pair[1] < pair[0]).count());
            lines.sum::<usize>()
        };
        naive += falls(as_counts(laboratory.words(&questions, bits!(count_plain_normal))?));
        stable += falls(as_counts(laboratory.words(&questions, bits!(count_inverted))?));
        inputs += questions.len();
    }
    Ok(Check {
        what: "counts of the same words as p grows in steps of .1 %".to_owned(),
        error_of: "counts that fall".to_owned(),
        inputs: inputs as u64,
        naive: Form::new("inversion, beyond a mean of 16 a plain normal number", naive as f64),
        stable: Form::new("inversion, beyond a mean of 16 a matched normal number", stable as f64),
        tolerance: 0.0,
    })
}
