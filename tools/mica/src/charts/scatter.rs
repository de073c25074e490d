//! Error against time: each method's rungs, which of them nothing beats, and what no method can do better than.

use super::axis::Axis;
use super::labels::{Label, place};
use super::text::width;
use super::{Anchor, Drawing, Ink, Look, Shape, Stroke, line, three_digits};
use mica_accuracy::{Estimate, front};

/// What a chart of error against time shows.
#[derive(Clone, Debug)]
pub struct Scatter {
    pub title: String,
    pub time: String,
    pub error: String,
    /// What no series can do better than, except by chance.
    pub floor: Option<f64>,
    pub series: Vec<Series>,
    /// Whether every mark is labelled, rather than those of the front, beside a legend.
    pub all_labelled: bool,
}

/// The rungs of one method.
#[derive(Clone, Debug)]
pub struct Series {
    pub name: String,
    pub look: Look,
    pub marks: Vec<Mark>,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Mark {
    /// By which a page finds what belongs to it.
    pub key: String,
    pub name: String,
    pub time: Estimate,
    pub error: Estimate,
}

/// A mark that can be drawn, where it is drawn.
struct Drawn<'a> {
    series: usize,
    mark: &'a Mark,
    time: f64,
    error: f64,
    at: [f64; 2],
    is_front: bool,
}

const HEIGHT: f64 = 460.0;
const WIDTH: f64 = 760.0;
const LEFT: f64 = 66.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 52.0;
/// Radii of markers in the front and elsewhere.
const LARGE: f64 = 7.5;
const SMALL: f64 = 3.6;
/// With more points in the front than this, only the most accurate of each series has a label.
const MOST_LABELS: usize = 9;
/// How opaque is what the front beats.
const PALE: f64 = 0.5;

/// Where a figure can be told from 0, itself; else the upper end of its interval, below which it lies.
pub fn shown(figure: Estimate) -> f64 {
    if is_bound(figure) { figure.high } else { figure.value }
}

/// An interval that is not known (NaN) bounds nothing.
fn is_bound(figure: Estimate) -> bool {
    figure.low <= 0.0 || figure.value <= 0.0
}

impl Scatter {
    /// The keys of the marks that nothing beats, the fastest first.
    pub fn front(&self) -> Vec<&str> {
        let marks: Vec<&Mark> =
            self.series.iter().flat_map(|series| &series.marks).filter(|m| can_be_drawn(m)).collect();
        let points: Vec<(f64, f64)> = marks.iter().map(|mark| (shown(mark.time), shown(mark.error))).collect();
        front(&points).into_iter().filter_map(|index| Some(marks.get(index)?.key.as_str())).collect()
    }

    /// The chart.
    pub fn draw(&self) -> Drawing {
        let mut drawing = Drawing::new([WIDTH, HEIGHT], self.title.clone());
        drawing.bold([LEFT, 18.0], Anchor::Start, 13.0, Ink::Words, self.title.clone());
        let legend = if self.all_labelled { 20.0 } else { 46.0 + self.legend_width() };
        let (right, bottom) = (WIDTH - legend, HEIGHT - BOTTOM);
        let marks = || self.series.iter().flat_map(|series| &series.marks).filter(|mark| can_be_drawn(mark));
        let x = Axis::around(marks().map(|mark| shown(mark.time)), [LEFT, right]);
        // The floor is seen where it is, if that is not so far off that nothing else could be told apart.
        let least = marks().map(|mark| shown(mark.error)).fold(f64::INFINITY, f64::min);
        let floor = self.floor.filter(|floor| *floor > least / 30.0);
        let y = Axis::around(marks().map(|mark| shown(mark.error)).chain(floor), [bottom, TOP]);
        let (Some(x), Some(y)) = (x, y) else {
            drawing.text(
                [LEFT, TOP + 30.0],
                Anchor::Start,
                12.0,
                Ink::Aside,
                "Nothing was measured that could be drawn.",
            );
            return drawing;
        };
        let area = [[LEFT, TOP], [right, bottom]];
        let chosen = self.front();
        let mut drawn: Vec<Drawn<'_>> = Vec::new();
        for (series, one) in self.series.iter().enumerate() {
            drawn.extend(one.marks.iter().filter(|mark| can_be_drawn(mark)).map(|mark| {
                let (time, error) = (shown(mark.time), shown(mark.error));
                let is_front = chosen.contains(&mark.key.as_str());
                Drawn { series, mark, time, error, at: [x.within(time), y.within(error)], is_front }
            }));
        }
        let steps = steps(&drawn, area);
        self.draw_paper(&mut drawing, &x, &y, area, &steps);
        if let Some(floor) = floor {
            draw_floor(&mut drawing, y.within(floor), area);
        }
        for series in 0..self.series.len() {
            self.draw_ladder(&mut drawing, drawn.iter().filter(|one| one.series == series));
        }
        if steps.len() > 1 {
            drawing.line(&steps, Stroke::solid(Ink::Words, 2.4));
        }
        // What matters most is drawn last.
        for is_front in [false, true] {
            for one in drawn.iter().filter(|one| one.is_front == is_front) {
                drawing.shapes.push(self.point(one, &x, &y));
            }
        }
        self.draw_labels(&mut drawing, &drawn, area, steps);
        if !self.all_labelled {
            self.draw_legend(&mut drawing, &drawn, right + 22.0);
        }
        drawing
    }

