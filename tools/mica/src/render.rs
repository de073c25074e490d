//! `mica render`: a picture, what it cost, and what was built for it.

use crate::args::{RenderArgs, TimingChoice};
use crate::budget::{self, BudgetReport};
use crate::edit::Edit;
use crate::error::{Failure, INTERRUPTED, NO_MEMORY};
use crate::interrupt::Interrupt;
use crate::measure::{self, Measurements, PassRow, PassSum};
use crate::output::{self, Destination};
use crate::picture::Picture;
use crate::progress::Progress;
use crate::report::{
    CameraReport, DeviceReport, EnvironmentReport, FrameCounts, FrameTimes, LeftOutReport, MemoryReport, RaysReport,
    RenderReport, SCHEMA, StartReport, UpdateReport, settings,
};
use crate::report_text;
use crate::session::{Session, Shot};
use crate::spare::Spare;
use mica_gpu::Timing;
use mica_render::Update;
use std::path::Path;
use std::time::Instant;

/// Fewest frames before the first that is measured.
const LEAST_WARMUP: u32 = 2;

/// Renders, measures, writes and prints.
pub fn render(args: &RenderArgs, interrupt: &Interrupt) -> Result<(), Failure> {
    let started = Instant::now();
    let outputs = Outputs::check(args)?;
    let mut progress = Progress::new(args.quiet);
    // Whether the first frame is under way.
    let mut starts = false;
    let mut make = |keep_tables| Made::new(args, interrupt, &mut progress, started, (keep_tables, &mut starts));
    let mut made = make(true);
    if made.as_ref().is_err_and(|failure| Spare::default().serves(failure)) {
        made = make(true);
    }
    if made.as_ref().is_err_and(|failure| failure.code == NO_MEMORY && !failure.device_lost) && starts {
        // Tables that are kept travel through memory, all at once, and are never needed.
        made = Made::new(args, interrupt, &mut progress, started, (false, &mut starts));
    }
    let made = made?;
    progress.clear();
    let Made { session, budget, updates, start, shot, samples, warmup, measurements } = made;

    let Shot { picture: Some(picture), .. } = &shot else {
        return Err(Failure::bad_input("the frame gave no picture"));
    };
    let report = report(
        &session,
        &Outcome {
            args,
            shot: &shot,
            picture,
            samples,
            warmup,
            measurements: &measurements,
            updates: &updates,
            start,
            interrupted: interrupt.requested(),
        },
        budget,
    );
    for warning in report.rays.iter().filter_map(RaysReport::warning) {
        log::warn!("{warning}");
    }
    let attributes = attributes(&report);
    for (destination, kind) in &outputs.pictures {
        destination.write(&match kind {
            PictureKind::Exr => picture.exr(&attributes)?,
            PictureKind::Png => picture.png()?,
        })?;
    }
    match &outputs.json {
        Some(Json::Stdout) => output::print_json(&report)?,
        Some(Json::File(destination)) => destination.write((output::json(&report)? + "\n").as_bytes())?,
        None => {}
    }
    if !(args.quiet || matches!(outputs.json, Some(Json::Stdout))) {
        let paths = args.output.iter().chain(&args.json);
        output::print(&report_text::for_people(&report, paths))?;
    }
    if report.interrupted {
        let samples = format!("{samples} of {} samples and {} measured frames", args.samples, measurements.count());
        return Err(Failure::with_code(INTERRUPTED, format!("interrupted after {samples}, which were kept")));
    }
    Ok(())
}

/// All that is rendered, and on what.
struct Made {
    session: Session,
    budget: Option<BudgetReport>,
    updates: Vec<UpdateReport>,
    start: StartReport,
    shot: Shot,
    samples: u32,
    warmup: u32,
    measurements: Measurements,
}

impl Made {
    fn new(
        args: &RenderArgs,
        interrupt: &Interrupt,
        progress: &mut Progress,
        started: Instant,
        (keep_tables, starts): (bool, &mut bool),
    ) -> Result<Self, Failure> {
        let (mut session, budget) = match args.budget.wish() {
            Some(wish) => {
                let (session, report) = budget::choose_for(&args.scene, &wish, interrupt, progress)?;
                (session, Some(report))
            }
            None => (Session::new(&args.scene, progress)?, None),
        };
        for edit in &args.edit {
            edit.check(&session)?;
        }
        let mut work = Work { session: &mut session, interrupt, progress, frames: 0, updates: Vec::new() };
        *starts = true;
        work.start(keep_tables)?;
        *starts = false;
        let start = StartReport::new(started.elapsed(), work.session.executor.pipelines());
        for edit in &args.edit {
            edit.apply(work.session, work.progress)?;
            work.update(Some(edit))?;
        }
        let (shot, samples) = work.picture(args.samples)?;
        let warmup = work.warm_up(args)?;
        let measurements = work.measure(args)?;
        let updates = work.updates;
        Ok(Self { session, budget, updates, start, shot, samples, warmup, measurements })
    }
}

/// How a picture is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PictureKind {
    Exr,
    Png,
}

