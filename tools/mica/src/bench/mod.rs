//! `mica bench`: how long the renderer's parts take, measured alone.

mod body;
mod methods;
mod occlusion;
mod rays;
mod report;
mod tables;

use crate::args::BenchArgs;
use crate::error::Failure;

/// Measures what was asked for.
pub fn bench(args: &BenchArgs) -> Result<(), Failure> {
    if args.occlusion { occlusion::occlusion(args) } else { methods::methods(args) }
}
