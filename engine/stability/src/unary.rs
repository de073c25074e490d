//! Functions of one number, tried on all that there are.
//!
//! Floats are few: each function gets every one of its domain, or as many of them as there is time for at equal
//! distances. The device makes the operands from their numbers, and the truth in f64 is found on all cores.

use crate::{Effort, Laboratory, StabilityError};
use mica_gpu::{Feature, Timing};
use mica_graph::{Buffer, Extent, Graph};
use mica_shaders::unary as passes;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2};

/// Operands of one dispatch.
const AT_ONCE: u32 = 1 << 21;
/// Operands of each function in a test.
const QUICK: u64 = 100_000_000;

/// A function of one word.
struct Helper {
    name: &'static str,
    /// What its words stand for.
    domain: &'static str,
    /// The first and the last word of the domain.
    words: [u32; 2],
    /// The operand of a word.
    operand: fn(u32) -> f64,
    error_of: &'static str,
    /// How wrong an answer is.
    error: fn(u32, f64) -> f64,
    /// What the worst error may be.
    bound: f64,
    /// Whether shaders with it use integers of 64 bits.
    needs_int64: bool,
    declare: fn(&mut Graph, &mut Buffer, u32, u32, u32),
}

/// How a function fared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnaryLine {
    /// Its name in shaders_glsl/shared.
    pub helper: String,
    /// The operands.
    pub domain: String,
    /// How many of them were tried.
    pub inputs: u64,
    /// What the error is.
    pub error_of: String,
    /// The worst error; infinite where an answer is no number at all.
    #[serde(deserialize_with = "crate::number_or_infinity")]
    pub worst: f64,
    /// The operand that it is at.
    pub at: f64,
    /// What the worst error may be.
    pub bound: f64,
}

impl UnaryLine {
    /// Whether the function is as good as it says.
    pub fn holds(&self) -> bool {
        self.worst <= self.bound
    }
}

macro_rules! declare {
    ($module:ident) => {
        |graph: &mut Graph, answers: &mut Buffer, count: u32, first: u32, distance: u32| {
            let params = passes::$module::Params { count, first, distance };
            graph.pass(passes::$module::Bind { answers }, params, Extent::new(count, 1));
        }
    };
}

fn float(word: u32) -> f64 {
    f32::from_bits(word).into()
}

/// The words of two floats of one sign; those between them are the floats between them.
const fn floats(first: f32, last: f32) -> [u32; 2] {
    [first.to_bits(), last.to_bits()]
}

/// |answer / truth - 1|
fn relative(answer: f64, truth: f64) -> f64 {
    if answer == truth { 0.0 } else { (answer / truth - 1.0).abs() }
}

const RELATIVE: &str = "|answer / truth - 1|";

/// All of them. Where a comment in shaders_glsl/shared states a bound, it is this one. A bound that says "fit" is that of a polynomial as published; the others are roundings counted: a unit of
/// rounding is 6e-8, and exp, log and division may take 3 + 2 |x|, 3 and 2.5 units in the last place of 1.2e-7 (Vulkan).
static HELPERS: [Helper; 9] = [
    Helper {
        name: "log_one_minus",
        domain: "1e-30 <= p <= 1/2",
        words: floats(1e-30, 0.5),
        operand: float,
        error_of: RELATIVE,
        error: |word, answer| relative(answer, (-float(word)).ln_1p()),
        // Two sums, a quotient and products: up to 8 roundings.
        bound: 6e-7,
        needs_int64: false,
        declare: declare!(log_one_minus),
    },
    Helper {
        name: "one_minus_exp",
        domain: "-80 <= x <= -1e-30",
        words: floats(-1e-30, -80.0),
        operand: float,
        error_of: RELATIVE,
        error: |word, answer| relative(answer, -float(word).exp_m1()),
        // From -0.3 on exp, 3.6 units off, is taken from 1, which leaves 0.26.
        bound: 1.5e-6,
        needs_int64: false,
        declare: declare!(one_minus_exp),
    },
    Helper {
        name: "normal_exceeded",
        domain: "6e-8 <= v < 1",
        words: floats(6e-8, 0.999_999_94),
        operand: float,
        error_of: "|P(normal number > answer) - v| / density there: the error of the normal number",
        error: |word, answer| {
            let density = (-0.5 * answer * answer).exp() / (2.0 * PI).sqrt();
            (0.5 * libm::erfc(answer / SQRT_2) - float(word)).abs() / density
        },
        // Published for single precision, up to 1 - 2v of one less its last place; below v = 3e-8 it drifts away.
        bound: 4e-6,
        needs_int64: false,
        declare: declare!(normal_exceeded),
    },
    Helper {
        name: "log_of_rest",
        domain: "1e-30 <= p < 1",
        words: floats(1e-30, 0.999_999_94),
        operand: float,
        error_of: RELATIVE,
        error: |word, answer| relative(answer, (-float(word)).ln_1p()),
        // From 0.4 on log, which may be off by 2^-21 where it is 0.51.
        bound: 1e-6,
        needs_int64: false,
        declare: declare!(log_of_rest),
    },
    Helper {
        name: "erfc_positive",
        domain: "0 <= x <= 8",
        words: floats(0.0, 8.0),
        operand: float,
        error_of: "|answer / truth - 1| / (1 + x^2)",
        error: |word, answer| {
            let x = float(word);
            relative(answer, libm::erfc(x)) / (1.0 + x * x)
        },
        // x^2 is rounded before exp makes a factor of that, and exp may be 3 + 2 x^2 units off.
        bound: 7e-7,
        needs_int64: false,
        declare: declare!(erfc_positive),
    },
    Helper {
        name: "minus_log",
        domain: "all words",
        words: [0, u32::MAX],
        operand: f64::from,
        error_of: "|answer / truth - 1|, truth of the word's upper 24 bits",
        error: |word, answer| {
            let word = word.max(1);
            let kept = u32::MAX << 8 >> word.leading_zeros();
            let kept = if word.leading_zeros() > 7 { word } else { word & kept };
            relative(answer, -(f64::from(kept) / 4_294_967_296.0).ln())
        },
        bound: 2e-7,
        needs_int64: true,
        declare: declare!(minus_log),
    },
    Helper {
        name: "inverse_root",
        domain: "all positive normal floats",
        words: floats(f32::MIN_POSITIVE, f32::MAX),
        operand: float,
        error_of: RELATIVE,
        error: |word, answer| relative(answer, 1.0 / float(word).sqrt()),
        bound: 2.4e-7,
        needs_int64: true,
        declare: declare!(inverse_root),
    },
    Helper {
        name: "clamped_integral",
        domain: "1e-15 <= y <= 1e6",
        words: floats(1e-15, 1e6),
        operand: float,
        error_of: RELATIVE,
        error: |word, answer| {
            let y = float(word);
            relative(answer, if y < 1.0 { 0.5 * y * y } else { y - 0.5 })
        },
        bound: 1.2e-7,
        needs_int64: false,
        declare: declare!(clamped_integral),
    },
    Helper {
        name: "unit_from",
        domain: "all words",
        words: [0, u32::MAX],
        operand: f64::from,
        error_of: "|answer - truth|, infinite unless 0 < answer < 1",
        error: |word, answer| {
            let truth = (f64::from(word >> 8) + 0.5) / 16_777_216.0;
            if answer > 0.0 && answer < 1.0 { (answer - truth).abs() } else { f64::INFINITY }
        },
        bound: 3e-8,
        needs_int64: false,
        declare: declare!(unit_from),
    },
];

