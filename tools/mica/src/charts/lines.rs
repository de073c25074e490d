//! Lines over a quantity: time against the size of the picture.

use super::axis::Axis;
use super::labels::{Label, place};
use super::{Anchor, Drawing, Ink, Look, Stroke, line};

/// What a chart of lines shows; the axis across is logarithmic.
#[derive(Clone, Debug)]
pub struct Lines {
    /// Whether the axis upwards is of equal differences; else it is logarithmic too.
    pub linear_up: bool,
    pub title: String,
    /// Below the title; may be empty.
    pub note: String,
    pub across: String,
    pub up: String,
    pub lines: Vec<Line>,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Line {
    pub name: String,
    pub look: Look,
    /// Somebody else's: dashed.
    pub dashed: bool,
    pub points: Vec<[f64; 2]>,
}

/// Points of a line that are marked.
const MOST_MARKS: usize = 40;
const SIZE: [f64; 2] = [760.0, 420.0];
const LEFT: f64 = 66.0;
const TOP: f64 = 40.0;
const RIGHT: f64 = 740.0;
const BOTTOM: f64 = 368.0;

impl Lines {
    /// The chart.
    pub fn draw(&self) -> Drawing {
        let mut drawing = Drawing::new(SIZE, self.title.clone());
        drawing.bold([LEFT, 18.0], Anchor::Start, 13.0, Ink::Words, self.title.clone());
        drawing.text([LEFT, 31.0], Anchor::Start, 11.0, Ink::Aside, self.note.clone());
        let usable = |[across, up]: &&[f64; 2]| {
            (1e-30..1e30).contains(across) && up.abs() < 1e30 && (self.linear_up || *up > 1e-30)
        };
        let all = || self.lines.iter().flat_map(|line| &line.points).filter(usable);
        // Room at the right for the names of lines.
        let x = Axis::around(all().map(|point| point[0]), [LEFT, RIGHT - 150.0]);
        let around = if self.linear_up { Axis::linear_around } else { Axis::around };
        let y = around(all().map(|point| point[1]), [BOTTOM, TOP]);
        let (Some(x), Some(y)) = (x, y) else {
            drawing.say_nothing([LEFT, TOP + 30.0]);
            return drawing;
        };
        for tick in x.ticks() {
            drawing.line(&[[tick.at, TOP], [tick.at, BOTTOM]], Stroke::solid(Ink::Grid, 0.8));
            drawing.text([tick.at, BOTTOM + 16.0], Anchor::Middle, 11.0, Ink::Aside, tick.label.unwrap_or_default());
        }
        for tick in y.ticks() {
            drawing.line(&[[LEFT, tick.at], [RIGHT - 150.0, tick.at]], Stroke::solid(Ink::Grid, 0.8));
            drawing.text([LEFT - 7.0, tick.at + 4.0], Anchor::End, 11.0, Ink::Aside, tick.label.unwrap_or_default());
        }
        drawing.line(&[[LEFT, TOP], [LEFT, BOTTOM], [RIGHT - 150.0, BOTTOM]], Stroke::solid(Ink::Aside, 1.0));
        drawing.text(
            [(LEFT + RIGHT) / 2.0 - 75.0, BOTTOM + 38.0],
            Anchor::Middle,
            12.0,
            Ink::Words,
            self.across.clone(),
        );
        drawing.upwards([17.0, (TOP + BOTTOM) / 2.0], 12.0, Ink::Words, self.up.clone());
        let mut labels = Vec::new();
        for one in &self.lines {
            let mut points: Vec<[f64; 2]> =
                one.points.iter().filter(usable).map(|[across, up]| [x.within(*across), y.within(*up)]).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let ink = Ink::Own(one.look.colour, 1.0);
            let stroke = if one.dashed { Stroke::dashed(ink, 1.6) } else { Stroke::solid(ink, 2.2) };
            drawing.shapes.push(line(&points, stroke));
            // Marks of many points would hide each other.
            for at in points.iter().filter(|_| points.len() <= MOST_MARKS) {
                let (fill, outline) =
                    if one.dashed { (Ink::Paper, Some(Stroke::solid(ink, 1.4))) } else { (ink, None) };
                drawing.shapes.push(one.look.mark(*at, 4.5, Some(fill), outline));
            }
            let end = points.last().map(|at| Label {
                at: *at,
                radius: 5.0,
                words: one.name.clone(),
                bold: !one.dashed,
                ink: if one.dashed { Ink::Aside } else { Ink::Words },
            });
            labels.extend(end);
        }
        place(&mut drawing, &labels, [[LEFT, TOP], [RIGHT + 10.0, BOTTOM]], &[], &[]);
        drawing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{Shape, look_of_number};

    #[test]
    fn a_line_goes_from_left_to_right_and_leaves_out_what_is_no_number() {
        let points = vec![[4.0, 8.0], [f64::NAN, 1.0], [1.0, 2.0], [2.0, 0.0]];
        let one = Line { name: "ours".to_owned(), look: look_of_number(0), dashed: false, points };
        let chart = Lines {
            linear_up: false,
            title: String::new(),
            note: String::new(),
            across: String::new(),
            up: String::new(),
            lines: vec![one],
        };
        let drawing = chart.draw();
        let drawn = drawing.shapes.iter().find_map(|shape| match shape {
            Shape::Line { points, stroke: Some(Stroke { ink: Ink::Own(..), .. }), .. } => Some(points),
            _ => None,
        });
        let drawn = drawn.expect("a line");
        assert!(drawn.len() == 2 && drawn[0][0] < drawn[1][0] && drawn[0][1] > drawn[1][1], "{drawn:?}");
    }
}
