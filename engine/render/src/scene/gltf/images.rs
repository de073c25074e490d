//! Textures by use: each image is decoded once, within limits, and copied for each way in which it is used.

use super::accessor::{Reader, named};
use super::limits::LoadLimits;
use super::source::Source;
use crate::scene::contained::contained;
use crate::scene::{Encoding, SceneError, SceneErrorCode, Texture, Wrap, memory};
use ::gltf::json;
use ::gltf::json::texture::{MagFilter, Sampler, WrappingMode};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};
use image::{ColorType, ImageDecoder, ImageError, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

/// What the crate gives for the source of a texture that has none, as those in other formats.
const NO_IMAGE: usize = u32::MAX as usize;

/// No byte of a PNG becomes more texels than this: eight of one bit each in a byte, 1032 times what deflate made of that.
/// JPEG has 64 texels in a bit at most.
const MOST_TEXELS_PER_BYTE: u64 = 8 * 1032;

/// The distinct uses of images, in the order in which materials name them.
pub struct TextureUses<'a> {
    document: &'a Root,
    uses: Vec<Use>,
    pub warnings: Vec<String>,
}

#[derive(Clone, Copy, PartialEq)]
struct Use {
    image: usize,
    encoding: Encoding,
    wrap: [Wrap; 2],
    nearest: bool,
}

impl<'a> TextureUses<'a> {
    pub fn new(document: &'a Root) -> Self {
        Self { document, uses: Vec::new(), warnings: Vec::new() }
    }

    /// The index that the scene's texture will have; none, with a warning, when the document gives it no image.
    pub fn register(
        &mut self,
        index: Index<json::Texture>,
        encoding: Encoding,
        location: &str,
    ) -> Result<Option<usize>, SceneError> {
        let texture = named(&self.document.textures, index.value(), "textures", location)?;
        let at = format!("textures[{}]", index.value());
        let image = texture.source.value();
        if image == NO_IMAGE {
            self.warnings.push(format!("{location}: {at} has no PNG or JPEG image, left out"));
            return Ok(None);
        }
        named(&self.document.images, image, "images", &at)?;
        let default = Sampler::default();
        let sampler = match texture.sampler {
            Some(sampler) => named(&self.document.samplers, sampler.value(), "samplers", &at)?,
            None => &default,
        };
        let wanted = Use {
            image,
            encoding,
            wrap: [wrap(sampler.wrap_s, &at)?, wrap(sampler.wrap_t, &at)?],
            nearest: sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest)),
        };
        Ok(Some(self.uses.iter().position(|known| *known == wanted).unwrap_or_else(|| {
            self.uses.push(wanted);
            self.uses.len() - 1
        })))
    }

    /// Decodes what was registered, and gives back the warnings.
    pub fn decode(self, reader: &Reader, source: &Source) -> Result<(Vec<Texture>, Vec<String>), SceneError> {
        let images: BTreeSet<usize> = self.uses.iter().map(|wanted| wanted.image).collect();
        let decoded: Vec<Result<(usize, Decoded), SceneError>> =
            images.par_iter().map(|&image| Ok((image, load(self.document, image, reader, source)?))).collect();
        let decoded: BTreeMap<usize, Decoded> = decoded.into_iter().collect::<Result<_, _>>()?;
        let textures = self.uses.iter().map(|wanted| {
            let image = &decoded[&wanted.image];
            reader.budget.claim(image.rgba.len() as u64, &image.location)?;
            let mut pixels = memory::with_room(image.rgba.len(), &image.location)?;
            pixels.extend_from_slice(&image.rgba);
            Ok(Texture {
                name: image.name.clone(),
                width: image.width,
                height: image.height,
                pixels,
                encoding: wanted.encoding,
                wrap: wanted.wrap,
                nearest: wanted.nearest,
            })
        });
        Ok((textures.collect::<Result<_, _>>()?, self.warnings))
    }
}

fn wrap(mode: Checked<WrappingMode>, location: &str) -> Result<Wrap, SceneError> {
    match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Invalid => Err(SceneError::new(
            SceneErrorCode::ValueNotInRange,
            location,
            "its sampler wraps in a way that does not exist; 33071, 33648 and 10497 do",
            "export the file again",
        )),
    }
}

struct Decoded {
    name: String,
    location: String,
    width: u32,
    height: u32,
    rgba: Vec<u8>,
}

fn load(document: &Root, index: usize, reader: &Reader, source: &Source) -> Result<Decoded, SceneError> {
    let location = format!("images[{index}]");
    let object = named(&document.images, index, "images", &location)?;
    let file;
    let bytes = match (&object.uri, object.buffer_view) {
        (Some(uri), _) => {
            file = source.read(uri, &location)?;
            &file
        }
        (None, Some(view)) => reader.view_bytes(view, &location)?,
        (None, None) => {
            let what = "neither a URI nor a buffer view";
            return Err(SceneError::new(SceneErrorCode::InvalidImage, location, what, "export the file again"));
        }
    };
    let uri_name = || object.uri.clone().filter(|uri| !uri.starts_with("data:"));
    let name = object.name.clone().or_else(uri_name).unwrap_or_else(|| location.clone());
    let claim = |bytes: u64| reader.budget.claim(bytes, &location);
    let (width, height, rgba) = decode(bytes, source.limits, claim, &location)?;
    Ok(Decoded { name, location, width, height, rgba })
}