    fn draw_paper(&self, drawing: &mut Drawing, x: &Axis, y: &Axis, area: [[f64; 2]; 2], steps: &[[f64; 2]]) {
        let [[left, top], [right, bottom]] = area;
        if let [first, .., last] = steps {
            let mut beaten = steps.to_vec();
            beaten.extend([[right, last[1]], [right, top], [first[0], top]]);
            drawing.shapes.push(Shape::Line { points: beaten, closed: true, fill: Some(Ink::Beaten), stroke: None });
        }
        for (ticks, is_time) in [(x.ticks(), true), (y.ticks(), false)] {
            for tick in ticks {
                let ends =
                    if is_time { [[tick.at, top], [tick.at, bottom]] } else { [[left, tick.at], [right, tick.at]] };
                let thickness = if tick.label.is_some() { 1.0 } else { 0.4 };
                drawing.line(&ends, Stroke::solid(Ink::Grid, thickness));
                let Some(label) = tick.label else { continue };
                let (at, anchor) = if is_time {
                    ([tick.at, bottom + 16.0], Anchor::Middle)
                } else {
                    ([left - 7.0, tick.at + 4.0], Anchor::End)
                };
                drawing.text(at, anchor, 11.0, Ink::Aside, label);
            }
        }
        drawing.line(&[[left, top], [left, bottom], [right, bottom]], Stroke::solid(Ink::Aside, 1.0));
        drawing.text([(left + right) / 2.0, bottom + 38.0], Anchor::Middle, 12.0, Ink::Words, self.time.clone());
        drawing.upwards([17.0, (top + bottom) / 2.0], 12.0, Ink::Words, self.error.clone());
    }

    fn colour(&self, series: usize, opacity: f64) -> Ink {
        self.series.get(series).map_or(Ink::Aside, |series| Ink::Own(series.look.colour, opacity))
    }

