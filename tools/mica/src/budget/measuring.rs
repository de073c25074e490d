//! Measures what is not known yet of a view: cheap methods first, and none for longer than it can matter to the choice.

use super::command;
use super::goal::Wish;
use super::kept::Kept;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED, NO_DEVICE};
use crate::interrupt::Interrupt;
use crate::measure;
use crate::progress::Progress;
use crate::session::{Session, Wanted};
use crate::study::{self, Effort, OpenPlace, Reference};
use mica_accuracy::exactness::Clock;
use mica_accuracy::{Cost, Errors, Estimate, Goal, Metric, Place, Point, Weight, choose};
use mica_gpu::Timing;
use mica_render::{MethodInfo, Rung, View};
use std::collections::BTreeSet;

/// What a driver on the processor may need to compile the shaders of a method when they first run, in nanoseconds.
const COMPILATION_NS: f64 = 20e9;
/// By how much a few frames may be off the median of many: what they say is cheaper by less may be dearer. A factor, and a
/// share of the frame without glints, as others who use a processor disturb all of a frame.
const DOUBT: [f64; 2] = [1.5, 0.25];
/// Of so many pixels along each side one is rendered where pixels are few.
const STRIDE: u32 = 8;
/// The effort of points whose times are those of the lesser of two frames.
const TWO_FRAMES: &str = "two frames";

/// A method with a rung of its ladder.
pub type Candidate = (&'static MethodInfo, &'static Rung);

/// A candidate that cannot be chosen.
pub struct Skipped {
    /// Which.
    pub candidate: Candidate,
    /// Why.
    pub why: String,
}

/// The work of one run.
pub struct Measuring<'a> {
    args: &'a SceneArgs,
    effort: &'a Effort,
    /// Whether FLIP is among the errors that are wanted: it takes longer than all others together.
    sees_flip: bool,
    /// What takes longer is not held against the reference.
    limit_ns: f64,
    kept: &'a mut Kept,
    interrupt: &'a Interrupt,
    progress: &'a mut Progress,
    /// As long as nothing was measured.
    session: Option<Session>,
    /// While something is measured, with the time of its frame without glints.
    open: Option<(OpenPlace, f64)>,
    reference: Option<Reference>,
    /// Method and rung of the points that this run added to.
    measured: BTreeSet<(&'static str, &'static str)>,
    /// What cannot be chosen.
    pub skipped: Vec<Skipped>,
}

