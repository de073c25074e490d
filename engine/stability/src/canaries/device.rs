//! How the device runs invocations, and what it counts.

use super::Canary;
use crate::{Laboratory, StabilityError, bits};
use mica_shaders::constants::STEPS_A_INVOCATION;
use mica_shaders::types::Words;

/// A loop longer than any budget, and short for any device.
const ROUNDS: u32 = 200_000;

pub(super) fn ask(laboratory: &mut Laboratory) -> Result<Vec<Canary>, StabilityError> {
    Ok(vec![loop_limit(laboratory)?, subgroups(laboratory)?, timestamps(laboratory), storage_range(laboratory)])
}

fn loop_limit(laboratory: &mut Laboratory) -> Result<Canary, StabilityError> {
    let asked = [Words { a: [ROUNDS, 1000, 0, 0], b: [0; 4] }];
    let gone = laboratory.words(&asked, bits!(rounds_of_a_loop))?[0];
    let question = "how many rounds of a loop are run when 200,000 are asked for, and of a loop of 1,000 after it?";
    let found = format!("{} and {}", gone[0], gone[1]);
    let means = if gone[0] < ROUNDS {
        format!(
            "this driver ends loops without a word, all loops of 8 invocations together; traversals take at most \
             {STEPS_A_INVOCATION} steps an invocation and stay below"
        )
    } else {
        "no limit met: long traversals are as long here as they are told to be".to_owned()
    };
    Ok(Canary::new("loop_limit", question, found, means))
}

fn subgroups(laboratory: &mut Laboratory) -> Result<Canary, StabilityError> {
    let asked = [Words { a: [0; 4], b: [0; 4] }; 64];
    let size = laboratory.words(&asked, bits!(canary_subgroup))?[0][0];
    Ok(Canary::new(
        "subgroup_size",
        "how many invocations run as one?",
        size.to_string(),
        "nothing for results: no shader counts on it; branches cost least where so many neighbours agree",
    ))
}

fn timestamps(laboratory: &Laboratory) -> Canary {
    let limits = laboratory.executor.device().info().limits;
    let (bits, period_ns) = (limits.timestamp_valid_bits, f64::from(limits.timestamp_period_ns));
    let question = "how many bits of a timestamp count, and how long is a tick?";
    if bits == 0 {
        return Canary::new(
            "timestamps",
            question,
            "none",
            "passes have no times here, only whole frames by the clock",
        );
    }
    let wraps_seconds = 2_f64.powi(bits.min(64) as i32) * period_ns * 1e-9;
    let means = if wraps_seconds > 86_400.0 {
        "times are right for frames of any length".to_owned()
    } else {
        format!("times are right for frames shorter than {wraps_seconds:.0} s: the counter may come round once")
    };
    Canary::new("timestamps", question, format!("{bits} bits of {period_ns} ns"), means)
}

fn storage_range(laboratory: &Laboratory) -> Canary {
    let range = laboratory.executor.device().info().limits.max_storage_buffer_range_bytes;
    let mebibytes = range / (1 << 20);
    let means =
        "larger scenes and tables are refused with an error that names the buffer; drivers would show a part of it";
    Canary::new("storage_range", "how much of a buffer can a shader see?", format!("{mebibytes} MiB"), means)
}