    /// The thin line that joins the rungs of a method, in their order of time.
    fn draw_ladder<'a>(&self, drawing: &mut Drawing, rungs: impl Iterator<Item = &'a Drawn<'a>>) {
        let mut rungs: Vec<&Drawn<'_>> = rungs.collect();
        rungs.sort_by(|a, b| a.time.total_cmp(&b.time).then(b.error.total_cmp(&a.error)));
        let points: Vec<[f64; 2]> = rungs.iter().map(|rung| rung.at).collect();
        if let [first, _, ..] = rungs.as_slice() {
            let opacity = if rungs.iter().any(|rung| rung.is_front) { 0.75 } else { 0.35 };
            drawing.line(&points, Stroke::solid(self.colour(first.series, opacity), 1.1));
        }
    }

    fn point(&self, drawn: &Drawn<'_>, x: &Axis, y: &Axis) -> Shape {
        let Drawn { series, mark, at, is_front, .. } = drawn;
        let Some(look) = self.series.get(*series).map(|series| series.look) else {
            return line(&[], Stroke::solid(Ink::Aside, 0.0));
        };
        let opacity = if *is_front { 1.0 } else { PALE };
        let ink = Ink::Own(look.colour, opacity);
        let radius = if *is_front { LARGE } else { SMALL };
        let bars = Stroke::solid(ink, if *is_front { 1.4 } else { 0.8 });
        let mut shapes = Vec::new();
        for (figure, axis, along) in [(mark.time, x, 0), (mark.error, y, 1)] {
            let end = |value: f64| if along == 0 { [axis.within(value), at[1]] } else { [at[0], axis.within(value)] };
            if is_bound(figure) {
                shapes.extend(arrow(*at, along, radius, bars));
            } else if figure.low.is_finite() && figure.high.is_finite() {
                shapes.push(line(&[end(figure.low), end(figure.high)], bars));
            }
        }
        let is_open = is_bound(mark.time) || is_bound(mark.error);
        let outline = if *is_front { Stroke::solid(Ink::Words, 1.8) } else { Stroke::solid(ink, 1.2) };
        // Paper first: lines do not shine through what is pale.
        shapes.push(look.mark(*at, radius, Some(Ink::Paper), None));
        shapes.push(match (is_open, *is_front) {
            (true, _) => look.mark(*at, radius, None, Some(Stroke { ink, ..outline })),
            (false, true) => look.mark(*at, radius, Some(ink), Some(outline)),
            (false, false) => look.mark(*at, radius, Some(ink), None),
        });
        let at_most = |figure: Estimate| if is_bound(figure) { "at most " } else { "" };
        let title = format!(
            "{}: {} {}{}, {} {}{}{}",
            mark.name,
            self.time,
            at_most(mark.time),
            three_digits(drawn.time),
            self.error,
            at_most(mark.error),
            three_digits(drawn.error),
            if *is_front { "; on the front" } else { "" },
        );
        Shape::Point { key: mark.key.clone(), title, shapes }
    }

    fn draw_labels(&self, drawing: &mut Drawing, drawn: &[Drawn<'_>], area: [[f64; 2]; 2], steps: Vec<[f64; 2]>) {
        let around = |one: &Drawn<'_>| {
            let radius = if one.is_front { LARGE + 1.0 } else { SMALL };
            [one.at.map(|side| side - radius), one.at.map(|side| side + radius)]
        };
        let taken: Vec<_> = drawn.iter().map(around).collect();
        let on_front = || drawn.iter().filter(|one| one.is_front);
        let is_crowded = on_front().count() > MOST_LABELS;
        let is_best = |one: &Drawn<'_>| on_front().all(|other| other.series != one.series || other.error >= one.error);
        let mut labels: Vec<Label> = drawn
            .iter()
            .filter(|one| self.all_labelled || (one.is_front && (!is_crowded || is_best(one))))
            .map(|one| Label {
                at: one.at,
                radius: if one.is_front { LARGE } else { SMALL },
                words: one.mark.name.clone(),
                bold: one.is_front,
                ink: if one.is_front { Ink::Words } else { Ink::Aside },
            })
            .collect();
        labels.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
        let bars = drawn.iter().filter(|one| one.is_front && !is_bound(one.mark.error)).map(|one| {
            let half = 14.0;
            vec![[one.at[0], one.at[1] - half], [one.at[0], one.at[1] + half]]
        });
        let lines: Vec<Vec<[f64; 2]>> = std::iter::once(steps).chain(bars).collect();
        place(drawing, &labels, area, &taken, &lines);
    }

    fn legend_width(&self) -> f64 {
        self.series.iter().map(|series| width(&series.name, 11.5, true)).fold(60.0, f64::max)
    }

    /// Methods of the front first, in its order; then the others.
    fn draw_legend(&self, drawing: &mut Drawing, drawn: &[Drawn<'_>], left: f64) {
        let mut on_front: Vec<&Drawn<'_>> = drawn.iter().filter(|one| one.is_front).collect();
        on_front.sort_by(|a, b| a.time.total_cmp(&b.time));
        let mut order: Vec<usize> = Vec::new();
        for series in on_front.iter().map(|one| one.series).chain(0..self.series.len()) {
            if !order.contains(&series) {
                order.push(series);
            }
        }
        let mut y = TOP + 6.0;
        let mut was_front = true;
        for (k, series) in order.iter().filter_map(|k| Some((*k, self.series.get(*k)?))) {
            let is_front = on_front.iter().any(|one| one.series == k);
            if was_front && !is_front {
                y += 8.0;
            }
            was_front = is_front;
            let ink = self.colour(k, if is_front { 1.0 } else { PALE });
            let outline = is_front.then_some(Stroke::solid(Ink::Words, 1.6));
            let radius = if is_front { 6.2 } else { 4.2 };
            drawing.shapes.push(series.look.mark([left, y], radius, Some(ink), outline));
            let at = [left + 14.0, y + 4.0];
            if is_front {
                drawing.bold(at, Anchor::Start, 11.5, Ink::Words, series.name.clone());
            } else {
                drawing.text(at, Anchor::Start, 11.5, Ink::Aside, series.name.clone());
            }
            y += 21.0;
        }
    }
}

fn can_be_drawn(mark: &Mark) -> bool {
    [mark.time, mark.error].iter().all(|figure| {
        let at = shown(*figure);
        at.is_finite() && at > 1e-30 && at < 1e30
    })
}

