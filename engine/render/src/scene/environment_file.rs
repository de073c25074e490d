//! Environment maps from OpenEXR and Radiance files; sizes are read from the headers and judged before anything is
//! decoded.

use super::contained::contained;
use super::environment::{EnvironmentReport, EquirectMap};
use super::error::{OneLine, SceneError, SceneErrorCode};
use super::gltf::read_regular_file;
use super::{environment_exr, memory};
use image::{ImageDecoder, codecs::hdr::HdrDecoder};
use std::io::Cursor;
use std::path::Path;

/// The largest map, texels: 16384 x 8192.
pub(super) const MAX_TEXELS: usize = EquirectMap::LARGEST_SIDE * EquirectMap::LARGEST_SIDE / 2;
/// No byte of a Radiance file becomes more texels than this: eight make a run of 127 texels in each of four channels.
const MOST_HDR_TEXELS_PER_BYTE: usize = 64;

impl EquirectMap {
    /// The largest side of a map that is read, texels; it may be half as high.
    pub const LARGEST_SIDE: usize = 16384;
    /// The largest file that is read, bytes: that map, uncompressed in 32 bits, with some channels more.
    pub const LARGEST_FILE_BYTES: u64 = 4 << 30;

    /// Reads an equirectangular map from an `.exr` or `.hdr` file, whichever its first bytes say it is.
    ///
    /// Of an OpenEXR file the first layer with channels R, G and B is taken (half, float or integer, any compression,
    /// scan lines or tiles, the full resolution). The report says which texels had to be repaired.
    pub fn load(path: &Path) -> Result<(EquirectMap, EnvironmentReport), SceneError> {
        let file = path.display().to_string();
        read_regular_file(path, Self::LARGEST_FILE_BYTES, "")
            .and_then(|bytes| Self::from_file_bytes(&file, &bytes))
            .map_err(|error| error.in_file(&file))
    }

    /// Reads the bytes of an `.exr` or `.hdr` file; `name` stands for the file's in errors.
    pub fn from_file_bytes(name: &str, bytes: &[u8]) -> Result<(EquirectMap, EnvironmentReport), SceneError> {
        Self::decoded(name, || match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => environment_exr::read(bytes),
            [b'#', b'?', ..] => read_hdr(bytes),
            _ => Err(SceneError::new(
                SceneErrorCode::UnknownFormat,
                "",
                "neither OpenEXR nor Radiance HDR",
                "give an equirectangular .exr or .hdr file",
            )),
        })
    }

    /// What a decoder gives, judged and repaired.
    fn decoded(
        name: &str,
        decode: impl FnOnce() -> Result<EquirectMap, SceneError>,
    ) -> Result<(EquirectMap, EnvironmentReport), SceneError> {
        let mut map = contained(decode, invalid).map_err(|error| error.in_file(name))?;
        let mut report = map.repair();
        if u64::from(map.width) != 2 * u64::from(map.height) {
            report.warnings.push(format!(
                "{} x {} texels, where an equirectangular map is twice as wide as high; it is stretched",
                map.width, map.height
            ));
        }
        let counts = [
            (report.nan_texels, "not a number, replaced by 0"),
            (report.negative_texels, "negative, replaced by 0"),
            (report.infinite_texels, "infinite, replaced by 65504"),
            (report.huge_texels, "above 1e12, replaced by that"),
        ];
        let repaired = counts.iter().filter(|(count, _)| *count > 0);
        let first = report.first_changed.map_or(String::new(), |[column, row]| {
            format!("; the first texel to be changed is in column {column} of row {row}")
        });
        let warnings: Vec<String> =
            repaired.map(|(count, what)| format!("{count} texels have channels that are {what}{first}")).collect();
        report.warnings.extend(warnings);
        for warning in &report.warnings {
            log::warn!("{}: {warning}", OneLine(name));
        }
        Ok((map, report))
    }
}

pub(super) fn invalid(what: String) -> SceneError {
    image_error(SceneErrorCode::InvalidImage, what, "save the map again, as OpenEXR with channels R, G and B")
}

pub(super) fn image_error(code: SceneErrorCode, what: String, remedy: &'static str) -> SceneError {
    SceneError::new(code, "", what, remedy)
}

/// Refuses a size that is nothing or too much.
pub(super) fn check_size(width: usize, height: usize) -> Result<(), SceneError> {
    if width == 0 || height == 0 {
        return Err(invalid(format!("{width} x {height} texels")));
    }
    let side = EquirectMap::LARGEST_SIDE;
    if width > side || height > side || width * height > MAX_TEXELS {
        return Err(image_error(
            SceneErrorCode::ImageTooLarge,
            format!("{width} x {height} texels, where {side} x {} are allowed", side / 2),
            "save the map again, smaller",
        ));
    }
    Ok(())
}

fn read_hdr(bytes: &[u8]) -> Result<EquirectMap, SceneError> {
    let failed = |error: image::ImageError| invalid(error.to_string());
    let decoder = HdrDecoder::new(Cursor::new(bytes)).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize)?;
    let texels = width as usize * height as usize;
    if texels > bytes.len().saturating_mul(MOST_HDR_TEXELS_PER_BYTE) {
        return Err(invalid(format!("{width} x {height} texels, which {} bytes of file cannot hold", bytes.len())));
    }
    let mut texels = memory::filled([0.0f32; 3], texels, "")?;
    decoder.read_image(bytemuck::cast_slice_mut(&mut texels)).map_err(failed)?;
    Ok(EquirectMap { width, height, texels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f43_a_decoder_of_maps_that_panics_is_an_error_of_the_file() {
        let error = EquirectMap::decoded("sky.exr", || panic!("injected")).expect_err("it panicked");
        assert_eq!(error.code, SceneErrorCode::InvalidImage);
        let said = error.to_string();
        assert!(said.contains("sky.exr") && said.contains("its decoder gave up on it; save the map again"), "{said}");
    }
}
