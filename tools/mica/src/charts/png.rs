//! Charts as PNG: for papers and notes, on white, twice as large.

use super::text::outlines;
use super::{Drawing, Ink, Shape, Stroke};
use crate::error::Failure;
use crate::picture::png_of;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke as Pen, StrokeDash, Transform,
};

/// Pixels of the picture for each of the drawing.
const SCALE: f32 = 2.0;

/// The chart as a PNG file.
pub fn png(drawing: &Drawing) -> Result<Vec<u8>, Failure> {
    let [width, height] = drawing.size.map(|side| (side as f32 * SCALE).ceil().clamp(1.0, 16384.0) as u32);
    let mut canvas =
        Pixmap::new(width, height).ok_or_else(|| Failure::bad_input("a chart is too large to be drawn"))?;
    canvas.fill(Color::WHITE);
    for shape in &drawing.shapes {
        draw(&mut canvas, shape);
    }
    // On white, nothing is left transparent.
    let rgb: Vec<u8> = canvas.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    png_of(&rgb, [width, height])
}

fn draw(canvas: &mut Pixmap, shape: &Shape) {
    match shape {
        Shape::Line { points, closed, fill: inside, stroke } => {
            let mut path = PathBuilder::new();
            for (k, [x, y]) in points.iter().enumerate() {
                let (x, y) = (*x as f32, *y as f32);
                if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
            if *closed {
                path.close();
            }
            paint(canvas, path.finish(), *inside, *stroke);
        }
        Shape::Disc { centre: [x, y], radius, fill: inside, stroke } => {
            paint(canvas, PathBuilder::from_circle(*x as f32, *y as f32, *radius as f32), *inside, *stroke);
        }
        Shape::Text(text) => paint(canvas, outlines(text), Some(text.ink), None),
        Shape::Point { shapes, .. } => shapes.iter().for_each(|shape| draw(canvas, shape)),
    }
}

fn paint(canvas: &mut Pixmap, path: Option<Path>, fill: Option<Ink>, stroke: Option<Stroke>) {
    // Without a path there is nothing to see: words may be blanks.
    let Some(path) = path else { return };
    let scale = Transform::from_scale(SCALE, SCALE);
    if let Some(ink) = fill {
        canvas.fill_path(&path, &colour(ink), FillRule::Winding, scale, None);
    }
    if let Some(Stroke { ink, width, dashed }) = stroke {
        let dash = if dashed { StrokeDash::new(vec![6.0, 4.0], 0.0) } else { None };
        let pen =
            Pen { width: width as f32, dash, line_join: LineJoin::Round, line_cap: LineCap::Butt, ..Pen::default() };
        canvas.stroke_path(&path, &colour(ink), &pen, scale, None);
    }
}

fn colour(ink: Ink) -> Paint<'static> {
    let ([r, g, b], opacity) = ink.on_white();
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (opacity.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::charts::Anchor;

    #[test]
    fn shapes_and_words_are_where_they_should_be_on_white() {
        let mut drawing = Drawing::new([60.0, 40.0], String::new());
        drawing.rectangle([10.0, 10.0], [20.0, 20.0], Ink::Own([255, 0, 0], 1.0));
        drawing.text([30.0, 30.0], Anchor::Start, 20.0, Ink::Own([0, 0, 255], 1.0), "H");
        let decoded = image::load_from_memory(&png(&drawing).expect("a file")).expect("a readable file").into_rgb8();
        assert_eq!(decoded.dimensions(), (120, 80));
        assert_eq!((decoded.get_pixel(30, 30).0, decoded.get_pixel(5, 5).0), ([255, 0, 0], [255; 3]));
        let blue = |x: u32, y: u32| decoded.get_pixel(x, y).0 == [0, 0, 255];
        let inked = (60..100).any(|x| (32..60).any(|y| blue(x, y)));
        assert!(inked && !(60..100).any(|x| (62..80).any(|y| blue(x, y))));
    }
}
