//! What a compiler makes of sums and products, and what becomes of small numbers.

use super::{Canary, words};
use crate::{Laboratory, StabilityError, bits};

pub(super) fn ask(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    let above = 1.0 + 2_f32.powi(-12);
    let asked = [words([1e8, 1.0, 0.0, 0.0], [0; 4])];
    let lost = f32::from_bits(laboratory.words(&asked, bits!(sum_error_loose))?[0][1]);
    let kept_lost = f32::from_bits(laboratory.words(&asked, bits!(sum_error))?[0][1]);
    let asked = [words([above, above * above, 0.0, 0.0], [0; 4])];
    let [loose, strict, ..] = laboratory.words(&asked, bits!(canary_products))?[0].map(f32::from_bits);
    let least = f32::MIN_POSITIVE;
    let denormal = f32::from_bits(0x0001_2345);
    let asked = [words([least, denormal, 0.0, 2_f32.powi(40)], [0; 4])];
    let small = laboratory.words(&asked, bits!(canary_denormals))?[0].map(f32::from_bits);
    Ok(vec![reassociation(lost, kept_lost), contraction(loose), fused(strict), denormals(denormal, small)])
}

fn reassociation(lost: f32, kept_lost: f32) -> Canary {
    let question = "is what rounding loses of 1e8 + 1 found by a sum of differences, without and with `precise`?";
    let says = |lost: f32| if lost == 1.0 { "yes" } else { "no, it is rewritten" };
    let means = match (lost == 1.0, kept_lost == 1.0) {
        (_, false) => "`precise` is not obeyed: exact tests of flakes near edges may go wrong here",
        (true, true) => "sums are as written, also where nothing says that they must be",
        (false, true) => "sums without `precise` are reassociated; those that need their order have it",
    };
    Canary::new("reassociation", question, format!("{}, {}", says(lost), says(kept_lost)), means)
}

fn contraction(loose: f32) -> Canary {
    let question = "is a product rounded before something is added to it, without `precise`?";
    if loose == 0.0 {
        Canary::new("contraction", question, "yes", "sums of products have two roundings, as on the host")
    } else {
        let means = "sums of products have one rounding: pictures differ from another device's in last digits";
        Canary::new("contraction", question, "no, it is contracted", means)
    }
}

fn fused(strict: f32) -> Canary {
    let question = "does fma(x, y, z) round once?";
    if strict == 0.0 {
        let means = "fma is a product and a sum: what rounding loses is found by Dekker's products instead";
        Canary::new("fma", question, "no, it is not fused", means)
    } else {
        Canary::new("fma", question, "yes, it is fused", "fma is exact to one rounding; no shader counts on it")
    }
}

fn denormals(denormal: f32, found: [f32; 4]) -> Canary {
    let question = "are floats below 1.2e-38 kept when read, halved into, added to 0 and scaled up?";
    let expected = [denormal, 0.5 * f32::MIN_POSITIVE, denormal, denormal * 2_f32.powi(40)];
    let kept = found.iter().zip(expected).map(|(found, expected)| if *found == expected { "kept" } else { "flushed" });
    let kept: Vec<&str> = kept.collect();
    let means = "nothing for results: pictures are the same with all of them flushed";
    Canary::new("denormals", question, kept.join(", "), means)
}