/// The steps along the front: down to each of its points, and on to the next.
fn steps(drawn: &[Drawn<'_>], [[_, top], [right, _]]: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    let mut front: Vec<&Drawn<'_>> = drawn.iter().filter(|one| one.is_front).collect();
    front.sort_by(|a, b| a.time.total_cmp(&b.time));
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut height = top;
    for one in front {
        points.extend([[one.at[0], height], one.at]);
        height = one.at[1];
    }
    if !points.is_empty() {
        points.push([right, height]);
    }
    points
}

fn draw_floor(drawing: &mut Drawing, at: f64, [[left, _], [right, bottom]]: [[f64; 2]; 2]) {
    drawing.rectangle([left, at], [right, bottom], Ink::Floor);
    drawing.line(&[[left, at], [right, at]], Stroke::dashed(Ink::Aside, 1.2));
    let below = at + 13.0;
    let y = if below + 4.0 < bottom { below } else { at - 5.0 };
    drawing.text([right - 6.0, y], Anchor::End, 10.5, Ink::Aside, "floor: the reference with other flakes");
    drawing.line(&[[left, bottom], [right, bottom]], Stroke::solid(Ink::Aside, 1.0));
}

/// A short arrow from a marker towards less, along x or y.
fn arrow(at: [f64; 2], along: usize, radius: f64, stroke: Stroke) -> [Shape; 2] {
    let (near, far, head) = (radius, radius + 13.0, 4.0);
    let to = |ahead: f64, aside: f64| {
        if along == 0 { [at[0] - ahead, at[1] + aside] } else { [at[0] + aside, at[1] + ahead] }
    };
    let stroke = Stroke { width: stroke.width.max(1.2), ..stroke };
    let tip = far;
    [
        line(&[to(near, 0.0), to(tip, 0.0)], stroke),
        line(&[to(tip - head, -head), to(tip, 0.0), to(tip - head, head)], stroke),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::look_of_number;

    fn mark(key: &str, time: (f64, f64, f64), error: (f64, f64, f64)) -> Mark {
        let estimate = |(low, value, high)| Estimate { value, low, high };
        Mark { key: key.to_owned(), name: key.to_owned(), time: estimate(time), error: estimate(error) }
    }

    fn chart(marks: Vec<Mark>) -> Scatter {
        Scatter {
            title: "a place".to_owned(),
            time: "time".to_owned(),
            error: "error".to_owned(),
            floor: Some(0.05),
            series: vec![Series { name: "method".to_owned(), look: look_of_number(0), marks }],
            all_labelled: false,
        }
    }

    fn points(drawing: &Drawing) -> Vec<(&str, &str, &[Shape])> {
        let points = drawing.shapes.iter().filter_map(|shape| match shape {
            Shape::Point { key, title, shapes } => Some((key.as_str(), title.as_str(), shapes.as_slice())),
            _ => None,
        });
        points.collect()
    }

    #[test]
    fn points_of_the_front_are_larger_and_drawn_last() {
        let scatter = chart(vec![
            mark("fast", (0.9, 1.0, 1.1), (0.4, 0.5, 0.6)),
            mark("exact", (9.0, 10.0, 11.0), (0.09, 0.1, 0.11)),
            mark("beaten", (19.0, 20.0, 21.0), (0.4, 0.5, 0.6)),
        ]);
        assert_eq!(scatter.front(), ["fast", "exact"]);
        let drawing = scatter.draw();
        let found = points(&drawing);
        assert_eq!(found.iter().map(|point| point.0).collect::<Vec<_>>(), ["beaten", "fast", "exact"]);
        let radius = |shapes: &[Shape]| {
            shapes.iter().find_map(|shape| if let Shape::Disc { radius, .. } = shape { Some(*radius) } else { None })
        };
        assert!(radius(found[0].2) < radius(found[1].2) && radius(found[1].2) == radius(found[2].2));
        assert!(found[1].1.contains("on the front") && !found[0].1.contains("on the front"));
    }

    #[test]
    fn what_cannot_be_told_from_nothing_is_open_at_the_edge_of_its_spread() {
        let scatter = chart(vec![
            mark("bound", (-1.0, 0.2, 2.0), (0.4, 0.5, 0.6)),
            mark("sure", (9.0, 10.0, 11.0), (0.09, 0.1, 0.11)),
        ]);
        let drawing = scatter.draw();
        let found = points(&drawing);
        let bound = found.iter().find(|point| point.0 == "bound").expect("a point");
        assert!(bound.1.contains("at most 2"), "{}", bound.1);
        let is_filled = |shapes: &[Shape]| matches!(shapes.last(), Some(Shape::Disc { fill: Some(_), .. }));
        assert!(!is_filled(bound.2) && is_filled(found.iter().find(|point| point.0 == "sure").expect("a point").2));
    }

    #[test]
    fn what_is_no_number_is_left_out_and_nothing_at_all_is_said() {
        let nan = f64::NAN;
        let scatter = chart(vec![
            mark("nan", (nan, nan, nan), (0.4, 0.5, 0.6)),
            mark("zero", (0.0, 0.0, 0.0), (0.4, 0.5, 0.6)),
            mark("huge", (1.0, 1.0, 1.0), (0.0, 1.0, f64::INFINITY)),
        ]);
        assert_eq!(scatter.front(), [""; 0]);
        assert!(crate::charts::svg(&scatter.draw(), crate::charts::Use::Page).contains("Nothing was measured"));
    }
}
