//! What a study says at one look: which methods are on the front of which place.

use super::html::Html;
use super::place::{Entry, Section, lighting, size};
use crate::charts::{Use, escaped, look_of, svg, swatch, three_digits};
use mica_accuracy::Metric;
use mica_render::METHODS;

/// A table of methods and places.
pub fn summary(sections: &[Section<'_>]) -> String {
    let mut html = Html::new();
    html.tag(
        "<section id=\"summary\"><h2>At a glance</h2><p><span class=\"dot on\" aria-hidden=\"true\"></span> on the front: \
         nothing that was measured is both faster and nearer to the reference, by the distribution of its pixels (W1). The \
         number is the time factor of a frame: with glints over without.</p><div class=\"scroll\"><table \
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
    let error = |entry: &Entry<'_>| entry.point.errors.as_ref().map_or(f64::INFINITY, |errors| errors.w1.value);
    let Some(best) = shown.iter().min_by(|a, b| error(a).total_cmp(&error(b))) else { return };
    let factors: Vec<f64> =
        shown.iter().map(|entry| entry.point.cost.ratio.value).filter(|factor| factor.is_finite()).collect();
    let least = factors.iter().copied().fold(f64::INFINITY, f64::min);
    let most = factors.iter().copied().fold(0.0, f64::max);
    let (least_words, most_words) = (factor_words(least), factor_words(most));
    let words = match factors.as_slice() {
        [] => "–".to_owned(),
        _ if least_words == most_words => format!("×{least_words}"),
        _ => format!("×{least_words} to {most_words}"),
    };
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

/// A factor of time with two decimals while that says something.
fn factor_words(factor: f64) -> String {
    if factor < 10.0 { format!("{factor:.2}") } else { three_digits(factor) }
}
