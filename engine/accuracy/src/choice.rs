//! What a budget of time or a wanted error chooses among measured points.

use crate::{Cost, Metric, Point, Weight, front};

/// What a choice is to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The most accurate of those whose glints take no more of a frame than so many nanoseconds.
    Budget {
        /// Nanoseconds.
        ns: f64,
    },
    /// The cheapest of those whose error is no larger.
    TargetError(f64),
}

/// What was chosen, and what one step from it costs or gives up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice<'a> {
    /// What reaches the goal.
    pub chosen: &'a Point,
    /// The cheapest of those that are more accurate; none where nothing is.
    pub next_better: Option<&'a Point>,
    /// The most accurate of those that are cheaper; none where nothing is.
    pub next_cheaper: Option<&'a Point>,
}

/// Why nothing was chosen.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NothingFits {
    /// No point has a time and, by this measure, an error.
    #[error("no point was measured whose time and error by {} are known", metric.name())]
    NothingMeasured {
        /// The measure.
        metric: Metric,
    },
    /// All that was measured takes longer.
    #[error("the cheapest measured, {}, takes {:.6} ms", .cheapest.name(), 1e-6 * .cheapest.cost.glint_ns())]
    OverBudget {
        /// What takes the least time, whether its error is known or not.
        cheapest: Box<Point>,
    },
    /// All that was measured has a larger error.
    #[error("the most accurate measured, {}, has the error {error:.4}", .most_accurate.name())]
    ErrorTooLarge {
        /// What has the least error.
        most_accurate: Box<Point>,
        /// Which.
        error: f64,
    },
}

/// What reaches a goal among the points of one place on one machine.
///
/// A time is [`Cost::glint_ns`], an error that of [`Weight::of_error`]: what happens as often as not, and where noise hides
/// that, the most that it can be. Spread and interval are in the points, for whoever wants more than that. Points
/// without a time or an error, and those that another beats in both ([`front`]), are never chosen nor named as a step.
///
/// Who embeds the renderer measures on the devices of interest, ships the `points.jsonl` that this writes, and chooses
/// when the device is known:
///
/// ```
/// use mica_accuracy::{Goal, Metric, NothingFits, Point, choose};
///
/// /// The method and its settings for a scene within a budget, from the lines of a study on this device.
/// fn settings(points: &str, scene: &str, budget_ms: f64) -> Result<(String, Vec<(String, String)>), NothingFits> {
///     let points = points.lines().filter_map(|line| serde_json::from_str::<Point>(line).ok());
///     let of_scene: Vec<Point> = points.filter(|point| point.place.scene == scene).collect();
///     let choice = choose(&of_scene, Metric::W1, Goal::Budget { ns: 1e6 * budget_ms })?;
///     if let Some(better) = choice.next_better {
///         println!("{} would take {:.1} ms", better.name(), 1e-6 * better.cost.glint_ns());
///     }
///     // Then `renderer.set_method(None, &method)`, and `renderer.set(None, &key, &value)` for each pair.
///     Ok((choice.chosen.method.clone(), choice.chosen.set.clone()))
/// }
/// assert!(settings("", "shoe", 4.0).is_err());
/// ```
///
/// # Errors
/// If no point reaches the goal; the error says what comes nearest.
pub fn choose(points: &[Point], metric: Metric, goal: Goal) -> Result<Choice<'_>, NothingFits> {
    let error = |point: &Point| {
        let known = point.errors.as_ref().and_then(|errors| metric.of(errors));
        known.map_or(f64::NAN, |error| Weight::of_error(error).value)
    };
    let weighed: Vec<(f64, f64)> = points.iter().map(|point| (point.cost.glint_ns(), error(point))).collect();
    let steps = front(&weighed);
    // Along the front times rise and errors fall.
    let chosen = match goal {
        Goal::Budget { ns } => steps.iter().rposition(|&index| weighed[index].0 <= ns),
        Goal::TargetError(largest) => steps.iter().position(|&index| weighed[index].1 <= largest),
    };
    let Some(chosen) = chosen else { return Err(nearest(points, metric, goal, &weighed, &steps)) };
    let step = |at: Option<usize>| at.and_then(|at| steps.get(at)).map(|&index| &points[index]);
    Ok(Choice {
        chosen: &points[steps[chosen]],
        next_better: step(chosen.checked_add(1)),
        next_cheaper: step(chosen.checked_sub(1)),
    })
}

/// Why no step reaches the goal.
fn nearest(points: &[Point], metric: Metric, goal: Goal, weighed: &[(f64, f64)], steps: &[usize]) -> NothingFits {
    let found = match goal {
        Goal::Budget { ns } => {
            // What fits and has no error hides whether the goal can be reached, unless another's error is known.
            let hidden = steps.is_empty() && weighed.iter().any(|(time, _)| *time <= ns);
            let over = (0..points.len()).filter(|&index| weighed[index].0.is_finite() && weighed[index].0 > ns);
            let cheapest = over.min_by(|&a, &b| weighed[a].0.total_cmp(&weighed[b].0)).filter(|_| !hidden);
            cheapest.map(|index| NothingFits::OverBudget { cheapest: Box::new(points[index].clone()) })
        }
        Goal::TargetError(_) => steps.last().map(|&index| NothingFits::ErrorTooLarge {
            most_accurate: Box::new(points[index].clone()),
            error: weighed[index].1,
        }),
    };
    found.unwrap_or(NothingFits::NothingMeasured { metric })
}