/// Decodes a PNG or JPEG whose size is within limits; `claim` is asked before memory is taken.
fn decode(
    bytes: &[u8],
    limits: &LoadLimits,
    claim: impl Fn(u64) -> Result<(), SceneError>,
    location: &str,
) -> Result<(u32, u32, Vec<u8>), SceneError> {
    let invalid = |what: String| {
        SceneError::new(SceneErrorCode::InvalidImage, location, what, "save the image again, as PNG or JPEG")
    };
    let too_large =
        |what: String| SceneError::new(SceneErrorCode::ImageTooLarge, location, what, "save the image again, smaller");
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        Ok(format) => return Err(invalid(format!("{format:?}, where PNG and JPEG are read"))),
        Err(_) => return Err(invalid("neither PNG nor JPEG".to_owned())),
    };
    let failed = |error: ImageError| match error {
        ImageError::Limits(error) => too_large(error.to_string()),
        error => invalid(error.to_string()),
    };
    let decode = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut bounds = image::Limits::default();
        bounds.max_image_width = Some(limits.image_side);
        bounds.max_image_height = Some(limits.image_side);
        // Twice, for sixteen bits a channel.
        bounds.max_alloc = Some(limits.image_bytes.saturating_mul(2));
        reader.limits(bounds);
        let decoder = reader.into_decoder().map_err(failed)?;
        let (width, height) = decoder.dimensions();
        let texels = u64::from(width) * u64::from(height);
        if texels == 0 {
            return Err(invalid("has no texels".to_owned()));
        }
        if texels * 4 > limits.image_bytes {
            return Err(too_large(format!("{width} x {height} texels, more than {} bytes", limits.image_bytes)));
        }
        if texels > MOST_TEXELS_PER_BYTE.saturating_mul(bytes.len() as u64) {
            return Err(invalid(format!("{width} x {height} texels, which {} bytes cannot hold", bytes.len())));
        }
        claim(texels * 4)?;
        let color = decoder.color_type();
        let mut rgba = memory::with_room(texels as usize * 4, location)?;
        let mut decoded = memory::filled(0, decoder.total_bytes() as usize, location)?;
        decoder.read_image(&mut decoded).map_err(failed)?;
        if !append_rgba8(&decoded, color, &mut rgba) {
            return Err(invalid(format!("texels of an unread kind, {color:?}")));
        }
        Ok((width, height, rgba))
    };
    // The decoders have not been seen to panic, but they meet bytes from anywhere.
    contained(decode, invalid)
}

/// Converts what a PNG or JPEG holds; false for kinds that neither has.
fn append_rgba8(decoded: &[u8], color: ColorType, rgba: &mut Vec<u8>) -> bool {
    let eight = |bytes: &[u8]| bytes[0];
    // 65535 is 257 times 255.
    let sixteen = |bytes: &[u8]| ((u32::from(u16::from_ne_bytes([bytes[0], bytes[1]])) + 128) / 257) as u8;
    match color {
        ColorType::L8 => append(decoded, 1, eight, |c: [u8; 1]| [c[0], c[0], c[0], 255], rgba),
        ColorType::La8 => append(decoded, 1, eight, |c: [u8; 2]| [c[0], c[0], c[0], c[1]], rgba),
        ColorType::Rgb8 => append(decoded, 1, eight, |c: [u8; 3]| [c[0], c[1], c[2], 255], rgba),
        ColorType::Rgba8 => rgba.extend_from_slice(decoded),
        ColorType::L16 => append(decoded, 2, sixteen, |c: [u8; 1]| [c[0], c[0], c[0], 255], rgba),
        ColorType::La16 => append(decoded, 2, sixteen, |c: [u8; 2]| [c[0], c[0], c[0], c[1]], rgba),
        ColorType::Rgb16 => append(decoded, 2, sixteen, |c: [u8; 3]| [c[0], c[1], c[2], 255], rgba),
        ColorType::Rgba16 => append(decoded, 2, sixteen, |c: [u8; 4]| c, rgba),
        _ => return false,
    }
    true
}

/// Texels of `N` channels of `bytes` bytes each.
fn append<const N: usize>(
    decoded: &[u8],
    bytes: usize,
    channel: impl Fn(&[u8]) -> u8,
    texel: impl Fn([u8; N]) -> [u8; 4],
    rgba: &mut Vec<u8>,
) {
    let texels = decoded.chunks_exact(N * bytes);
    rgba.extend(texels.flat_map(|source| texel(std::array::from_fn(|k| channel(&source[k * bytes..])))));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f43_a_decoder_of_images_that_panics_is_an_error_of_the_image() {
        let mut png = Vec::new();
        image::RgbImage::new(2, 1).write_to(&mut Cursor::new(&mut png), ImageFormat::Png).expect("it is encoded");
        let limits = LoadLimits::default();
        decode(&png, &limits, |_| Ok(()), "images[0]").expect("it is a good one");
        // Memory is asked for in the middle of decoding.
        let error = decode(&png, &limits, |_| panic!("injected"), "images[0]").expect_err("it panicked");
        assert_eq!(error.code, SceneErrorCode::InvalidImage);
        let said = error.to_string();
        assert!(
            said.contains("images[0]") && said.contains("its decoder gave up on it; save the image again"),
            "{said}"
        );
    }
}
