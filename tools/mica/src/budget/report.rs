//! What was chosen, and what one step from it costs or gives up: as JSON and in words.

use super::command;
use super::goal::Wish;
use super::measuring::Skipped;
use crate::args::SceneArgs;
use mica_accuracy::{Choice, Estimate, Goal, Metric, Point, Weight};
use serde::Serialize;
use serde_json::{Map, Value as Json};

/// The part of a report that says what a budget came to.
#[derive(Serialize)]
pub struct BudgetReport {
    pub goal: GoalReport,
    /// The same in words.
    #[serde(skip)]
    pub asked: String,
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
    /// A frame with glints less one without: the median, within what rounds and sittings differ by.
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
            Goal::Budget { ns } => (Some(ns / 1e6), None),
            Goal::TargetError(error) => (None, Some(error)),
        };
        let of_skipped =
            |Skipped { candidate: (method, rung), why }| SkippedReport { method: method.name, rung: rung.name, why };
        Self {
            goal: GoalReport { budget_ms, target_error },
            asked: wish.words(),
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
        let mut text = format!("chosen for {}: {}\n", self.asked, self.chosen.words(self.metric));
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
        let error = self.error.map_or_else(|| "unknown".to_owned(), self::error);
        format!("{}: {}, expected error {metric} {error}", self.name, times(self.glint_ns, self.frame_ns))
    }

    /// Whether the intervals of both errors are apart.
    fn is_told_apart_from(&self, other: &Self) -> bool {
        self.error.zip(other.error).is_some_and(|(a, b)| a.high < b.low || b.high < a.low)
    }
}

/// What glints take, and their frame.
pub fn times(glints: Estimate, frame: Estimate) -> String {
    let ms = glints.scaled(1e-6);
    let (figure, ends) = words(ms, Weight::of_time(ms));
    // Known by two frames alone, which have no spread.
    let about = if ms.low == ms.high { "about " } else { "" };
    format!("{about}{figure} ms{ends} of a frame of {:.1} ms", frame.value * 1e-6)
}

/// An error with its interval.
pub fn error(error: Estimate) -> String {
    let (figure, ends) = words(error, Weight::of_error(error));
    figure + &ends
}

/// A figure, and its lower and upper end behind it where these are known, all of them in as many digits as tell them apart.
fn words(Estimate { value, low, high }: Estimate, weight: Weight) -> (String, String) {
    let decimals = decimals_apart(&[value, low, high]);
    let digits = |figure: f64| format!("{figure:.decimals$}");
    if weight.is_at_most {
        (format!("at most {}", digits(weight.value)), String::new())
    } else if low.is_finite() && high.is_finite() && low < high {
        (digits(value), format!(" ({} to {})", digits(low), digits(high)))
    } else {
        (digits(value), String::new())
    }
}

/// Decimals with which figures that differ are written differently: three, and more where these are not enough.
fn decimals_apart(figures: &[f64]) -> usize {
    const FEWEST: usize = 3;
    const MOST: usize = 12;
    let mut figures: Vec<f64> = figures.iter().copied().filter(|figure| figure.is_finite()).collect();
    figures.sort_by(f64::total_cmp);
    let are_apart = |decimals: &usize| {
        let written = |figure: f64| format!("{figure:.decimals$}");
        figures.windows(2).all(|pair| pair[0] == pair[1] || written(pair[0]) != written(pair[1]))
    };
    (FEWEST..MOST).find(are_apart).unwrap_or(MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(low: f64, value: f64, high: f64) -> Estimate {
        Estimate { value, low, high }
    }

    #[test]
    fn figures_have_as_many_digits_as_tell_their_ends_apart() {
        assert_eq!(error(estimate(0.1, 0.2, 0.3)), "0.200 (0.100 to 0.300)");
        assert_eq!(error(estimate(0.20001, 0.20002, 0.20004)), "0.20002 (0.20001 to 0.20004)");
        assert_eq!(error(estimate(0.0, 0.2, 0.3)), "at most 0.300");
        assert_eq!(error(Estimate::exact(0.25)), "0.250");
        assert_eq!(error(Estimate { value: 0.25, ..Estimate::UNKNOWN }), "0.250");
    }

    #[test]
    fn times_say_what_is_known_of_them() {
        let frame = Estimate::exact(20e6);
        assert_eq!(times(estimate(1.9e6, 2e6, 2.2e6), frame), "2.000 ms (1.900 to 2.200) of a frame of 20.0 ms");
        assert_eq!(times(estimate(0.1e6, 2e6, 3.9e6), frame), "at most 3.900 ms of a frame of 20.0 ms");
        assert_eq!(times(Estimate::exact(2e6), frame), "about 2.000 ms of a frame of 20.0 ms");
        assert_eq!(
            times(estimate(1.99998e6, 2e6, 2.00002e6), frame),
            "2.00000 ms (1.99998 to 2.00002) of a frame of 20.0 ms"
        );
    }
}