impl Cost {
    /// What the glints of a frame take in nanoseconds, by which costs are compared ([`Weight::of_time`]).
    pub fn glint_ns(&self) -> f64 {
        Weight::of_time(self.glints).value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Errors, Estimate, Machine, POINT_SCHEMA, Place};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::Rng;

    const MS: f64 = 1e6;

    fn errors(w1: f64, mean_ratio: f64) -> Errors {
        let of = Estimate::exact;
        Errors {
            pixels: 576,
            left_out: 0,
            mean_ratio: of(mean_ratio),
            variance_ratio: of(1.0),
            w1: of(w1),
            rel_mse: of(1.0),
            flip: of(0.1),
            hdr_flip: of(0.1),
            energy_per_glint: of(1.0),
            bands: Vec::new(),
            path: None,
        }
    }

    fn point(method: &str, glints: Estimate, errors: Option<Errors>) -> Point {
        let of = Estimate::exact;
        Point {
            schema: POINT_SCHEMA.to_owned(),
            place: Place { scene: "plane".to_owned(), lighting: "own".to_owned(), size: [32, 18] },
            method: method.to_owned(),
            rung: method.to_owned(),
            set: Vec::new(),
            claim: "look".to_owned(),
            machine: Machine {
                device: "device".to_owned(),
                driver: "driver".to_owned(),
                occlusion: "bvh".to_owned(),
                build: "build".to_owned(),
            },
            effort: "little".to_owned(),
            content: String::new(),
            command: "mica render plane".to_owned(),
            errors,
            cost: Cost {
                clock: "gpu".to_owned(),
                sittings: vec![vec![[2e7, 1e7]; 3]],
                glints,
                frame: of(20.0 * MS),
                ratio: of(1.1),
                passes: Vec::new(),
                tables: 0.0,
                precomputation: 0.0,
                glint_bytes: 0,
                memory: Vec::new(),
            },
            pictures: None,
        }
    }

    /// Of a time in milliseconds and a Wasserstein-1 distance.
    fn exactly(method: &str, ms: f64, w1: f64) -> Point {
        point(method, Estimate::exact(ms * MS), Some(errors(w1, 1.0)))
    }

    fn names(choice: &Choice) -> [Option<String>; 3] {
        [choice.next_cheaper, Some(choice.chosen), choice.next_better].map(|point| point.map(Point::name))
    }

    /// Four steps of the front, a point that `fair` beats in both, and one without an error.
    fn ladder() -> Vec<Point> {
        let mut points = vec![
            exactly("dear", 300.0, 0.02),
            exactly("beaten", 4.0, 0.5),
            exactly("cheap", 0.5, 0.9),
            exactly("good", 9.8, 0.05),
            exactly("fair", 3.1, 0.12),
        ];
        points.push(point("only timed", Estimate::exact(0.1 * MS), None));
        points
    }

    #[test]
    fn a_budget_buys_the_most_accurate_that_fits_and_names_both_neighbours() {
        let points = ladder();
        let of = |ms: f64| choose(&points, Metric::W1, Goal::Budget { ns: ms * MS }).map(|choice| names(&choice));
        let named = |names: [&str; 3]| Ok(names.map(|name| (!name.is_empty()).then(|| name.to_owned())));
        assert_eq!(of(4.0), named(["cheap", "fair", "good"]));
        assert_eq!(of(3.1), named(["cheap", "fair", "good"]), "a budget holds what takes just as long");
        assert_eq!(of(3.09), named(["", "cheap", "fair"]));
        assert_eq!(of(f64::INFINITY), named(["good", "dear", ""]));
    }

    #[test]
    fn an_error_is_reached_by_the_cheapest_that_does() {
        let points = ladder();
        let of = |error: f64| choose(&points, Metric::W1, Goal::TargetError(error)).map(|choice| names(&choice));
        let named = |names: [&str; 3]| Ok(names.map(|name| (!name.is_empty()).then(|| name.to_owned())));
        assert_eq!(of(0.5), named(["cheap", "fair", "good"]));
        assert_eq!(of(0.12), named(["cheap", "fair", "good"]), "an error is reached by its equal");
        assert_eq!(of(0.119), named(["fair", "good", "dear"]));
        assert_eq!(of(1.0), named(["", "cheap", "fair"]));
    }

