//! Charts as SVG: for a page that sets its colours, or a file of its own.

use super::{Anchor, Drawing, Ink, Shape, Stroke, Text};
use std::fmt::Write;

/// Where the SVG is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// In a page: classes name the inks, and points can be chosen.
    Page,
    /// As a file.
    File,
}

/// The chart as SVG.
pub fn svg(drawing: &Drawing, read: Use) -> String {
    let [width, height] = drawing.size;
    let title = escaped(&drawing.title);
    let mut text = match read {
        // A group: what lies in it can be chosen, which an image's parts cannot.
        Use::Page => {
            format!("<svg class=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"group\" aria-label=\"{title}\">")
        }
        Use::File => format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} \
             {height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\"><title>{title}</title>\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>"
        ),
    };
    for one in &drawing.shapes {
        draw(&mut text, one, read);
    }
    text + "</svg>"
}

/// Text as it may stand in XML and HTML, between tags and in attributes.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            // XML has no way to hold them.
            letter if letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}') => safe.push('\u{fffd}'),
            letter => safe.push(letter),
        }
    }
    safe
}

fn draw(to: &mut String, shape: &Shape, read: Use) {
    // Writing to a string does not fail.
    let _ = match shape {
        Shape::Line { points, closed, fill, stroke } => {
            let points: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", pixel(*x), pixel(*y))).collect();
            let name = if *closed { "polygon" } else { "polyline" };
            write!(to, "<{name} points=\"{}\"{}/>", points.join(" "), paint(*fill, *stroke, read))
        }
        Shape::Disc { centre: [x, y], radius, fill, stroke } => {
            let [x, y, radius] = [x, y, radius].map(|value| pixel(*value));
            write!(to, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"{}/>", paint(*fill, *stroke, read))
        }
        Shape::Text(text) => write!(to, "{}", words(text, read)),
        Shape::Point { key, title, shapes } => {
            let title = escaped(title);
            let _ = match read {
                Use::Page => write!(
                    to,
                    "<g class=\"point\" data-point=\"{}\" tabindex=\"-1\" role=\"button\" aria-label=\"{title}\">",
                    escaped(key)
                ),
                Use::File => write!(to, "<g>"),
            };
            let _ = write!(to, "<title>{title}</title>");
            for one in shapes {
                draw(to, one, read);
            }
            write!(to, "</g>")
        }
    };
}

fn words(text: &Text, read: Use) -> String {
    let [x, y] = text.at.map(pixel);
    let anchor = match text.anchor {
        Anchor::Start => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::End => " text-anchor=\"end\"",
    };
    let weight = if text.bold { " font-weight=\"bold\"" } else { "" };
    let turn = if text.upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
    let paint = paint(Some(text.ink), None, read);
    let words = escaped(&text.words);
    format!("<text x=\"{x}\" y=\"{y}\" font-size=\"{}\"{anchor}{weight}{turn}{paint}>{words}</text>", pixel(text.size))
}

/// Fill and stroke as attributes, which a style sheet overrides by the classes beside them.
fn paint(fill: Option<Ink>, stroke: Option<Stroke>, read: Use) -> String {
    let mut text = String::new();
    let mut classes = Vec::new();
    let mut add = |text: &mut String, what: &str, ink: Ink| {
        let ([r, g, b], opacity) = ink.on_white();
        let _ = write!(text, " {what}=\"#{r:02x}{g:02x}{b:02x}\"");
        if opacity < 1.0 {
            let _ = write!(text, " {what}-opacity=\"{}\"", pixel(opacity));
        }
        classes.extend(ink.name().map(|name| format!("{what}-{name}")));
    };
    match fill {
        Some(ink) => add(&mut text, "fill", ink),
        None => text += " fill=\"none\"",
    }
    if let Some(Stroke { ink, width, dashed }) = stroke {
        add(&mut text, "stroke", ink);
        let dashes = if dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        let _ = write!(text, " stroke-width=\"{}\" stroke-linejoin=\"round\"{dashes}", pixel(width));
    }
    if read == Use::Page && !classes.is_empty() {
        let _ = write!(text, " class=\"{}\"", classes.join(" "));
    }
    text
}

/// A length to the hundredth of a pixel.
fn pixel(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_a_study_says_stays_text() {
        let mut drawing = Drawing::new([10.0, 10.0], "<b>\"x\"&'\u{7}".to_owned());
        drawing.shapes.push(Shape::Point {
            key: "\"><i>".to_owned(),
            title: "</title><script>".to_owned(),
            shapes: vec![],
        });
        drawing.text([0.0, 0.0], Anchor::Start, 9.0, Ink::Words, "</text><img src=x>");
        for read in [Use::Page, Use::File] {
            let text = svg(&drawing, read);
            assert!(!["<b>", "<i>", "<script>", "<img", "\u{7}"].iter().any(|bad| text.contains(bad)), "{text}");
            assert!(text.contains("&lt;b&gt;&quot;x&quot;&amp;&#39;\u{fffd}"), "{text}");
        }
    }

    #[test]
    fn a_page_names_inks_and_a_file_has_all_of_them() {
        let mut drawing = Drawing::new([10.0, 10.0], String::new());
        drawing.line(&[[0.0, 0.0], [1.0, 2.345]], Stroke::dashed(Ink::Aside, 1.0));
        let (page, file) = (svg(&drawing, Use::Page), svg(&drawing, Use::File));
        assert!(page.contains("class=\"stroke-aside\"") && !page.contains("xmlns"), "{page}");
        assert!(file.contains("stroke=\"#666a73\"") && file.contains("1,2.35") && file.contains("dasharray"), "{file}");
    }
}
