//! `mica bench --paper wdh20`: the tables and figures of Wang, Deng and Holzschuch 2020 for this implementation on this
//! device, with the paper's own numbers beside them.

use super::BenchArgs;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::measure;
use crate::output;
use crate::progress::Progress;
use crate::study::{Effort, Lighting, Lines, OpenPlace, Reference, measure as measure_point, paired, spread};
use crate::table::{Column, table};
use mica_accuracy::{Cost, Estimate, Machine};
use mica_gpu::Timing;
use mica_render::{MethodInfo, Rung, method};
use serde::Serialize;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};

/// What lines of a paper's tables say of themselves.
const SCHEMA: &str = "mica-paper-1";
/// What the paper's real-time figures were taken on, and its size.
const THEIR_GPU: &str = "NVIDIA GeForce RTX 2080 Ti, OptiX, 1920x1080";
const THEIR_CPU: &str = "40 cores of Intel Xeon E5-2630";
const THEIR_SIZE: [u32; 2] = [1920, 1080];
/// Samples of a pixel in the paper's renderings on the processor.
const THEIR_SAMPLES: f64 = 1024.0;

/// What the paper prints of a scene.
#[derive(Debug, PartialEq)]
struct TheirScene {
    name: &'static str,
    /// Milliseconds of what glints add, and of the frame.
    glints_ms: f64,
    frame_ms: f64,
    /// Average energy of a glint over that of the reference.
    energy: f64,
    /// Minutes of Wang et al. 2018 and of Jakob et al. 2014.
    wang2018_min: f64,
    jakob_min: f64,
}

/// Its Table 1. The frame without glints is known of Shoe (10.5 ms) and of Cloth (11.1 ms): the difference, as here.
const THEIR_SCENES: [TheirScene; 3] = [
    TheirScene { name: "shoe", glints_ms: 8.4, frame_ms: 18.9, energy: 1.29, wang2018_min: 7.5, jakob_min: 12.2 },
    TheirScene { name: "snow", glints_ms: 9.3, frame_ms: 26.4, energy: 0.974, wang2018_min: 15.5, jakob_min: 20.6 },
    TheirScene { name: "cloth", glints_ms: 4.4, frame_ms: 15.5, energy: 0.932, wang2018_min: 6.9, jakob_min: 9.0 },
];

/// Bytes that stay on the device, by how their names begin here: in the paper's Table 2, MB.
const THEIR_MEMORY: [(&str, &str, f64); 4] = [
    ("quadtree", "quadtree", 256.0),
    ("prefiltered environment", "prefiltered", 10.22),
    ("probabilities accumulated over gamma", "dpf_accumulated", 5.7),
    ("probabilities of all roughnesses", "dpf", 46.7),
];

/// A table made anew by an edit.
struct TheirEdit {
    name: &'static str,
    /// The passes that make it here.
    passes: &'static [&'static str],
    /// A setting of Shoe that changes it, and values to change between.
    key: &'static str,
    values: [&'static str; 2],
    ms: f64,
}

/// Its Table 3.
const THEIR_EDITS: [TheirEdit; 3] = [
    TheirEdit { name: "quadtree", passes: &["quadtree"], key: "count", values: ["9e5", "1e6"], ms: 6.4 },
    TheirEdit {
        name: "prefilter",
        passes: &["prefilter_probability", "prefilter"],
        key: "gamma_deg",
        values: ["5", "6"],
        ms: 8.0,
    },
    TheirEdit {
        name: "accumulation over gamma",
        passes: &["dpf_accumulate"],
        key: "gamma_deg",
        values: ["5", "6"],
        ms: 2.7,
    },
];
/// Of all of them together, milliseconds.
const THEIR_EDITS_MS: f64 = 17.1;

