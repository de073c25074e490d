//! What was found of the hard cases, as JSON and for people.

use super::cost::CostRow;
use crate::report::DeviceReport;
use crate::table::{Column, table};
use mica_gpu::DeviceInfo;
use mica_stability::{Case, Check, Effort, STABILITY_SCHEMA, StabilityError, StableForm, UnaryLine};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The result of a run.
#[derive(Serialize)]
pub struct StabilityReport {
    schema: &'static str,
    build: &'static str,
    device: DeviceReport,
    /// `quick` or `full`.
    effort: &'static str,
    /// Cases whose stable forms are all within their tolerance.
    held: usize,
    /// Cases that were asked for.
    asked: usize,
    pub cases: Vec<CaseReport>,
    /// Functions of one number, tried on as many words as `effort` says.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub helpers: Vec<UnaryLine>,
    /// What stable forms cost in whole frames; empty where nobody asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cost: Vec<CostRow>,
}

impl StabilityReport {
    /// Nothing was measured yet.
    pub fn new(device: &DeviceInfo, effort: Effort, asked: usize) -> Self {
        Self {
            schema: STABILITY_SCHEMA,
            build: crate::build::BUILD,
            device: DeviceReport::new(device),
            effort: if effort == Effort::Quick { "quick" } else { "full" },
            held: 0,
            asked,
            cases: Vec::new(),
            helpers: Vec::new(),
            cost: Vec::new(),
        }
    }

    /// Adds a case.
    pub fn push(&mut self, case: CaseReport) {
        self.held += usize::from(case.holds);
        self.cases.push(case);
    }

    /// Takes over what an earlier run found, if that was of the same build, device and effort: cases that were measured, and
    /// helpers that were tried to their end.
    pub fn resume(&mut self, text: &str, cases: &[&Case], helpers: &[&str]) -> Result<(), String> {
        let earlier: Earlier =
            serde_json::from_str(text).map_err(|error| format!("no report of this command: {error}"))?;
        let own = serde_json::to_value(&*self).map_err(|error| error.to_string())?;
        let also = [("build", &earlier.build), ("effort", &earlier.effort), ("device", &earlier.device)];
        if let Some((what, theirs)) = also.into_iter().find(|(what, theirs)| own[what] != **theirs) {
            return Err(format!("is of another {what}, {theirs} and not {}; run without --resume", own[what]));
        }
        for found in earlier.cases.into_iter().filter(|found| found.error.is_none()) {
            if let Some(case) = cases.iter().find(|case| case.id == found.id) {
                self.push(CaseReport::new(case, Ok(found.checks)));
            }
        }
        self.helpers.extend(earlier.helpers.into_iter().filter(|line| helpers.contains(&&*line.helper)));
        Ok(())
    }
}

/// What is read of an earlier report.
#[derive(Deserialize)]
struct Earlier {
    build: Value,
    device: Value,
    effort: Value,
    cases: Vec<EarlierCase>,
    #[serde(default)]
    helpers: Vec<UnaryLine>,
}

#[derive(Deserialize)]
struct EarlierCase {
    id: String,
    checks: Vec<Check>,
    error: Option<String>,
}

