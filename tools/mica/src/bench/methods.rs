//! `mica bench`: what every method costs with every rung of its ladder, at every scene, size and lighting.

use super::BenchArgs;
use crate::accuracy::chosen;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED, NO_DEVICE};
use crate::interrupt::Interrupt;
use crate::output;
use crate::progress::Progress;
use crate::scene_choice;
use crate::spare::Spare;
use crate::study::{Effort, LeftOut, Lines, OpenPlace, Stop, measure, rungs, sit_again, stops, table_of, unmeasured};
use mica_accuracy::Point;
use mica_render::{MethodInfo, Rung};
use std::path::{Path, PathBuf};

/// What is measured where nobody says.
const DEFAULT_SCENE: &str = "shoe";
const DEFAULT_SIZE: [u32; 2] = [640, 360];
/// Seconds that the rounds of a sitting may take, if there are two at least.
const SECONDS: f64 = 7.0;

/// Measures, writes and prints. What was measured before Ctrl-C or a failure is kept.
pub fn methods(args: &BenchArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let methods = chosen(&args.method)?;
    let to_stdout = args.json.as_deref() == Some(Path::new("-"));
    let lines = args.json.as_deref().filter(|_| !to_stdout).map(Lines::of_points).transpose()?;
    if let (Some(lines), Some(path)) = (&lines, &args.json)
        && lines.all.is_empty()
        && lines.passed_over > 0
    {
        let path = path.display();
        return Err(Failure::bad_input(format!("--json {path}: it holds no points of a bench; name another file")));
    }
    let scenes = if args.scene.is_empty() { vec![PathBuf::from(DEFAULT_SCENE)] } else { args.scene.clone() };
    scenes.iter().try_for_each(|scene| scene_choice::check(scene))?;
    let sizes = if args.size.is_empty() { vec![DEFAULT_SIZE] } else { args.size.clone() };
    let mut bench = Bench {
        args,
        effort: Effort { seconds: SECONDS, rounds: [args.rounds.min(2), args.rounds], ..Effort::full() },
        rungs: rungs(&methods, false),
        interrupt,
        progress: Progress::new(args.quiet),
        to_stdout,
        lines,
        left_out: LeftOut::default(),
        spare: Spare::default(),
        measured: 0,
    };
    interrupt.defer();
    let finished = stops(&scenes, &sizes, &args.lighting).iter().try_for_each(|stop| bench.stop(stop));
    bench.progress.clear();
    if let Some(path) = args.json.as_deref().filter(|_| !(args.quiet || to_stdout)) {
        output::print(&format!("\n{}: {} points measured\n", path.display(), bench.measured))?;
    }
    finished?;
    bench.left_out.end()
}

struct Bench<'a> {
    args: &'a BenchArgs,
    effort: Effort,
    rungs: Vec<(&'static MethodInfo, &'static Rung)>,
    interrupt: &'a Interrupt,
    progress: Progress,
    to_stdout: bool,
    lines: Option<Lines<Point>>,
    left_out: LeftOut,
    spare: Spare,
    measured: usize,
}

impl Bench<'_> {
    /// All points of a place. One that cannot be measured is reported, and the others go on, unless the device is missing.
    fn stop(&mut self, stop: &Stop) -> Result<(), Failure> {
        let scene = SceneArgs {
            scene: stop.scene.clone(),
            size: stop.size,
            device: self.args.device.clone(),
            ..SceneArgs::of("")
        };
        let mut open = None;
        let mut points = Vec::new();
        let mut ended = Ok(());
        let mut next = 0;
        while let Some((method, rung)) = self.rungs.get(next).copied() {
            if self.interrupt.requested() {
                break;
            }
            next += 1;
            // After a failure the place is opened anew, as frames may be lost with it.
            let place = match &mut open {
                Some(place) => place,
                none => match OpenPlace::open(&scene, stop.lighting, &mut self.progress) {
                    Ok(place) => none.insert(place),
                    Err(failure) if self.spare.serves(&failure) => {
                        next -= 1;
                        continue;
                    }
                    // No other place has another.
                    Err(failure) if failure.code == NO_DEVICE => {
                        ended = Err(failure);
                        break;
                    }
                    Err(failure) => {
                        self.report(&stop.scene.display().to_string(), &failure);
                        break;
                    }
                },
            };
            let wanted = unmeasured(place, method, rung, &self.effort.of_times());
            let all = self.lines.as_ref().map_or(&[][..], |lines| &lines.all);
            if let Some(point) = all.iter().find(|point| point.is_same_as(&wanted)) {
                points.push(point.clone());
                continue;
            }
            let what = format!("{} by {}", place.place.scene, wanted.name());
            let title = format!("{what} ({next} of {})", self.rungs.len());
            let (effort, interrupt) = (&self.effort, self.interrupt);
            match self.progress.during(&title, || measure(place, method, rung, None, effort, interrupt)) {
                Ok(measured) => {
                    points.push(measured.point.clone());
                    self.keep(measured.point)?;
                }
                Err(failure) if failure.code == INTERRUPTED => {}
                Err(failure) => {
                    open = None;
                    if self.spare.serves(&failure) {
                        next -= 1;
                    } else {
                        self.report(&what, &failure);
                    }
                }
            }
        }
        while let Some(place) = &mut open {
            let (lines, around) = (&mut self.lines, (self.interrupt, &mut self.progress));
            let keep = |point: &Point| lines.as_mut().map_or(Ok(()), |lines| lines.renew(point.clone()));
            let cut_short = sit_again(place, &mut points, &self.effort, around, keep)?;
            open = None;
            let mut failed = cut_short.filter(|failure| failure.code != INTERRUPTED);
            if failed.as_ref().is_some_and(|failure| self.spare.serves(failure)) {
                let again = OpenPlace::open(&scene, stop.lighting, &mut self.progress);
                (open, failed) = again.map_or_else(|failure| (None, Some(failure)), |place| (Some(place), None));
            }
            if let Some(failure) = failed {
                self.report(&stop.scene.display().to_string(), &failure);
            }
        }
        self.show(&points)?;
        if self.interrupt.requested() {
            let message = format!("interrupted after {} points, which were kept", self.measured);
            return Err(Failure::with_code(INTERRUPTED, message));
        }
        ended
    }

    fn keep(&mut self, point: Point) -> Result<(), Failure> {
        self.lines.as_mut().map_or(Ok(()), |lines| lines.renew(point))?;
        self.measured += 1;
        Ok(())
    }

    fn show(&mut self, points: &[Point]) -> Result<(), Failure> {
        self.progress.clear();
        if self.to_stdout {
            let failed = |error: serde_json::Error| Failure::bad_input(error.to_string());
            return points
                .iter()
                .try_for_each(|point| output::print(&(serde_json::to_string(point).map_err(failed)? + "\n")));
        }
        if self.args.quiet { Ok(()) } else { output::print(&table_of(points)) }
    }

    fn report(&mut self, what: &str, failure: &Failure) {
        self.progress.clear();
        self.left_out.add(what, failure);
    }
}
