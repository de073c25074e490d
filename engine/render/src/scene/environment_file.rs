//! Environment maps from OpenEXR and Radiance files; sizes are read from the headers and judged before anything is
//! decoded.

use super::environment::{EnvironmentReport, EquirectMap};
use super::error::{OneLine, SceneError, SceneErrorCode};
use super::gltf::read_regular_file;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{ReadChannels, ReadLayers};
use image::{DynamicImage, ImageDecoder, codecs::hdr::HdrDecoder};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// The largest side of a map, texels.
const MAX_SIDE: usize = 16384;
/// The largest map, texels: 16384 x 8192.
const MAX_TEXELS: usize = 1 << 27;
/// The largest file: that map, uncompressed in 32 bits, with some channels more.
const MAX_FILE_BYTES: u64 = 4 << 30;
/// The longest table of blocks in an OpenEXR file; the smallest blocks in use are tiles of 32 x 32.
const MAX_BLOCKS: usize = 1 << 20;

impl EquirectMap {
    /// Reads an equirectangular map from an `.exr` or `.hdr` file, whichever its first bytes say it is.
    ///
    /// Of an OpenEXR file the first layer with channels R, G and B is taken (half, float or integer, any compression,
    /// scan lines or tiles, the full resolution). The report says which texels had to be repaired.
    pub fn load(path: &Path) -> Result<(EquirectMap, EnvironmentReport), SceneError> {
        let file = path.display().to_string();
        read_regular_file(path, MAX_FILE_BYTES, "")
            .and_then(|bytes| Self::from_file_bytes(&file, &bytes))
            .map_err(|error| error.in_file(&file))
    }

    /// Reads the bytes of an `.exr` or `.hdr` file; `name` stands for the file's in errors.
    pub fn from_file_bytes(name: &str, bytes: &[u8]) -> Result<(EquirectMap, EnvironmentReport), SceneError> {
        // The decoders' own checks have holes; what is left is caught, as bytes may come from anywhere.
        let read = || match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => read_exr(bytes),
            [b'#', b'?', ..] => read_hdr(bytes),
            _ => Err(SceneError::new(
                SceneErrorCode::UnknownFormat,
                "",
                "neither OpenEXR nor Radiance HDR",
                "give an equirectangular .exr or .hdr file",
            )),
        };
        let caught = catch_unwind(AssertUnwindSafe(read));
        let mut map = caught
            .unwrap_or_else(|_| Err(invalid("its decoder gave up on it".to_owned())))
            .map_err(|error| error.in_file(name))?;
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

fn invalid(what: String) -> SceneError {
    SceneError::new(SceneErrorCode::InvalidImage, "", what, "save the map again, as OpenEXR with channels R, G and B")
}

/// Refuses a size that is nothing or too much.
fn check_size(width: usize, height: usize) -> Result<(), SceneError> {
    if width == 0 || height == 0 {
        return Err(invalid(format!("{width} x {height} texels")));
    }
    if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_TEXELS {
        return Err(SceneError::new(
            SceneErrorCode::ImageTooLarge,
            "",
            format!("{width} x {height} texels, where {MAX_SIDE} x {} are allowed", MAX_SIDE / 2),
            "save the map again, smaller",
        ));
    }
    Ok(())
}

fn read_exr(bytes: &[u8]) -> Result<EquirectMap, SceneError> {
    let failed = |error: exr::error::Error| invalid(error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &meta.headers {
        if header.deep {
            return Err(invalid("holds deep data, which is not read".to_owned()));
        }
        check_size(header.layer_size.width(), header.layer_size.height())?;
        // What the decoder allocates per block follows from the header alone.
        let block_texels = match header.blocks {
            BlockDescription::Tiles(tiles) => tiles.tile_size.width().saturating_mul(tiles.tile_size.height()),
            BlockDescription::ScanLines => header.layer_size.width(),
        };
        let block_bytes = block_texels.saturating_mul(header.channels.bytes_per_pixel);
        if block_texels > MAX_TEXELS || block_bytes > 1 << 30 || header.chunk_count > MAX_BLOCKS {
            let what = format!(
                "blocks of {block_texels} texels and {} bytes a texel, {} of them",
                header.channels.bytes_per_pixel, header.chunk_count
            );
            let remedy = "save the map again, in scan lines or tiles of 32 to 4096 texels";
            return Err(SceneError::new(SceneErrorCode::ImageTooLarge, "", what, remedy));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| EquirectMap {
                width: size.width() as u32,
                height: size.height() as u32,
                texels: vec![[0.0; 3]; size.width() * size.height()],
            },
            |map: &mut EquirectMap, at, (r, g, b): (f32, f32, f32)| {
                map.texels[at.y() * map.width as usize + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        // One thread: a decoder that panics on another could not be caught.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;
    Ok(image.layer_data.channel_data.pixels)
}

fn read_hdr(bytes: &[u8]) -> Result<EquirectMap, SceneError> {
    let failed = |error: image::ImageError| invalid(error.to_string());
    let decoder = HdrDecoder::new(Cursor::new(bytes)).map_err(failed)?;
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize)?;
    let pixels = DynamicImage::from_decoder(decoder).map_err(failed)?.into_rgb32f();
    let texels = pixels.pixels().map(|pixel| pixel.0).collect();
    Ok(EquirectMap { width, height, texels })
}
