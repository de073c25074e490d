//! Charts of one question under many conditions, side by side along the same axes.

use super::axis::Axis;
use super::scatter::Frame;
use super::text::width;
use super::{Anchor, Drawing, Ink, Look, Scatter, Stroke};

/// Charts in rows.
#[derive(Clone, Debug)]
pub struct Facets {
    pub title: String,
    /// How many stand beside each other.
    pub columns: usize,
    /// What all of them show, and how that looks; empty where each has names of its own.
    pub legend: Vec<(String, Look)>,
    /// One for each of the conditions, which its title says.
    pub charts: Vec<Facet>,
}

/// One of the charts.
#[derive(Clone, Debug)]
pub struct Facet {
    /// Charts of the same kind have the same axis of error.
    pub kind: usize,
    pub chart: Scatter,
}

const WIDTH: f64 = 1280.0;
/// Room for the numbers of an axis of error, with what the axis says; and where another chart has them.
const WIDE_GAP: f64 = 60.0;
const NARROW_GAP: f64 = 14.0;
const TITLE_SIZE: f64 = 11.0;
const TITLE_LINE: f64 = 14.0;
const LEGEND_LINE: f64 = 20.0;
const RADII: [f64; 2] = [6.0, 3.8];

impl Facets {
    /// The charts.
    pub fn draw(&self) -> Drawing {
        let columns = self.columns.max(1);
        let has_numbers: Vec<bool> = self
            .charts
            .iter()
            .enumerate()
            .map(|(k, facet)| k % columns == 0 || self.charts[k - 1].kind != facet.kind)
            .collect();
        let gaps: Vec<f64> = (0..columns)
            .map(|column| {
                let is_wide = has_numbers.iter().skip(column).step_by(columns).any(|has| *has);
                if is_wide { WIDE_GAP } else { NARROW_GAP }
            })
            .collect();
        let wide = (WIDTH - 24.0 - gaps.iter().sum::<f64>()) / columns as f64;
        let high = if columns > 4 { 150.0 } else { 200.0 };
        let titles: Vec<Vec<String>> = self.charts.iter().map(|facet| lines(&facet.chart.title, wide)).collect();
        let title_high = 6.0 + TITLE_LINE * titles.iter().map(Vec::len).max().unwrap_or(1) as f64;
        let keys = self.key_places();
        let top = 34.0 + keys.last().map_or(0.0, |last| last[1] + LEGEND_LINE);
        let rows = self.charts.len().div_ceil(columns);
        let row_high = title_high + high + 26.0;
        let mut drawing = Drawing::new([WIDTH, top + row_high * rows as f64 + 24.0], self.title.clone());
        drawing.bold([20.0, 20.0], Anchor::Start, 14.0, Ink::Words, self.title.clone());
        for ((name, look), [x, y]) in self.legend.iter().zip(keys) {
            let outline = Some(Stroke::solid(Ink::Words, 1.2));
            drawing.shapes.push(look.mark([x, 40.0 + y], 5.0, Some(Ink::Own(look.colour, 1.0)), outline));
            drawing.text([x + 12.0, 44.0 + y], Anchor::Start, 11.5, Ink::Words, name.clone());
        }
        let all_times = || self.charts.iter().flat_map(|facet| facet.chart.times());
        for (k, facet) in self.charts.iter().enumerate() {
            let (row, column) = (k / columns, k % columns);
            let left = gaps.iter().take(column + 1).sum::<f64>() + wide * column as f64;
            let above = top + row_high * row as f64 + title_high;
            let (right, below) = (left + wide, above + high);
            for (number, words) in titles[k].iter().enumerate() {
                let baseline = above - title_high + TITLE_LINE * (number + 1) as f64;
                drawing.bold([left, baseline], Anchor::Start, TITLE_SIZE, Ink::Words, words.trim_end());
            }
            let same = self.charts.iter().filter(|other| other.kind == facet.kind);
            let x = Axis::around(all_times(), [left, right]);
            let y = Axis::around(same.flat_map(|other| other.chart.errors()), [below, above]);
            let (Some(x), Some(y)) = (x, y) else { continue };
            let area = [[left, above], [right, below]];
            facet.chart.draw_in(&mut drawing, &Frame { area, x, y, numbers: [true, has_numbers[k]], radii: RADII });
            if column == 0 {
                drawing.upwards([14.0, f64::midpoint(above, below)], 11.5, Ink::Words, facet.chart.error.clone());
            }
        }
        if let Some(first) = self.charts.first() {
            let at = [WIDTH / 2.0, drawing.size[1] - 8.0];
            drawing.text(at, Anchor::Middle, 12.0, Ink::Words, first.chart.time.clone());
        }
        drawing
    }

