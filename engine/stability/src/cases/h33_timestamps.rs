//! H33. Timestamps that wrap.
//!
//! A family of queues whose timestamps have no bits measures no time: `Limits::timestamp_valid_bits` is 0 then, each
//! `PassTime::ns` is `None`, and reports say so (`mica doctor`: "measures no time").

use crate::{Check, Form, Laboratory, Random, StabilityError, share_wrong};
use mica_gpu::elapsed_ns;

/// Measures it, on the host.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    let mut random = Random::new(34);
    let (mut differences, mut understood, mut truth) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..laboratory.inputs(100_000, 10_000_000) {
        // 36 bits are what Vulkan promises where there are any.
        let valid_bits = 36 + (random.bits() % 29) as u32;
        let period = [1.0_f32, 10.0, 41.666_668, 0.5][(random.bits() % 4) as usize];
        // Ticks of a counter of more bits than count, and a frame of at most a minute: fewer ticks than 2^36.
        let began = u128::from(random.bits());
        let lasted = random.log_between(1.0, (6e10 / f64::from(period)).min(6.8e10)) as u64;
        let mask = (1_u128 << valid_bits) - 1;
        let garbage = if valid_bits == 64 { 0 } else { random.bits() & !(mask as u64) };
        let from = (began & mask) as u64 | garbage;
        let to = ((began + u128::from(lasted)) & mask) as u64 | (garbage >> 1 & !(mask as u64));
        let in_ns = |ticks: u64| (ticks as f64 * f64::from(period)).round() as u64;
        differences.push(in_ns(to.saturating_sub(from)));
        understood.push(elapsed_ns(from, to, valid_bits, period));
        truth.push(in_ns(lasted));
    }
    Ok(vec![Check {
        what: "times of up to a minute by counters of 36 to 64 bits, wherever they begin".to_owned(),
        error_of: "share of times that are wrong".to_owned(),
        inputs: truth.len() as u64,
        naive: Form::new("to - from", share_wrong(&differences, &truth)),
        stable: Form::new("(to - from) & mask", share_wrong(&understood, &truth)),
        tolerance: 0.0,
    }])
}
