//! `mica accuracy`: what methods show, against the truth and against each other.

mod counts;
mod sheet;

use crate::args::AccuracyArgs;
use crate::error::Failure;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use mica_render::{METHODS, MethodInfo, method};

/// Does what was asked for.
pub fn accuracy(args: &AccuracyArgs) -> Result<(), Failure> {
    if !args.counts && args.sheet.is_none() {
        return Err(Failure::bad_input("nothing to do: give --counts, --sheet FILE.png, or both"));
    }
    let methods = chosen(&args.method)?;
    let interrupt = Interrupt::new()?;
    let mut progress = Progress::new(args.quiet);
    // A file that cannot be written is known before anything is computed.
    let sheet = args.sheet.as_deref().map(sheet::Sheet::check).transpose()?;
    if args.counts {
        counts::counts(args, &methods, &interrupt, &mut progress)?;
    }
    if let Some(sheet) = sheet {
        sheet.draw(args, &methods, &interrupt, &mut progress)?;
    }
    Ok(())
}

/// The methods of these names, or all.
fn chosen(names: &[String]) -> Result<Vec<&'static MethodInfo>, Failure> {
    if names.is_empty() {
        return Ok(METHODS.iter().collect());
    }
    Ok(names.iter().map(|name| method(name)).collect::<Result<_, _>>()?)
}
