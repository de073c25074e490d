//! JPEG images.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

/// In colour and in grey, and one that is cut short.
pub fn files() -> Vec<Vec<u8>> {
    let encoded = |color: ExtendedColorType, channels: usize| {
        let texels: Vec<u8> = (0..9 * 7 * channels).map(|k| (k * 29) as u8).collect();
        let mut file = Vec::new();
        JpegEncoder::new_with_quality(&mut file, 30).write_image(&texels, 9, 7, color).expect("memory has room");
        file
    };
    let color = encoded(ExtendedColorType::Rgb8, 3);
    let cut = color[..color.len() - 20].to_vec();
    vec![color, encoded(ExtendedColorType::L8, 1), cut]
}
