//! What a study says at one look: which methods are on the front of which place.

use super::figures::{Shown, factor};
use super::html::Html;
use super::place::{Entry, Section, lighting, size};
use crate::charts::{Use, escaped, look_of, svg, swatch, three_digits};
use mica_accuracy::{Metric, Weight};
use mica_render::METHODS;

/// A table of methods and places.
pub fn summary(sections: &[Section<'_>]) -> String {
    let mut html = Html::new();
    html.tag(
        "<section id=\"summary\"><h2>At a glance</h2><p><span class=\"dot on\" aria-hidden=\"true\"></span> on the front: \
         nothing that was measured is both faster and nearer to the reference, by the distribution of its pixels (W1). The \
         number is the time factor of a frame: with glints over without, at most so much where that may be noise.</p><div class=\"scroll\"><table \
         class=\"matrix\"><thead><tr><td></td>",
    );
    for section in sections {
        let place = &section.newest.place;
        html.tags(format_args!("<th scope=\"col\"><a href=\"#{}\">", section.slug)).words(&place.scene);
        html.tag("<small>").words(&lighting(place)).tag("</small><small>").words(&size(place));
        html.tag("</small></a></th>");
    }
    html.tag("</tr></thead><tbody>");
    for method in methods(sections) {
        html.tag("<tr><th scope=\"row\">").tag(&svg(&swatch(look_of(method), 16.0), Use::Page)).words(method);
        html.tag("</th>");
        for section in sections {
            cell(&mut html, section, method);
        }
        html.tag("</tr>");
    }
    html.tag("</tbody></table></div></section>");
    html.done()
}

/// The methods of a study, in the order of the program.
fn methods<'a>(sections: &'a [Section<'a>]) -> Vec<&'a str> {
    let mut methods: Vec<&str> = Vec::new();
    for entry in sections.iter().flat_map(|section| &section.points) {
        if !methods.contains(&entry.point.method.as_str()) {
            methods.push(&entry.point.method);
        }
    }
    methods.sort_by_key(|name| METHODS.iter().position(|info| info.name == *name).unwrap_or(METHODS.len()));
    methods
}

fn cell(html: &mut Html, section: &Section<'_>, method: &str) {
    let rungs: Vec<&Entry<'_>> = section.points.iter().filter(|entry| entry.point.method == method).collect();
    let on_front: Vec<&Entry<'_>> = rungs.iter().copied().filter(|entry| entry.fronts.contains(&Metric::W1)).collect();
    let (class, word, shown) = match (on_front.is_empty(), rungs.is_empty()) {
        (_, true) => {
            html.tag("<td class=\"none\">–</td>");
            return;
        }
        (true, _) => ("beaten", "beaten", &rungs),
        (false, _) => ("front", "on the front", &on_front),
    };
    let error = |entry: &Entry<'_>| {
        entry.point.errors.as_ref().map_or(f64::INFINITY, |errors| Weight::of_error(errors.w1).value)
    };
    let Some(best) = shown.iter().min_by(|a, b| error(a).total_cmp(&error(b))) else { return };
    let factors: Vec<Shown> =
        shown.iter().map(|entry| factor(entry.point)).filter(|factor| factor.number().is_finite()).collect();
    let words = factors_words(&factors);
    let names: Vec<String> =
        shown.iter().map(|entry| format!("{} (W1 {})", entry.point.rung, three_digits(error(entry)))).collect();
    let title = format!("{method}, {word}: {}", names.join(", "));
    html.tags(format_args!(
        "<td class=\"{class}\"><a href=\"#{}/{}\" title=\"{}\"><span class=\"dot {}\"></span><span \
         class=\"unseen\">{word}, </span>",
        section.slug,
        best.slug,
        escaped(&title),
        if class == "front" { "on" } else { "off" },
    ));
    html.words(&words).tag("</a></td>");
}

/// Factors of time from the least to the greatest.
fn factors_words(factors: &[Shown]) -> String {
    let numbers = || factors.iter().map(Shown::number);
    let [least, most] = [numbers().fold(f64::INFINITY, f64::min), numbers().fold(0.0, f64::max)].map(factor_words);
    let at_most = if factors.iter().all(|factor| factor.is_at_most) { "at most " } else { "" };
    match factors {
        [] => "–".to_owned(),
        _ if least == most || !at_most.is_empty() => format!("{at_most}×{most}"),
        _ => format!("×{least} to {most}"),
    }
}

/// A factor of time with two decimals while that says something.
fn factor_words(factor: f64) -> String {
    if factor < 10.0 { format!("{factor:.2}") } else { three_digits(factor) }
}
