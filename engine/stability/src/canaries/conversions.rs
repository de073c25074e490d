//! Integers at their edges, and half floats.

use super::{Canary, shown};
use crate::{Laboratory, StabilityError, bits};
use mica_shaders::types::Words;

pub(super) fn ask(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    Ok(vec![floats_to_integers(laboratory)?, shifts(laboratory)?, half_floats(laboratory)?])
}

fn floats_to_integers(laboratory: &mut Laboratory) -> Result<Canary, StabilityError> {
    let numbers = [3e9, f32::NAN, f32::NEG_INFINITY, -1.5, 5e9];
    let asked: Vec<Words> = numbers.iter().map(|x| Words { a: [1, 0, 1, 0], b: [x.to_bits(), 0, 0, 0] }).collect();
    let answers = laboratory.words(&asked, bits!(edges_plain))?;
    let int = |at: usize| format!("int({}) = {}", shown(numbers[at].to_bits()), answers[at][2].cast_signed());
    let uint = |at: usize| format!("uint({}) = {}", shown(numbers[at].to_bits()), answers[at][3]);
    let saturates = answers[3][3] == 0 && answers[4][3] == u32::MAX && answers[0][2].cast_signed() == i32::MAX;
    let means = if saturates {
        "they saturate, as on most devices; other devices do not, so no shader may count on it"
    } else {
        "they do not saturate, as they do on most GPUs: no shader may count on either"
    };
    let question = "what are conversions of floats out of range?";
    let found = [int(0), int(1), int(2), uint(3), uint(4)].join(", ");
    Ok(Canary::new("float_to_integer", question, found, means))
}

fn shifts(laboratory: &mut Laboratory) -> Result<Canary, StabilityError> {
    let asked = [Words { a: [1, 32, 1, 0], b: [0; 4] }, Words { a: [7, 0, 0, 0], b: [0; 4] }];
    let answers = laboratory.words(&asked, bits!(edges_plain))?;
    Ok(Canary::new(
        "integer_edges",
        "what are 1 << 32 and 7 / 0?",
        format!("1 << 32 = {}, 7 / 0 = {}", answers[0][0], answers[1][1]),
        "another device has other answers: no shader may shift by 32 or divide by 0",
    ))
}

/// Half floats have 11 bits; their least normal one is 2^-14, their least denormal 2^-24.
fn half_floats(laboratory: &mut Laboratory) -> Result<Canary, StabilityError> {
    let unit = 2_f32.powi(-10);
    // Halfway between two half floats, of which the even one is below or above; overflow and underflow.
    let asked = [[1.0 + 0.5 * unit, 1.0 + 1.5 * unit], [65519.0, 65520.0], [2_f32.powi(-20), 2.9e-8]];
    let asked = asked.map(|x| Words { a: [x[0].to_bits(), x[1].to_bits(), 0, 0], b: [0; 4] });
    let answers = laboratory.words(&asked, bits!(halves_plain))?;
    let halves = |at: usize| [answers[at][0] & 0xffff, answers[at][0] >> 16];
    let rounding = match halves(0) {
        [0x3c00, 0x3c02] => "to nearest, ties to even",
        [0x3c00, 0x3c01] => "towards 0",
        [0x3c01, 0x3c02] => "to nearest, ties away from 0",
        _ => "in another way",
    };
    let name = |half: u32| match half & 0x7fff {
        0x7c00 => "inf".to_owned(),
        0x7bff => "65504".to_owned(),
        0 => "0".to_owned(),
        other => format!("{other:#06x}"),
    };
    let [high, over] = halves(1);
    let [denormal, under] = halves(2);
    let found = format!(
        "{rounding}; 65519 = {}, 65520 = {}; 2^-20 is {}, 2.9e-8 = {}",
        name(high),
        name(over),
        if denormal == 0x10 { "kept" } else { "flushed" },
        name(under)
    );
    let means = "half floats hold only numbers within 65504 here, clamped before they are stored; light is kept in f32";
    Ok(Canary::new("half_floats", "how are floats rounded to half floats?", found, means))
}
