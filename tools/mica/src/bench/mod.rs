//! `mica bench`: how long the renderer's parts take, measured alone.

mod body;
mod methods;
mod occlusion;
mod rays;
mod report;
mod tables;
mod wdh20;

use crate::args::{BenchArgs, Paper};
use crate::error::Failure;

/// Measures what was asked for.
pub fn bench(args: &BenchArgs) -> Result<(), Failure> {
    match args.paper {
        Some(Paper::Wdh20) => wdh20::wdh20(args),
        None if args.occlusion => occlusion::occlusion(args),
        None => methods::methods(args),
    }
}
