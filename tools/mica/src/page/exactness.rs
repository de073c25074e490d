//! What each exactness costs on its own: ways to compute one thing, their error against their nanoseconds.

use super::figures::with_interval;
use super::html::Html;
use super::read::is_same_device;
use super::{Plot, unused};
use crate::charts::{Facet, Facets, Labelled, Mark, Scatter, Series, Use, look_of_number, svg};
use mica_accuracy::exactness::ExactnessLine;

/// More cases than these are drawn smaller, so that all of them are seen at once.
const FEW_CASES: usize = 12;

/// The section of the page, and its plots; empty where nothing was measured.
pub fn exactness(lines: &[ExactnessLine], plots: &mut Vec<Plot>) -> String {
    let mut html = Html::new();
    if lines.is_empty() {
        return html.done();
    }
    html.tag(
        "<section id=\"exactness\"><h2>Each exactness on its own</h2><p>Ways to compute one part of a glint, apart from the \
         others: error against nanoseconds. Large markers are on the front of their chart: no other way is both faster and \
         more exact.</p>",
    );
    let mut used = Vec::new();
    let is_one_chart = |a: &ExactnessLine, b: &ExactnessLine| {
        (&a.chart, &a.per) == (&b.chart, &b.per) && is_same_device(&a.machine, &b.machine)
    };
    for lines in groups(lines.iter(), is_one_chart) {
        let Some(first) = lines.first() else { continue };
        one(&mut html, &lines, unused(&format!("exactness {}", first.chart), &mut used), plots);
    }
    html.tag("</section>");
    html.done()
}

/// Lines that belong together, in the order of their first.
fn groups<'a>(
    lines: impl Iterator<Item = &'a ExactnessLine>,
    is_same: impl Fn(&ExactnessLine, &ExactnessLine) -> bool,
) -> Vec<Vec<&'a ExactnessLine>> {
    let mut groups: Vec<Vec<&ExactnessLine>> = Vec::new();
    for line in lines {
        match groups.iter_mut().find(|group| group.first().is_some_and(|first| is_same(first, line))) {
            Some(group) => group.push(line),
            None => groups.push(vec![line]),
        }
    }
    groups
}

/// Each of some words once, in their order.
fn each_once<'a>(words: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut each: Vec<&str> = Vec::new();
    for word in words {
        if !each.contains(&word) {
            each.push(word);
        }
    }
    each
}

fn one(html: &mut Html, lines: &[&ExactnessLine], file: String, plots: &mut Vec<Plot>) {
    let Some(first) = lines.first() else { return };
    let rungs = each_once(lines.iter().map(|line| line.rung.as_str()));
    let kinds = each_once(lines.iter().map(|line| line.error_of.as_str()));
    let mut cases = groups(lines.iter().copied(), |a, b| (&a.case, &a.error_of) == (&b.case, &b.error_of));
    cases.sort_by_key(|case| case.first().map(|line| kinds.iter().position(|kind| *kind == line.error_of)));
    // Where every case has ways of its own, their names stand beside them instead of in a legend of all.
    let has_legend = cases.iter().all(|case| 2 * case.len() > rungs.len());
    let is_large = cases.len() <= FEW_CASES;
    let labelled = match (has_legend, is_large) {
        (false, _) => Labelled::All,
        (true, true) => Labelled::Front,
        (true, false) => Labelled::None,
    };
    let charts: Vec<Facet> = cases
        .iter()
        .map(|case| {
            let error_of = case.first().map_or("", |line| line.error_of.as_str());
            let kind = kinds.iter().position(|kind| *kind == error_of).unwrap_or_default();
            Facet { kind, chart: chart(case, if has_legend { &rungs } else { &[] }, labelled) }
        })
        .collect();
    let legend = if has_legend { rungs.as_slice() } else { &[] };
    let fronts: Vec<Vec<&str>> = charts.iter().map(|facet| facet.chart.front()).collect();
    let facets = Facets {
        title: heading(&first.chart).to_owned(),
        columns: if is_large { cases.len().min(4) } else { 6 },
        legend: legend.iter().enumerate().map(|(k, rung)| ((*rung).to_owned(), look_of_number(k + 1))).collect(),
        charts: charts.clone(),
    };
    let drawing = facets.draw();
    html.tag("<figure><div class=\"wide\">").tag(&svg(&drawing, Use::Page)).tag("</div><figcaption>");
    for kind in &kinds {
        html.tag("<p>Error");
        let count = cases.iter().filter(|case| case.first().is_some_and(|line| line.error_of == *kind)).count();
        if kinds.len() > 1 && count > 4 {
            html.words(" in the other charts");
        } else if kinds.len() > 1 {
            let of = each_once(lines.iter().filter(|line| line.error_of == *kind).map(|line| line.case.as_str()));
            html.words(" in ").words(&of.join("; "));
        }
        html.words(": ").words(kind).tag(".</p>");
    }
    html.tag("<p>").words(&format!("{}, {}", first.machine.device, first.machine.driver)).tag(".</p>");
    html.tag("<details><summary>What each way computes</summary><dl>");
    for rung in &rungs {
        let said = each_once(lines.iter().filter(|line| line.rung == *rung).map(|line| line.what.as_str()));
        html.tag("<dt>").words(rung).tag("</dt>");
        for what in said {
            html.tag("<dd>").words(what).tag("</dd>");
        }
    }
    html.tag("</dl></details><details><summary>Figures</summary><div class=\"scroll\"><table><thead><tr>");
    html.tag("<th scope=\"col\">case</th><th scope=\"col\">way</th><th scope=\"col\">error</th><th scope=\"col\">");
    html.words(&time_of(first)).tag("</th></tr></thead><tbody>");
    for (case, front) in cases.iter().zip(&fronts) {
        for line in case {
            html.tag(if front.contains(&line.rung.as_str()) { "<tr class=\"front\"><td>" } else { "<tr><td>" });
            html.words(&line.case).tag("</td><th scope=\"row\">").words(&line.rung).tag("</th><td>");
            html.words(&with_interval(line.error)).tag("</td><td>").words(&with_interval(line.ns)).tag("</td></tr>");
        }
    }
    html.tag("</tbody></table></div></details></figcaption></figure>");
    plots.push(Plot { file, drawing });
}

