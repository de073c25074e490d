//! Charts of studies: a list of shapes each, written as SVG for pages and as PNG for papers.

mod axis;
mod bars;
mod facets;
mod floor;
mod labels;
mod lines;
mod palette;
mod png;
mod scatter;
mod svg;
mod text;

pub use bars::{Bar, Bars};
pub use facets::{Facet, Facets};
pub use lines::{Line, Lines};
pub use palette::{Look, look_of, look_of_number, swatch};
pub use png::png;
pub use scatter::{Labelled, Mark, Scatter, Series};
pub use svg::{Use, escaped, svg};

/// A finished chart, in pixels from the top left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Width and height.
    pub size: [f64; 2],
    /// What a reader is told who does not see it.
    pub title: String,
    /// From back to front.
    pub shapes: Vec<Shape>,
}

/// What charts are made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Straight lines from point to point.
    Line {
        points: Vec<[f64; 2]>,
        closed: bool,
        fill: Option<Ink>,
        stroke: Option<Stroke>,
    },
    Disc {
        centre: [f64; 2],
        radius: f64,
        fill: Option<Ink>,
        stroke: Option<Stroke>,
    },
    Text(Text),
    /// What belongs to one point of a study, and can be chosen on a page.
    Point {
        key: String,
        title: String,
        shapes: Vec<Shape>,
    },
}

/// Words on a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// Where the baseline begins, is halved or ends.
    pub at: [f64; 2],
    pub anchor: Anchor,
    pub size: f64,
    pub bold: bool,
    /// Read from the bottom up.
    pub upwards: bool,
    pub ink: Ink,
    pub words: String,
}

/// What of a text lies at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A line's width, and whether it is broken into dashes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    pub ink: Ink,
    pub width: f64,
    pub dashed: bool,
}

/// A colour by what it is for, so that a page can be light or dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ink {
    /// Words and what matters most.
    Words,
    /// Words and lines that stand back.
    Aside,
    Grid,
    /// What lies behind everything.
    Paper,
    /// What keeps words legible over lines.
    Veil,
    /// What the front does better than.
    Beaten,
    /// What no method can do better than.
    Floor,
    /// A colour of its own, and how opaque it is.
    Own([u8; 3], f64),
}

impl Ink {
    /// Its name for style sheets; none for a colour of its own.
    pub const fn name(self) -> Option<&'static str> {
        match self {
            Self::Words => Some("words"),
            Self::Aside => Some("aside"),
            Self::Grid => Some("grid"),
            Self::Paper => Some("paper"),
            Self::Veil => Some("veil"),
            Self::Beaten => Some("beaten"),
            Self::Floor => Some("floor"),
            Self::Own(..) => None,
        }
    }

    /// The colour on white paper, and how opaque it is.
    pub const fn on_white(self) -> ([u8; 3], f64) {
        match self {
            Self::Words => ([0x1b, 0x1c, 0x20], 1.0),
            Self::Aside => ([0x66, 0x6a, 0x73], 1.0),
            Self::Grid => ([0xe4, 0xe6, 0xea], 1.0),
            Self::Paper => ([0xff, 0xff, 0xff], 1.0),
            Self::Veil => ([0xff, 0xff, 0xff], 0.72),
            Self::Beaten => ([0xf5, 0xf6, 0xf8], 1.0),
            Self::Floor => ([0xe9, 0xf3, 0xec], 1.0),
            Self::Own(colour, opacity) => (colour, opacity),
        }
    }
}

impl Stroke {
    pub const fn solid(ink: Ink, width: f64) -> Self {
        Self { ink, width, dashed: false }
    }

    pub const fn dashed(ink: Ink, width: f64) -> Self {
        Self { ink, width, dashed: true }
    }
}

impl Drawing {
    /// Nothing yet.
    pub const fn new(size: [f64; 2], title: String) -> Self {
        Self { size, title, shapes: Vec::new() }
    }

    /// A line that is neither closed nor filled.
    pub fn line(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        self.shapes.push(line(points, stroke));
    }

    /// A filled rectangle between two corners.
    pub fn rectangle(&mut self, from: [f64; 2], to: [f64; 2], fill: Ink) {
        let points = vec![from, [to[0], from[1]], to, [from[0], to[1]]];
        self.shapes.push(Shape::Line { points, closed: true, fill: Some(fill), stroke: None });
    }

    /// In place of a chart without any points.
    pub fn say_nothing(&mut self, at: [f64; 2]) {
        self.text(at, Anchor::Start, 12.0, Ink::Aside, "Nothing was measured that could be drawn.");
    }

    /// Words.
    pub fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, ink: Ink, words: impl Into<String>) {
        self.shapes.push(Shape::Text(Text { at, anchor, size, bold: false, upwards: false, ink, words: words.into() }));
    }

    /// Words that stand out.
    pub fn bold(&mut self, at: [f64; 2], anchor: Anchor, size: f64, ink: Ink, words: impl Into<String>) {
        self.shapes.push(Shape::Text(Text { at, anchor, size, bold: true, upwards: false, ink, words: words.into() }));
    }

    /// Words beside an axis that goes up.
    pub fn upwards(&mut self, at: [f64; 2], size: f64, ink: Ink, words: impl Into<String>) {
        let (anchor, bold, upwards) = (Anchor::Middle, false, true);
        self.shapes.push(Shape::Text(Text { at, anchor, size, bold, upwards, ink, words: words.into() }));
    }
}

/// A line that is neither closed nor filled.
pub fn line(points: &[[f64; 2]], stroke: Stroke) -> Shape {
    Shape::Line { points: points.to_vec(), closed: false, fill: None, stroke: Some(stroke) }
}

/// A number with as many digits as a reader can use: three that count.
pub fn three_digits(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.1e}");
    }
    let decimals = (2 - size.log10().floor() as i32).max(0) as usize;
    // Rounding may carry into one more digit (9.996), which is then one decimal too many and does no harm.
    let text = format!("{value:.decimals$}");
    let (sign, digits) = text.strip_prefix('-').map_or(("", text.as_str()), |digits| ("-", digits));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let fraction = fraction.trim_end_matches('0');
    let point = if fraction.is_empty() { "" } else { "." };
    format!("{sign}{}{point}{fraction}", grouped(whole))
}

/// Whole numbers with their thousands apart.
fn grouped(digits: &str) -> String {
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) && digits.len() > 4 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::three_digits;

    #[test]
    fn numbers_have_three_digits_that_count() {
        let shown = [0.0, 0.012345, 0.5, 1.0, 3.27649, 27.0, 999.6, 1234.4, 56789.0, -0.25, 2.5e-7, 3e9, f64::NAN]
            .map(three_digits);
        let expected =
            ["0", "0.0123", "0.5", "1", "3.28", "27", "1000", "1234", "56,789", "-0.25", "2.5e-7", "3.0e9", "–"];
        assert_eq!(shown, expected);
    }
}
