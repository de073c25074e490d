//! `mica stability`: the hard cases on a device, naive forms and stable ones side by side.

mod cost;
mod report;
mod sweeps;

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
    /// As many inputs as say something new, in place of as many as take a second.
    #[arg(long)]
    pub full: bool,
    /// Measures too what stable forms cost: whole frames with those of microfacets, chances and areas over frames with naive
    /// ones.
    #[arg(long)]
    pub cost: bool,
    /// In place of the cases: sweeps over wide ranges of distance, number of flakes, angles, roughness, texture coordinates
    /// and anisotropy, as charts (SVG and PNG) and lines of JSON in this folder.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["case", "cost", "json"])]
    pub sweeps: Option<PathBuf>,
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
pub fn stability(args: &StabilityArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let destination = args.json.as_deref().filter(|_| !to_stdout).map(Destination::check).transpose()?;
    let device = Device::new(&DeviceOptions { select: args.device.clone(), ..DeviceOptions::default() })?;
    let wanted: Vec<&Case> =
        CASES.iter().filter(|case| args.case.is_empty() || args.case.iter().any(|id| id == case.id)).collect();
    let mut progress = Progress::new(args.quiet);
    let effort = if args.full { Effort::Full } else { Effort::Quick };
    let mut runs = executor(device.clone(), None, None)?;
    interrupt.defer();
    if let Some(folder) = &args.sweeps {
        let mut laboratory = Laboratory { executor: &mut runs, effort };
        let beyond = sweeps::draw(folder, &mut laboratory, (interrupt, &mut progress, args.quiet))?;
        return within_tolerance(&device.info().name, &beyond);
    }
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
    let mut cost = Vec::new();
    let whole = if args.cost && !interrupt.requested() {
        cost::measure(args, interrupt, &mut progress, &mut cost)
    } else {
        Ok(())
    };
    progress.clear();
    let mut report = StabilityReport::new(device.info(), effort, cases, wanted.len());
    report.cost = cost;
    if to_stdout {
        output::print_json(&report)?;
    } else {
        if !args.quiet {
            output::print(&for_people(&report))?;
            if !report.cost.is_empty() {
                output::print(&cost::for_people(&report.cost))?;
            }
        }
        if let Some(destination) = &destination {
            destination.write(output::json(&report)?.as_bytes())?;
        }
    }
    whole?;
    if interrupt.requested() {
        let message = format!("interrupted after {} of {} cases", report.cases.len(), wanted.len());
        return Err(Failure::with_code(INTERRUPTED, message));
    }
    let beyond: Vec<String> = report.cases.iter().filter(|case| !case.holds).map(|case| case.id.to_owned()).collect();
    within_tolerance(&device.info().name, &beyond)
}

fn within_tolerance(device: &str, beyond: &[String]) -> Result<(), Failure> {
    if beyond.is_empty() {
        return Ok(());
    }
    let message = format!("{device} does not keep {} within tolerance", beyond.join(", "));
    Err(Failure::with_code(NO_DEVICE, message))
}
