//! `mica bench`: how long the renderer's parts take, measured alone.

mod args;
mod body;
mod coverage;
mod methods;
mod occlusion;
mod rays;
mod report;
mod tables;
mod wdh20;

pub use args::BenchArgs;

use crate::error::Failure;
use crate::interrupt::Interrupt;
use args::Paper;

/// Measures what was asked for.
pub fn bench(args: &BenchArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    match args.paper {
        Some(Paper::Wdh20) => wdh20::wdh20(args, interrupt),
        None if args.coverage => coverage::coverage(args, interrupt),
        None if args.occlusion => occlusion::occlusion(args, interrupt),
        None => methods::methods(args, interrupt),
    }
}
