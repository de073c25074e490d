//! OpenEXR environment maps. What the decoder would allocate is judged from headers and blocks before it runs: an
//! allocation that fails ends the process, and nothing can catch that.

use super::environment::EquirectMap;
use super::environment_file::{MAX_TEXELS, check_size, image_error, invalid};
use super::error::{SceneError, SceneErrorCode};
use super::memory;
use exr::block::chunk::CompressedBlock;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{ReadChannels, ReadLayers};
use std::io::Cursor;

/// The longest table of blocks; the smallest blocks in use are tiles of 32 x 32.
const MAX_BLOCKS: usize = 1 << 20;
/// The largest block, decoded, bytes.
const MAX_BLOCK_BYTES: usize = 1 << 30;
/// No byte of a file becomes more bytes of texels than this: deflate, which most of the compressions end in, gives 1032.
const MOST_BYTES_PER_BYTE: usize = 2048;
/// The same for DWAA and DWAB, which keep one value of 64 where nothing changes, and deflate those.
const MOST_BYTES_PER_BYTE_OF_DWA: usize = 1 << 17;

/// Reads the first layer with channels R, G and B.
pub(super) fn read(bytes: &[u8]) -> Result<EquirectMap, SceneError> {
    let failed = |error: exr::error::Error| invalid(error.to_string());
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    for header in &meta.headers {
        check_header(header, bytes.len())?;
    }
    if meta.headers.iter().any(is_dwa) {
        check_blocks(bytes)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| EquirectMap {
                width: size.width() as u32,
                height: size.height() as u32,
                // Where there is no memory this stays empty, as an error cannot be returned from here.
                texels: memory::filled([0.0; 3], size.area(), "").unwrap_or_default(),
            },
            |map: &mut EquirectMap, at, (r, g, b): (f32, f32, f32)| {
                if let Some(texel) = map.texels.get_mut(at.y() * map.width as usize + at.x()) {
                    *texel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        // One thread: a decoder that panics on another could not be caught.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;
    let map = image.layer_data.channel_data.pixels;
    if map.texels.is_empty() {
        Err(memory::exhausted(u64::from(map.width) * u64::from(map.height) * 12, ""))
    } else {
        Ok(map)
    }
}

fn is_dwa(header: &Header) -> bool {
    matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_))
}

/// Refuses what the decoder does not read rightly, and sizes that are too much or more than the file can hold.
fn check_header(header: &Header, file_bytes: usize) -> Result<(), SceneError> {
    if header.deep {
        return Err(invalid("holds deep data, which is not read".to_owned()));
    }
    if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(invalid("has channels of fewer samples than texels, which are not read".to_owned()));
    }
    let size = header.layer_size;
    check_size(size.width(), size.height())?;
    let block_texels = match header.blocks {
        BlockDescription::Tiles(tiles) => tiles.tile_size.width().saturating_mul(tiles.tile_size.height()),
        BlockDescription::ScanLines => size.width() * header.compression.scan_lines_per_block().min(size.height()),
    };
    let texel_bytes = header.channels.bytes_per_pixel;
    if block_texels > MAX_TEXELS
        || block_texels.saturating_mul(texel_bytes) > MAX_BLOCK_BYTES
        || header.chunk_count > MAX_BLOCKS
    {
        let what =
            format!("blocks of {block_texels} texels and {texel_bytes} bytes a texel, {} of them", header.chunk_count);
        return Err(image_error(
            SceneErrorCode::ImageTooLarge,
            what,
            "save the map again, in scan lines or tiles of 32 to 4096 texels",
        ));
    }
    let most = if is_dwa(header) { MOST_BYTES_PER_BYTE_OF_DWA } else { MOST_BYTES_PER_BYTE };
    if size.area().saturating_mul(texel_bytes) > file_bytes.saturating_mul(most) {
        return Err(invalid(format!(
            "{} x {} texels of {texel_bytes} bytes, which {file_bytes} bytes of file cannot hold",
            size.width(),
            size.height()
        )));
    }
    Ok(())
}

/// A block of DWAA or DWAB begins with the sizes of its parts, and the decoder (exr 1.74) allocates whatever they say.
fn check_blocks(bytes: &[u8]) -> Result<(), SceneError> {
    let failed = |error: exr::error::Error| invalid(error.to_string());
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(failed)?;
    let headers = reader.headers().to_vec();
    // By the table of offsets, as the decoder goes: what lies between blocks is never read.
    for chunk in reader.filter_chunks(false, |_, _, _| true).map_err(failed)? {
        let chunk = chunk.map_err(failed)?;
        let Some(header) = headers.get(chunk.layer_index).filter(|header| is_dwa(header)) else { continue };
        let block = match &chunk.compressed_block {
            CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
            CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
            CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => continue,
        };
        let place = header.get_block_data_indices(&chunk.compressed_block).map_err(failed)?;
        let extent = header.get_absolute_block_pixel_coordinates(place).map_err(failed)?.size;
        let whole = extent.area().saturating_mul(header.channels.bytes_per_pixel);
        if block.len() == whole {
            // Kept as it is, because it would not have become smaller.
            continue;
        }
        // In small blocks, samples are padded to whole squares of 8 x 8.
        let limit = whole.saturating_mul(2).max(1 << 20) as u64;
        // A version, then bytes of parts and numbers of values; after these, how one of the parts is coded.
        let counters = block.chunks_exact(8).map(|counter| u64::from_le_bytes(std::array::from_fn(|k| counter[k])));
        if let Some(counter) = counters.take(10).skip(1).find(|&counter| counter > limit) {
            return Err(invalid(format!("a block with a part of {counter} bytes, where {limit} is the most")));
        }
    }
    Ok(())
}
