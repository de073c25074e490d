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
use mica_stability::{CASES, Case, Effort, Laboratory, Trial};
use report::{CaseReport, StabilityReport, for_people, helpers_for_people};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `mica stability`.
#[derive(Debug, Args)]
#[command(
    after_long_help = "A case is a place where a naive form of a computation loses its digits, its energy or its way. Each is run on the \
    device with inputs that are hard for it, as the renderer has it (stable) and as it would be written down first (naive), and held \
    against f64. Of a case with several checks, the table shows the one whose stable form comes closest to its tolerance; \
    --json has all. Small functions of one number, such as log_one_minus, are tried with --full, each on all of its words \
    (1.5 x 10^10 in all, some ten minutes on two cores), or by their names on 10^8. What is finished is kept if the run is \
    interrupted, and --resume goes on from there. Exit code 3 if a stable form is beyond its tolerance on this device."
)]
pub struct StabilityArgs {
    /// Cases to measure, such as H05, or functions of one number, such as unit_from. Default: all cases, and with --full
    /// all functions.
    #[arg(value_name = "CASE", value_parser = case)]
    pub case: Vec<String>,
    /// As many inputs as say something new, in place of as many as take a second; of functions of one number, all.
    #[arg(long)]
    pub full: bool,
    /// Measures too what stable forms cost: whole frames with those of microfacets, chances and areas over frames with naive
    /// ones.
    #[arg(long)]
    pub cost: bool,
    /// In place of the cases: sweeps over wide ranges of distance, number of flakes, angles, roughness, texture coordinates
    /// and anisotropy, as charts (SVG and PNG) and lines of JSON in this folder.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["case", "cost", "json", "resume"])]
    pub sweeps: Option<PathBuf>,
    /// Writes what was found as JSON, anew after each case; `-` is stdout, in place of the table.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Takes what an earlier run of the same build found on the same device from its JSON, and goes on with the rest.
    #[arg(long, value_name = "FILE", conflicts_with = "cost")]
    pub resume: Option<PathBuf>,
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
    let helpers: Vec<&str> = Trial::all(Effort::Quick).iter().map(Trial::name).collect();
    match (CASES.iter().any(|case| case.id == id), helpers.contains(&text)) {
        (true, _) => Ok(id),
        (_, true) => Ok(text.to_owned()),
        _ => Err(format!("expected {} to {}, or {}", CASES[0].id, CASES[CASES.len() - 1].id, helpers.join(", "))),
    }
}

