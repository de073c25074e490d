//! `mica accuracy`: what methods show, against the truth and against each other.

mod args;
mod counts;
mod exactness;
mod sheet;

pub use args::AccuracyArgs;

use crate::error::Failure;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::study::{self, Folder};
use crate::{output, page};
use mica_render::{METHODS, MethodInfo, method};
use std::path::Path;

/// Does what was asked for.
pub fn accuracy(args: &AccuracyArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    if let (true, Some(folder)) = (args.redraw, &args.output) {
        return draw(args, folder);
    }
    let is_study = !args.counts && !args.exactness && args.sheet.is_none();
    if is_study && args.output.is_none() {
        return Err(Failure::bad_input(
            "nothing to do: give -o DIR for a study, --counts, --exactness, or --sheet FILE.png",
        ));
    }
    let methods = chosen(&args.method)?;
    let mut progress = Progress::new(args.quiet);
    if let Some(folder) = args.output.as_deref().filter(|_| is_study) {
        let mut folder = Folder::open(folder)?;
        let points = study::study(args, &mut folder, &methods, interrupt, &mut progress);
        // Who asks for certain methods or scenes asks for nothing else.
        let whole = args.scene.is_empty() && args.method.is_empty() && points.is_ok();
        let charts = if whole { exactness::exactness(args, false, interrupt, &mut progress) } else { Ok(()) };
        // What was measured is shown, whatever became of the rest.
        let drawn = if folder.points.all.is_empty() { Ok(()) } else { draw(args, &folder.path) };
        return points.and(charts).and(drawn);
    }
    // A file that cannot be written is known before anything is computed.
    let sheet = args.sheet.as_deref().map(|path| sheet::Sheet::check(path, &args.size)).transpose()?;
    if args.counts {
        counts::counts(args, &methods, interrupt, &mut progress)?;
    }
    if args.exactness {
        exactness::exactness(args, true, interrupt, &mut progress)?;
    }
    if let Some(sheet) = sheet {
        sheet.draw(args, &methods, interrupt, &mut progress)?;
    }
    Ok(())
}

/// The report of a study.
fn draw(args: &AccuracyArgs, folder: &Path) -> Result<(), Failure> {
    let written = page::write(folder)?;
    let Some((page, plots)) = written.split_first().filter(|_| !args.quiet) else { return Ok(()) };
    output::print(&format!("{}, and {} files in plots/\n", page.display(), plots.len()))
}

/// The methods of these names, or all.
pub fn chosen(names: &[String]) -> Result<Vec<&'static MethodInfo>, Failure> {
    if names.is_empty() {
        return Ok(METHODS.iter().collect());
    }
    Ok(names.iter().map(|name| method(name)).collect::<Result<_, _>>()?)
}