/// Where JSON goes.
enum Json {
    Stdout,
    File(Destination),
}

/// What is to be written, all of it checked before anything is rendered.
struct Outputs {
    pictures: Vec<(Destination, PictureKind)>,
    json: Option<Json>,
}

impl Outputs {
    fn check(args: &RenderArgs) -> Result<Self, Failure> {
        let json = match &args.json {
            Some(path) if path == Path::new("-") => Some(Json::Stdout),
            Some(path) => Some(Json::File(Destination::check(path)?)),
            None => None,
        };
        let mut pictures = Vec::new();
        for path in &args.output {
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            let kind = match extension.as_str() {
                "exr" => PictureKind::Exr,
                "png" => PictureKind::Png,
                _ => {
                    let path = path.display();
                    return Err(Failure::bad_input(format!("{path}: pictures are written as .exr or .png; name one")));
                }
            };
            if args.output.iter().filter(|other| *other == path).count() > 1 || args.json.as_ref() == Some(path) {
                return Err(Failure::bad_input(format!("{} is named twice; name each file once", path.display())));
            }
            pictures.push((Destination::check(path)?, kind));
        }
        Ok(Self { pictures, json })
    }
}

/// The frames of one run of the command, one after the other.
struct Work<'a> {
    session: &'a mut Session,
    interrupt: &'a Interrupt,
    progress: &'a mut Progress,
    /// How many were made so far.
    frames: u32,
    /// What they brought up to date.
    updates: Vec<UpdateReport>,
}

impl Work<'_> {
    fn frame(&mut self, sample: Option<u32>, timing: Timing, picture: bool) -> Result<Shot, Failure> {
        let shot = self.session.frame(sample, timing, picture)?;
        self.note(&shot, None);
        Ok(shot)
    }

    /// Makes the first frame, from the tables of earlier runs if they are kept. What edits cost does not depend on those.
    fn start(&mut self, keep_tables: bool) -> Result<(), Failure> {
        self.session.keep_tables(keep_tables);
        self.update(None)?;
        self.session.keep_tables(false);
        Ok(())
    }

    /// Makes the first frame, or one after an edit.
    fn update(&mut self, edit: Option<&Edit>) -> Result<(), Failure> {
        let precomputed = self.session.precompute(self.progress)?;
        let (frame, typed) = (self.frames as usize, edit.map(Edit::to_string));
        self.updates.extend(precomputed.into_iter().map(|Update { pass, why, ns }| UpdateReport {
            pass,
            why,
            runs: 1,
            ns: Some(ns),
            frame,
            edit: typed.clone(),
        }));
        let session = &mut self.session;
        let shot = self.progress.during("building tables", || session.frame(None, Timing::Isolated, false))?;
        self.note(&shot, edit);
        Ok(())
    }

    /// Notes what a frame brought up to date: nothing, where nothing was edited.
    fn note(&mut self, shot: &Shot, edit: Option<&Edit>) {
        let (frame, edit) = (self.frames as usize, edit.map(Edit::to_string));
        let sums = measure::sums(shot, true).into_iter();
        let noted =
            |PassSum { name, why, runs, ns }| UpdateReport { pass: name, why, runs, ns, frame, edit: edit.clone() };
        self.updates.extend(sums.map(noted));
        self.frames += 1;
    }

    /// The picture as the mean of so many samples, fewer after Ctrl-C; and how many there are in it.
    fn picture(&mut self, samples: u32) -> Result<(Shot, u32), Failure> {
        self.interrupt.defer();
        log::info!("all tables are there; from here on Ctrl-C keeps what is finished");
        for sample in 0.. {
            self.progress.update("samples", sample.into(), samples.into());
            let is_last = sample + 1 >= samples || self.interrupt.requested();
            let shot = self.frame((samples > 1).then_some(sample), Timing::Overlapped, is_last)?;
            if is_last {
                return Ok((shot, sample + 1));
            }
        }
        Err(Failure::bad_input("no sample was asked for"))
    }

    /// Makes up for frames that are missing before the first one measured; returns how many there were in all.
    fn warm_up(&mut self, args: &RenderArgs) -> Result<u32, Failure> {
        while self.frames < LEAST_WARMUP && args.frames > 0 && !self.interrupt.requested() {
            self.frame(None, Timing::Isolated, false)?;
        }
        Ok(self.frames)
    }

    /// Measures frames, fewer after Ctrl-C.
    fn measure(&mut self, args: &RenderArgs) -> Result<Measurements, Failure> {
        let mut measurements = Measurements::default();
        // What is measured has the pass that averages samples, if the picture has it.
        let sample = (args.samples > 1).then_some(0);
        for timing in [Timing::Isolated, Timing::Overlapped] {
            let skipped = match args.timing {
                Some(TimingChoice::Isolated) => timing == Timing::Overlapped,
                Some(TimingChoice::Overlapped) => timing == Timing::Isolated,
                None => false,
            };
            for frame in 0..args.frames {
                if skipped || self.interrupt.requested() {
                    break;
                }
                self.progress.update("measured frames", frame.into(), args.frames.into());
                let shot = self.frame(sample, timing, false)?;
                match timing {
                    Timing::Isolated => measurements.add_isolated(&shot),
                    Timing::Overlapped => measurements.add_overlapped(&shot),
                }
            }
        }
        Ok(measurements)
    }
}

