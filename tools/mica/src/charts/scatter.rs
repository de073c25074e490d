//! Error against time: each method's rungs, which of them nothing beats, and what no method can do better than.

use super::axis::Axis;
use super::floor;
use super::labels::{Area, Label, place};
use super::text::width;
use super::{Anchor, Drawing, Ink, Look, Shape, Stroke, line, three_digits};
use mica_accuracy::{Estimate, Weight, front};

/// What a chart of error against time shows.
#[derive(Clone, Debug)]
pub struct Scatter {
    pub title: String,
    pub time: String,
    pub error: String,
    /// What no series can do better than, except by chance.
    pub floor: Option<f64>,
    pub series: Vec<Series>,
    pub labelled: Labelled,
}

/// Which marks have their names beside them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Labelled {
    None,
    Front,
    All,
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
    /// What else a reader is told who points at it; may be empty.
    pub what: String,
    pub time: Estimate,
    pub error: Estimate,
}

/// Where a chart is drawn within a drawing, and along which axes.
pub struct Frame {
    /// Two corners.
    pub area: [[f64; 2]; 2],
    pub x: Axis,
    pub y: Axis,
    /// Whether numbers stand below and to the left.
    pub numbers: [bool; 2],
    /// Radii of markers in the front and elsewhere.
    pub radii: [f64; 2],
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

impl Drawn<'_> {
    /// The area of its marker; radii as in [`Frame`].
    fn around(&self, [large, small]: [f64; 2]) -> Area {
        let radius = if self.is_front { large + 1.0 } else { small };
        [self.at.map(|side| side - radius), self.at.map(|side| side + radius)]
    }

    /// From end to end of what is known of its time and of its error, where that has two ends and no marker stands at one.
    fn bars(&self, Frame { x, y, .. }: &Frame) -> Vec<Vec<[f64; 2]>> {
        let [time, error] = self.mark.weights();
        let mut bars = Vec::new();
        for (figure, weight, axis, along) in [(self.mark.time, time, x, 0), (self.mark.error, error, y, 1)] {
            if !weight.is_at_most && weight.value > 0.0 && figure.low.is_finite() && figure.high.is_finite() {
                bars.push(
                    [figure.low, figure.high]
                        .map(|value| {
                            let mut end = self.at;
                            end[along] = axis.within(value);
                            end
                        })
                        .to_vec(),
                );
            }
        }
        bars
    }
}

const HEIGHT: f64 = 460.0;
const WIDTH: f64 = 760.0;
const LEFT: f64 = 66.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 52.0;
const RADII: [f64; 2] = [7.5, 3.6];
/// How far numbers of an axis may reach beyond its end.
const ROOM_BESIDE: f64 = 12.0;
/// With more points in the front than this, only the most accurate of each series has a label.
const MOST_LABELS: usize = 9;
/// How opaque is what the front beats.
const PALE: f64 = 0.5;

impl Mark {
    /// What stands for its time and for its error.
    pub fn weights(&self) -> [Weight; 2] {
        [Weight::of_time(self.time), Weight::of_error(self.error)]
    }

    /// Where it is drawn: time and error.
    fn shown(&self) -> [f64; 2] {
        self.weights().map(|weight| weight.value)
    }

    fn can_be_drawn(&self) -> bool {
        self.shown().iter().all(|at| at.is_finite() && *at < 1e30)
    }
}

impl Scatter {
    /// The keys of the marks that nothing beats, the fastest first.
    pub fn front(&self) -> Vec<&str> {
        let marks: Vec<&Mark> =
            self.series.iter().flat_map(|series| &series.marks).filter(|m| m.can_be_drawn()).collect();
        let points: Vec<(f64, f64)> = marks.iter().map(|mark| mark.shown().into()).collect();
        front(&points).into_iter().filter_map(|index| Some(marks.get(index)?.key.as_str())).collect()
    }

    /// The chart.
    pub fn draw(&self) -> Drawing {
        let mut drawing = Drawing::new([WIDTH, HEIGHT], self.title.clone());
        drawing.bold([LEFT, 18.0], Anchor::Start, 13.0, Ink::Words, self.title.clone());
        let (right, bottom) = (WIDTH - 46.0 - self.legend_width(), HEIGHT - BOTTOM);
        let x = Axis::around(self.times(), [LEFT, right]);
        let y = Axis::around(self.errors().chain(self.floor_in_sight()), [bottom, TOP]);
        let (Some(x), Some(y)) = (x, y) else {
            drawing.say_nothing([LEFT, TOP + 30.0]);
            return drawing;
        };
        let area = [[LEFT, TOP], [right, bottom]];
        let on_front = self.draw_in(&mut drawing, &Frame { area, x, y, numbers: [true; 2], radii: RADII });
        let middle = f64::midpoint(LEFT, right);
        drawing.text([middle, bottom + 38.0], Anchor::Middle, 12.0, Ink::Words, self.time.clone());
        drawing.upwards([17.0, f64::midpoint(TOP, bottom)], 12.0, Ink::Words, self.error.clone());
        self.draw_legend(&mut drawing, &on_front, right + 22.0);
        drawing
    }