impl<'a> Measuring<'a> {
    /// Nothing is measured yet.
    pub fn new(
        args: &'a SceneArgs,
        session: Session,
        (effort, sees_flip): (&'a Effort, bool),
        limit_ns: f64,
        kept: &'a mut Kept,
        (interrupt, progress): (&'a Interrupt, &'a mut Progress),
    ) -> Self {
        Self {
            args,
            effort,
            sees_flip,
            limit_ns,
            kept,
            interrupt,
            progress,
            session: Some(session),
            open: None,
            reference: None,
            measured: BTreeSet::new(),
            skipped: Vec::new(),
        }
    }

    /// Measures what the choice depends on: two frames of every candidate first, and then, from cheap to dear, errors and times
    /// until the step after the chosen one is known.
    ///
    /// # Errors
    /// An interrupt, or if the view cannot be rendered at all.
    pub fn all(&mut self, candidates: &[Candidate], wish: &Wish) -> Result<(), Failure> {
        let mut probed = self.probe_all(candidates)?;
        probed.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        for (index, (candidate, least_ns)) in probed.iter().enumerate() {
            if let Some(why) = self.end(candidates, wish, *least_ns) {
                probed[index..].iter().for_each(|(candidate, _)| self.skip(*candidate, why.clone()));
                break;
            }
            self.compare(*candidate, wish.metric, &format!("({} of {})", index + 1, probed.len()))?;
        }
        self.progress.clear();
        Ok(())
    }

    /// All points that are known, those with errors whose times are known too: what can be chosen.
    pub fn points(&self, candidates: &[Candidate]) -> Vec<Point> {
        let known = candidates.iter().filter_map(|(method, rung)| self.kept.point(method, rung));
        known
            .map(|point| if self.is_timed(point) { point.clone() } else { Point { errors: None, ..point.clone() } })
            .collect()
    }

    /// How many points this run added.
    pub fn measured(&self) -> usize {
        self.measured.len()
    }

    /// The candidates that may be chosen, each with what its glints take at least. Ladders go from cheap to dear, so that
    /// a rung that takes too long ends its own.
    fn probe_all(&mut self, candidates: &[Candidate]) -> Result<Vec<(Candidate, f64)>, Failure> {
        let mut probed = Vec::new();
        let mut ended: Vec<Candidate> = Vec::new();
        for (index, candidate) in candidates.iter().enumerate() {
            let (method, rung) = *candidate;
            if let Some((_, dear)) = ended.iter().find(|(of, _)| of.name == method.name) {
                self.skip(*candidate, format!("dearer than {}", dear.name));
                continue;
            }
            let known = self.kept.point(method, rung).cloned();
            let title = format!("looking at {}, {} ({} of {})", method.name, rung.name, index + 1, candidates.len());
            let point = if known.is_some() { known } else { self.probe(*candidate, &title)? };
            let Some(point) = point else { continue };
            let ns = point.cost.glint_ns();
            if ns > self.limit_ns {
                self.skip(*candidate, format!("takes about {:.0} ms", ns * 1e-6));
                ended.push(*candidate);
            } else {
                probed.push((*candidate, self.least_ns(&point)));
            }
        }
        Ok(probed)
    }

    /// What the glints of a point take at least, as far as is known.
    fn least_ns(&self, point: &Point) -> f64 {
        let Cost { glints, frame, .. } = &point.cost;
        let [factor, share] = DOUBT;
        if self.is_timed(point) {
            point.cost.glint_ns()
        } else {
            glints.value / factor - share * (frame.value - glints.value)
        }
    }

    /// Why no candidate need be measured that takes at least so long, if that is so.
    fn end(&self, candidates: &[Candidate], wish: &Wish, least_ns: f64) -> Option<String> {
        match (choose(&self.points(candidates), wish.metric, wish.goal), wish.goal) {
            (Ok(choice), _) => choice
                .next_better
                .filter(|better| least_ns > better.cost.glint_ns())
                .map(|better| format!("dearer than {}", better.name())),
            (Err(_), Goal::Budget { ns }) if least_ns > ns => Some("over the budget".to_owned()),
            (Err(_), _) => None,
        }
    }

    /// The view, ready to be rendered with what was chosen: as if nothing had been measured.
    pub fn finish(self) -> Result<Session, Failure> {
        // What measurements left on the device goes first.
        drop(self.open);
        self.session.map_or_else(|| Session::new(self.args, self.progress), Ok)
    }

    /// Whether a point is surely cheaper than another, whose times are those of two frames, and more accurate.
    fn beats(&self, point: &Point, other: &Point, metric: Metric) -> bool {
        let known = |point: &Point| point.errors.as_ref().and_then(|errors| metric.of(errors));
        let error = |point: &Point| known(point).map(|error| Weight::of_error(error).value);
        let is_cheaper = self.is_timed(point) && point.cost.glint_ns() < self.least_ns(other);
        is_cheaper && error(point).zip(error(other)).is_some_and(|(error, other)| error <= other)
    }

    /// Whether the times of a point are of many frames.
    fn is_timed(&self, point: &Point) -> bool {
        point.effort == self.effort.describe()
    }

    fn skip(&mut self, candidate: Candidate, why: String) {
        self.skipped.push(Skipped { candidate, why });
    }

    fn keep(&mut self, (method, rung): Candidate, point: Point) {
        self.measured.insert((method.name, rung.name));
        self.kept.add(point);
    }

    /// Keeps and returns a point with what the glints of a candidate take by two frames; none where it cannot be rendered.
    fn probe(&mut self, candidate: Candidate, title: &str) -> Result<Option<Point>, Failure> {
        let (method, rung) = candidate;
        let (mut open, without_ns) = self.opened()?;
        let (limit_ns, interrupt) = (self.limit_ns, self.interrupt);
        let rough = self.progress.during(title, || rough_ns(&mut open, candidate, without_ns, limit_ns, interrupt));
        let Some(ns) = self.tried(candidate, rough)? else { return Ok(None) };
        let mut point = study::unmeasured(&open, method, rung, TWO_FRAMES);
        point.cost.glints = Estimate::exact(ns);
        point.cost.frame = Estimate::exact(ns + without_ns);
        log::info!("{title}: {:.3} ms", ns * 1e-6);
        self.open = Some((open, without_ns));
        self.keep(candidate, point.clone());
        Ok(Some(point))
    }

    /// Makes the errors of a candidate known and, unless another is surely both cheaper and more accurate, its times.
    fn compare(&mut self, candidate: Candidate, metric: Metric, place: &str) -> Result<(), Failure> {
        let (method, rung) = candidate;
        let Some(mut point) = self.kept.point(method, rung).cloned() else { return Ok(()) };
        let title = format!("measuring {}, {} {place}", method.name, rung.name);
        if point.errors.is_none() {
            let Some(errors) = self.errors(candidate, &title)? else { return Ok(()) };
            point.errors = Some(errors);
            self.keep(candidate, point.clone());
        }
        if self.is_timed(&point) {
            return Ok(());
        }
        if let Some(better) = self.kept.all().iter().find(|other| self.beats(other, &point, metric)) {
            let why = format!("{} is cheaper and more accurate", better.name());
            self.skip(candidate, why);
            return Ok(());
        }
        let (mut open, without_ns) = self.opened()?;
        let (effort, interrupt) = (self.effort, self.interrupt);
        let times = self.progress.during(&title, || {
            open.set(method, rung.set)?;
            study::paired(&mut open, effort, interrupt)
        });
        let Some(cost) = self.tried(candidate, times)? else { return Ok(()) };
        log::info!("{title}: {:.3} ms", cost.glint_ns() * 1e-6);
        self.open = Some((open, without_ns));
        self.keep(candidate, Point { cost, effort: effort.describe(), ..point });
        Ok(())
    }

    /// The errors of a candidate; none where it cannot be rendered.
    fn errors(&mut self, candidate: Candidate, title: &str) -> Result<Option<Errors>, Failure> {
        let (method, rung) = candidate;
        let (mut open, without_ns) = self.opened()?;
        self.prepare_reference(&mut open)?;
        let (reference, interrupt, sees_flip) = (self.reference.as_ref(), self.interrupt, self.sees_flip);
        let errors = self.progress.during(title, || {
            let Some(Reference { pixels, base, path, .. }) = reference else { return Ok(None) };
            open.set(method, rung.set)?;
            open.session.precompute(&mut Progress::new(true))?;
            let view = open.session.view.clone();
            let picture = open.radiance(&view)?;
            let path = pixels.path_errors(&study::path_frames(&mut open, &picture, path, interrupt)?)?;
            let errors = pixels.errors(&picture, base, sees_flip.then_some(view.exposure))?;
            Ok::<_, Failure>(Some(Errors { path, ..errors }))
        });
        let errors = self.tried(candidate, errors)?.flatten();
        if errors.is_some() {
            self.open = Some((open, without_ns));
        }
        Ok(errors)
    }

    /// What came of an attempt at a candidate; none where it failed, which is the candidate's own matter.
    fn tried<T>(&mut self, candidate: Candidate, result: Result<T, Failure>) -> Result<Option<T>, Failure> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(failure) if failure.code == INTERRUPTED => Err(failure),
            Err(failure) => {
                self.skip(candidate, failure.to_string());
                Ok(None)
            }
        }
    }

    /// The view, opened to be measured: for the first time, or anew after a failure, as frames may be lost with it.
    fn opened(&mut self) -> Result<(OpenPlace, f64), Failure> {
        if self.interrupt.requested() {
            return Err(Failure::with_code(INTERRUPTED, "interrupted"));
        }
        if let Some(open) = self.open.take() {
            return Ok(open);
        }
        let session = self.session.take().map_or_else(|| Session::new(self.args, self.progress), Ok)?;
        let place = Place { scene: session.scene.clone(), lighting: "own".to_owned(), size: self.args.size };
        let mut open = OpenPlace::of_session(session, place, command::options(self.args))?;
        // The first frame compiles shaders where the device is the processor.
        let without = View { glints: false, ..open.session.view.clone() };
        frame_ns(&mut open, &without, self.interrupt)?;
        let mut again = || frame_ns(&mut open, &without, self.interrupt);
        let without_ns = again()?.min(again()?);
        Ok((open, without_ns))
    }

    /// Takes the reference from the cache or renders it, once.
    fn prepare_reference(&mut self, open: &mut OpenPlace) -> Result<(), Failure> {
        if self.reference.is_some() {
            return Ok(());
        }
        let stored = self.kept.reference();
        let stored = stored.map(|(line, pixels)| Reference::of_stored(open, self.effort, line, pixels)).transpose()?;
        self.reference = Some(match stored {
            Some(reference) => reference,
            None => {
                let names = ["reference.png", "reference.exr"].map(str::to_owned);
                let reference = Reference::render(open, self.effort, names, self.interrupt, self.progress)?;
                self.kept.keep_reference(&reference);
                reference
            }
        });
        self.progress.clear();
        Ok(())
    }
}

