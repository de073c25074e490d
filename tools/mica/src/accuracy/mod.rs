//! `mica accuracy`: what methods show, against the truth and against each other.

mod counts;
mod exactness;
mod sheet;

use crate::args::AccuracyArgs;
use crate::error::Failure;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::study;
use crate::{output, page};
use mica_render::{METHODS, MethodInfo, method};

/// Does what was asked for.
pub fn accuracy(args: &AccuracyArgs) -> Result<(), Failure> {
    if let (true, Some(folder)) = (args.redraw, &args.output) {
        let written = page::write(folder)?;
        let paths: Vec<String> = written.iter().map(|path| format!("{}\n", path.display())).collect();
        return if args.quiet { Ok(()) } else { output::print(&paths.concat()) };
    }
    let is_study = !args.counts && !args.exactness && args.sheet.is_none();
    if is_study && args.output.is_none() {
        return Err(Failure::bad_input(
            "nothing to do: give -o DIR for a study, --counts, --exactness, or --sheet FILE.png",
        ));
    }
    let methods = chosen(&args.method)?;
    let interrupt = Interrupt::new()?;
    let mut progress = Progress::new(args.quiet);
    if let Some(folder) = args.output.as_deref().filter(|_| is_study) {
        return study::study(args, folder, &methods, &interrupt, &mut progress);
    }
    // A file that cannot be written is known before anything is computed.
    let sheet = args.sheet.as_deref().map(|path| sheet::Sheet::check(path, &args.size)).transpose()?;
    if args.counts {
        counts::counts(args, &methods, &interrupt, &mut progress)?;
    }
    if args.exactness {
        exactness::exactness(args, true, &interrupt, &mut progress)?;
    }
    if let Some(sheet) = sheet {
        sheet.draw(args, &methods, &interrupt, &mut progress)?;
    }
    Ok(())
}

/// The methods of these names, or all.
pub fn chosen(names: &[String]) -> Result<Vec<&'static MethodInfo>, Failure> {
    if names.is_empty() {
        return Ok(METHODS.iter().collect());
    }
    Ok(names.iter().map(|name| method(name)).collect::<Result<_, _>>()?)
}
