//! What a chart says of its floor, written where it hides least.

use super::labels::{Area, length_in, overlap};
use super::text::width;
use super::{Anchor, Drawing, Ink};

const WORDS: &str = "floor: the reference with other flakes";
const SIZE: f64 = 10.5;
/// Pixels from one place that is tried to the next.
const STRIDE: f64 = 12.0;

/// Says what the floor at a height is, along its line: below it to the right, or where less of the markers and lines would be
/// hidden. Returns the area of the words.
pub fn draw_words(
    drawing: &mut Drawing,
    at: f64,
    [[left, top], [right, bottom]]: Area,
    markers: &[Area],
    lines: &[Vec<[f64; 2]>],
) -> Area {
    let wide = width(WORDS, SIZE, false);
    let area = |end: f64, y: f64| [[end - wide - 2.0, y - 9.0], [end + 2.0, y + 3.0]];
    let hides = |area: &Area| {
        let markers: f64 = markers.iter().map(|marker| overlap(area, marker)).sum();
        markers + lines.iter().map(|line| 3.0 * length_in(area, line)).sum::<f64>()
    };
    let rightmost = right - 6.0;
    let steps = ((rightmost - wide - 6.0 - left) / STRIDE).max(0.0) as u32;
    let ends = (0..=steps).map(|step| rightmost - STRIDE * f64::from(step));
    // Below it belongs to what it is about; above only where nothing else is free.
    let heights = [(at + 13.0, 0.0), (at - 5.0, 30.0)].into_iter().filter(|(y, _)| *y + 4.0 < bottom && *y - 9.0 > top);
    let places = ends.flat_map(|end| heights.clone().map(move |(y, cost)| (cost + 0.05 * (rightmost - end), end, y)));
    let best = places
        .map(|(cost, end, y)| (cost + hides(&area(end, y)), end, y))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or([rightmost, at - 5.0], |(_, end, y)| [end, y]);
    let [end, y] = best;
    let area = area(end, y);
    drawing.rectangle(area[0], area[1], Ink::Veil);
    drawing.text([end, y], Anchor::End, SIZE, Ink::Aside, WORDS);
    area
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = [[60.0, 30.0], [600.0, 400.0]];

    fn words(at: f64, markers: &[Area], lines: &[Vec<[f64; 2]>]) -> Area {
        draw_words(&mut Drawing::new([700.0, 450.0], String::new()), at, AREA, markers, lines)
    }

    #[test]
    fn the_words_lie_below_the_floor_to_the_right_and_make_way_for_markers_and_lines() {
        let free = words(300.0, &[], &[]);
        assert!(free[0][1] > 300.0 && free[1][0] > 590.0, "{free:?}");
        let marker = [[540.0, 300.0], [556.0, 316.0]];
        let line = vec![[300.0, 306.0], [600.0, 306.0]];
        for (markers, lines) in [(&[marker][..], vec![]), (&[], vec![line.clone()]), (&[marker], vec![line])] {
            let area = words(300.0, markers, &lines);
            assert!(markers.iter().all(|marker| overlap(&area, marker) == 0.0), "{area:?}");
            assert!(lines.iter().all(|line| length_in(&area, line) == 0.0), "{area:?}");
        }
    }

    #[test]
    fn the_words_stay_in_the_chart() {
        for at in [31.0, 200.0, 399.0] {
            let area = words(at, &[AREA], &[]);
            assert!(
                area[0][0] >= 60.0 && area[1][0] <= 600.0 && area[0][1] >= 30.0 - 9.0 && area[1][1] <= 400.0,
                "{area:?}"
            );
        }
    }
}