/// What the glints of a candidate take in nanoseconds, by the lesser of two frames.
fn rough_ns(
    open: &mut OpenPlace,
    (method, rung): Candidate,
    without_ns: f64,
    limit_ns: f64,
    interrupt: &Interrupt,
) -> Result<f64, Failure> {
    open.set(method, rung.set)?;
    open.session.precompute(&mut Progress::new(true))?;
    // Few of the very pixels make tables and have shaders compiled, and say what would take too long.
    let view = open.session.view.clone();
    let few = View { size: view.size.map(|side| side.div_ceil(STRIDE)), ..view.part(STRIDE, STRIDE / 2, STRIDE / 2) };
    let first = open.session.look(&few, Timing::Isolated, Wanted::default())?;
    let first: u64 = measure::sums(&first, false).iter().filter_map(|pass| pass.ns).sum();
    let first = first as f64;
    if first > limit_ns + COMPILATION_NS {
        return Ok(first);
    }
    let ns = frame_ns(open, &view, interrupt)? - without_ns;
    // What takes too long need not be looked at twice.
    if ns > limit_ns { Ok(ns) } else { Ok(ns.min(frame_ns(open, &view, interrupt)? - without_ns)) }
}

/// What a frame takes by the clock of its device.
fn frame_ns(open: &mut OpenPlace, view: &View, interrupt: &Interrupt) -> Result<f64, Failure> {
    if interrupt.requested() {
        return Err(Failure::with_code(INTERRUPTED, "interrupted"));
    }
    let clock = Clock::of(&open.session.executor);
    let shot = open.session.look(view, clock.timing(), Wanted::default())?;
    clock.ns(&shot.run).ok_or_else(|| Failure::with_code(NO_DEVICE, "the device gave no time for a frame; run again"))
}