    fn marks(&self) -> impl Iterator<Item = &Mark> {
        self.series.iter().flat_map(|series| &series.marks).filter(|mark| mark.can_be_drawn())
    }

    /// What the axis of time has to hold.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.marks().map(|mark| mark.shown()[0])
    }

    /// What the axis of error has to hold.
    pub fn errors(&self) -> impl Iterator<Item = f64> {
        self.marks().map(|mark| mark.shown()[1])
    }

    /// The floor is seen where it is, if that is not so far off that nothing else could be told apart.
    fn floor_in_sight(&self) -> Option<f64> {
        let least = self.errors().fold(f64::INFINITY, f64::min);
        self.floor.filter(|floor| *floor > least / 30.0)
    }

    /// Everything between the axes, and their numbers. Returns the series on the front, the fastest first.
    pub fn draw_in(&self, drawing: &mut Drawing, frame: &Frame) -> Vec<usize> {
        let Frame { area, x, y, .. } = frame;
        let chosen = self.front();
        let mut drawn: Vec<Drawn<'_>> = Vec::new();
        for (series, one) in self.series.iter().enumerate() {
            drawn.extend(one.marks.iter().filter(|mark| mark.can_be_drawn()).map(|mark| {
                let [time, error] = mark.shown();
                let is_front = chosen.contains(&mark.key.as_str());
                Drawn { series, mark, time, error, at: [x.within(time), y.within(error)], is_front }
            }));
        }
        let steps = steps(&drawn, *area);
        draw_paper(drawing, frame, &steps);
        let floor = self.floor_in_sight().map(|floor| y.within(floor));
        if let Some(at) = floor {
            drawing.rectangle([area[0][0], at], area[1], Ink::Floor);
            drawing.line(&[[area[0][0], at], [area[1][0], at]], Stroke::dashed(Ink::Aside, 1.2));
        }
        for series in 0..self.series.len() {
            self.draw_ladder(drawing, drawn.iter().filter(|one| one.series == series));
        }
        if steps.len() > 1 {
            drawing.line(&steps, Stroke::solid(Ink::Words, 2.4 * frame.radii[0] / RADII[0]));
        }
        // What matters most is drawn last.
        for is_front in [false, true] {
            for one in drawn.iter().filter(|one| one.is_front == is_front) {
                drawing.shapes.push(self.point(one, frame));
            }
        }
        let taken = floor.map(|at| {
            let markers: Vec<Area> = drawn.iter().map(|one| one.around(frame.radii)).collect();
            let mut lines: Vec<Vec<[f64; 2]>> = drawn.iter().flat_map(|one| one.bars(frame)).collect();
            lines.extend((0..self.series.len()).map(|series| ladder(drawn.iter().filter(|one| one.series == series))));
            lines.push(steps.clone());
            floor::draw_words(drawing, at, *area, &markers, &lines)
        });
        self.draw_labels(drawing, &drawn, frame, steps, taken);
        let mut on_front: Vec<&Drawn<'_>> = drawn.iter().filter(|one| one.is_front).collect();
        on_front.sort_by(|a, b| a.time.total_cmp(&b.time));
        on_front.iter().map(|one| one.series).collect()
    }

    fn colour(&self, series: usize, opacity: f64) -> Ink {
        self.series.get(series).map_or(Ink::Aside, |series| Ink::Own(series.look.colour, opacity))
    }

    /// The thin line that joins the rungs of a method.
    fn draw_ladder<'a>(&self, drawing: &mut Drawing, rungs: impl Iterator<Item = &'a Drawn<'a>> + Clone) {
        if let Some(first) = rungs.clone().next() {
            let opacity = if rungs.clone().any(|rung| rung.is_front) { 0.75 } else { 0.35 };
            drawing.shapes.extend(long_line(&ladder(rungs), Stroke::solid(self.colour(first.series, opacity), 1.1)));
        }
    }

    fn point(&self, drawn: &Drawn<'_>, frame: &Frame) -> Shape {
        let Drawn { series, mark, at, is_front, .. } = drawn;
        let Some(look) = self.series.get(*series).map(|series| series.look) else {
            return line(&[], Stroke::solid(Ink::Aside, 0.0));
        };
        let opacity = if *is_front { 1.0 } else { PALE };
        let ink = Ink::Own(look.colour, opacity);
        let radius = frame.radii[usize::from(!*is_front)];
        let bars = Stroke::solid(ink, if *is_front { 1.4 } else { 0.8 });
        let mut shapes = Vec::new();
        let [time, error] = mark.weights();
        shapes.extend(drawn.bars(frame).iter().filter_map(|bar| long_line(bar, bars)));
        for (along, weight) in [time, error].into_iter().enumerate() {
            if weight.is_at_most {
                shapes.extend(arrow(*at, along, radius, bars));
            }
        }
        let is_open = time.is_at_most || error.is_at_most;
        let outline = if *is_front { Stroke::solid(Ink::Words, 1.8) } else { Stroke::solid(ink, 1.2) };
        // Paper first: lines do not shine through what is pale.
        shapes.push(look.mark(*at, radius, Some(Ink::Paper), None));
        shapes.push(match (is_open, *is_front) {
            (true, _) => look.mark(*at, radius, None, Some(Stroke { ink, ..outline })),
            (false, true) => look.mark(*at, radius, Some(ink), Some(outline)),
            (false, false) => look.mark(*at, radius, Some(ink), None),
        });
        let at_most = |weight: Weight| if weight.is_at_most { "at most " } else { "" };
        let title = format!(
            "{}: {} {}{}, {} {}{}{}{}{}",
            mark.name,
            self.time,
            at_most(time),
            three_digits(time.value),
            self.error,
            at_most(error),
            three_digits(error.value),
            if *is_front { "; on the front" } else { "" },
            if mark.what.is_empty() { "" } else { ". " },
            mark.what,
        );
        Shape::Point { key: mark.key.clone(), title, shapes }
    }

    fn draw_labels(
        &self,
        drawing: &mut Drawing,
        drawn: &[Drawn<'_>],
        frame: &Frame,
        steps: Vec<[f64; 2]>,
        more: Option<Area>,
    ) {
        let [large, small] = frame.radii;
        let taken: Vec<Area> = drawn.iter().map(|one| one.around(frame.radii)).chain(more).collect();
        let on_front = || drawn.iter().filter(|one| one.is_front);
        let is_crowded = on_front().count() > MOST_LABELS;
        let is_best = |one: &Drawn<'_>| on_front().all(|other| other.series != one.series || other.error >= one.error);
        let mut labels: Vec<Label> = drawn
            .iter()
            .filter(|one| match self.labelled {
                Labelled::None => false,
                Labelled::Front => one.is_front && (!is_crowded || is_best(one)),
                Labelled::All => true,
            })
            .map(|one| Label {
                at: one.at,
                radius: if one.is_front { large } else { small },
                words: one.mark.name.clone(),
                bold: one.is_front,
                ink: if one.is_front { Ink::Words } else { Ink::Aside },
            })
            .collect();
        labels.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
        let bars = drawn.iter().filter(|one| one.is_front && !one.mark.weights()[1].is_at_most).map(|one| {
            let half = 14.0;
            vec![[one.at[0], one.at[1] - half], [one.at[0], one.at[1] + half]]
        });
        let lines: Vec<Vec<[f64; 2]>> = std::iter::once(steps).chain(bars).collect();
        place(drawing, &labels, frame.area, &taken, &lines);
    }

    fn legend_width(&self) -> f64 {
        self.series.iter().map(|series| width(&series.name, 11.5, true)).fold(60.0, f64::max)
    }

    /// Methods of the front first, in its order; then the others.
    fn draw_legend(&self, drawing: &mut Drawing, on_front: &[usize], left: f64) {
        let mut order: Vec<usize> = Vec::new();
        for series in on_front.iter().copied().chain(0..self.series.len()) {
            if !order.contains(&series) {
                order.push(series);
            }
        }
        let mut y = TOP + 6.0;
        let mut was_front = true;
        for (k, series) in order.iter().filter_map(|k| Some((*k, self.series.get(*k)?))) {
            let is_front = on_front.contains(&k);
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

/// Where the rungs of a method are, in their order of time.
fn ladder<'a>(rungs: impl Iterator<Item = &'a Drawn<'a>>) -> Vec<[f64; 2]> {
    let mut rungs: Vec<&Drawn<'_>> = rungs.collect();
    rungs.sort_by(|a, b| a.time.total_cmp(&b.time).then(b.error.total_cmp(&a.error)));
    rungs.iter().map(|rung| rung.at).collect()
}

fn draw_paper(drawing: &mut Drawing, frame: &Frame, steps: &[[f64; 2]]) {
    let [[left, top], [right, bottom]] = frame.area;
    if let [first, .., last] = steps {
        let mut beaten = steps.to_vec();
        beaten.extend([[right, last[1]], [right, top], [first[0], top]]);
        drawing.shapes.push(Shape::Line { points: beaten, closed: true, fill: Some(Ink::Beaten), stroke: None });
    }
    for (axis, is_time) in [(&frame.x, true), (&frame.y, false)] {
        let ends = |at: f64| if is_time { [[at, top], [at, bottom]] } else { [[left, at], [right, at]] };
        let has_numbers = frame.numbers[usize::from(!is_time)];
        let number = |drawing: &mut Drawing, at: f64, words: String| {
            let (place, anchor) =
                if is_time { ([at, bottom + 16.0], Anchor::Middle) } else { ([left - 7.0, at + 4.0], Anchor::End) };
            drawing.text(place, anchor, 11.0, Ink::Aside, words);
        };
        for tick in axis.ticks() {
            let thickness = if tick.label.is_some() { 1.0 } else { 0.4 };
            drawing.line(&ends(tick.at), Stroke::solid(Ink::Grid, thickness));
            // Beside may be another chart, and numbers of its own.
            let sticks_out =
                |label: &String| is_time && tick.at + width(label, 11.0, false) / 2.0 > right + ROOM_BESIDE;
            if let Some(label) = tick.label.filter(|label| has_numbers && !sticks_out(label)) {
                number(drawing, tick.at, label);
            }
        }
        if let Some(at) = axis.zero() {
            drawing.line(&ends(at), Stroke::dashed(Ink::Aside, 1.0));
            if has_numbers {
                number(drawing, at, if is_time { "0" } else { "exact" }.to_owned());
            }
        }
    }
    drawing.line(&[[left, top], [left, bottom], [right, bottom]], Stroke::solid(Ink::Aside, 1.0));
}

/// A line, if it is longer than a point.
fn long_line(points: &[[f64; 2]], stroke: Stroke) -> Option<Shape> {
    let is_long = points.windows(2).any(|ends| (ends[0][0] - ends[1][0]).hypot(ends[0][1] - ends[1][1]) > 0.01);
    is_long.then(|| line(points, stroke))
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
        Mark {
            key: key.to_owned(),
            name: key.to_owned(),
            what: String::new(),
            time: estimate(time),
            error: estimate(error),
        }
    }

    fn chart(marks: Vec<Mark>) -> Scatter {
        Scatter {
            title: "a place".to_owned(),
            time: "time".to_owned(),
            error: "error".to_owned(),
            floor: Some(0.05),
            series: vec![Series { name: "method".to_owned(), look: look_of_number(0), marks }],
            labelled: Labelled::Front,
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
            mark("no faster", (0.1, 1.5, 2.9), (0.5, 0.6, 0.7)),
            mark("sure", (9.0, 10.0, 11.0), (0.09, 0.1, 0.11)),
        ]);
        assert_eq!(scatter.front(), ["bound", "sure"], "a spread that just does not reach 0 wins nothing");
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
            mark("huge", (1.0, 1.0, 1.0), (0.0, 1.0, f64::INFINITY)),
        ]);
        assert_eq!(scatter.front(), [""; 0]);
        assert!(crate::charts::svg(&scatter.draw(), crate::charts::Use::Page).contains("Nothing was measured"));
    }

    #[test]
    fn what_costs_nothing_or_is_exact_has_a_line_of_its_own_and_is_on_the_front() {
        let scatter = chart(vec![
            mark("free", (-3.0, -2.0, -1.0), (0.4, 0.5, 0.6)),
            mark("exact", (9.0, 10.0, 11.0), (0.0, 0.0, 0.0)),
            mark("beaten", (9.0, 10.0, 11.0), (0.5, 0.6, 0.7)),
        ]);
        assert_eq!(scatter.front(), ["free", "exact"]);
        let drawing = scatter.draw();
        let text = crate::charts::svg(&drawing, crate::charts::Use::Page);
        assert!(text.contains(">0</text>") && text.contains(">exact</text>"), "{text}");
        let found = points(&drawing);
        assert_eq!(found.len(), 3);
        assert!(found.iter().all(|point| !point.1.contains("at most")));
    }

    #[test]
    fn intervals_of_no_length_are_not_drawn() {
        let scatter = chart(vec![mark("one", (10.0, 10.0, 10.0), (0.5, 0.5, 0.5))]);
        let drawing = scatter.draw();
        let found = points(&drawing);
        assert!(found[0].2.iter().all(|shape| matches!(shape, Shape::Disc { .. })), "{:?}", found[0].2);
    }
}
