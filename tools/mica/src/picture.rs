//! A finished picture: what is said about it, and how it is written.

use crate::error::Failure;
use exr::prelude::*;
use serde::Serialize;
use std::io::Cursor;

/// A picture as it came from the device.
pub struct Picture {
    /// Pixels along x and y.
    pub size: [u32; 2],
    /// Linear, scene-referred radiance: red, green, blue and coverage of each pixel, row by row from the top.
    pub radiance: Vec<f32>,
    /// Tone-mapped and sRGB-encoded: red, green, blue and 255.
    pub display: Vec<u8>,
}

/// What a picture's radiance amounts to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImageSummary {
    /// Mean of red, green and blue over the pixels that are finite.
    pub mean: [f64; 3],
    /// The greatest finite channel.
    pub max: f64,
    /// Pixels with a channel that is infinite or not a number.
    pub nonfinite: u64,
}

/// Infinities and what is not a number have all bits of the exponent set. Comparisons may be compiled away, this not.
fn is_finite(value: f32) -> bool {
    value.to_bits() & 0x7f80_0000 != 0x7f80_0000
}

impl Picture {
    /// Mean, maximum, and how many pixels are no numbers.
    pub fn summary(&self) -> ImageSummary {
        let (mut sum, mut max, mut nonfinite, mut finite) = ([0.0; 3], 0.0_f64, 0, 0_u64);
        for pixel in self.radiance.chunks_exact(4) {
            if !pixel.iter().copied().all(is_finite) {
                nonfinite += 1;
                continue;
            }
            finite += 1;
            for (sum, channel) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(*channel);
                max = max.max(f64::from(*channel));
            }
        }
        ImageSummary { mean: sum.map(|sum| sum / finite.max(1) as f64), max, nonfinite }
    }

    /// The radiance as an OpenEXR file of 32-bit floats, with text attributes. The same pixels and attributes give the
    /// same bytes.
    pub fn exr(&self, attributes: &[(&str, String)]) -> std::result::Result<Vec<u8>, Failure> {
        let size = self.size.map(|side| side as usize);
        let at = |position: Vec2<usize>| {
            let pixel = (position.y() * size[0] + position.x()) * 4;
            let channel = |k: usize| self.radiance.get(pixel + k).copied().unwrap_or(f32::NAN);
            (channel(0), channel(1), channel(2), channel(3))
        };
        let mut own = LayerAttributes::named("radiance");
        own.software_name = Some(ascii(&format!("mica {}", env!("CARGO_PKG_VERSION"))));
        own.other.extend(attributes.iter().map(|(name, text)| (ascii(name), AttributeValue::Text(ascii(text)))));
        // Blocks in increasing order: otherwise they lie in the order in which threads finish them.
        let encoding =
            Encoding { compression: Compression::ZIP16, line_order: LineOrder::Increasing, ..Encoding::default() };
        let layer = Layer::new((size[0], size[1]), own, encoding, SpecificChannels::rgba(at));
        let mut bytes = Vec::new();
        Image::from_layer(layer)
            .write()
            .to_buffered(Cursor::new(&mut bytes))
            .map_err(|error| Failure::bad_input(format!("the picture cannot be written as OpenEXR: {error}")))?;
        Ok(with_sorted_attributes(bytes))
    }

    /// The tone-mapped picture as a PNG file.
    pub fn png(&self) -> std::result::Result<Vec<u8>, Failure> {
        let rgb: Vec<u8> = self.display.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        png_of(&rgb, self.size)
    }
}

/// Red, green and blue of each pixel, sRGB-encoded, as a PNG file.
pub fn png_of(rgb: &[u8], [width, height]: [u32; 2]) -> std::result::Result<Vec<u8>, Failure> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(rgb, width, height, image::ExtendedColorType::Rgb8)
        .map_err(|error| Failure::bad_input(format!("the picture cannot be written as PNG: {error}")))?;
    Ok(bytes)
}

/// Text as EXR attributes hold it; whatever is not ASCII is escaped.
pub fn ascii(text: &str) -> Text {
    let is_plain = |c: &char| c.is_ascii() && !c.is_ascii_control();
    let plain: String =
        text.chars().flat_map(|c| if is_plain(&c) { vec![c] } else { c.escape_default().collect() }).collect();
    Text::from(plain.as_str())
}

/// The same OpenEXR file of one part with its attributes in the order of their names: the writer keeps them in a hash
/// map, whose order differs from run to run. Nothing else moves, as their sizes stay.
pub fn with_sorted_attributes(mut file: Vec<u8>) -> Vec<u8> {
    const START: usize = 8;
    let until_zero = |from: usize| file.get(from..)?.iter().position(|byte| *byte == 0).map(|length| from + length + 1);
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = START;
    // Name, type, size in four bytes, value; an empty name ends the list.
    while file.get(at).is_some_and(|byte| *byte != 0) {
        let end = until_zero(at).and_then(until_zero).and_then(|size_at| {
            let size = file.get(size_at..size_at + 4)?.try_into().ok().map(u32::from_le_bytes)?;
            Some(size_at + 4 + size as usize)
        });
        let Some(attribute) = end.and_then(|end| file.get(at..end)) else { return file };
        attributes.push(attribute);
        at += attribute.len();
    }
    attributes.sort_unstable();
    let sorted = attributes.concat();
    file[START..at].copy_from_slice(&sorted);
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let radiance = (0..7 * 5 * 4).map(|k| k as f32 * 0.37).collect();
        Picture { size: [7, 5], radiance, display: (0..7 * 5 * 4).map(|k| k as u8).collect() }
    }

    fn attributes() -> Vec<(&'static str, String)> {
        ["scene", "method", "settings", "camera", "device", "environment"]
            .map(|name| (name, format!("{name} \u{fc}\n")))
            .to_vec()
    }

    #[test]
    fn an_exr_holds_every_bit_and_every_attribute() {
        let bytes = picture().exr(&attributes()).expect("a file");
        let read = read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, _| vec![[0_f32; 4]; size.area()],
                |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * 7 + at.x()] = [r, g, b, a],
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(&bytes))
            .expect("a readable file");
        assert_eq!(read.layer_data.channel_data.pixels.as_flattened(), picture().radiance);
        let other = &read.layer_data.attributes.other;
        assert_eq!(other.len(), attributes().len());
        assert_eq!(other.get(&ascii("camera")), Some(&AttributeValue::Text(Text::from("camera \\u{fc}\\n"))));
    }

    #[test]
    fn the_same_picture_gives_the_same_bytes() {
        let first = picture().exr(&attributes()).expect("a file");
        assert!((0..20).all(|_| picture().exr(&attributes()).expect("a file") == first));
    }

    #[test]
    fn a_png_holds_the_display_values() {
        let decoded = image::load_from_memory(&picture().png().expect("a file")).expect("a readable file").into_rgba8();
        let expected: Vec<u8> =
            picture().display.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255]).collect();
        assert_eq!(decoded.into_raw(), expected);
    }

    #[test]
    fn pixels_that_are_no_numbers_are_counted_and_left_out() {
        let radiance =
            vec![1.0, 2.0, 3.0, 1.0, f32::NAN, 0.0, 0.0, 1.0, 0.0, f32::INFINITY, 0.0, 1.0, 3.0, 2.0, 9.0, 1.0];
        let summary = Picture { size: [2, 2], radiance, display: Vec::new() }.summary();
        assert_eq!(summary, ImageSummary { mean: [2.0, 2.0, 6.0], max: 9.0, nonfinite: 2 });
    }
}