    /// Where each name of the legend stands, below the title: in lines that are as long as there is room.
    fn key_places(&self) -> Vec<[f64; 2]> {
        let mut at = [28.0, 0.0];
        self.legend
            .iter()
            .map(|(name, _)| {
                let wide = 34.0 + width(name, 11.5, false);
                if at[0] + wide > WIDTH {
                    at = [28.0, at[1] + LEGEND_LINE];
                }
                let place = at;
                at[0] += wide;
                place
            })
            .collect()
    }
}

/// Words in lines of at most this width, broken after commas where that is enough, else between words; a word that is
/// longer has a line of its own.
fn lines(words: &str, wide: f64) -> Vec<String> {
    let fits = |words: &str| width(words.trim_end(), TITLE_SIZE, true) <= wide;
    let mut lines: Vec<String> = Vec::new();
    for clause in words.split_inclusive(", ") {
        let pieces = if fits(clause) { vec![clause] } else { clause.split_inclusive(' ').collect() };
        for piece in pieces {
            match lines.last_mut() {
                Some(line) if fits(&format!("{line}{piece}")) => line.push_str(piece),
                _ => lines.push(piece.to_owned()),
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{Labelled, Mark, Series, Shape, look_of_number};
    use mica_accuracy::Estimate;

    fn facet(kind: usize, title: &str, points: &[(f64, f64)]) -> Facet {
        let mark = |(time, error): &(f64, f64)| Mark {
            key: format!("{time} {error}"),
            name: String::new(),
            what: String::new(),
            time: Estimate::exact(*time),
            error: Estimate::exact(*error),
        };
        let series =
            Series { name: "way".to_owned(), look: look_of_number(0), marks: points.iter().map(mark).collect() };
        let [title, time, error] = [title, "ns", "error"].map(ToOwned::to_owned);
        let chart = Scatter { title, time, error, floor: None, series: vec![series], labelled: Labelled::None };
        Facet { kind, chart }
    }

    fn centres(drawing: &Drawing) -> Vec<[f64; 2]> {
        let centre = |shape: &Shape| match shape {
            Shape::Point { shapes, .. } => shapes.iter().find_map(|shape| match shape {
                Shape::Disc { centre, .. } => Some(*centre),
                _ => None,
            }),
            _ => None,
        };
        drawing.shapes.iter().filter_map(centre).collect()
    }

    #[test]
    fn equal_points_lie_alike_in_all_charts_of_a_kind_and_all_charts_are_in_the_drawing() {
        let charts = vec![
            facet(0, "a", &[(1.0, 0.1)]),
            facet(0, "b", &[(1.0, 0.1), (500.0, 0.001)]),
            facet(1, "c", &[(1.0, 0.1)]),
        ];
        let legend = vec![("way".to_owned(), look_of_number(0))];
        let drawing = Facets { title: "t".to_owned(), columns: 2, legend, charts }.draw();
        let mut found = centres(&drawing);
        found.sort_by(|a, b| (a[1], a[0]).partial_cmp(&(b[1], b[0])).expect("numbers"));
        let [a, b, exact, c] = found[..] else { panic!("{found:?}") };
        assert!(a[1] == b[1] && a[0] < b[0] && exact[0] > b[0], "{found:?}");
        assert!(c[0] == a[0] && c[1] > b[1], "{found:?}");
        assert!(found.iter().all(|[x, y]| *x < drawing.size[0] && *y < drawing.size[1]));
    }

    #[test]
    fn titles_are_broken_after_commas_or_between_words() {
        let broken = lines("studio, alpha 0.1, gamma 6 deg, 0.5 flakes", 190.0);
        assert_eq!(broken, ["studio, alpha 0.1, ", "gamma 6 deg, 0.5 flakes"]);
        assert_eq!(lines("a rather long title", 80.0), ["a rather ", "long title"]);
        assert_eq!(lines("one", 1.0), ["one"]);
    }
}