/// What a report is made from, beside the session.
struct Outcome<'a> {
    args: &'a RenderArgs,
    shot: &'a Shot,
    picture: &'a Picture,
    samples: u32,
    warmup: u32,
    measurements: &'a Measurements,
    updates: &'a [UpdateReport],
    start: StartReport,
    interrupted: bool,
}

fn report(session: &Session, outcome: &Outcome, budget: Option<BudgetReport>) -> RenderReport {
    let Outcome { args, shot, measurements, .. } = *outcome;
    let mut of_picture = measure::sums(shot, false);
    of_picture.retain(|pass| !pass.name.starts_with("download "));
    of_picture.iter_mut().for_each(|pass| pass.ns = None);
    let every_frame = measurements.passes(&of_picture);
    let sum = |rows: &mut dyn Iterator<Item = &PassRow>| rows.map(|row| row.median_ns).sum::<Option<u64>>();
    let isolated_sum = sum(&mut every_frame.iter());
    let rays = shot.rays.iter().map(|traced| RaysReport::new(traced, &every_frame)).collect();
    let glint_ns = sum(&mut every_frame.iter().filter(|row| measure::is_of_glints(&row.name)));
    let mut passes = once(outcome.updates);
    passes.extend(every_frame);
    let validation = args
        .scene
        .device
        .validation
        .then(|| session.executor.device().take_messages().iter().map(ToString::to_string).collect());
    RenderReport {
        schema: SCHEMA,
        scene: session.scene.clone(),
        method: session.method(),
        budget,
        settings: settings(session.renderer.materials()),
        size: session.view.size,
        samples: outcome.samples,
        camera: CameraReport::new(&session.view.camera),
        environment: EnvironmentReport {
            name: session.environment.clone(),
            rotation_deg: session.environment_rotation_deg,
        },
        lights: session.lights.len(),
        device: DeviceReport::new(session.device()),
        occlusion: session.renderer.occlusion().name(),
        occlusion_why: session.occlusion_why.clone(),
        frames: FrameCounts { warmup: outcome.warmup, measured: measurements.count() },
        passes,
        frame_ns: FrameTimes {
            isolated_sum,
            overlapped_median: measurements.overlapped_median_ns(),
            overlapped_cpu_median: measurements.cpu_median_ns(),
        },
        glint_ns,
        rays,
        memory: session.executor.memory().into_iter().map(MemoryReport::new).collect(),
        edits: args.edit.iter().map(Edit::to_string).collect(),
        updates: outcome.updates.to_vec(),
        start: outcome.start,
        image: outcome.picture.summary(),
        left_out: shot.left_out.iter().map(LeftOutReport::new).collect(),
        validation,
        interrupted: outcome.interrupted,
    }
}

/// The passes that built tables, each with its time in the last frame that ran it.
fn once(updates: &[UpdateReport]) -> Vec<PassRow> {
    let mut rows: Vec<(usize, PassRow)> = Vec::new();
    for UpdateReport { pass, runs, ns, frame, .. } in updates {
        let new = PassRow { name: pass.clone(), runs: *runs, once: true, median_ns: *ns, min_ns: *ns, max_ns: *ns };
        match rows.iter_mut().find(|(_, row)| row.name == *pass) {
            Some((of_frame, row)) if of_frame == frame => {
                let ns = row.median_ns.zip(*ns).map(|(a, b)| a + b);
                *row = PassRow { runs: row.runs + runs, median_ns: ns, min_ns: ns, max_ns: ns, ..new };
            }
            Some(earlier) => *earlier = (*frame, new),
            None => rows.push((*frame, new)),
        }
    }
    rows.into_iter().map(|(_, row)| row).collect()
}

/// What an .exr says of itself: all that decides its pixels, and nothing that changes from run to run.
fn attributes(report: &RenderReport) -> Vec<(&'static str, String)> {
    let [ex, ey, ez] = report.camera.eye;
    let [fx, fy, fz] = report.camera.forward;
    let environment = match report.environment.rotation_deg {
        0.0 => report.environment.name.clone(),
        degrees => format!("{} turned by {degrees} degrees", report.environment.name),
    };
    vec![
        ("scene", report.scene.clone()),
        ("method", report.method.clone()),
        ("settings", report.settings.to_string()),
        (
            "camera",
            format!(
                "eye {ex},{ey},{ez} metres, looking along {fx},{fy},{fz}, vertical field of view {} degrees",
                report.camera.vertical_fov_deg
            ),
        ),
        ("environment", environment),
        ("lights", report.lights.to_string()),
        ("occlusion", report.occlusion.to_owned()),
        ("samples", report.samples.to_string()),
        ("device", format!("{}, {}, Vulkan {}", report.device.name, report.device.driver, report.device.api)),
    ]
}
