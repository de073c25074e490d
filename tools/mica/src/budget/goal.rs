//! What `mica render` is asked to reach: so little time for glints, or so small an error.

use clap::Args;
use mica_accuracy::{Goal, Metric};

/// The options that let measurements choose the method.
#[derive(Debug, Args)]
pub struct BudgetArgs {
    /// Chooses the most accurate method and settings whose glints take no more than so many milliseconds of a frame: the
    /// median of a frame of one sample less the same frame without glints, as the rest is not theirs, and its upper end
    /// where it is no greater than its spread, since that may be noise. Measures this view
    /// on this device once, which takes minutes on a processor, and keeps the figures in the cache. Ctrl-C keeps what
    /// was measured until then. `smooth`, without any sparkle, counts as a method too: a small budget may choose it. With
    /// --method, chooses among the settings of that method.
    #[arg(long, value_name = "MS", group = "goal", conflicts_with = "edit", value_parser = budget_ms, allow_hyphen_values = true)]
    pub budget_ms: Option<f64>,
    /// The other way round: chooses the cheapest whose error is no larger.
    #[arg(long, value_name = "E", group = "goal", conflicts_with = "edit", value_parser = target_error, allow_hyphen_values = true)]
    pub target_error: Option<f64>,
    /// What an error is: of the distribution of pixels (`w1`, over the mean), of the mean, of the variance, of pixels one
    /// by one (`relmse`), of the picture as it is seen (`flip`, at any exposure `hdr-flip`), or over time (`flicker`).
    #[arg(long, value_name = "METRIC", requires = "goal", default_value = Metric::W1.name(), value_parser = metric)]
    pub metric: Metric,
}

/// What is to be reached, and how errors are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// What is to be reached.
    pub goal: Goal,
    /// What an error is.
    pub metric: Metric,
}

impl BudgetArgs {
    /// What is asked for, if anything is.
    pub fn wish(&self) -> Option<Wish> {
        let budget = self.budget_ms.map(|ms| Goal::Budget { ns: ms * 1e6 });
        let goal = budget.or(self.target_error.map(Goal::TargetError))?;
        Some(Wish { goal, metric: self.metric })
    }
}

impl Wish {
    /// The goal in words.
    pub fn words(&self) -> String {
        match self.goal {
            Goal::Budget { ns } => format!("{} ms of glints", number(ns / 1e6)),
            Goal::TargetError(error) => format!("a {} error of {}", self.metric.name(), number(error)),
        }
    }
}

/// A number as people write it, without rows of zeros.
fn number(figure: f64) -> String {
    if figure == 0.0 || (1e-6..1e6).contains(&figure) { format!("{figure}") } else { format!("{figure:e}") }
}

/// More than a week a frame.
const LARGEST_MS: f64 = 1e9;

fn budget_ms(text: &str) -> Result<f64, String> {
    let accepted = |ms: &f64| *ms > 0.0 && *ms <= LARGEST_MS;
    text.trim()
        .parse()
        .ok()
        .filter(accepted)
        .ok_or_else(|| format!("expected milliseconds above 0, up to {LARGEST_MS:e}"))
}

fn target_error(text: &str) -> Result<f64, String> {
    let accepted = |error: &f64| *error >= 0.0 && error.is_finite();
    text.trim().parse().ok().filter(accepted).ok_or_else(|| "expected a number that is not negative".to_owned())
}

fn metric(text: &str) -> Result<Metric, String> {
    let names = || Metric::ALL.map(Metric::name).join(", ");
    Metric::ALL.into_iter().find(|metric| metric.name() == text).ok_or_else(|| format!("expected one of {}", names()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_told_as_they_were_asked_for() {
        let words = |goal| Wish { goal, metric: Metric::W1 }.words();
        for (asked, told) in [("4", "4"), ("5.8", "5.8"), ("1e-6", "0.000001"), ("1e9", "1e9"), ("1e-300", "1e-300")] {
            let ns = budget_ms(asked).expect("a budget") * 1e6;
            assert_eq!(words(Goal::Budget { ns }), format!("{told} ms of glints"));
            let error = target_error(asked).expect("an error");
            assert_eq!(words(Goal::TargetError(error)), format!("a w1 error of {told}"));
        }
        assert_eq!(words(Goal::TargetError(0.0)), "a w1 error of 0");
    }

    #[test]
    fn goals_are_numbers_that_can_be_reached() {
        assert_eq!((budget_ms("4"), budget_ms("1e-6"), target_error("0")), (Ok(4.0), Ok(1e-6), Ok(0.0)));
        for bad in ["", "0", "-1", "NaN", "inf", "1e10", "4ms"] {
            assert!(budget_ms(bad).is_err(), "{bad}");
        }
        for bad in ["", "-0.1", "NaN", "inf", "5%"] {
            assert!(target_error(bad).is_err(), "{bad}");
        }
        for known in Metric::ALL {
            assert_eq!(metric(known.name()), Ok(known));
        }
        assert!(metric("W1").is_err_and(|error| error.contains("hdr-flip")));
    }
}
