//! The sections of a page, one below the other.

use super::Plot;
use super::exactness::exactness;
use super::figures::{FIGURES, FURTHER};
use super::html::Html;
use super::papers::papers;
use super::place::Section;
use super::read::Study;
use super::summary::summary;

/// Everything that is seen before a script runs, and the plots in it.
pub fn body(study: &Study, sections: &[Section<'_>], plots: &mut Vec<Plot>) -> String {
    let mut html = Html::new();
    html.tag("<header><h1>What accuracy costs in time</h1><p>").words(&lead(study, sections)).tag("</p>");
    for (file, count) in &study.skipped {
        let lines = if *count == 1 { "line is" } else { "lines are" };
        html.tags(format_args!(
            "<p class=\"warning\">{count} {lines} left out of {file}: not of a study, or cut off.</p>"
        ));
    }
    html.tag("</header><main>");
    if !sections.is_empty() {
        html.tag(&summary(sections));
    }
    for section in sections {
        html.tag(&section.html(plots));
    }
    html.tag(&exactness(&study.exactness, plots)).tag(&papers(&study.papers, plots));
    html.tag(&definitions());
    html.tag("</main>");
    html.done()
}

/// What was measured, in a sentence.
fn lead(study: &Study, sections: &[Section<'_>]) -> String {
    if sections.is_empty() && study.exactness.is_empty() && study.papers.is_empty() {
        return "Nothing has been measured yet.".to_owned();
    }
    let mut methods: Vec<&str> = study.points.iter().map(|point| point.method.as_str()).collect();
    methods.sort_unstable();
    methods.dedup();
    let of = |count: usize, one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
    format!(
        "{} at {}, {}: error against the reference of each place, and time, measured in one run.",
        of(methods.len(), "method"),
        of(sections.len(), "place"),
        of(study.points.len(), "point")
    )
}

fn definitions() -> String {
    let mut html = Html::new();
    html.tag("<section id=\"definitions\"><h2>What the figures mean</h2><details><summary>Definitions</summary><dl>");
    let all = FIGURES.iter().map(|figure| (figure.name, figure.meaning)).chain(FURTHER);
    for (name, meaning) in FURTHER_TERMS.into_iter().chain(all) {
        html.tag("<dt>").words(name).tag("</dt><dd>").words(meaning).tag("</dd>");
    }
    html.tag("</dl></details></section>");
    html.done()
}

/// Words that charts use.
const FURTHER_TERMS: [(&str, &str); 5] = [
    (
        "front",
        "The points that nothing beats: no other is both at least as fast and at least as accurate. Bold in charts, joined \
         by steps; what lies above the steps is beaten. A time counts as its median, and as its upper end if it is no greater \
         than its spread from end to end; an error counts as itself, and as its upper end if its interval reaches 0. So nothing wins by noise. \
         `mica render --budget-ms` and `--target-error` choose by the same rule.",
    ),
    (
        "glints",
        "Radiance with glints less radiance of the same view without, in linear HDR, over the pixels that see glinting \
         material and nothing else.",
    ),
    (
        "intervals",
        "Of errors: 95 % by bootstrap over tiles of 16 by 16 pixels. Of times: from the least to the greatest of all rounds, and \
         to either side at least as far as sittings of one point lie apart for nine tenths of the points of the place, and 5 %.",
    ),
    (
        "open markers",
        "What may be noise (a time no greater than its spread, an error whose interval reaches 0) is drawn at the upper end \
         of its interval, open, with an arrow towards less: it is at most that.",
    ),
    (
        "floor",
        "The error of the reference's own method with other flakes, one sample a pixel: what a method that is right, but \
         has flakes of its own, can reach.",
    ),
];
