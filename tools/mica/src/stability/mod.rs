//! `mica stability`: the hard cases on a device, naive forms and stable ones side by side.

mod report;

use crate::error::{Failure, INTERRUPTED, NO_DEVICE};
use crate::interrupt::Interrupt;
use crate::output::{self, Destination};
use crate::progress::Progress;
use crate::session::executor;
use clap::Args;
use mica_gpu::{Device, DeviceOptions};
use mica_stability::{CASES, Case, Effort, Laboratory};
use report::{CaseReport, StabilityReport, for_people};
use std::path::{Path, PathBuf};

/// `mica stability`.
#[derive(Debug, Args)]
#[command(
    after_long_help = "A case is a place where a naive form of a computation loses its digits, its energy or its way. Each is run on the \
    device with inputs that are hard for it, as the renderer has it (stable) and as it would be written down first (naive), and held \
    against f64. Of a case with several checks, the table shows the one whose stable form comes closest to its tolerance; \
    --json has all. Exit code 3 if a stable form is beyond its tolerance on this device."
)]
pub struct StabilityArgs {
    /// Cases to measure, such as H05. Default: all.
    #[arg(value_name = "CASE", value_parser = case)]
    pub case: Vec<String>,
    /// As many inputs as say something new, in place of as many as take a second: of functions of one number, all of them.
    #[arg(long)]
    pub full: bool,
    /// Writes what was found as JSON; `-` is stdout, in place of the table.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// A device, by its number or a part of its name or of its driver's name and version (see `mica doctor`). Default:
    /// the best there is.
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Prints neither table nor progress.
    #[arg(long)]
    pub quiet: bool,
}

fn case(text: &str) -> Result<String, String> {
    let id = text.to_uppercase();
    match CASES.iter().any(|case| case.id == id) {
        true => Ok(id),
        false => Err(format!("expected {} to {}", CASES[0].id, CASES[CASES.len() - 1].id)),
    }
}

/// Measures, writes and prints. What was measured before Ctrl-C is kept; a case that cannot be measured does not hold.
pub fn stability(args: &StabilityArgs) -> Result<(), Failure> {
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let destination = args.json.as_deref().filter(|_| !to_stdout).map(Destination::check).transpose()?;
    let device = Device::new(&DeviceOptions { select: args.device.clone(), ..DeviceOptions::default() })?;
    let wanted: Vec<&Case> =
        CASES.iter().filter(|case| args.case.is_empty() || args.case.iter().any(|id| id == case.id)).collect();
    let interrupt = Interrupt::new()?;
    let mut progress = Progress::new(args.quiet);
    let effort = if args.full { Effort::Full } else { Effort::Quick };
    let mut runs = executor(device.clone(), None, None)?;
    interrupt.defer();
    let mut cases = Vec::new();
    for case in wanted.iter().take_while(|_| !interrupt.requested()) {
        let title = format!("{} {} ({} of {})", case.id, case.title, cases.len() + 1, wanted.len());
        let mut laboratory = Laboratory { executor: &mut runs, effort };
        let checks = progress.during(&title, || (case.measure)(&mut laboratory));
        if checks.is_err() {
            // A device that was lost with a frame does not serve the next case.
            runs = executor(device.clone(), None, None)?;
        }
        cases.push(CaseReport::new(case, checks));
    }
    progress.clear();
    let report = StabilityReport::new(device.info(), effort, cases, wanted.len());
    if to_stdout {
        output::print_json(&report)?;
    } else {
        if !args.quiet {
            output::print(&for_people(&report))?;
        }
        if let Some(destination) = &destination {
            destination.write(output::json(&report)?.as_bytes())?;
        }
    }
    if interrupt.requested() {
        let message = format!("interrupted after {} of {} cases", report.cases.len(), wanted.len());
        return Err(Failure::with_code(INTERRUPTED, message));
    }
    let beyond: Vec<&str> = report.cases.iter().filter(|case| !case.holds).map(|case| case.id).collect();
    if beyond.is_empty() {
        return Ok(());
    }
    let message = format!("{} does not keep {} within tolerance", device.info().name, beyond.join(", "));
    Err(Failure::with_code(NO_DEVICE, message))
}
