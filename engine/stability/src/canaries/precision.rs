//! How far functions of the language are from the truth.

use super::Canary;
use crate::{Laboratory, Random, StabilityError, bits};
use mica_shaders::types::Words;
use std::f64::consts::PI;

/// Arguments of each function.
const COUNT: usize = 100_000;

/// A function, where it is in the answers, and what Vulkan promises of it.
struct Function {
    name: &'static str,
    domain: &'static str,
    promise: Promise,
    means: &'static str,
}

#[derive(Clone, Copy)]
enum Promise {
    /// Units in the last place.
    Ulp(f64),
    /// Units in the last place: so many, and so many more for each of |x|.
    UlpAndOf(f64, f64),
    /// Absolute: this power of two.
    Absolute(i32),
}

/// In the order of the answers of the two shaders.
const FUNCTIONS: [Function; 8] = [
    Function {
        name: "sin",
        domain: "-pi..pi",
        promise: Promise::Absolute(-11),
        means: "cones are given to shaders as sin^2(gamma/2) by the host, in f64",
    },
    Function {
        name: "cos",
        domain: "-pi..pi",
        promise: Promise::Absolute(-11),
        means: "small angles are compared by chords, as 1 - cos has no digits there",
    },
    Function {
        name: "exp",
        domain: "-80..80",
        promise: Promise::UlpAndOf(3.0, 2.0),
        means: "small exponents go through a series, so that 1 - exp(x) keeps its digits",
    },
    Function {
        name: "log",
        domain: ".5..2",
        promise: Promise::Absolute(-21),
        means: "log(1 - p) goes through a series: near 1 the logarithm has few digits of its own",
    },
    Function {
        name: "atan",
        domain: "-1e3..1e3",
        promise: Promise::Ulp(4096.0),
        means: "angles only find cells and texels; edges of cones are compared by chords",
    },
    Function {
        name: "sqrt",
        domain: "1e-30..1e30",
        // Inherited from 1 / inversesqrt: 2 units and those of a division.
        promise: Promise::Ulp(4.5),
        means: "lengths are good to so much",
    },
    Function {
        name: "inversesqrt",
        domain: "1e-30..1e30",
        promise: Promise::Ulp(2.0),
        means: "normalised directions are good to so much; flakes, which must be the same everywhere, have their own",
    },
    Function {
        name: "division",
        domain: "1e-15..1e15 by the same",
        promise: Promise::Ulp(2.5),
        means: "nothing is compared for equality after a division",
    },
];

pub(super) fn ask(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    let mut random = Random::new(50);
    let first: Vec<Words> = (0..COUNT)
        .map(|index| {
            // Half of the logarithms are asked close to 1, where they lose their digits.
            let near_one = if index % 4 < 2 {
                random.log_between(0.5, 2.0)
            } else {
                1.0 + random.log_between(1e-7, 0.5) * if index % 4 == 2 { 1.0 } else { -1.0 }
            };
            let x = [random.between(-PI, PI), random.between(-80.0, 80.0), near_one, 0.0];
            Words { a: x.map(|x| (x as f32).to_bits()), b: [0; 4] }
        })
        .collect();
    let second: Vec<Words> = (0..COUNT)
        .map(|index| {
            let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
            let x = [
                sign * random.log_between(1e-3, 1e3),
                random.log_between(1e-30, 1e30),
                random.log_between(1e-15, 1e15),
                random.log_between(1e-15, 1e15),
            ];
            Words { a: x.map(|x| (x as f32).to_bits()), b: [0; 4] }
        })
        .collect();
    let functions = laboratory.words(&first, bits!(canary_functions))?;
    let roots = laboratory.words(&second, bits!(canary_roots))?;
    let mut found = Vec::new();
    for (at, function) in FUNCTIONS.iter().enumerate() {
        let mut worst = Worst::default();
        let (asked, answers) = if at < 4 { (&first, &functions) } else { (&second, &roots) };
        for (asked, answers) in asked.iter().zip(answers) {
            let x = asked.a.map(|bits| f64::from(f32::from_bits(bits)));
            let (argument, truth) = match at {
                0 => (x[0], x[0].sin()),
                1 => (x[0], x[0].cos()),
                2 => (x[1], x[1].exp()),
                3 => (x[2], x[2].ln()),
                4 => (x[0], x[0].atan()),
                5 => (x[1], x[1].sqrt()),
                6 => (x[1], 1.0 / x[1].sqrt()),
                _ => (x[2], x[2] / x[3]),
            };
            worst.add(function.promise, argument, f64::from(f32::from_bits(answers[at % 4])), truth);
        }
        let promised = match function.promise {
            Promise::Ulp(ulp) => format!("Vulkan promises {ulp} ULP"),
            Promise::UlpAndOf(ulp, more) => format!("Vulkan promises {ulp} + {more} |x| ULP"),
            Promise::Absolute(power) => format!("Vulkan promises 2^{power}"),
        };
        let kept = if worst.of_promise <= 1.0 { "" } else { "; THE PROMISE IS NOT KEPT, results may be wrong" };
        found.push(Canary::new(
            &format!("precision_{}", function.name),
            &format!("how far is {} from the truth in {}?", function.name, function.domain),
            match function.promise {
                Promise::Absolute(_) => format!("{:.1e}, relative {:.1e}", worst.absolute, worst.relative),
                _ => format!("{:.1} ULP, relative {:.1e}", worst.ulp, worst.relative),
            },
            format!("{promised}{kept}; {}", function.means),
        ));
    }
    Ok(found)
}

/// The worst errors so far.
#[derive(Default)]
struct Worst {
    ulp: f64,
    relative: f64,
    absolute: f64,
    /// Error over what is promised.
    of_promise: f64,
}

impl Worst {
    fn add(&mut self, promise: Promise, argument: f64, value: f64, truth: f64) {
        let absolute = if value.is_finite() { (value - truth).abs() } else { f64::INFINITY };
        // The last place of an f32 of the truth's size.
        let last_place = 2_f64.powi(truth.abs().max(f64::from(f32::MIN_POSITIVE)).log2().floor() as i32 - 23);
        let ulp = absolute / last_place;
        let of_promise = match promise {
            Promise::Ulp(most) => ulp / most,
            Promise::UlpAndOf(most, more) => ulp / (most + more * argument.abs()),
            Promise::Absolute(power) => absolute / 2_f64.powi(power),
        };
        self.ulp = self.ulp.max(ulp);
        if truth != 0.0 {
            self.relative = self.relative.max(absolute / truth.abs());
        }
        self.absolute = self.absolute.max(absolute);
        self.of_promise = self.of_promise.max(of_promise);
    }
}