    #[test]
    fn what_comes_nearest_is_told_where_nothing_fits() {
        let points = ladder();
        let refusal = |points: &[Point], goal| choose(points, Metric::W1, goal).map(|_| ()).unwrap_err();
        // A time without an error is a time all the same.
        let cheapest = refusal(&points, Goal::Budget { ns: 0.05 * MS });
        assert_eq!(cheapest.to_string(), "the cheapest measured, only timed, takes 0.100000 ms");
        // It fits here, but what it would look like nobody knows.
        let with_an_error = refusal(&points, Goal::Budget { ns: 0.2 * MS });
        assert_eq!(with_an_error.to_string(), "the cheapest measured, cheap, takes 0.500000 ms");
        let best = refusal(&points, Goal::TargetError(0.01));
        assert_eq!(best.to_string(), "the most accurate measured, dear, has the error 0.0200");
        for goal in [Goal::Budget { ns: MS }, Goal::TargetError(0.5)] {
            assert_eq!(refusal(&points[5..], goal), NothingFits::NothingMeasured { metric: Metric::W1 });
            assert_eq!(refusal(&[], goal), NothingFits::NothingMeasured { metric: Metric::W1 });
        }
        for goal in [Goal::Budget { ns: f64::NAN }, Goal::TargetError(f64::NAN)] {
            assert!(choose(&points, Metric::W1, goal).is_err(), "{goal:?}");
        }
    }

    #[test]
    fn the_measure_decides() {
        let mut points = ladder();
        points[2].errors = Some(errors(0.9, 1.001));
        points[4].errors = Some(errors(0.12, 0.8));
        let of = |metric| choose(&points, metric, Goal::Budget { ns: 4.0 * MS }).map(|choice| choice.chosen.name());
        assert_eq!(of(Metric::W1), Ok("fair".to_owned()));
        assert_eq!(of(Metric::Mean), Ok("beaten".to_owned()), "its ratio of means is 1");
        // No path was rendered.
        assert_eq!(of(Metric::Flicker), Err(NothingFits::NothingMeasured { metric: Metric::Flicker }));
    }

    #[test]
    fn what_noise_hides_counts_as_its_upper_end() {
        let hidden = Estimate { value: -MS, low: -2.0 * MS, high: MS };
        let points = [point("a", hidden, Some(errors(0.5, 1.0)))];
        let of = |points: &[Point], goal| choose(points, Metric::W1, goal).is_ok();
        assert!(!of(&points, Goal::Budget { ns: 0.9 * MS }), "less than nothing is no bargain");
        assert!(of(&points, Goal::Budget { ns: MS }));
        let w1 = Estimate { value: 0.01, low: 0.0, high: 0.03 };
        let points = [point("a", hidden, Some(Errors { w1, ..errors(0.0, 1.0) }))];
        assert!(!of(&points, Goal::TargetError(0.02)) && of(&points, Goal::TargetError(0.03)));
        // Of two that noise hides, neither is the cheaper because its spread happens to end before 0.
        let of_ends = |name, [low, value, high]: [f64; 3], w1| {
            point(name, Estimate { value, low, high }.scaled(MS), Some(errors(w1, 1.0)))
        };
        let points = [of_ends("a", [-2.0, 5.9, 13.9], 0.1), of_ends("b", [0.4, 8.5, 16.7], 0.2)];
        let best = choose(&points, Metric::W1, Goal::TargetError(1.0)).map(|choice| choice.chosen.name());
        assert_eq!(best, Ok("a".to_owned()));
    }

    #[test]
    fn choices_are_what_their_definitions_say() {
        let mut random = Pcg64::new(3, 3);
        let mut figure = move || match random.next_u32() % 9 {
            0 => f64::NAN,
            number => f64::from(number),
        };
        for _ in 0..500 {
            let points: Vec<Point> = (0..8).map(|_| exactly("", figure() / MS, figure())).collect();
            let all: Vec<(f64, f64)> = points
                .iter()
                .map(|point| (point.cost.glint_ns(), point.errors.as_ref().map_or(f64::NAN, |errors| errors.w1.value)))
                .filter(|(ns, error)| ns.is_finite() && error.is_finite())
                .collect();
            let weighed = |point: &Point| (point.cost.glint_ns(), point.errors.as_ref().map(|errors| errors.w1.value));
            for limit in 0..10 {
                let limit = f64::from(limit);
                let fitting = all.iter().filter(|(ns, _)| *ns <= limit).map(|(_, error)| *error);
                let least_error = fitting.reduce(f64::min);
                let bought = choose(&points, Metric::W1, Goal::Budget { ns: limit }).ok();
                assert_eq!(bought.map(|choice| weighed(choice.chosen).1), least_error.map(Some));
                let reaching = all.iter().filter(|(_, error)| *error <= limit).map(|(ns, _)| *ns);
                let reached = choose(&points, Metric::W1, Goal::TargetError(limit)).ok();
                assert_eq!(reached.map(|choice| weighed(choice.chosen).0), reaching.reduce(f64::min));

                for choice in [bought, reached].into_iter().flatten() {
                    let (ns, error) = (choice.chosen.cost.glint_ns(), weighed(choice.chosen).1);
                    let better = all.iter().filter(|(_, other)| Some(*other) < error).map(|(ns, _)| *ns);
                    assert_eq!(choice.next_better.map(|point| weighed(point).0), better.reduce(f64::min));
                    let cheaper = all.iter().filter(|(other, _)| *other < ns).map(|(_, error)| *error);
                    assert_eq!(choice.next_cheaper.map(|point| weighed(point).1), cheaper.reduce(f64::min).map(Some));
                }
            }
        }
    }
}
