//! What a study's folder holds: lines of JSON, of which the last of a kind counts.

use crate::error::Failure;
use mica_accuracy::exactness::{EXACTNESS_SCHEMA, ExactnessLine};
use mica_accuracy::{Estimate, Machine, POINT_SCHEMA, Point, REFERENCE_SCHEMA, ReferenceLine};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::io::ErrorKind;
use std::path::Path;

/// All lines that could be read.
#[derive(Debug, Default)]
pub struct Study {
    pub points: Vec<Point>,
    pub references: Vec<ReferenceLine>,
    pub exactness: Vec<ExactnessLine>,
    pub papers: Vec<PaperLine>,
    /// How many lines of which file could not.
    pub skipped: Vec<(&'static str, usize)>,
}

/// A line of `papers.jsonl`: a cell of a paper's table, ours beside theirs.
#[derive(Clone, Debug, Deserialize)]
pub struct PaperLine {
    pub paper: String,
    pub table: String,
    pub row: String,
    pub column: String,
    pub unit: String,
    pub ours: Option<Estimate>,
    pub theirs: Option<f64>,
    pub theirs_on: String,
    pub machine: Machine,
    #[serde(default)]
    pub note: Option<String>,
}

const PAPER_SCHEMA: &str = "mica-paper-1";

impl Study {
    /// Reads what there is; a file that is not there has no lines.
    pub fn read(folder: &Path) -> Result<Self, Failure> {
        if !folder.is_dir() {
            return Err(Failure::bad_input(format!("{}: there is no such folder", folder.display())));
        }
        let mut study = Self::default();
        let skipped = &mut study.skipped;
        study.points = last_of(lines(folder, "points.jsonl", POINT_SCHEMA, skipped)?, |a: &Point, b| {
            a.place == b.place
                && is_same_device(&a.machine, &b.machine)
                && (&a.effort, &a.method, &a.rung, &a.set) == (&b.effort, &b.method, &b.rung, &b.set)
        });
        study.references =
            last_of(lines(folder, "references.jsonl", REFERENCE_SCHEMA, skipped)?, |a: &ReferenceLine, b| {
                a.place == b.place && is_same_device(&a.machine, &b.machine) && a.effort == b.effort
            });
        study.exactness =
            last_of(lines(folder, "exactness.jsonl", EXACTNESS_SCHEMA, skipped)?, |a: &ExactnessLine, b| {
                is_same_device(&a.machine, &b.machine)
                    && (&a.chart, &a.case, &a.rung, &a.per) == (&b.chart, &b.case, &b.rung, &b.per)
            });
        study.papers = last_of(lines(folder, "papers.jsonl", PAPER_SCHEMA, skipped)?, |a: &PaperLine, b| {
            is_same_device(&a.machine, &b.machine)
                && (&a.paper, &a.table, &a.row, &a.column) == (&b.paper, &b.table, &b.row, &b.column)
        });
        for (file, count) in &study.skipped {
            log::warn!(
                "{}: {count} lines are not of a study, or were cut off, and are left out",
                folder.join(file).display()
            );
        }
        Ok(study)
    }

    /// Whether there is nothing to show, not even lines that could not be read.
    pub fn is_empty(&self) -> bool {
        let Self { points, references, exactness, papers, skipped } = self;
        points.is_empty() && references.is_empty() && exactness.is_empty() && papers.is_empty() && skipped.is_empty()
    }
}

/// Whether two lines were measured on the same device in the same way. A newer build replaces what an older one measured.
pub fn is_same_device(a: &Machine, b: &Machine) -> bool {
    (&a.device, &a.driver, &a.occlusion) == (&b.device, &b.driver, &b.occlusion)
}

/// The lines of a file that are what they should be; how many are not is noted.
fn lines<T: DeserializeOwned>(
    folder: &Path,
    file: &'static str,
    schema: &str,
    skipped: &mut Vec<(&'static str, usize)>,
) -> Result<Vec<T>, Failure> {
    let path = folder.join(file);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(Failure::bad_input(format!("{}: {error}", path.display()))),
    };
    let texts: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').filter(|line| !line.trim_ascii().is_empty()).collect();
    let read: Vec<T> = texts.iter().filter_map(|line| of_schema(line, schema)).collect();
    if read.len() < texts.len() {
        skipped.push((file, texts.len() - read.len()));
    }
    Ok(read)
}

fn of_schema<T: DeserializeOwned>(line: &[u8], schema: &str) -> Option<T> {
    let value: serde_json::Value = serde_json::from_slice(line).ok()?;
    if value.get("schema")?.as_str()? != schema {
        return None;
    }
    serde_json::from_value(value).ok()
}

/// Of lines that say the same thing the last, at the place of the first.
fn last_of<T>(lines: Vec<T>, is_same: impl Fn(&T, &T) -> bool) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for line in lines {
        match kept.iter_mut().find(|other| is_same(other, &line)) {
            Some(older) => *older = line,
            None => kept.push(line),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = r#"{"schema":"mica-paper-1","paper":"wdh20","table":"table 1","row":"shoe","column":"ms","unit":"ms","ours":{"value":VALUE,"low":1,"high":2},"theirs":8.4,"theirs_on":"RTX 2080 Ti","machine":{"device":"d","driver":"v","occlusion":"bvh","build":"BUILD"},"note":null}"#;

    fn line(value: &str, build: &str) -> String {
        LINE.replace("VALUE", value).replace("BUILD", build)
    }

    #[test]
    fn the_last_line_of_a_kind_counts_and_torn_and_foreign_lines_are_counted() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let torn = &line("9", "new")[..120];
        let text = [&line("1", "old"), "", "{}", "not JSON", r#"{"schema":"mica-point-1"}"#, &line("1.5", "new"), torn];
        std::fs::write(folder.path().join("papers.jsonl"), text.join("\n")).expect("a file");
        let study = Study::read(folder.path()).expect("a study");
        assert_eq!(study.skipped, [("papers.jsonl", 4)]);
        let values: Vec<_> = study.papers.iter().map(|line| line.ours.map(|ours| ours.value)).collect();
        assert_eq!(values, [Some(1.5)]);
        assert!(study.points.is_empty());
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let failure = Study::read(Path::new("/nowhere/at all")).expect_err("no folder");
        assert!(failure.to_string().contains("/nowhere/at all"));
    }
}
