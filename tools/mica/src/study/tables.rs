//! What was found at a place, for people.

use crate::table::{Column, bytes, table};
use mica_accuracy::{Estimate, Point, Weight};

/// A heading and a row for each point.
pub fn of_place(points: &[Point]) -> String {
    let Some(first) = points.first() else { return String::new() };
    let [width, height] = first.place.size;
    let lighting = match first.place.lighting.as_str() {
        "own" => "",
        "lights" => ", without its environment",
        _ => ", without its lights",
    };
    let clock = if first.cost.clock == "cpu" { "processor time" } else { "GPU time" };
    let mut text = format!("\n{} {width}x{height}{lighting}; {clock} on {}\n", first.place.scene, first.machine.device);
    let with_errors = points.iter().any(|point| point.errors.is_some());
    let mut columns = vec![Column::Left("method"), Column::Left("rung")];
    if with_errors {
        columns.extend(["W1", "mean ratio", "FLIP"].map(Column::Right));
    }
    columns.extend(["glints ms", "with/without", "frame ms", "tables ms", "glint memory"].map(Column::Right));
    let rows: Vec<Vec<String>> = points
        .iter()
        .map(|point| {
            let mut row = vec![point.method.clone(), point.rung.clone()];
            if with_errors {
                let errors = point.errors.as_ref();
                let figure = |of: Option<Estimate>| of.map_or_else(|| "-".to_owned(), |of| with_spread(of, 1.0, 3));
                row.push(figure(errors.map(|errors| errors.w1)));
                row.push(figure(errors.map(|errors| errors.mean_ratio)));
                row.push(figure(errors.map(|errors| errors.flip)));
            }
            let cost = &point.cost;
            row.push(time(cost.glints));
            row.push(with_spread(cost.ratio, 1.0, 3));
            row.push(with_spread(cost.frame, 1e-6, 1));
            row.push(format!("{:.1}", (cost.tables + cost.precomputation) * 1e-6));
            row.push(bytes(cost.glint_bytes));
            row
        })
        .collect();
    text += &table(&columns, &rows);
    text
}

/// Milliseconds of what takes nanoseconds.
fn time(ns: Estimate) -> String {
    let Weight { value, is_at_most } = Weight::of_time(ns);
    if is_at_most { format!("at most {:.2}", value * 1e-6) } else { with_spread(ns, 1e-6, 2) }
}

/// A figure with its spread: as one width where both sides are about as wide, else as both; a dash for what is not defined.
fn with_spread(estimate: Estimate, factor: f64, places: usize) -> String {
    let Estimate { value, low, high } = estimate.scaled(factor);
    if !value.is_finite() {
        return "-".to_owned();
    }
    let (above, below) = (high - value, value - low);
    let (narrow, wide) = (above.min(below), above.max(below));
    let spread = if !wide.is_finite() {
        String::new()
    } else if wide - narrow <= wide / 3.0 {
        format!(" ± {wide:.places$}")
    } else {
        format!(" +{above:.places$}/-{below:.places$}")
    };
    format!("{value:.places$}{spread}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stand_with_both_sides_of_their_spread() {
        let of = |low, high| with_spread(Estimate { value: 2e6, low, high }, 1e-6, 2);
        assert_eq!([of(1.5e6, 2.5e6), of(1.5e6, 2.4e6)], ["2.00 ± 0.50"; 2]);
        assert_eq!([of(1.5e6, 2.1e6), of(2e6, 2.3e6)], ["2.00 +0.10/-0.50", "2.00 +0.30/-0.00"]);
        let times = [[1.2e6, 2.8e6], [0.5e6, 3.5e6]].map(|[low, high]| time(Estimate { value: 2e6, low, high }));
        assert_eq!(times, ["2.00 ± 0.80", "at most 3.50"]);
        assert_eq!(with_spread(Estimate::UNKNOWN, 1.0, 2), "-");
        assert_eq!(with_spread(Estimate { value: 1.0, ..Estimate::UNKNOWN }, 1.0, 1), "1.0");
    }
}
