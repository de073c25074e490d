//! What was chosen, and what one step from it costs or gives up: as JSON and in words.

use super::command;
use super::goal::Wish;
use super::measuring::Skipped;
use crate::args::SceneArgs;
use mica_accuracy::{Choice, Estimate, Goal, Metric, Point};
use serde::Serialize;
use serde_json::{Map, Value as Json};

/// The part of a report that says what a budget came to.
#[derive(Serialize)]
pub struct BudgetReport {
    pub goal: GoalReport,
    /// What an error is.
    pub metric: &'static str,
    pub chosen: StepReport,
    /// The cheapest that is more accurate.
    pub next_better: Option<StepReport>,
    /// The most accurate that is cheaper.
    pub next_cheaper: Option<StepReport>,
    /// Points that this run measured.
    pub measured: usize,
    /// Points that were measured before.
    pub kept: usize,
    pub skipped: Vec<SkippedReport>,
}

/// One of the two.
#[derive(Serialize)]
pub struct GoalReport {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_error: Option<f64>,
}

/// A method with settings: what it costs, and what error to expect.
#[derive(Serialize)]
pub struct StepReport {
    pub method: String,
    /// Of its ladder.
    pub rung: String,
    pub set: Map<String, Json>,
    /// Median, least and greatest of a frame with glints less one without.
    pub glint_ns: Estimate,
    /// The frame with glints.
    pub frame_ns: Estimate,
    /// `gpu` or `cpu`.
    pub clock: String,
    /// With its interval of 95 %.
    pub error: Option<Estimate>,
    /// What renders this.
    pub command: String,
    #[serde(skip)]
    name: String,
}

/// What could not be chosen.
#[derive(Serialize)]
pub struct SkippedReport {
    pub method: &'static str,
    pub rung: &'static str,
    pub why: String,
}

impl BudgetReport {
    /// Of a choice.
    pub fn new(wish: &Wish, choice: &Choice, args: &SceneArgs, skipped: Vec<Skipped>) -> Self {
        let step = |point: &Point| StepReport::new(point, wish.metric, args);
        let (budget_ms, target_error) = match wish.goal {
            Goal::Budget { ns } => (Some(ns * 1e-6), None),
            Goal::TargetError(error) => (None, Some(error)),
        };
        let of_skipped =
            |Skipped { candidate: (method, rung), why }| SkippedReport { method: method.name, rung: rung.name, why };
        Self {
            goal: GoalReport { budget_ms, target_error },
            metric: wish.metric.name(),
            chosen: step(choice.chosen),
            next_better: choice.next_better.map(step),
            next_cheaper: choice.next_cheaper.map(step),
            measured: 0,
            kept: 0,
            skipped: skipped.into_iter().map(of_skipped).collect(),
        }
    }

    /// Lines for people, each ended.
    pub fn words(&self) -> String {
        let goal = match self.goal {
            GoalReport { budget_ms: Some(ms), .. } => format!("{ms} ms of glints"),
            GoalReport { target_error, .. } => format!("{} error {}", self.metric, target_error.unwrap_or_default()),
        };
        let mut text = format!("chosen for {goal}: {}\n", self.chosen.words(self.metric));
        let steps =
            [("next better", "more accurate", &self.next_better), ("next cheaper", "cheaper", &self.next_cheaper)];
        for (title, adjective, step) in steps {
            text += &match step {
                Some(step) if step.is_told_apart_from(&self.chosen) => {
                    format!("{title}: {}\n", step.words(self.metric))
                }
                Some(step) => format!("{title}: {}; the intervals of their errors overlap\n", step.words(self.metric)),
                None => format!("{title}: nothing that was measured is {adjective}\n"),
            };
        }
        text += &format!("measured {} now, {} before", self.measured, self.kept);
        // One reason for many rungs is told once.
        let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
        for SkippedReport { method, rung, why } in &self.skipped {
            let name = format!("{method}, {rung}");
            match reasons.iter_mut().find(|(reason, names)| *reason == why && names[0].starts_with(method)) {
                Some((_, names)) => names.push((*rung).to_owned()),
                None => reasons.push((why, vec![name])),
            }
        }
        let reasons: Vec<String> = reasons.iter().map(|(why, names)| format!("{} ({why})", names.join(", "))).collect();
        if !reasons.is_empty() {
            text += &format!("; not compared: {}", reasons.join("; "));
        }
        text + "\n"
    }
}

impl StepReport {
    fn new(point: &Point, metric: Metric, args: &SceneArgs) -> Self {
        let Point { method, rung, set, cost, errors, .. } = point;
        Self {
            method: method.clone(),
            rung: rung.clone(),
            set: set.iter().map(|(key, value)| (key.clone(), Json::from(value.as_str()))).collect(),
            glint_ns: cost.glints,
            frame_ns: cost.frame,
            clock: cost.clock.clone(),
            error: errors.as_ref().and_then(|errors| metric.of(errors)),
            command: command::command(args, point),
            name: point.name(),
        }
    }

    fn words(&self, metric: &str) -> String {
        let error =
            self.error.map_or_else(|| "unknown".to_owned(), |error| with_ends(error, |error| format!("{error:.3}")));
        format!("{}: {}, expected error {metric} {error}", self.name, times(self.glint_ns, self.frame_ns))
    }

    /// Whether the intervals of both errors are apart.
    fn is_told_apart_from(&self, other: &Self) -> bool {
        self.error.zip(other.error).is_some_and(|(a, b)| a.high < b.low || b.high < a.low)
    }
}

/// What glints take, and their frame.
pub fn times(glints: Estimate, frame: Estimate) -> String {
    let ms = |ns: f64| format!("{:.3}", ns * 1e-6);
    // A difference of two noisy frames: below 0 there is nothing.
    let glints = if glints.low <= 0.0 {
        format!("at most {} ms", ms(glints.high))
    } else {
        with_ends(glints, ms).replacen(' ', " ms ", 1)
    };
    format!("{glints} of a frame of {:.1} ms", frame.value * 1e-6)
}

/// A figure with its lower and upper end, where these are known.
fn with_ends(Estimate { value, low, high }: Estimate, figure: impl Fn(f64) -> String) -> String {
    if low.is_finite() && high.is_finite() {
        format!("{} ({} to {})", figure(value), figure(low), figure(high))
    } else {
        figure(value)
    }
}