/// A case.
#[derive(Serialize)]
pub struct CaseReport {
    pub id: &'static str,
    pub title: &'static str,
    /// Whether every stable form is within its tolerance.
    pub holds: bool,
    /// Whether every naive form is beyond it: the inputs are hard on this device.
    pub naive_fails: bool,
    /// Inputs tried in all checks.
    pub inputs: u64,
    /// The functions that the stable forms are, and who renders with each.
    pub stable_forms: Vec<StableForm>,
    pub checks: Vec<Check>,
    /// Why it could not be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl CaseReport {
    pub fn new(case: &Case, checks: Result<Vec<Check>, StabilityError>) -> Self {
        let (checks, error) = match checks {
            Ok(checks) => (checks, None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        Self {
            id: case.id,
            title: case.title,
            holds: !checks.is_empty() && checks.iter().all(Check::holds),
            naive_fails: !checks.is_empty() && checks.iter().all(Check::has_teeth),
            inputs: checks.iter().map(|check| check.inputs).sum(),
            stable_forms: case.stable.iter().filter_map(|name| StableForm::named(name)).copied().collect(),
            checks,
            error,
        }
    }

    /// Who renders with the stable forms, the first few of them.
    fn in_use_by(&self) -> String {
        const NAMED: usize = 2;
        let mut users: Vec<&str> = Vec::new();
        for user in self.stable_forms.iter().flat_map(|form| form.used_by.split(", ")).filter(|user| !user.is_empty()) {
            if !users.contains(&user) {
                users.push(user);
            }
        }
        let unused: Vec<&str> =
            self.stable_forms.iter().filter(|form| form.used_by.is_empty()).map(|form| form.name).collect();
        let more = users.len().saturating_sub(NAMED);
        let mut words = users.into_iter().take(NAMED).collect::<Vec<_>>().join(", ");
        if more > 0 {
            words += &format!(" and {more} more");
        }
        match (words.is_empty(), unused.is_empty()) {
            (true, _) => "library only".to_owned(),
            (false, true) => words,
            (false, false) => format!("{words}; library only: {}", unused.join(", ")),
        }
    }

    /// The check whose stable form comes closest to its tolerance, or is farthest beyond.
    fn closest(&self) -> Option<&Check> {
        let share = |check: &Check| if check.stable.worst == 0.0 { 0.0 } else { check.stable.worst / check.tolerance };
        self.checks.iter().max_by(|a, b| share(a).total_cmp(&share(b)))
    }

    fn verdict(&self) -> &'static str {
        match (self.error.is_some(), self.holds, self.naive_fails) {
            (true, ..) => "not measured",
            (_, false, _) => "BEYOND",
            (_, true, true) => "holds",
            (_, true, false) => "holds, the naive form too",
        }
    }
}

/// A row for each case.
pub fn for_people(report: &StabilityReport) -> String {
    let StabilityReport { device, cases, held, asked, effort, .. } = report;
    let columns = [
        Column::Left("case"),
        Column::Left("what is hard"),
        Column::Right("inputs"),
        Column::Right("naive"),
        Column::Right("stable"),
        Column::Right("tolerance"),
        Column::Left("verdict"),
        Column::Left("in use by"),
    ];
    let rows: Vec<Vec<String>> = cases
        .iter()
        .map(|case| {
            let of = |figure: fn(&Check) -> f64| case.closest().map_or_else(|| "-".to_owned(), |of| error(figure(of)));
            vec![
                case.id.to_owned(),
                case.title.to_owned(),
                thousands(case.inputs),
                of(|check| check.naive.worst),
                of(|check| check.stable.worst),
                of(|check| check.tolerance),
                case.verdict().to_owned(),
                case.in_use_by(),
            ]
        })
        .collect();
    let mut text = format!("hard cases on {} ({}), {effort} effort: worst errors\n\n", device.name, device.driver);
    text += &table(&columns, &rows);
    for case in cases {
        text += &case.error.iter().map(|error| format!("{}: {error}\n", case.id)).collect::<String>();
    }
    text += &format!("\n{held} of {asked} within tolerance\n");
    text
}

/// A row for each function of one number.
pub fn helpers_for_people(report: &StabilityReport) -> String {
    let StabilityReport { device, helpers, effort, .. } = report;
    let columns = [
        Column::Left("function"),
        Column::Left("of"),
        Column::Right("inputs"),
        Column::Right("worst error"),
        Column::Right("at"),
        Column::Right("bound"),
        Column::Left("verdict"),
        Column::Left("an error is"),
    ];
    let rows: Vec<Vec<String>> = helpers
        .iter()
        .map(|line| {
            vec![
                line.helper.clone(),
                line.domain.clone(),
                thousands(line.inputs),
                error(line.worst),
                format!("{:e}", line.at as f32),
                error(line.bound),
                if line.holds() { "holds" } else { "BEYOND" }.to_owned(),
                line.error_of.clone(),
            ]
        })
        .collect();
    let all = if *effort == "full" { "all of their words" } else { "words at equal distances" };
    let mut text = format!("functions of one number on {} ({}), tried on {all}\n\n", device.name, device.driver);
    text += &table(&columns, &rows);
    let held = helpers.iter().filter(|line| line.holds()).count();
    text + &format!("\n{held} of {} within their bounds\n", helpers.len())
}

fn error(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        value if value.is_infinite() => "no number".to_owned(),
        value => format!("{value:.1e}"),
    }
}

/// 1234567 as 1,234,567.
fn thousands(value: u64) -> String {
    let digits = value.to_string();
    let grouped = digits.as_bytes().rchunks(3).rev().map(|group| String::from_utf8_lossy(group).into_owned());
    grouped.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_stability::{CASES, Form};

    fn check(naive: f64, stable: f64) -> Check {
        Check {
            what: "a thing".to_owned(),
            error_of: "relative".to_owned(),
            inputs: 1_000,
            naive: Form::new("naive", naive),
            stable: Form::new("stable", stable),
            tolerance: 1e-3,
        }
    }

    #[test]
    fn a_case_holds_if_all_its_checks_do_and_says_when_inputs_are_not_hard() {
        let of = |checks: Vec<Check>| CaseReport::new(&CASES[0], Ok(checks));
        assert_eq!(of(vec![check(1.0, 1e-4), check(f64::NAN, 0.0)]).verdict(), "holds");
        assert_eq!(of(vec![check(1.0, 1e-4), check(1e-4, 0.0)]).verdict(), "holds, the naive form too");
        assert_eq!(of(vec![check(1.0, 1e-4), check(1.0, 1e-2)]).verdict(), "BEYOND");
        assert_eq!(of(vec![check(1.0, f64::NAN)]).verdict(), "BEYOND");
        assert_eq!(of(Vec::new()).verdict(), "BEYOND");
        let broken = CaseReport::new(&CASES[0], Err(StabilityError::Missing("no such thing".to_owned())));
        assert_eq!((broken.verdict(), broken.holds), ("not measured", false));
        let closest = of(vec![check(1.0, 0.0), check(2.0, 5e-4), check(3.0, 1e-5)]);
        assert_eq!(closest.closest().map(|check| check.naive.worst), Some(2.0));
    }

    #[test]
    fn large_numbers_can_be_read() {
        assert_eq!([0, 999, 1_000, 12_345_678].map(thousands), ["0", "999", "1,000", "12,345,678"]);
    }
}
