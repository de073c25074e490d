//! Measures what is not known yet of a view: cheap methods first, and none for longer than it can matter.

use super::command;
use super::kept::Kept;
use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::measure;
use crate::progress::Progress;
use crate::session::{Session, Wanted};
use crate::study::{self, Effort, OpenPlace, Reference};
use mica_accuracy::{Estimate, Place, Point};
use mica_gpu::Timing;
use mica_render::{MethodInfo, Rung, View};

/// What a driver on the processor may need to compile the shaders of a method when they first run, in nanoseconds.
const COMPILATION_NS: f64 = 20e9;

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
    /// How many points this run added.
    pub measured: usize,
    /// What cannot be chosen.
    pub skipped: Vec<Skipped>,
}

impl<'a> Measuring<'a> {
    /// Nothing is measured yet.
    pub fn new(
        args: &'a SceneArgs,
        session: Session,
        effort: &'a Effort,
        limit_ns: f64,
        kept: &'a mut Kept,
        (interrupt, progress): (&'a Interrupt, &'a mut Progress),
    ) -> Self {
        Self {
            args,
            effort,
            limit_ns,
            kept,
            interrupt,
            progress,
            session: Some(session),
            open: None,
            reference: None,
            measured: 0,
            skipped: Vec::new(),
        }
    }

    /// Measures what is missing, in this order. Ladders go from cheap to dear, so that a rung that takes too long ends its
    /// own.
    ///
    /// # Errors
    /// An interrupt, or if the view cannot be rendered at all.
    pub fn all(&mut self, candidates: &[Candidate]) -> Result<(), Failure> {
        let mut ended: Vec<Candidate> = Vec::new();
        for (index, candidate) in candidates.iter().enumerate() {
            let (method, rung) = *candidate;
            if let Some((_, dear)) = ended.iter().find(|(of, _)| of.name == method.name) {
                self.skip(*candidate, format!("dearer than {}", dear.name));
                continue;
            }
            let known = self.kept.point(method, rung).filter(|point| self.is_enough(point)).cloned();
            let title = format!("measuring {}, {} ({} of {})", method.name, rung.name, index + 1, candidates.len());
            let point = if known.is_some() { known } else { self.measure(*candidate, &title)? };
            if let Some(Point { errors: None, cost, .. }) = point {
                self.skip(*candidate, format!("takes about {:.0} ms", cost.glint_ns() * 1e-6));
                ended.push(*candidate);
            }
        }
        self.progress.clear();
        Ok(())
    }

    /// The view, ready to be rendered with what was chosen: as if nothing had been measured.
    pub fn finish(self) -> Result<Session, Failure> {
        // What measurements left on the device goes first.
        drop(self.open);
        self.session.map_or_else(|| Session::new(self.args, self.progress), Ok)
    }

    /// A point without errors says no more than that it takes too long; a longer limit needs more.
    fn is_enough(&self, point: &Point) -> bool {
        point.errors.is_some() || point.cost.glint_ns() > self.limit_ns
    }

    fn skip(&mut self, candidate: Candidate, why: String) {
        self.skipped.push(Skipped { candidate, why });
    }

    /// Measures and keeps a point; none where this candidate cannot be rendered.
    fn measure(&mut self, candidate: Candidate, title: &str) -> Result<Option<Point>, Failure> {
        let (method, rung) = candidate;
        let (mut open, without_ns) = self.opened()?;
        let (limit_ns, interrupt) = (self.limit_ns, self.interrupt);
        let rough = self.progress.during(title, || rough_ns(&mut open, candidate, without_ns, limit_ns, interrupt));
        let Some(ns) = self.tried(candidate, rough)? else { return Ok(None) };
        let point = if ns > limit_ns {
            let mut point = study::unmeasured(&open, method, rung, &self.effort.of_times());
            point.cost.glints = Estimate::exact(ns);
            point.cost.frame = Estimate::exact(ns + without_ns);
            point
        } else {
            self.prepare_reference(&mut open)?;
            let (reference, effort) = (self.reference.as_ref(), self.effort);
            let measured =
                self.progress.during(title, || study::measure(&mut open, method, rung, reference, effort, interrupt));
            let Some(measured) = self.tried(candidate, measured)? else { return Ok(None) };
            measured.point
        };
        log::info!("{title}: {:.3} ms", point.cost.glint_ns() * 1e-6);
        self.open = Some((open, without_ns));
        self.kept.add(point.clone());
        self.measured += 1;
        Ok(Some(point))
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
        frame_ns(&mut open, false, self.interrupt)?;
        let without_ns = frame_ns(&mut open, false, self.interrupt)?;
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

/// What the glints of a candidate take, roughly, in nanoseconds: of one frame, pass by pass.
fn rough_ns(
    open: &mut OpenPlace,
    (method, rung): Candidate,
    without_ns: f64,
    limit_ns: f64,
    interrupt: &Interrupt,
) -> Result<f64, Failure> {
    open.set(method, rung.set)?;
    open.session.precompute(&mut Progress::new(true))?;
    let first = frame_ns(open, true, interrupt)? - without_ns;
    let may_be_compilation = first > limit_ns && first < limit_ns + COMPILATION_NS;
    if may_be_compilation { Ok(frame_ns(open, true, interrupt)? - without_ns) } else { Ok(first) }
}

/// The passes of a frame, without those that bring tables up to date.
fn frame_ns(open: &mut OpenPlace, glints: bool, interrupt: &Interrupt) -> Result<f64, Failure> {
    if interrupt.requested() {
        return Err(Failure::with_code(INTERRUPTED, "interrupted"));
    }
    let view = View { glints, ..open.session.view.clone() };
    let shot = open.session.look(&view, Timing::Isolated, Wanted::default())?;
    Ok(measure::sums(&shot, false).iter().filter_map(|pass| pass.ns).map(|ns| ns as f64).sum())
}