/// A function under trial, many operands at a time: it can be left between any two steps.
pub struct Trial {
    helper: &'static Helper,
    /// From one word to the next.
    distance: u32,
    /// Words in all.
    words: u64,
    /// Words that were tried.
    tried: u64,
    /// The worst error, and its word.
    worst: (f64, u32),
}

impl Trial {
    /// One of each function.
    pub fn all(effort: Effort) -> Vec<Self> {
        let new = |helper: &'static Helper| {
            let all = u64::from(helper.words[1] - helper.words[0]) + 1;
            let distance = match effort {
                Effort::Full => 1,
                // An odd distance meets all patterns of the lower bits.
                Effort::Quick => (all.div_ceil(QUICK) | 1) as u32,
            };
            // The last word is tried whatever the distance: errors like ends.
            let words = (all - 1).div_ceil(distance.into()) + 1;
            Self { helper, distance, words, tried: 0, worst: (0.0, helper.words[0]) }
        };
        HELPERS.iter().map(new).collect()
    }

    /// Its name in shaders_glsl/shared.
    pub fn name(&self) -> &'static str {
        self.helper.name
    }

    /// How many operands were tried, and how many there are.
    pub fn progress(&self) -> [u64; 2] {
        [self.tried, self.words]
    }

    /// Tries some more, and says how the function fared once all are tried.
    ///
    /// # Errors
    /// Those of the device, also that it lacks a feature.
    pub fn step(&mut self, laboratory: &mut Laboratory) -> Result<Option<UnaryLine>, StabilityError> {
        let Self { helper, distance, words, .. } = *self;
        if helper.needs_int64 && !laboratory.executor.device().has(Feature::Int64) {
            return Err(StabilityError::Missing(format!("{} needs shaderInt64, which this device lacks", helper.name)));
        }
        let [first, last] = helper.words;
        // All but the last lie at equal distances.
        let before_last = words - 1 - self.tried;
        let (from, count) = match before_last {
            0 => (last, 1),
            _ => (first + (self.tried * u64::from(distance)) as u32, before_last.min(AT_ONCE.into()) as u32),
        };
        let mut graph = Graph::new();
        let mut answers = graph.buffer("answers", 4 * u64::from(count));
        (helper.declare)(&mut graph, &mut answers, count, from, distance);
        let download = graph.download(&answers);
        let bytes = laboratory.executor.run(graph, Timing::Overlapped)?.take(download);
        let error_of = |(index, bytes): (usize, &[u8])| {
            let word = from + index as u32 * distance;
            let answer = f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let error = (helper.error)(word, answer.into());
            // What is no number is infinitely wrong.
            (if error.is_nan() { f64::INFINITY } else { error }, word)
        };
        let found = bytes.par_chunks_exact(4).with_min_len(1 << 12).enumerate().map(error_of);
        self.worst = worse(self.worst, found.reduce(|| (0.0, from), worse));
        self.tried += u64::from(count);
        Ok((self.tried == words).then(|| self.line()))
    }

    fn line(&self) -> UnaryLine {
        let helper = self.helper;
        UnaryLine {
            helper: helper.name.to_owned(),
            domain: helper.domain.to_owned(),
            inputs: self.tried,
            error_of: helper.error_of.to_owned(),
            worst: self.worst.0,
            at: (helper.operand)(self.worst.1),
            bound: helper.bound,
        }
    }
}

/// The larger error, and of two alike that of the smaller word: the same whatever the order of threads.
fn worse(a: (f64, u32), b: (f64, u32)) -> (f64, u32) {
    if b.0 > a.0 || (b.0 == a.0 && b.1 < a.1) { b } else { a }
}