/// Shares of the side of the largest picture in Figure 10.
const SIDES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// A number of the paper's, and ours.
#[derive(Serialize)]
struct Line<'a> {
    schema: &'static str,
    paper: &'static str,
    table: &'static str,
    row: &'a str,
    column: &'a str,
    unit: &'static str,
    ours: Option<Estimate>,
    theirs: Option<f64>,
    theirs_on: &'static str,
    machine: &'a Machine,
    note: &'a str,
}

/// What a number is.
#[derive(Clone, Copy)]
struct Entry<'a> {
    table: &'static str,
    row: &'a str,
    column: &'a str,
    unit: &'static str,
    theirs: Option<f64>,
    theirs_on: &'static str,
    note: &'a str,
}

/// The numbers as they come: into a file, and into the table for people.
struct Numbers {
    file: Option<Lines<Json>>,
    to_stdout: bool,
    rows: Vec<Vec<String>>,
}

impl Numbers {
    fn create(path: Option<&Path>) -> Result<Self, Failure> {
        let to_stdout = path == Some(Path::new("-"));
        let file = path.filter(|_| !to_stdout).map(Lines::open).transpose()?;
        Ok(Self { file, to_stdout, rows: Vec::new() })
    }

    fn add(&mut self, machine: &Machine, entry: Entry, ours: Option<Estimate>) -> Result<(), Failure> {
        let Entry { table, row, column, unit, theirs, theirs_on, note } = entry;
        let line =
            Line { schema: SCHEMA, paper: "wdh20", table, row, column, unit, ours, theirs, theirs_on, machine, note };
        let line = serde_json::to_value(&line).map_err(|error| Failure::bad_input(error.to_string()))?;
        if self.to_stdout {
            output::print(&format!("{line}\n"))?;
        }
        if let Some(file) = &mut self.file {
            file.add(line)?;
        }
        let known = ours.filter(|ours| ours.value.is_finite());
        let words = |figure: Option<f64>| figure.map_or_else(|| "-".to_owned(), |figure| format!("{figure:.3}"));
        let spread = known.map_or_else(String::new, |Estimate { low, high, .. }| format!("{low:.3} to {high:.3}"));
        let ours = words(known.map(|ours| ours.value));
        self.rows.push(vec![
            table.to_owned(),
            row.to_owned(),
            column.to_owned(),
            unit.to_owned(),
            ours,
            spread,
            words(theirs),
        ]);
        Ok(())
    }

    fn for_people(&self, machine: Option<&(Machine, String)>) -> String {
        let columns = [
            Column::Left("wdh20"),
            Column::Left("of"),
            Column::Left("what"),
            Column::Left("unit"),
            Column::Right("here"),
            Column::Right("least to most"),
            Column::Right("paper"),
        ];
        let here = machine.map_or_else(String::new, |(Machine { device, driver, occlusion, .. }, clock)| {
            let clock = if clock == "cpu" { "processor time, of all threads" } else { "GPU time" };
            format!("here: {device}, {driver}, occlusion by {occlusion}; table 1 and figure 10 in {clock}\n")
        });
        format!(
            "{}\n{here}paper: {THEIR_GPU}; jakob, wang2018 and the precomputation: {THEIR_CPU}\n",
            table(&columns, &self.rows)
        )
    }
}

/// Measures, writes and prints; what was measured before Ctrl-C or a failure is kept.
pub fn wdh20(args: &BenchArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let size = args.size.last().copied().unwrap_or(THEIR_SIZE);
    let effort =
        &Effort { path_frames: 0, sittings: 1, rounds: [2, args.rounds.max(2)], isolated: 3, ..Effort::quick() };
    let scenes = scenes(&args.scene)?;
    let mut numbers = Numbers::create(args.json.as_deref())?;
    let mut progress = Progress::new(args.quiet);
    let mut paper = Paper { args, size, effort, interrupt, numbers: &mut numbers, machine: None };
    interrupt.defer();
    let done = scenes.into_iter().try_for_each(|scene| paper.scene(scene, &mut progress));
    let machine = paper.machine.take();
    progress.clear();
    if !(args.quiet || numbers.to_stdout) {
        output::print(&numbers.for_people(machine.as_ref()))?;
    }
    match done {
        Err(failure) if failure.code == INTERRUPTED => {
            let kept = numbers.rows.len();
            Err(Failure::with_code(INTERRUPTED, format!("interrupted after {kept} numbers, which were kept")))
        }
        done => done,
    }
}

