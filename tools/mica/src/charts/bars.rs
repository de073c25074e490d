//! Stacked bars: of what the time of a frame is made.

use super::text::width;
use super::{Anchor, Drawing, Ink, look_of_number, three_digits};

/// What a chart of bars shows: each bar as long as the others, its parts as shares of it.
#[derive(Clone, Debug)]
pub struct Bars {
    pub title: String,
    pub unit: String,
    /// What bars are made of, in this order.
    pub parts: Vec<String>,
    pub bars: Vec<Bar>,
}

/// One of them.
#[derive(Clone, Debug)]
pub struct Bar {
    pub name: String,
    /// How much of each part.
    pub amounts: Vec<f64>,
}

const WIDTH: f64 = 760.0;
const RIGHT: f64 = 670.0;
const BAR: f64 = 22.0;
const STEP: f64 = 32.0;
const TOP: f64 = 34.0;

impl Bars {
    /// The chart.
    pub fn draw(&self) -> Drawing {
        let names = self.bars.iter().map(|bar| width(&bar.name, 12.0, false)).fold(40.0, f64::max);
        let left = (24.0 + names).min(RIGHT - 200.0);
        let below = TOP + STEP * self.bars.len() as f64;
        let keys = self.key_places(left);
        let height = below + 30.0 + keys.iter().map(|place| place[1]).fold(0.0, f64::max);
        let mut drawing = Drawing::new([WIDTH, height], self.title.clone());
        drawing.bold([16.0, 18.0], Anchor::Start, 13.0, Ink::Words, self.title.clone());
        for (k, bar) in self.bars.iter().enumerate() {
            let top = TOP + STEP * k as f64;
            let sound = |amount: &f64| if amount.is_finite() { amount.max(0.0) } else { 0.0 };
            let total: f64 = bar.amounts.iter().map(sound).sum();
            drawing.text([left - 8.0, top + 16.0], Anchor::End, 12.0, Ink::Words, bar.name.clone());
            let mut from = left;
            for (part, amount) in bar.amounts.iter().enumerate().filter(|_| total > 0.0) {
                let to = from + sound(amount) / total * (RIGHT - left);
                drawing.rectangle([from, top], [to, top + BAR], part_ink(part));
                let share = format!("{:.0} %", 100.0 * sound(amount) / total);
                if to - from > width(&share, 10.5, false) + 8.0 {
                    let middle = [(from + to) / 2.0, top + 15.0];
                    drawing.text(middle, Anchor::Middle, 10.5, Ink::Own([255; 3], 1.0), share);
                }
                from = to;
            }
            let sum = format!("{} {}", three_digits(total), self.unit);
            drawing.text([RIGHT + 8.0, top + 16.0], Anchor::Start, 12.0, Ink::Words, sum);
        }
        for (part, (name, [x, y])) in self.parts.iter().zip(keys).enumerate() {
            drawing.rectangle([x, below + y], [x + 12.0, below + y + 12.0], part_ink(part));
            drawing.text([x + 17.0, below + y + 10.5], Anchor::Start, 11.0, Ink::Words, name.clone());
        }
        drawing
    }

    /// Where each part is named, below the bars: in lines that are as long as there is room.
    fn key_places(&self, left: f64) -> Vec<[f64; 2]> {
        let mut at = [left, 8.0];
        self.parts
            .iter()
            .map(|name| {
                let wide = 34.0 + width(name, 11.0, false);
                if at[0] > left && at[0] + wide > WIDTH {
                    at = [left, at[1] + 20.0];
                }
                let place = at;
                at[0] += wide;
                place
            })
            .collect()
    }
}

/// The first look is a grey that bars have no use for.
fn part_ink(part: usize) -> Ink {
    Ink::Own(look_of_number(part + 1).colour, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Shape;

    #[test]
    fn bars_are_of_one_length_and_their_parts_in_proportion() {
        let bar = |name: &str, amounts: &[f64]| Bar { name: name.to_owned(), amounts: amounts.to_vec() };
        let bars = vec![bar("a", &[1.0, 3.0]), bar("b", &[200.0, 200.0]), bar("c", &[f64::NAN, 0.0])];
        let parts = vec!["one".to_owned(), "two".to_owned()];
        let drawing = Bars { title: String::new(), unit: "ms".to_owned(), parts, bars }.draw();
        let long: Vec<f64> = drawing
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Line { points, closed: true, .. } if points[2][1] - points[0][1] == BAR => {
                    Some(points[2][0] - points[0][0])
                }
                _ => None,
            })
            .collect();
        assert_eq!(long.len(), 4);
        assert!((long[0] * 3.0 - long[1]).abs() < 1e-9 && (long[2] - long[3]).abs() < 1e-9);
        assert!((long[0] + long[1] - long[2] - long[3]).abs() < 1e-9);
    }
}
