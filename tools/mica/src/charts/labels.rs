//! Words beside points, placed so that they hide neither each other nor other points, as far as that can be.

use super::text::width;
use super::{Anchor, Drawing, Ink, Stroke};

/// A label that has not found its place.
#[derive(Clone, Debug)]
pub struct Label {
    /// The point that it is about.
    pub at: [f64; 2],
    /// How far its marker reaches.
    pub radius: f64,
    pub words: String,
    pub bold: bool,
    pub ink: Ink,
}

/// A rectangle by two corners.
pub type Area = [[f64; 2]; 2];

const SIZE: f64 = 11.5;
/// From the baseline to the top of letters, and to their bottom.
const RISE: f64 = 9.5;
const FALL: f64 = 3.0;
/// A label further off than this from its marker has a line to it.
const NEAR: f64 = 9.0;

/// Draws labels within an area. `taken`: areas that had better stay free; `lines`: lines that had better not be crossed.
pub fn place(drawing: &mut Drawing, labels: &[Label], within: Area, taken: &[Area], lines: &[Vec<[f64; 2]>]) {
    let mut placed: Vec<Area> = Vec::new();
    for label in labels {
        let wide = width(&label.words, SIZE, label.bold);
        let best = candidates(label, wide)
            .map(|(cost, baseline)| {
                let area = [[baseline[0], baseline[1] - RISE], [baseline[0] + wide, baseline[1] + FALL]];
                let hidden: f64 = taken.iter().map(|other| overlap(&area, other)).sum();
                let covered: f64 = placed.iter().map(|other| overlap(&area, other)).sum();
                let crossed = lines.iter().map(|line| length_in(&area, line)).sum::<f64>();
                let outside = wide * (RISE + FALL) - overlap(&area, &within);
                (cost + hidden + 20.0 * covered + 2.0 * crossed + 40.0 * outside, area)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, area)) = best else { continue };
        let [[left, top], [right, bottom]] = area;
        let [x, y] = label.at;
        let nearest = [x.clamp(left, right), y.clamp(top + 2.0, bottom - 2.0)];
        let (dx, dy) = (nearest[0] - x, nearest[1] - y);
        let distance = dx.hypot(dy);
        if distance > label.radius + NEAR {
            let from = [x + dx / distance * (label.radius + 2.0), y + dy / distance * (label.radius + 2.0)];
            let to = [nearest[0] - dx / distance * 2.0, nearest[1] - dy / distance * 2.0];
            drawing.line(&[from, to], Stroke::solid(Ink::Aside, 0.8));
        }
        placed.push(area);
        drawing.rectangle([left - 2.0, top], [right + 2.0, bottom], Ink::Veil);
        let baseline = [left, bottom - FALL];
        if label.bold {
            drawing.bold(baseline, Anchor::Start, SIZE, label.ink, label.words.clone());
        } else {
            drawing.text(baseline, Anchor::Start, SIZE, label.ink, label.words.clone());
        }
    }
}

/// Where the baseline may begin, and what that costs beside what it hides: the further off, the more.
fn candidates(label: &Label, wide: f64) -> impl Iterator<Item = (f64, [f64; 2])> {
    let [x, y] = label.at;
    let radius = label.radius;
    let middle = (RISE - FALL) / 2.0;
    let sides = [
        // Above right first: there the front leaves room.
        ([1.0, -1.0], 0.0),
        ([1.0, 0.0], 2.0),
        ([0.0, -1.0], 4.0),
        ([0.0, 1.0], 5.0),
        ([1.0, 1.0], 5.0),
        ([-1.0, 1.0], 6.0),
        ([-1.0, 0.0], 7.0),
        ([-1.0, -1.0], 7.0),
    ];
    (0..7).flat_map(move |ring| {
        let away = radius + 4.0 + 13.0 * f64::from(ring);
        sides.map(|(side, cost): ([f64; 2], f64)| {
            let diagonal = if side[0] != 0.0 && side[1] != 0.0 { 0.75 } else { 1.0 };
            let start = x + side[0] * away * diagonal - wide * (1.0 - side[0]) / 2.0;
            let baseline = y + middle + side[1] * (away * diagonal + middle);
            (cost + 14.0 * f64::from(ring), [start, baseline])
        })
    })
}

/// Pixels that two rectangles share.
pub fn overlap(a: &Area, b: &Area) -> f64 {
    let side = |k: usize| (a[1][k].min(b[1][k]) - a[0][k].max(b[0][k])).max(0.0);
    side(0) * side(1)
}

/// Pixels of a line in a rectangle, to a few pixels.
pub fn length_in(area: &Area, line: &[[f64; 2]]) -> f64 {
    const STEP: f64 = 3.0;
    let inside = |[x, y]: [f64; 2]| (area[0][0]..=area[1][0]).contains(&x) && (area[0][1]..=area[1][1]).contains(&y);
    line.windows(2)
        .map(|ends| {
            let [from, to] = [ends[0], ends[1]];
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            let steps = (length / STEP).ceil().min(2000.0) as u32;
            let at =
                |k: u32, side: usize| from[side] + (to[side] - from[side]) * f64::from(k) / f64::from(steps.max(1));
            (0..steps).filter(|k| inside([at(*k, 0), at(*k, 1)])).count() as f64 * STEP
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Shape;

    #[test]
    fn labels_of_crowded_points_do_not_lie_on_each_other() {
        let labels: Vec<Label> = (0..9)
            .map(|k| {
                let at = [200.0 + f64::from(k % 3) * 7.0, 150.0 + f64::from(k / 3) * 7.0];
                Label { at, radius: 6.0, words: format!("method {k}"), bold: k % 2 == 0, ink: Ink::Words }
            })
            .collect();
        let mut drawing = Drawing::new([400.0, 300.0], String::new());
        place(&mut drawing, &labels, [[0.0, 0.0], [400.0, 300.0]], &[], &[]);
        let areas: Vec<Area> = drawing
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text(text) => {
                    let [x, y] = text.at;
                    Some([[x, y - RISE], [x + width(&text.words, SIZE, text.bold), y + FALL]])
                }
                _ => None,
            })
            .collect();
        assert_eq!(areas.len(), labels.len());
        for (k, area) in areas.iter().enumerate() {
            assert!(areas[..k].iter().all(|other| overlap(area, other) == 0.0), "{areas:?}");
            assert!(area[0][0] >= 0.0 && area[1][0] <= 400.0 && area[0][1] >= 0.0 && area[1][1] <= 300.0);
        }
    }
}
