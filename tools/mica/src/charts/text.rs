//! The letters of charts: how wide words are, and their outlines.

use super::Text;
use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// The typeface that is drawn as PNG, and by which words are measured: pages have others, most of which are narrower.
fn face(bold: bool) -> Option<Face<'static>> {
    let bytes = if bold { dejavu::sans::bold() } else { dejavu::sans::regular() };
    Face::parse(bytes, 0).ok()
}

/// Pixels that words take along their line.
pub fn width(words: &str, size: f64, bold: bool) -> f64 {
    let Some(face) = face(bold) else { return 0.0 };
    let units: f64 = words.chars().map(|letter| advance(&face, letter)).sum();
    units * size / f64::from(face.units_per_em())
}

fn advance(face: &Face<'_>, letter: char) -> f64 {
    let glyph = face.glyph_index(letter).unwrap_or_default();
    f64::from(face.glyph_hor_advance(glyph).unwrap_or_default())
}

/// The outlines of a text, where it stands.
pub fn outlines(text: &Text) -> Option<Path> {
    let face = face(text.bold)?;
    let scale = text.size / f64::from(face.units_per_em());
    let shift = match text.anchor {
        super::Anchor::Start => 0.0,
        super::Anchor::Middle => -0.5,
        super::Anchor::End => -1.0,
    } * width(&text.words, text.size, text.bold);
    let mut pen = Pen { builder: PathBuilder::new(), scale, x: shift };
    for letter in text.words.chars() {
        let glyph = face.glyph_index(letter).unwrap_or_default();
        face.outline_glyph(glyph, &mut pen);
        pen.x += advance(&face, letter) * scale;
    }
    let [x, y] = text.at.map(|value| value as f32);
    let turned = if text.upwards { Transform::from_rotate(-90.0) } else { Transform::identity() };
    pen.builder.finish()?.transform(turned.post_translate(x, y))
}

/// Outlines in font units, upwards, as a path in pixels, downwards.
struct Pen {
    builder: PathBuilder,
    scale: f64,
    x: f64,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        ((self.x + f64::from(x) * self.scale) as f32, (-f64::from(y) * self.scale) as f32)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.builder.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.builder.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.builder.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::{Anchor, Ink};

    #[test]
    fn words_are_as_wide_as_their_outlines_and_end_where_they_should() {
        let words = "HMMMH".to_owned();
        let wide = width(&words, 20.0, false);
        for (anchor, left) in [(Anchor::Start, 50.0), (Anchor::Middle, 50.0 - wide / 2.0), (Anchor::End, 50.0 - wide)] {
            let text = Text {
                at: [50.0, 30.0],
                anchor,
                size: 20.0,
                bold: false,
                upwards: false,
                ink: Ink::Words,
                words: words.clone(),
            };
            let bounds = outlines(&text).expect("outlines").bounds();
            assert!((f64::from(bounds.left()) - left).abs() < 3.0, "{anchor:?}: {bounds:?}");
            assert!((f64::from(bounds.width()) - wide).abs() < 5.0 && (bounds.bottom() - 30.0).abs() < 0.5);
        }
        assert!(width("bold words", 12.0, true) > width("bold words", 12.0, false));
    }
}