/// The scenes of these names, or all.
fn scenes(names: &[PathBuf]) -> Result<Vec<&'static TheirScene>, Failure> {
    if names.is_empty() {
        return Ok(THEIR_SCENES.iter().collect());
    }
    let of_name = |name: &PathBuf| {
        let known = THEIR_SCENES.iter().find(|scene| name == Path::new(scene.name));
        known.ok_or_else(|| {
            Failure::bad_input(format!("{}: the paper has shoe, snow and cloth; name one of them", name.display()))
        })
    };
    names.iter().map(of_name).collect()
}

/// The paper being measured.
struct Paper<'a> {
    args: &'a BenchArgs,
    size: [u32; 2],
    effort: &'a Effort,
    interrupt: &'a Interrupt,
    numbers: &'a mut Numbers,
    /// Who measures, and by which clock, once something was.
    machine: Option<(Machine, String)>,
}

impl Paper<'_> {
    /// All that the paper says of a scene.
    fn scene(&mut self, theirs: &TheirScene, progress: &mut Progress) -> Result<(), Failure> {
        let wang2020 = method("wang2020")?;
        let mut open = self.open(theirs.name, progress)?;
        for share in SIDES {
            open.resize(self.size.map(|side| ((f64::from(side) * share).round() as u32).max(1)));
            progress.update(&format!("{} at {share} of the size", theirs.name), 0, 0);
            if share == SIDES[0] {
                self.of_energy(theirs, &mut open, wang2020, progress)?;
                self.of_older_methods(theirs, &mut open)?;
            }
            open.set(wang2020, &[])?;
            let cost = paired(&mut open, self.effort, self.interrupt)?;
            self.machine.get_or_insert_with(|| (open.machine.clone(), cost.clock.clone()));
            self.of_resolution(theirs, &open, &cost)?;
            if share == SIDES[SIDES.len() - 1] {
                self.of_frame(theirs, &open, &cost)?;
                if theirs.name == "shoe" {
                    self.of_memory(&mut open, &cost, wang2020)?;
                    self.of_edits(&mut open)?;
                }
            }
        }
        Ok(())
    }

    fn open(&self, scene: &str, progress: &mut Progress) -> Result<OpenPlace, Failure> {
        let args = SceneArgs { size: self.size, device: self.args.device.clone(), ..SceneArgs::of(scene) };
        OpenPlace::open(&args, Lighting::Own, progress)
    }

    fn add(&mut self, open: &OpenPlace, entry: Entry, ours: Estimate) -> Result<(), Failure> {
        self.numbers.add(&open.machine, entry, Some(ours))
    }

    /// Table 1, times of the real-time method, and Figure 9.
    fn of_frame(&mut self, theirs: &TheirScene, open: &OpenPlace, cost: &Cost) -> Result<(), Failure> {
        let row = theirs.name;
        let entry = |column, theirs| Entry {
            table: "table 1",
            row,
            column,
            unit: "ms",
            theirs: Some(theirs),
            theirs_on: THEIR_GPU,
            note: "",
        };
        self.add(open, entry("glints", theirs.glints_ms), cost.glints.scaled(1e-6))?;
        self.add(open, entry("frame", theirs.frame_ms), cost.frame.scaled(1e-6))?;
        for (pass, ns) in &cost.passes {
            let component = Entry {
                table: "figure 9",
                row,
                column: pass,
                unit: "ms",
                theirs: None,
                theirs_on: THEIR_GPU,
                note: "passes in isolation; the paper's bars are drawn, not printed",
            };
            self.add(open, component, ns.scaled(1e-6))?;
        }
        Ok(())
    }

    /// Figure 10.
    fn of_resolution(&mut self, theirs: &TheirScene, open: &OpenPlace, cost: &Cost) -> Result<(), Failure> {
        let [width, height] = open.place.size;
        let entry = Entry {
            table: "figure 10",
            row: &format!("{width}x{height}"),
            column: theirs.name,
            unit: "ms",
            theirs: (open.place.size == THEIR_SIZE).then_some(theirs.glints_ms),
            theirs_on: THEIR_GPU,
            note: "glints; the paper's curve is drawn, and printed for 1920x1080 only",
        };
        self.add(open, entry, cost.glints.scaled(1e-6))
    }

    /// Table 1, average energy of a glint.
    fn of_energy(
        &mut self,
        theirs: &TheirScene,
        open: &mut OpenPlace,
        wang2020: &'static MethodInfo,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let reference = Reference::render(open, self.effort, Default::default(), self.interrupt, progress)?;
        let printed = Rung { name: "printed", set: &[] };
        let measured = measure_point(open, wang2020, &printed, Some(&reference), self.effort, self.interrupt)?;
        let energy = measured.point.errors.map_or(Estimate::UNKNOWN, |errors| errors.energy_per_glint);
        let entry = Entry {
            table: "table 1",
            row: theirs.name,
            column: "energy of a glint",
            unit: "of the reference",
            theirs: Some(theirs.energy),
            theirs_on: THEIR_GPU,
            note: "the reference is Jakob et al. 2014 in the paper, every flake here",
        };
        self.add(open, entry, energy)
    }

    /// Table 1, the methods that the paper renders on processors: a sample of a pixel here, times theirs.
    fn of_older_methods(&mut self, theirs: &TheirScene, open: &mut OpenPlace) -> Result<(), Failure> {
        let [width, height] = open.place.size;
        let samples = THEIR_SAMPLES * 1920.0 * 1080.0 / (f64::from(width) * f64::from(height));
        let once = Effort { rounds: [1, 1], isolated: 1, ..self.effort.clone() };
        let note = format!("a frame of {width}x{height} times {samples:.0}, for 1024 samples at 1920x1080");
        for (name, minutes) in [("wang2018", theirs.wang2018_min), ("jakob", theirs.jakob_min)] {
            open.set(method(name)?, &[])?;
            let cost = paired(open, &once, self.interrupt)?;
            let entry = Entry {
                table: "table 1",
                row: theirs.name,
                column: name,
                unit: "min",
                theirs: Some(minutes),
                theirs_on: THEIR_CPU,
                note: &note,
            };
            self.add(open, entry, cost.frame.scaled(samples / 60e9))?;
        }
        Ok(())
    }

    /// Table 2: what is kept, and what takes long before the first frame.
    fn of_memory(&mut self, open: &mut OpenPlace, cost: &Cost, wang2020: &'static MethodInfo) -> Result<(), Failure> {
        for (row, name, theirs) in THEIR_MEMORY {
            let ours = cost.memory.iter().filter(|kept| match name {
                "dpf" => kept.name == name,
                start => kept.name.starts_with(start),
            });
            let bytes: u64 = ours.map(|kept| kept.bytes).sum();
            let entry = Entry {
                table: "table 2",
                row,
                column: "memory",
                unit: "MB",
                theirs: Some(theirs),
                theirs_on: THEIR_GPU,
                note: "",
            };
            self.add(open, entry, Estimate::exact(bytes as f64 * 1e-6))?;
        }
        // Another method gives the tables back.
        open.set(method("smooth")?, &[])?;
        open.session.frame(None, Timing::Overlapped, false)?;
        open.set(wang2020, &[])?;
        let precomputation_ns = open.session.precompute_anew()?.iter().map(|update| update.ns as f64).sum::<f64>();
        let entry = Entry {
            table: "table 2",
            row: "probabilities of all roughnesses",
            column: "precomputation",
            unit: "s",
            theirs: Some(18.0),
            theirs_on: THEIR_CPU,
            note: "here by quadrature, in the paper by counting 1e9 flakes at each roughness",
        };
        self.add(open, entry, Estimate::exact(precomputation_ns * 1e-9))
    }

    /// Table 3: tables made anew by an edit of Shoe.
    fn of_edits(&mut self, open: &mut OpenPlace) -> Result<(), Failure> {
        let mut in_all: Vec<f64> = Vec::new();
        for TheirEdit { name, passes, key, values, ms } in THEIR_EDITS {
            let mut times = Vec::new();
            for round in 0..self.effort.rounds[0].max(2) as usize {
                if self.interrupt.requested() {
                    return Err(Failure::with_code(INTERRUPTED, "interrupted"));
                }
                open.session.renderer.set(None, key, values[round % 2])?;
                let shot = open.session.frame(None, Timing::Isolated, false)?;
                let built = measure::sums(&shot, true);
                let ns = built.iter().filter(|sum| passes.contains(&sum.name.as_str())).filter_map(|sum| sum.ns);
                times.push(ns.sum::<u64>() as f64 * 1e-6);
            }
            in_all.resize(times.len().max(in_all.len()), 0.0);
            in_all.iter_mut().zip(&times).for_each(|(sum, time)| *sum += time);
            self.of_edit(open, name, ms, spread(times.iter().copied(), 0.0))?;
        }
        self.of_edit(open, "all", THEIR_EDITS_MS, spread(in_all.iter().copied(), 0.0))
    }

    fn of_edit(&mut self, open: &OpenPlace, row: &str, theirs: f64, ours: Estimate) -> Result<(), Failure> {
        let entry = Entry {
            table: "table 3",
            row,
            column: "edit",
            unit: "ms",
            theirs: Some(theirs),
            theirs_on: THEIR_GPU,
            note: "shoe",
        };
        self.add(open, entry, ours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_scenes_of_the_paper_are_taken() {
        let of = |names: &[&str]| scenes(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        let names = |names: &[&str]| of(names).map(|scenes| scenes.iter().map(|scene| scene.name).collect::<Vec<_>>());
        assert_eq!(names(&[]), Ok(vec!["shoe", "snow", "cloth"]));
        assert_eq!(names(&["cloth"]), Ok(vec!["cloth"]));
        assert_eq!(of(&["plane"]).map(|_| ()).map_err(|failure| failure.code), Err(crate::error::BAD_INPUT));
    }

    #[test]
    fn a_number_that_is_not_known_is_null_in_the_file_and_a_dash_in_the_table() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("papers.jsonl");
        let machine = Machine {
            device: "d".to_owned(),
            driver: "1".to_owned(),
            occlusion: "bvh".to_owned(),
            build: "b".to_owned(),
        };
        let entry = |column, theirs| Entry {
            table: "table 1",
            row: "shoe",
            column,
            unit: "ms",
            theirs,
            theirs_on: THEIR_GPU,
            note: "",
        };
        let mut numbers = Numbers::create(Some(&path)).expect("the file can be written");
        numbers.add(&machine, entry("glints", Some(8.4)), Some(Estimate::UNKNOWN)).expect("a line");
        numbers.add(&machine, entry("frame", None), Some(Estimate::exact(2.0))).expect("a line");
        let text = std::fs::read_to_string(&path).expect("lines");
        let lines: Vec<serde_json::Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        assert_eq!((&lines[0]["ours"]["value"], &lines[0]["theirs"]), (&serde_json::Value::Null, &8.4.into()));
        assert_eq!((&lines[1]["ours"]["value"], &lines[1]["theirs"]), (&2.0.into(), &serde_json::Value::Null));
        assert_eq!(numbers.rows[0][4..], ["-", "", "8.400"]);
        assert_eq!(numbers.rows[1][4..], ["2.000", "2.000 to 2.000", "-"]);
    }
}
