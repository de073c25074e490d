//! The tables and figures of papers drawn anew: ours beside theirs.

use super::figures::with_interval;
use super::html::Html;
use super::read::{PaperLine, is_same_device};
use super::{Plot, unused};
use crate::charts::{Bar, Bars, Drawing, Line, Lines, Use, look_of_number, svg, three_digits};

/// The section of the page, and its plots; empty where nothing was measured.
pub fn papers(lines: &[PaperLine], plots: &mut Vec<Plot>) -> String {
    let mut html = Html::new();
    if lines.is_empty() {
        return html.done();
    }
    html.tag("<section id=\"papers\"><h2>The papers' tables, ours beside theirs</h2>");
    let mut groups: Vec<Vec<&PaperLine>> = Vec::new();
    for line in lines {
        let is_here = |group: &&mut Vec<&PaperLine>| {
            group.first().is_some_and(|first| {
                (&first.paper, &first.table) == (&line.paper, &line.table)
                    && is_same_device(&first.machine, &line.machine)
            })
        };
        match groups.iter_mut().find(is_here) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    let mut used = Vec::new();
    for group in &groups {
        let Some(first) = group.first() else { continue };
        let title = format!("{}, {}", paper_name(&first.paper), first.table);
        html.tag("<h3>").words(&title).tag("</h3>");
        let drawing = match first.table.as_str() {
            "figure 9" => Some(bars(group, &title)),
            "figure 10" => Some(over_pixels(group, &title)),
            _ => None,
        };
        if let Some(drawing) = drawing {
            html.tag("<figure>").tag(&svg(&drawing, Use::Page)).tag("</figure>");
            plots.push(Plot { file: unused(&format!("{} {}", first.paper, first.table), &mut used), drawing });
        }
        table(&mut html, group);
    }
    html.tag("</section>");
    html.done()
}

fn paper_name(paper: &str) -> String {
    match paper {
        "wdh20" => "Wang, Deng and Holzschuch 2020".to_owned(),
        other => other.to_owned(),
    }
}

fn table(html: &mut Html, group: &[&PaperLine]) {
    let Some(first) = group.first() else { return };
    html.tag("<div class=\"scroll\"><table><thead><tr><th scope=\"col\"></th><th scope=\"col\"></th>");
    html.tag("<th scope=\"col\" class=\"number\">ours<small>").words(&first.machine.device).tag("</small></th>");
    html.tag("<th scope=\"col\" class=\"number\">theirs</th><th scope=\"col\">their hardware</th>");
    html.tag("<th scope=\"col\">note</th></tr></thead><tbody>");
    for line in group {
        html.tag("<tr><th scope=\"row\">").words(&line.row).tag("</th><td>").words(&line.column).tag("</td><td>");
        html.words(&line.ours.map_or_else(|| "–".to_owned(), |ours| format!("{} {}", with_interval(ours), line.unit)));
        html.tag("</td><td>");
        html.words(
            &line.theirs.map_or_else(|| "–".to_owned(), |theirs| format!("{} {}", three_digits(theirs), line.unit)),
        );
        html.tag("</td><td>").words(if line.theirs.is_some() { &line.theirs_on } else { "" });
        html.tag("</td><td>").words(line.note.as_deref().unwrap_or_default()).tag("</td></tr>");
    }
    html.tag("</tbody></table></div>");
}

/// Components of each scene's time, ours above theirs.
fn bars(group: &[&PaperLine], title: &str) -> Drawing {
    let scenes = distinct(group.iter().map(|line| line.row.as_str()));
    let parts = distinct(group.iter().map(|line| line.column.as_str()));
    let find = |scene: &str, part: &str| group.iter().find(|line| line.row == scene && line.column == part);
    let mut bars = Vec::new();
    for scene in scenes {
        let of = |amount: &dyn Fn(&PaperLine) -> Option<f64>| -> Vec<f64> {
            parts.iter().map(|part| find(scene, part).and_then(|line| amount(line)).unwrap_or(0.0)).collect()
        };
        let both = [("ours", of(&|line| Some(line.ours?.value))), ("theirs", of(&|line| line.theirs))];
        let measured = both.into_iter().filter(|(_, amounts)| amounts.iter().any(|amount| *amount > 0.0));
        bars.extend(measured.map(|(whose, amounts)| Bar { name: format!("{scene}, {whose}"), amounts }));
    }
    let unit = group.first().map(|line| line.unit.clone()).unwrap_or_default();
    Bars { title: title.to_owned(), unit, parts: parts.into_iter().map(str::to_owned).collect(), bars }.draw()
}

/// Time against the size of the picture, a line each scene.
fn over_pixels(group: &[&PaperLine], title: &str) -> Drawing {
    let mut lines = Vec::new();
    for (k, scene) in distinct(group.iter().map(|line| line.column.as_str())).into_iter().enumerate() {
        let along = |amount: &dyn Fn(&PaperLine) -> Option<f64>| -> Vec<[f64; 2]> {
            let of_scene = group.iter().filter(|line| line.column == scene);
            of_scene.filter_map(|line| Some([megapixels(&line.row)?, amount(line)?])).collect()
        };
        let both =
            [("ours", false, along(&|line| Some(line.ours?.value))), ("theirs", true, along(&|line| line.theirs))];
        for (whose, dashed, points) in both.into_iter().filter(|(.., points)| !points.is_empty()) {
            lines.push(Line { name: format!("{scene}, {whose}"), look: look_of_number(k + 1), dashed, points });
        }
    }
    let unit = group.first().map(|line| line.unit.clone()).unwrap_or_default();
    Lines {
        linear_up: false,
        note: String::new(),
        title: title.to_owned(),
        across: "megapixels".to_owned(),
        up: format!("time, {unit}"),
        lines,
    }
    .draw()
}

/// `1280x720` in millions of pixels.
fn megapixels(size: &str) -> Option<f64> {
    let (width, height) = size.split_once(['x', '×'])?;
    let side = |text: &str| text.trim().parse::<f64>().ok();
    Some(side(width)? * side(height)? * 1e-6)
}

fn distinct<'a>(words: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = Vec::new();
    for word in words {
        if !seen.contains(&word) {
            seen.push(word);
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::megapixels;

    #[test]
    fn sizes_are_read_as_they_are_typed() {
        assert_eq!(megapixels("1000x500"), Some(0.5));
        assert_eq!((megapixels("1 × 2e6"), megapixels("large"), megapixels("1x")), (Some(2.0), None, None));
    }
}
