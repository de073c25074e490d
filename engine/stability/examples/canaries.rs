//! Asks the best device there is what its arithmetic does: `cargo run -p mica-stability --example canaries`.

use mica_gpu::{Device, DeviceOptions, Executor, Validation};
use mica_stability::{Effort, Laboratory, canaries};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let device = Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })?;
    let mut executor = Executor::new(device.clone())?;
    for canary in canaries(&mut Laboratory { executor: &mut executor, effort: Effort::Quick })? {
        println!("{}: {}\n  {}\n  {}", canary.name, canary.question, canary.found, canary.means);
    }
    for message in device.take_messages() {
        println!("{message}");
    }
    Ok(())
}
