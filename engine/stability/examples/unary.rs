//! Tries functions of one number on the best device there is: `cargo run -p mica-stability --example unary [-- full]`.

use mica_gpu::{Device, DeviceOptions, Executor};
use mica_stability::{Effort, Laboratory, unary};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let effort = if std::env::args().any(|word| word == "full") { Effort::Full } else { Effort::Quick };
    let mut executor = Executor::new(Device::new(&DeviceOptions::default())?)?;
    unary(&mut Laboratory { executor: &mut executor, effort }, |line| {
        let verdict = if line.holds() { "holds" } else { "FAILS" };
        println!(
            "{} ({}, {} inputs): {:.2e} at {:e}, bound {:.1e}, {verdict}; {}",
            line.helper, line.domain, line.inputs, line.worst, line.at, line.bound, line.error_of
        );
    })?;
    Ok(())
}