/// Measures, writes and prints. What was measured before Ctrl-C is kept; a case that cannot be measured does not hold.
pub fn stability(args: &StabilityArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let destination = args.json.as_deref().filter(|_| !to_stdout).map(Destination::check).transpose()?;
    let device = Device::new(&DeviceOptions { select: args.device.clone(), ..DeviceOptions::default() })?;
    let mut progress = Progress::new(args.quiet);
    let effort = if args.full { Effort::Full } else { Effort::Quick };
    if let Some(folder) = &args.sweeps {
        let mut runs = executor(device.clone(), None, None)?;
        interrupt.defer();
        let mut laboratory = Laboratory { executor: &mut runs, effort };
        let beyond = sweeps::draw(folder, &mut laboratory, (interrupt, &mut progress, args.quiet))?;
        return within_tolerance(&device.info().name, &beyond);
    }
    let named = |name: &str| args.case.iter().any(|wanted| wanted == name);
    let wanted: Vec<&Case> = CASES.iter().filter(|case| args.case.is_empty() || named(case.id)).collect();
    let trials =
        Trial::all(effort).into_iter().filter(|trial| (args.full && args.case.is_empty()) || named(trial.name()));
    let trials: Vec<Trial> = trials.collect();
    let mut report = StabilityReport::new(device.info(), effort, wanted.len());
    if let Some(path) = &args.resume {
        let failed = |why: String| Failure::bad_input(format!("{}: {why}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let names: Vec<&str> = trials.iter().map(Trial::name).collect();
        report.resume(&text, &wanted, &names).map_err(failed)?;
    }
    interrupt.defer();
    let run = Run { args, device: &device, destination: destination.as_ref(), interrupt };
    let ended = run.measure(&wanted, trials, &mut report, &mut progress);
    progress.clear();
    run.show(&report, to_stdout)?;
    ended?;
    let cases = report.cases.iter().filter(|case| !case.holds).map(|case| case.id.to_owned());
    let helpers = report.helpers.iter().filter(|line| !line.holds()).map(|line| line.helper.clone());
    within_tolerance(&device.info().name, &cases.chain(helpers).collect::<Vec<_>>())
}

/// What a run is asked for.
struct Run<'a> {
    args: &'a StabilityArgs,
    device: &'a Arc<Device>,
    destination: Option<&'a Destination>,
    interrupt: &'a Interrupt,
}

impl Run<'_> {
    /// Measures what the report does not have yet; what was measured before a failure is in it.
    fn measure(
        &self,
        wanted: &[&Case],
        trials: Vec<Trial>,
        report: &mut StabilityReport,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let effort = if self.args.full { Effort::Full } else { Effort::Quick };
        let mut runs = executor(self.device.clone(), None, None)?;
        let all = trials.len();
        for (number, case) in (1..).zip(wanted) {
            if report.cases.iter().any(|done| done.id == case.id) {
                continue;
            }
            self.go_on(report, (wanted.len(), all))?;
            let title = format!("{} {} ({number} of {})", case.id, case.title, wanted.len());
            let mut laboratory = Laboratory { executor: &mut runs, effort };
            let checks = progress.during(&title, || (case.measure)(&mut laboratory));
            if checks.is_err() {
                // A device that was lost with a frame does not serve the next case.
                runs = executor(self.device.clone(), None, None)?;
            }
            report.push(CaseReport::new(case, checks));
            self.keep(report)?;
        }
        for mut trial in trials {
            if report.helpers.iter().any(|done| done.helper == trial.name()) {
                continue;
            }
            let line = loop {
                self.go_on(report, (wanted.len(), all))?;
                let [tried, words] = trial.progress();
                progress.update(trial.name(), tried, words);
                if let Some(line) = trial.step(&mut Laboratory { executor: &mut runs, effort })? {
                    break line;
                }
            };
            report.helpers.push(line);
            self.keep(report)?;
        }
        if self.args.cost {
            self.go_on(report, (wanted.len(), all))?;
            cost::measure(self.args, self.interrupt, progress, &mut report.cost)?;
        }
        Ok(())
    }

    /// An error if somebody wants it to end.
    fn go_on(&self, report: &StabilityReport, (cases, helpers): (usize, usize)) -> Result<(), Failure> {
        if !self.interrupt.requested() {
            return Ok(());
        }
        let done = [(report.cases.len(), cases, "cases"), (report.helpers.len(), helpers, "functions")];
        let done = done.into_iter().filter(|(_, all, _)| *all > 0);
        let done: Vec<String> = done.map(|(done, all, what)| format!("{done} of {all} {what}")).collect();
        Err(Failure::with_code(INTERRUPTED, format!("interrupted after {}", done.join(" and "))))
    }

    /// Writes the file of JSON, if one is wanted.
    fn keep(&self, report: &StabilityReport) -> Result<(), Failure> {
        match self.destination {
            Some(destination) => destination.write(output::json(report)?.as_bytes()),
            None => Ok(()),
        }
    }

    fn show(&self, report: &StabilityReport, to_stdout: bool) -> Result<(), Failure> {
        if to_stdout {
            return output::print_json(report);
        }
        if !self.args.quiet {
            let mut parts = Vec::new();
            if !report.cases.is_empty() {
                parts.push(for_people(report));
            }
            if !report.helpers.is_empty() {
                parts.push(helpers_for_people(report));
            }
            if !report.cost.is_empty() {
                parts.push(cost::for_people(&report.cost));
            }
            output::print(&parts.join("\n"))?;
        }
        self.keep(report)
    }
}

fn within_tolerance(device: &str, beyond: &[String]) -> Result<(), Failure> {
    if beyond.is_empty() {
        return Ok(());
    }
    let message = format!("{device} does not keep {} within tolerance", beyond.join(", "));
    Err(Failure::with_code(NO_DEVICE, message))
}
