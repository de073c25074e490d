//! `mica render --budget-ms` and `--target-error`: method and settings chosen by what they cost and show of this view on this
//! device.

mod command;
mod goal;
mod kept;
mod measuring;
mod report;

pub use goal::{BudgetArgs, Wish};
pub use report::BudgetReport;

use crate::args::SceneArgs;
use crate::error::{Failure, INTERRUPTED};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::session::{Loaded, Session};
use crate::study::{self, Effort};
use kept::Kept;
use measuring::{Candidate, Measuring};
use mica_accuracy::{Goal, Metric, NothingFits, Point, choose};
use mica_render::{COMMON_SETTINGS, Claim, METHODS, method};

/// Names this way of measuring: another is another entry of the cache.
const SCHEMA: &str = "mica-budget-2";
/// What takes more than so many times the budget is not compared, nor are dearer rungs of its method looked at.
const FAR_OVER_BUDGET: f64 = 20.0;
/// Nor is what takes longer than this, in nanoseconds, whatever the goal: a point needs a dozen frames.
const SLOWEST_NS: f64 = 5e9;

/// Measures what is not known yet, chooses, and sets the scene to what was chosen.
///
/// # Errors
/// If nothing reaches the goal; if the command line sets what is to be chosen; on Ctrl-C, with what was measured kept.
pub fn choose_for(
    args: &SceneArgs,
    wish: &Wish,
    interrupt: &Interrupt,
    progress: &mut Progress,
) -> Result<(Session, BudgetReport), Failure> {
    let loaded = Loaded::new(args, progress)?;
    let scene = loaded.fingerprint();
    let session = Session::of(loaded, args, None)?;
    refuse_what_is_chosen(args)?;
    let effort = effort(wish.metric);
    let how = (&effort, sees_flip(wish.metric));
    let mut kept = Kept::open(session.cache().cloned(), &decisive(&session, &scene, args, how));
    let candidates = candidates(args.method.as_deref())?;

    // Points are kept one by one.
    interrupt.defer();
    let mut measuring = Measuring::new(args, session, how, limit_ns(wish.goal), &mut kept, (interrupt, &mut *progress));
    let done = measuring.all(&candidates, wish);
    let (points, measured) = (measuring.points(&candidates), measuring.measured());
    let skipped = std::mem::take(&mut measuring.skipped);
    let done = done.and_then(|()| measuring.finish());
    progress.clear();
    let mut session = done.map_err(|failure| match failure.code {
        INTERRUPTED => interrupted(measured, &kept),
        _ => failure,
    })?;

    let choice = choose(&points, wish.metric, wish.goal).map_err(|nothing| nothing_fits(wish, &nothing))?;
    session.renderer.set_method(None, &choice.chosen.method)?;
    for (key, value) in &choice.chosen.set {
        session.renderer.set(None, key, value)?;
    }
    let report =
        BudgetReport { measured, kept: points.len() - measured, ..BudgetReport::new(wish, &choice, args, skipped) };
    Ok((session, report))
}

/// Little: a budget is asked for by somebody who waits. A reference of 2x2 and 3x3 parts takes a third of the time of a quick
/// study's and moves W1 by .002 of the mean (`shoe`, 320x180), a fifth of its interval.
fn effort(metric: Metric) -> Effort {
    let path_frames = if metric == Metric::Flicker { Effort::quick().path_frames } else { 0 };
    Effort { parts: [2, 3], path_frames, sittings: 1, seconds: 1.0, rounds: [2, 5], isolated: 1, ..Effort::quick() }
}

/// FLIP takes longer than all other errors together.
fn sees_flip(metric: Metric) -> bool {
    matches!(metric, Metric::Flip | Metric::HdrFlip)
}

/// All rungs of one method or of all: those first that claim little, as they are cheap.
fn candidates(name: Option<&str>) -> Result<Vec<Candidate>, Failure> {
    let mut methods = match name {
        Some(name) => vec![method(name)?],
        None => METHODS.iter().collect(),
    };
    methods.sort_by_key(|method| match method.claim {
        Claim::Mean => 0,
        Claim::Look => 1,
        Claim::Distribution => 2,
        Claim::Pixels => 3,
    });
    Ok(study::rungs(&methods, false))
}

fn limit_ns(goal: Goal) -> f64 {
    match goal {
        Goal::Budget { ns } => SLOWEST_NS.min(FAR_OVER_BUDGET * ns),
        Goal::TargetError(_) => SLOWEST_NS,
    }
}

/// Settings of a method are what is chosen: nobody else may say them. What every method has describes the material.
fn refuse_what_is_chosen(args: &SceneArgs) -> Result<(), Failure> {
    let describes = |key: &str| COMMON_SETTINGS.iter().any(|setting| setting.key == key);
    let refused = args.set.iter().chain(&args.glint).find(|change| !describes(&change.key));
    refused.map_or(Ok(()), |change| {
        let may_be: Vec<&str> = COMMON_SETTINGS.iter().map(|setting| setting.key).collect();
        Err(Failure::bad_input(format!(
            "{change}: --budget-ms and --target-error choose the method and its settings; leave this out and set only \
             what every method has ({}), or choose among the settings of one with --method",
            may_be.join(", ")
        )))
    })
}

/// Everything that decides the figures, in words.
fn decisive(session: &Session, scene: &str, args: &SceneArgs, (effort, sees_flip): (&Effort, bool)) -> String {
    let materials: Vec<_> = session
        .renderer
        .materials()
        .iter()
        .map(|material| {
            (
                material.index,
                material.uv_set,
                COMMON_SETTINGS.iter().map(|of| material.values.get(of.key)).collect::<Vec<_>>(),
            )
        })
        .collect();
    let machine = study::machine(session.device(), session.renderer.occlusion().name());
    format!(
        "{SCHEMA}; {scene}; turned by {}; {:?}; {:?}; {materials:?}; {machine:?}; {}; FLIP {sees_flip}",
        args.env_rotate,
        args.light,
        session.view,
        effort.describe()
    )
}

fn interrupted(measured: usize, kept: &Kept) -> Failure {
    let what = if kept.lasts() { "were kept; the same command goes on" } else { "are lost, as there is no cache" };
    Failure::with_code(INTERRUPTED, format!("interrupted after measuring {measured} points, which {what}"))
}

/// Why nothing was chosen, and what to do about it.
fn nothing_fits(wish: &Wish, nothing: &NothingFits) -> Failure {
    let metric = wish.metric;
    let of = |point: &Point| {
        let error = point.errors.as_ref().and_then(|errors| metric.of(errors)).filter(|error| error.value.is_finite());
        let error = error.map_or_else(String::new, |of| format!(", {} error {}", metric.name(), report::error(of)));
        format!("{}, which takes {}{error}", point.name(), report::times(point.cost.glints, point.cost.frame))
    };
    let (found, advice) = match nothing {
        NothingFits::OverBudget { cheapest } => {
            (format!("the cheapest measured is {}", of(cheapest)), "raise --budget-ms, or use a smaller --size")
        }
        NothingFits::ErrorTooLarge { most_accurate, .. } => {
            (format!("the most accurate measured is {}", of(most_accurate)), "raise --target-error")
        }
        NothingFits::NothingMeasured { .. } => (
            nothing.to_string(),
            "too few pixels glint, or no frame was quick enough: use a larger --size, another --camera or another --metric",
        ),
    };
    Failure::bad_input(format!("nothing fits {}: {found}; {advice}", wish.words()))
}
