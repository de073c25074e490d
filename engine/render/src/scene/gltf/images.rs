//! Textures by use: each image is decoded once, within limits, and copied for each way in which it is used.

use super::accessor::{Reader, named};
use super::limits::LoadLimits;
use super::source::Source;
use crate::scene::{Encoding, SceneError, SceneErrorCode, Texture, Wrap};
use ::gltf::json;
use ::gltf::json::texture::{MagFilter, Sampler, WrappingMode};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Index, Root};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What the crate gives for the source of a texture that has none, as those in other formats.
const NO_IMAGE: usize = u32::MAX as usize;

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
            Ok(Texture {
                name: image.name.clone(),
                width: image.width,
                height: image.height,
                pixels: image.rgba.clone(),
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
    let image = decode(bytes, source.limits, claim, &location)?;
    let (width, height) = (image.width(), image.height());
    Ok(Decoded { name, location, width, height, rgba: image.into_rgba8().into_raw() })
}

/// Decodes a PNG or JPEG whose size is within limits; `claim` is asked before memory is taken.
fn decode(
    bytes: &[u8],
    limits: &LoadLimits,
    claim: impl Fn(u64) -> Result<(), SceneError>,
    location: &str,
) -> Result<DynamicImage, SceneError> {
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
    // The decoders have not been seen to panic, but they meet bytes from anywhere.
    let caught = catch_unwind(AssertUnwindSafe(|| {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut bounds = image::Limits::default();
        bounds.max_image_width = Some(limits.image_side);
        bounds.max_image_height = Some(limits.image_side);
        // Twice, for sixteen bits a channel.
        bounds.max_alloc = Some(limits.image_bytes.saturating_mul(2));
        reader.limits(bounds);
        let decoder = reader.into_decoder().map_err(failed)?;
        let (width, height) = decoder.dimensions();
        let rgba_bytes = u64::from(width) * u64::from(height) * 4;
        if rgba_bytes > limits.image_bytes {
            return Err(too_large(format!("{width} x {height} texels, more than {} bytes", limits.image_bytes)));
        }
        claim(rgba_bytes)?;
        DynamicImage::from_decoder(decoder).map_err(failed)
    }));
    let image = caught.unwrap_or_else(|_| Err(invalid("its decoder gave up on it".to_owned())))?;
    if image.width() == 0 || image.height() == 0 { Err(invalid("has no texels".to_owned())) } else { Ok(image) }
}
