//! Measures hard cases by their numbers on the best device there is: `cargo run -p mica-stability --example case -- H05`.

use mica_gpu::{Device, DeviceOptions, Executor, Validation};
use mica_stability::{CASES, Effort, Laboratory};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let device = Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })?;
    let mut executor = Executor::new(device.clone())?;
    for case in CASES.iter().filter(|case| wanted.is_empty() || wanted.iter().any(|id| id == case.id)) {
        println!("{} {}", case.id, case.title);
        for check in (case.measure)(&mut Laboratory { executor: &mut executor, effort: Effort::Quick })? {
            let [naive, stable] = [&check.naive, &check.stable];
            println!("  {} ({} inputs; {})", check.what, check.inputs, check.error_of);
            println!("    naive  {:.2e}  {}", naive.worst, naive.form);
            println!("    stable {:.2e}  {} (tolerance {:.2e})", stable.worst, stable.form, check.tolerance);
            println!("    {}", if check.holds() && check.has_teeth() { "holds, with teeth" } else { "FAILS" });
        }
    }
    for message in device.take_messages() {
        println!("{message}");
    }
    Ok(())
}
