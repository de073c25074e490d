//! H14. Hashes: duplicates, correlation, dispersion, their twin on the host.

use crate::{Check, Form, Laboratory, Random, StabilityError, bits};
use mica_oracle::flake_set::{hash2, hash3};
use mica_shaders::types::Words;
use std::num::Wrapping;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![twin(laboratory)?, evenness(laboratory)?])
}

/// The Tiny Encryption Algorithm of 8 rounds (Wheeler and Needham 1994).
fn tea(first: u32, second: u32) -> [u32; 2] {
    let (mut first, mut second) = (Wrapping(first), Wrapping(second));
    let keys = [0xa341_316c, 0xc801_3ea4, 0xad90_777d, 0x7e95_761e].map(Wrapping);
    for round in 1..=8 {
        let sum = Wrapping(0x9e37_79b9_u32) * Wrapping(round);
        first += ((second << 4) + keys[0]) ^ (second + sum) ^ ((second >> 5) + keys[1]);
        second += ((first << 4) + keys[2]) ^ (first + sum) ^ ((first >> 5) + keys[3]);
    }
    [first.0, second.0]
}

/// What a device makes of words against what the host makes of them.
fn twin(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(14);
    let edges = [0, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];
    let mut words: Vec<[u32; 3]> = Vec::new();
    for a in edges {
        words.extend(edges.iter().flat_map(|b| edges.map(|c| [a, *b, c])));
    }
    let drawn = laboratory.inputs(1_000_000, 20_000_000);
    words.extend((0..drawn).map(|_| [0; 3].map(|_| (random.bits() >> 32) as u32)));
    let (mut naive, mut stable) = (0, 0);
    for words in words.chunks(1 << 20) {
        let questions: Vec<Words> = words.iter().map(|[a, b, c]| Words { a: [*a, *b, *c, 0], b: [0; 4] }).collect();
        let differing = |answers: Vec<[u32; 4]>, twin: &dyn Fn(&[u32; 3]) -> [u32; 4]| {
            answers.iter().zip(words).filter(|(answer, words)| **answer != twin(words)).count()
        };
        let of_words = |[a, b, c]: &[u32; 3]| {
            let [first, second] = tea(*a, *b);
            [hash2(*a, *b), hash3(*a, *b, *c), first, second]
        };
        let of_sine = |[a, b, _]: &[u32; 3]| {
            let place = *a as i32 as f32 * 12.9898 + *b as i32 as f32 * 78.233;
            let bits = (((place.sin() * 43_758.547).rem_euclid(1.0)) * 16_777_216.0) as u32;
            [bits << 8, bits << 8, 0, 0]
        };
        naive += differing(laboratory.words(&questions, bits!(hash_sine))?, &of_sine);
        stable += differing(laboratory.words(&questions, bits!(hash_words))?, &of_words);
    }
    let share = |differing: usize| differing as f64 / words.len() as f64;
    Ok(Check {
        what: "hashes of two and of three words, and of pairs".to_owned(),
        error_of: "share that the host hashes differently".to_owned(),
        inputs: words.len() as u64,
        naive: Form::new("fract(sin(dot) 43758.5)", share(naive)),
        stable: Form::new("chained mixers of integers", share(stable)),
        tolerance: 0.0,
    })
}

/// How unevenly the values of a square lattice are spread: the worst deviation, in standard deviations, of a histogram, of
/// the correlations of neighbours and of the means of blocks.
fn unevenness(values: &[f64], side: usize) -> f64 {
    const BINS: usize = 1024;
    const BLOCK: usize = 16;
    let count = values.len() as f64;
    let mut histogram = [0.0; BINS];
    for value in values {
        histogram[((value * BINS as f64) as usize).min(BINS - 1)] += 1.0;
    }
    let expected = count / BINS as f64;
    let square: f64 = histogram.iter().map(|seen| (seen - expected).powi(2) / expected).sum();
    let freedom = (BINS - 1) as f64;
    let histogram = (square - freedom) / (2.0 * freedom).sqrt();

    let centred = |x: usize, y: usize| values[y * side + x] - 0.5;
    let correlation = |dx: usize, dy: usize| {
        let places = (0..side - dy).flat_map(|y| (0..side - dx).map(move |x| (x, y)));
        let products: f64 = places.map(|(x, y)| centred(x, y) * centred(x + dx, y + dy)).sum();
        let pairs = ((side - dx) * (side - dy)) as f64;
        12.0 * products / pairs.sqrt()
    };

    let blocks = side / BLOCK;
    let mean = |block: usize| {
        let (left, top) = (block % blocks * BLOCK, block / blocks * BLOCK);
        let inside = (top..top + BLOCK).flat_map(|y| (left..left + BLOCK).map(move |x| centred(x, y)));
        inside.sum::<f64>() / (BLOCK * BLOCK) as f64
    };
    let all = (blocks * blocks) as f64;
    let variance = (0..blocks * blocks).map(|block| mean(block).powi(2)).sum::<f64>() / all;
    let dispersion = (variance * 12.0 * (BLOCK * BLOCK) as f64 - 1.0) * (0.5 * all).sqrt();

    let found = [histogram, correlation(1, 0), correlation(0, 1), correlation(1, 1), correlation(2, 0), dispersion];
    found.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Neighbouring cells, near the origin and far from it.
fn evenness(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let side = laboratory.inputs(512, 1024);
    let (mut naive, mut stable) = (0.0_f64, 0.0_f64);
    let offsets = [0, 100_000, -100_000, 20_000_000];
    for offset in offsets {
        let place = |at: usize| [at % side, at / side].map(|along| (along as i32 + offset) as u32);
        let questions: Vec<Words> = (0..side * side)
            .map(|at| {
                let [x, y] = place(at);
                Words { a: [x, y, 7, 0], b: [0; 4] }
            })
            .collect();
        // The middle of the word's place.
        let values = |answers: Vec<[u32; 4]>| -> Vec<f64> {
            answers.iter().map(|answer| (f64::from(answer[1]) + 0.5) / 4_294_967_296.0).collect()
        };
        let primes = unevenness(&values(laboratory.words(&questions, bits!(hash_primes))?), side);
        let sine = unevenness(&values(laboratory.words(&questions, bits!(hash_sine))?), side);
        naive = naive.max(primes.min(sine));
        stable = stable.max(unevenness(&values(laboratory.words(&questions, bits!(hash_words))?), side));
    }
    Ok(Check {
        what: "hashes of neighbouring cells, up to 2e7 cells from the origin".to_owned(),
        error_of: "unevenness of values, neighbours and blocks, in standard deviations".to_owned(),
        inputs: (offsets.len() * side * side) as u64,
        naive: Form::new("the better of a sine's fraction and of products with primes", naive),
        stable: Form::new("chained mixers of integers", stable),
        // The worst of 24 numbers: beyond 4.5 once in 6,000 families.
        tolerance: 4.5,
    })
}
