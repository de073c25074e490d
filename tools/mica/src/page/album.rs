//! The pictures of a study within its page: read, made small enough, and written as data URIs.

use crate::table::bytes;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::FilterType;
use std::path::{Component, Path, PathBuf};

/// Of JPEG: glints keep their places and colours.
const QUALITY: u8 = 85;
/// Pages should open at once; beyond this, pictures are made smaller.
const MOST_BYTES: usize = 32 << 20;
/// Longest sides of pictures, one tried after the other.
const SIDES: [u32; 3] = [u32::MAX, 960, 480];

/// Pictures to be put into a page, each once.
pub struct Album {
    folder: PathBuf,
    paths: Vec<String>,
}

/// Pictures in a page.
pub struct Embedded {
    /// Data URIs by number; empty where there is no picture that can be read.
    pub images: Vec<String>,
    /// What a reader should know of them.
    pub remark: String,
}

impl Album {
    /// Of a study's folder.
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), paths: Vec::new() }
    }

    /// The number of a picture in the folder; none if there is no such file there.
    pub fn add(&mut self, path: &str) -> Option<usize> {
        // A line of a study is no reason to look elsewhere.
        let is_inside = Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
        if !is_inside || !self.folder.join(path).is_file() {
            return None;
        }
        let known = self.paths.iter().position(|other| other == path);
        Some(known.unwrap_or_else(|| {
            self.paths.push(path.to_owned());
            self.paths.len() - 1
        }))
    }

    /// All pictures that were added.
    pub fn embed(&self) -> Embedded {
        if self.paths.is_empty() {
            return Embedded { images: Vec::new(), remark: "The study has no pictures.".to_owned() };
        }
        let mut side = SIDES[0];
        let mut images = self.encoded(side);
        for smaller in &SIDES[1..] {
            if total(&images) > MOST_BYTES {
                side = *smaller;
                images = self.encoded(side);
            }
        }
        let shrunk = if side == SIDES[0] { String::new() } else { format!(", at most {side} pixels wide or high") };
        let remark = format!(
            "{} pictures are embedded as JPEG of quality {QUALITY}{shrunk} ({}); the originals are in pictures/.",
            images.len(),
            bytes(total(&images) as u64),
        );
        Embedded { images, remark }
    }

    fn encoded(&self, side: u32) -> Vec<String> {
        self.paths.iter().map(|path| data_uri(&self.folder.join(path), side).unwrap_or_default()).collect()
    }
}

fn total(images: &[String]) -> usize {
    images.iter().map(String::len).sum()
}

/// A picture as a data URI, its longer side at most so long.
fn data_uri(path: &Path, side: u32) -> Option<String> {
    let decoded = match image::open(path) {
        Ok(decoded) => decoded,
        Err(error) => {
            log::warn!("{}: {error}; the page goes without it", path.display());
            return None;
        }
    };
    let is_large = decoded.width().max(decoded.height()) > side;
    let sized = if is_large { decoded.resize(side, side, FilterType::Triangle) } else { decoded };
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY).encode_image(&sized.into_rgb8()).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)))
}
