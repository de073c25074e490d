//! `mica accuracy -o DIR`: measures what is missing in a study, and keeps every point as soon as it is finished.

use super::Folder;
use super::effort::Effort;
use super::left_out::LeftOut;
use super::measure::{measure, unmeasured};
use super::place::OpenPlace;
use super::plan::{self, Stop};
use super::reference::Reference;
use super::sittings::sit_again;
use super::store::{picture_names, reference_names};
use super::tables;
use crate::accuracy::AccuracyArgs;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED, NO_DEVICE};
use crate::interrupt::Interrupt;
use crate::output;
use crate::progress::Progress;
use crate::scene_choice;
use crate::spare::Spare;
use mica_accuracy::Point;
use mica_gpu::Executor;
use mica_render::{MethodInfo, Rung};

/// Measures what is missing, keeps it and prints all.
pub fn study(
    args: &AccuracyArgs,
    folder: &mut Folder,
    methods: &[&'static MethodInfo],
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Result<(), Failure> {
    let scenes = if args.scene.is_empty() { plan::scenes(args.quick) } else { args.scene.clone() };
    let default_size = if args.quick { [320, 180] } else { [640, 360] };
    let sizes = if args.size.is_empty() { vec![default_size] } else { args.size.clone() };
    scenes.iter().try_for_each(|scene| scene_choice::check(scene))?;
    let stops = plan::stops(&scenes, &sizes, &args.lighting);
    let effort = effort(args);
    interrupt.defer();
    let mut run = Run {
        args,
        effort: &effort,
        rungs: plan::rungs(methods, args.quick),
        interrupt,
        progress,
        folder,
        executor: None,
        left_out: LeftOut::default(),
        spare: Spare::default(),
        measured: 0,
    };
    let finished = stops.iter().try_for_each(|stop| run.stop(stop));
    let Run { measured, left_out, folder, progress, .. } = run;
    progress.clear();
    if !args.quiet {
        let path = folder.path.join("points.jsonl");
        let all = folder.points.all.len();
        output::print(&format!("\n{}: {measured} points measured, {all} in all\n", path.display()))?;
    }
    finished.map_err(|failure| match failure.code {
        INTERRUPTED => {
            let message = format!("interrupted after {measured} points, which were kept; the same command goes on");
            Failure::with_code(INTERRUPTED, message)
        }
        _ => failure,
    })?;
    left_out.end()
}

/// How much work the command line asks for.
fn effort(args: &AccuracyArgs) -> Effort {
    let mut effort = if args.quick { Effort::quick() } else { Effort::full() };
    effort.seconds = args.seconds.unwrap_or(effort.seconds);
    if let Some(most) = args.rounds {
        effort.rounds = [effort.rounds[0].min(most), most];
    }
    effort
}

struct Run<'a> {
    args: &'a AccuracyArgs,
    effort: &'a Effort,
    rungs: Vec<(&'static MethodInfo, &'static Rung)>,
    interrupt: &'a Interrupt,
    progress: &'a mut Progress,
    folder: &'a mut Folder,
    /// That of the last place, if all went well there.
    executor: Option<Executor>,
    left_out: LeftOut,
    spare: Spare,
    measured: usize,
}

impl Run<'_> {
    /// A place with all its points. One that cannot be measured is reported, and the others go on.
    ///
    /// # Errors
    /// An interrupt, a device that is missing, and whatever keeps results from being kept.
    fn stop(&mut self, stop: &Stop) -> Result<(), Failure> {
        let mut next = 0;
        let mut shown = Vec::new();
        loop {
            // After a failure the place is opened anew, as frames may be lost with it.
            match self.stop_from(stop, &mut next, &mut shown) {
                Ok(()) => break,
                Err(Stopped::For(failure)) => {
                    self.show(&shown)?;
                    return Err(failure);
                }
                Err(Stopped::At(_, failure)) if self.spare.serves(&failure) => next -= 1,
                Err(Stopped::At(what, failure)) => self.report(&what, &failure),
                Err(Stopped::Place(failure)) if self.spare.serves(&failure) => {
                    // What is shown is what is kept: from the start again.
                    next = 0;
                    shown.clear();
                }
                Err(Stopped::Place(failure)) => {
                    self.report(&stop.scene.display().to_string(), &failure);
                    break;
                }
            }
        }
        self.show(&shown)
    }

    fn stop_from(&mut self, stop: &Stop, next: &mut usize, shown: &mut Vec<Point>) -> Result<(), Stopped> {
        self.check_interrupt()?;
        let scene = SceneArgs {
            scene: stop.scene.clone(),
            size: stop.size,
            occlusion: self.args.occlusion,
            device: self.args.device.clone(),
            ..SceneArgs::of("")
        };
        let earlier = self.executor.take();
        let mut open = OpenPlace::open_on(earlier, &scene, stop.lighting, self.progress).map_err(|failure| {
            match failure.code {
                // No other place has another.
                NO_DEVICE => Stopped::For(failure),
                _ => Stopped::Place(failure),
            }
        })?;
        let mut reference = None;
        // Whoever looks at the study finds what its points were compared with, even where none of them is missing.
        if let Some(lost) = self.folder.lost_reference(&open, self.effort) {
            log::warn!("{}: it is lost or damaged, and rendered again", lost.display());
            reference = Some(self.reference(&mut open)?);
        }
        while let Some((method, rung)) = self.rungs.get(*next).copied() {
            self.check_interrupt()?;
            *next += 1;
            let wanted = unmeasured(&open, method, rung, &self.effort.describe());
            let known = self.folder.points.all.iter().find(|point| point.is_same_as(&wanted));
            if let Some(point) = known.filter(|point| self.folder.has_pictures(point)) {
                shown.push(point.clone());
                continue;
            }
            if reference.is_none() {
                reference = Some(self.reference(&mut open)?);
            }
            let what = format!("{} by {}", open.place.scene, wanted.name());
            let title = format!("{what} ({next} of {})", self.rungs.len());
            let (effort, interrupt) = (self.effort, self.interrupt);
            let measured = self
                .progress
                .during(&title, || measure(&mut open, method, rung, reference.as_ref(), effort, interrupt))
                .map_err(|failure| match failure.code {
                    INTERRUPTED => Stopped::For(failure),
                    _ => Stopped::At(what, failure),
                })?;
            let mut point = measured.point;
            if let Some(pictures) = measured.pictures {
                let names = picture_names(&point);
                for (name, bytes) in names.iter().zip(&pictures) {
                    self.folder.write(name, bytes).map_err(Stopped::For)?;
                }
                point.pictures = Some(names);
            }
            self.folder.points.renew(point.clone()).map_err(Stopped::For)?;
            self.measured += 1;
            shown.push(point);
        }
        let (folder, around) = (&mut *self.folder, (self.interrupt, &mut *self.progress));
        let keep = |point: &Point| folder.points.renew(point.clone());
        match sit_again(&mut open, shown, self.effort, around, keep).map_err(Stopped::For)? {
            Some(failure) if failure.code == INTERRUPTED => return Err(Stopped::For(failure)),
            Some(failure) => return Err(Stopped::Place(failure)),
            None => {}
        }
        self.executor = Some(open.session.into_executor());
        Ok(())
    }

    /// The reference of a place: the one that was kept, or a new one.
    fn reference(&mut self, open: &mut OpenPlace) -> Result<Reference, Stopped> {
        let of_place = |failure: Failure| {
            if failure.code == INTERRUPTED { Stopped::For(failure) } else { Stopped::Place(failure) }
        };
        if let Some((line, pixels)) = self.folder.reference(open, self.effort) {
            return Reference::of_stored(open, self.effort, line, pixels).map_err(of_place);
        }
        let names = reference_names(&open.place);
        let reference = Reference::render(open, self.effort, names, self.interrupt, self.progress).map_err(of_place)?;
        self.progress.clear();
        self.folder.keep_reference(&reference, open.session.view.exposure).map_err(Stopped::For)?;
        Ok(reference)
    }

    fn check_interrupt(&self) -> Result<(), Stopped> {
        if self.interrupt.requested() {
            return Err(Stopped::For(Failure::with_code(INTERRUPTED, "interrupted")));
        }
        Ok(())
    }

    fn report(&mut self, what: &str, failure: &Failure) {
        self.progress.clear();
        self.left_out.add(what, failure);
    }

    fn show(&mut self, points: &[Point]) -> Result<(), Failure> {
        self.progress.clear();
        if self.args.quiet || points.is_empty() {
            return Ok(());
        }
        output::print(&tables::of_place(points))
    }
}

/// Why a place was left before its last point.
enum Stopped {
    /// Nothing more can be done at all.
    For(Failure),
    /// One point cannot be measured.
    At(String, Failure),
    /// The whole place cannot.
    Place(Failure),
}