/// The chart of a case. Ways look as they do among all of the rungs; without these, as they come.
fn chart(case: &[&ExactnessLine], rungs: &[&str], labelled: Labelled) -> Scatter {
    let series = case.iter().enumerate().map(|(k, line)| Series {
        name: line.rung.clone(),
        look: look_of_number(1 + rungs.iter().position(|rung| *rung == line.rung).unwrap_or(k)),
        marks: vec![Mark {
            key: line.rung.clone(),
            name: line.rung.clone(),
            what: line.what.clone(),
            time: line.ns,
            error: line.error,
        }],
    });
    Scatter {
        title: case.first().map(|line| line.case.clone()).unwrap_or_default(),
        time: case.first().map(|line| time_of(line)).unwrap_or_default(),
        error: "error".to_owned(),
        floor: None,
        series: series.collect(),
        labelled,
    }
}

/// What the nanoseconds are of.
fn time_of(line: &ExactnessLine) -> String {
    format!(
        "ns per {}",
        ["per ", "an ", "a "].iter().fold(line.per.as_str(), |per, word| per.strip_prefix(word).unwrap_or(per))
    )
}

/// The names of charts as people read them.
fn heading(chart: &str) -> &str {
    match chart {
        "lit_probability" => "Probability that a flake is lit",
        "count_law" => "Law of the count",
        "footprint" => "Filter of the footprint",
        "environment" => "Environment",
        "occlusion" => "Occlusion",
        "arithmetic" => "Arithmetic",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_accuracy::exactness::EXACTNESS_SCHEMA;
    use mica_accuracy::{Estimate, Machine};

    fn line(chart: &str, case: &str, rung: &str, error: f64, ns: f64) -> ExactnessLine {
        let [schema, chart, case, rung] = [EXACTNESS_SCHEMA, chart, case, rung].map(ToOwned::to_owned);
        let [what, error_of, per] = ["What it is.", "of <all>", "an evaluation"].map(ToOwned::to_owned);
        let machine = ["a device", "a driver", "none", "a build"].map(ToOwned::to_owned);
        let [device, driver, occlusion, build] = machine;
        let machine = Machine { device, driver, occlusion, build };
        let [error, ns] = [error, ns].map(Estimate::exact);
        ExactnessLine { schema, chart, case, rung, what, error_of, error, ns, per, machine }
    }

    #[test]
    fn each_quantity_is_one_plot_of_all_its_cases_and_nothing_that_is_exact_or_free_is_left_out() {
        let mut lines = Vec::new();
        for case in ["small", "large"] {
            lines.push(line("footprint", case, "rough", 0.1, -1.0));
            lines.push(line("footprint", case, "whole", 0.0, 9.0));
        }
        lines.push(line("occlusion", "shoe", "none", 0.3, 0.0));
        let mut plots = Vec::new();
        let page = exactness(&lines, &mut plots);
        let files: Vec<&str> = plots.iter().map(|plot| plot.file.as_str()).collect();
        assert_eq!(files, ["exactness-footprint", "exactness-occlusion"]);
        for (text, count) in [("data-point=\"rough\"", 2), ("data-point=\"whole\"", 2), ("data-point=\"none\"", 1)] {
            assert_eq!(page.matches(text).count(), count, "{text}");
        }
        assert_eq!(page.matches("; on the front. What it is.").count(), 2 * 5, "as a title, and as a label: {page}");
        assert!(
            page.contains("of &lt;all&gt;") && page.contains("ns per evaluation") && page.contains(">exact</text>")
        );
    }

    #[test]
    fn ways_that_each_case_has_of_its_own_are_named_beside_their_markers() {
        let lines: Vec<ExactnessLine> = ["a", "b", "c"]
            .iter()
            .flat_map(|case| {
                ["plain", "stable"].map(|rung| line("arithmetic", case, &format!("{rung} {case}"), 0.1, 1.0))
            })
            .collect();
        let page = exactness(&lines, &mut Vec::new());
        assert!(["plain a", "stable c"].iter().all(|name| page.contains(&format!(">{name}</text>"))), "{page}");
    }
}
