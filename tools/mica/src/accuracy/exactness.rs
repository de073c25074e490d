//! `mica accuracy --exactness`: what each exactness costs on its own, error against nanoseconds.

use super::AccuracyArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::output;
use crate::progress::Progress;
use crate::session::{cache, device, executor};
use crate::study::{Lines, machine};
use crate::table::{Column, table};
use mica_accuracy::Machine;
use mica_accuracy::exactness::{Chart, EXACTNESS_SCHEMA, Effort, ExactnessError, ExactnessLine, measure};
use std::path::Path;

/// The file of a study's folder.
const FILE: &str = "exactness.jsonl";

/// Measures, appends to the file and prints, a chart at a time: those that were asked for `anew`, or those that the folder
/// has no lines of from this machine. What was measured before Ctrl-C or a failure is kept.
pub fn exactness(
    args: &AccuracyArgs,
    anew: bool,
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let mut lines = args.output.as_deref().map(open).transpose()?;
    let device = device(&args.device)?;
    let machine = machine(device.info(), "none");
    let kept = cache(&args.device);
    let mut executor = executor(device, kept.as_ref(), args.device.memory)?;
    let effort = if args.quick { Effort::QUICK } else { Effort::FULL };
    let there = lines.as_ref().filter(|_| !anew).map_or(&[][..], |lines| &lines.all);
    let wanted = wanted(&args.chart, there, &machine);
    interrupt.defer();
    for (done, chart) in wanted.iter().enumerate() {
        if interrupt.requested() {
            let why = format!("interrupted after {done} of {} charts, which were kept", wanted.len());
            return Err(Failure::with_code(INTERRUPTED, why));
        }
        let mut show = |what: &str, done, total| progress.update(what, done, total);
        let measured = measure(*chart, &mut executor, &effort, &machine, &mut show)?;
        progress.clear();
        if let Some(lines) = &mut lines {
            measured.iter().try_for_each(|line| lines.add(line.clone()))?;
        }
        if !args.quiet {
            output::print(&for_people(*chart, &measured))?;
        }
    }
    match args.output.as_deref().filter(|_| !args.quiet && !wanted.is_empty()) {
        Some(folder) => output::print(&format!("{}\n", folder.join(FILE).display())),
        None => Ok(()),
    }
}

/// The charts of these names, or all, of which there are no lines from this machine yet.
fn wanted(asked: &[Chart], there: &[ExactnessLine], machine: &Machine) -> Vec<Chart> {
    // Some charts ask about occlusion, and say who answered.
    let is_same = |of: &Machine| Machine { occlusion: machine.occlusion.clone(), ..of.clone() } == *machine;
    let is_there = |chart: &Chart| there.iter().any(|line| line.chart == chart.name() && is_same(&line.machine));
    let is_asked_for = |chart: &Chart| asked.is_empty() || asked.contains(chart);
    Chart::ALL.into_iter().filter(|chart| is_asked_for(chart) && !is_there(chart)).collect()
}

fn open(folder: &Path) -> Result<Lines<ExactnessLine>, Failure> {
    output::make_folder(folder)?;
    let mut lines = Lines::<ExactnessLine>::open(&folder.join(FILE))?;
    lines.all.retain(|line| line.schema == EXACTNESS_SCHEMA);
    Ok(lines)
}

impl From<ExactnessError> for Failure {
    fn from(error: ExactnessError) -> Self {
        match error {
            ExactnessError::Gpu(error) => error.into(),
            ExactnessError::Render(error) => error.into(),
            ExactnessError::Stage(error) => error.into(),
            ExactnessError::Setting(error) => error.into(),
            ExactnessError::Scene(error) => Self::bad_input(error.to_string()),
            ExactnessError::Oracle(error) => Self::bad_input(error.to_string()),
            error @ ExactnessError::NoClock { .. } => Self::with_code(3, error.to_string()),
        }
    }
}

/// A chart as a table, each case with what its errors are of.
fn for_people(chart: Chart, lines: &[ExactnessLine]) -> String {
    let cells: Vec<Vec<String>> = lines
        .iter()
        .enumerate()
        .map(|(index, line)| {
            let is_first = index == 0 || lines[index - 1].case != line.case;
            vec![
                if is_first { line.case.clone() } else { String::new() },
                line.rung.clone(),
                format!("{:.1e}", line.error.value),
                format!("{:.1e}", line.error.high),
                format!("{:.2}", line.ns.value),
                format!("{:.2} to {:.2}", line.ns.low, line.ns.high),
                if is_first { line.error_of.clone() } else { String::new() },
            ]
        })
        .collect();
    let columns = [
        Column::Left(chart.name()),
        Column::Left("rung"),
        Column::Right("error"),
        Column::Right("high"),
        Column::Right("ns"),
        Column::Right("least to most"),
        Column::Left("error of"),
    ];
    let per = lines.first().map(|line| line.per.clone()).unwrap_or_default();
    format!("{}ns: of {per}\n\n", table(&columns, &cells))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_accuracy::Estimate;

    fn machine(device: &str, occlusion: &str) -> Machine {
        let [device, occlusion] = [device, occlusion].map(str::to_owned);
        Machine { device, occlusion, driver: "driver".to_owned(), build: "build".to_owned() }
    }

    fn line(chart: Chart, machine: Machine) -> ExactnessLine {
        let [schema, case, rung, what, error_of, per] = [(); 6].map(|()| String::new());
        let (error, ns) = (Estimate::exact(1.0), Estimate::exact(1.0));
        ExactnessLine { schema, chart: chart.name().to_owned(), case, rung, what, error_of, error, ns, per, machine }
    }

    #[test]
    fn what_this_machine_has_not_measured_is_wanted() {
        let here = machine("here", "none");
        assert_eq!(wanted(&[], &[], &here), Chart::ALL);
        let there = [
            line(Chart::CountLaw, here.clone()),
            line(Chart::Occlusion, machine("here", "bvh")),
            line(Chart::Arithmetic, machine("elsewhere", "none")),
        ];
        let missing = [Chart::LitProbability, Chart::Footprint, Chart::Environment, Chart::Arithmetic];
        assert_eq!(wanted(&[], &there, &here), missing);
        assert_eq!(wanted(&[Chart::Arithmetic, Chart::CountLaw], &there, &here), [Chart::Arithmetic]);
    }
}
