//! What each exactness costs on its own: ways to compute one thing, their error against their nanoseconds.

use super::figures::with_interval;
use super::html::Html;
use super::read::{ExactnessLine, is_same_device};
use super::{Plot, unused};
use crate::charts::{Mark, Scatter, Series, Use, look_of_number, svg};

/// The section of the page, and its plots; empty where nothing was measured.
pub fn exactness(lines: &[ExactnessLine], plots: &mut Vec<Plot>) -> String {
    let mut html = Html::new();
    if lines.is_empty() {
        return html.done();
    }
    html.tag(
        "<section id=\"exactness\"><h2>Each exactness on its own</h2><p>Ways to compute one part of a glint, apart from the \
         others: error against nanoseconds.</p>",
    );
    let mut groups: Vec<Vec<&ExactnessLine>> = Vec::new();
    for line in lines {
        let is_here = |group: &&mut Vec<&ExactnessLine>| {
            group.first().is_some_and(|first| {
                (&first.chart, &first.case, &first.per, &first.error_of)
                    == (&line.chart, &line.case, &line.per, &line.error_of)
                    && is_same_device(&first.machine, &line.machine)
            })
        };
        match groups.iter_mut().find(is_here) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    let mut used = Vec::new();
    let mut chart = "";
    for group in &groups {
        let Some(first) = group.first() else { continue };
        if first.chart != chart {
            html.tag(if chart.is_empty() { "" } else { "</div>" });
            html.tag("<h3>").words(&heading(&first.chart)).tag("</h3><div class=\"gallery\">");
            chart = &first.chart;
        }
        one(&mut html, group, first, unused(&format!("exactness {} {}", first.chart, first.case), &mut used), plots);
    }
    html.tag("</div></section>");
    html.done()
}

fn one(html: &mut Html, group: &[&ExactnessLine], first: &ExactnessLine, file: String, plots: &mut Vec<Plot>) {
    let series = group.iter().enumerate().map(|(k, line)| Series {
        name: line.rung.clone(),
        look: look_of_number(k + 1),
        marks: vec![Mark { key: line.rung.clone(), name: line.rung.clone(), time: line.ns, error: line.error }],
    });
    let scatter = Scatter {
        title: format!("{}: {}", heading(&first.chart), first.case),
        time: format!("ns per {}", first.per.strip_prefix("per ").unwrap_or(&first.per)),
        error: "error".to_owned(),
        floor: None,
        series: series.collect(),
        all_labelled: true,
    };
    let drawing = scatter.draw();
    let front = scatter.front();
    html.tag("<figure>").tag(&svg(&drawing, Use::Page)).tag("<figcaption>Error: ").words(&first.error_of);
    html.tag(". ").words(&format!("{}, {}", first.machine.device, first.machine.driver));
    html.tag(".<details><summary>Figures</summary><div class=\"scroll\"><table><thead><tr><th scope=\"col\">way</th>");
    html.tag("<th scope=\"col\">what</th><th scope=\"col\">error</th><th scope=\"col\">ns</th></tr></thead><tbody>");
    for line in group {
        html.tag(if front.contains(&line.rung.as_str()) { "<tr class=\"front\">" } else { "<tr>" });
        html.tag("<th scope=\"row\">").words(&line.rung).tag("</th><td>").words(&line.what).tag("</td><td>");
        html.words(&with_interval(line.error)).tag("</td><td>").words(&with_interval(line.ns)).tag("</td></tr>");
    }
    html.tag("</tbody></table></div></details></figcaption></figure>");
    plots.push(Plot { file, drawing });
}

/// The names of charts as people read them.
fn heading(chart: &str) -> String {
    match chart {
        "lit_probability" => "Probability that a flake is lit".to_owned(),
        "count_law" => "Law of the count".to_owned(),
        "footprint" => "Filter of the footprint".to_owned(),
        "environment" => "Environment".to_owned(),
        "occlusion" => "Occlusion".to_owned(),
        "arithmetic" => "Arithmetic".to_owned(),
        other => other.to_owned(),
    }
}
