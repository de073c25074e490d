//! Makes sweeps by their names on the best device there is: `cargo run -p mica-stability --example sweep -- distance`.

use mica_gpu::{Device, DeviceOptions, Executor, Validation};
use mica_stability::{Effort, Laboratory, SWEEPS};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let device = Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })?;
    let mut executor = Executor::new(device.clone())?;
    for (_, make) in SWEEPS.iter().filter(|(name, _)| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name)) {
        let sweep = make(&mut Laboratory { executor: &mut executor, effort: Effort::Quick })?;
        println!("{}: {}", sweep.name, sweep.claim);
        println!(
            "  worst {:.2e}, tolerance {:.2e}{}",
            sweep.worst,
            sweep.tolerance,
            if sweep.holds() { "" } else { ", FAILS" }
        );
        for series in &sweep.series {
            let ends = [series.points.first(), series.points.last()].map(|point| point.copied().unwrap_or_default());
            let values = series.points.iter().map(|(_, y)| *y);
            let (least, most) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
            println!(
                "  {} ({} points, {:?} to {:?}): {least:.3e} to {most:.3e}",
                series.name,
                series.points.len(),
                ends[0],
                ends[1]
            );
        }
    }
    for message in device.take_messages() {
        println!("{message}");
    }
    Ok(())
}
