//! Where bytes come from: files beside the scene, data URIs, and nothing else.

use super::limits::LoadLimits;
use crate::scene::{SceneError, SceneErrorCode, memory};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Resolves the URIs of one scene.
pub struct Source<'a> {
    /// The scene's folder; none when the scene came as bytes and may refer to no files.
    pub folder: Option<PathBuf>,
    pub limits: &'a LoadLimits,
}

impl Source<'_> {
    /// The bytes that a URI stands for.
    pub fn read(&self, uri: &str, location: &str) -> Result<Vec<u8>, SceneError> {
        match uri.get(..5) {
            Some(scheme) if scheme.eq_ignore_ascii_case("data:") => self.decode_data_uri(&uri[5..], location),
            _ => read_regular_file(&self.confined(uri, location)?, self.limits.file_bytes, location),
        }
    }

    fn decode_data_uri(&self, body: &str, location: &str) -> Result<Vec<u8>, SceneError> {
        if body.len() as u64 > self.limits.data_uri_chars {
            return Err(SceneError::new(
                SceneErrorCode::FileTooLarge,
                location,
                format!("a data URI of {} characters where {} are allowed", body.len(), self.limits.data_uri_chars),
                "put the data into a file of its own or into a .glb",
            ));
        }
        let invalid = |what: String| {
            SceneError::new(SceneErrorCode::InvalidDataUri, location, what, "export the file again, as .glb")
        };
        let (head, payload) = body.split_once(',').ok_or_else(|| invalid("a data URI without a comma".to_owned()))?;
        if !head.to_ascii_lowercase().ends_with(";base64") {
            return Err(invalid("a data URI that is not base64".to_owned()));
        }
        BASE64.decode(payload).map_err(|error| invalid(format!("a data URI whose base64 is bad: {error}")))
    }

    /// The path of a file in the scene's folder or below; links are followed before that is judged.
    fn confined(&self, uri: &str, location: &str) -> Result<PathBuf, SceneError> {
        let refused = |why: &str| {
            SceneError::new(
                SceneErrorCode::NonRelativeUri,
                location,
                format!("URI `{uri}` {why}"),
                "put the file into the scene's folder and refer to it by a relative path",
            )
        };
        let decoded = percent_decoded(uri).ok_or_else(|| refused("is not percent-encoded UTF-8"))?;
        if decoded.contains('\0') {
            return Err(refused("contains a NUL"));
        }
        if decoded.contains('\\') {
            return Err(refused("contains a backslash"));
        }
        if decoded.split('/').next().is_some_and(|first| first.contains(':')) {
            return Err(refused("has a scheme or a drive"));
        }
        let relative = Path::new(&decoded);
        let mut is_empty = true;
        for component in relative.components() {
            match component {
                Component::Normal(_) => is_empty = false,
                Component::CurDir => {}
                Component::ParentDir => return Err(refused("leaves the scene's folder")),
                Component::RootDir | Component::Prefix(_) => return Err(refused("is absolute")),
            }
        }
        if is_empty {
            return Err(refused("names no file"));
        }
        let folder = self.folder.as_deref().ok_or_else(|| refused("refers to a file, but the scene has no folder"))?;
        let unreadable = |error: std::io::Error| {
            SceneError::new(
                SceneErrorCode::FileUnreadable,
                location,
                format!("`{decoded}` cannot be opened: {error}"),
                "put the file beside the scene, or export the scene as .glb",
            )
        };
        let folder = fs::canonicalize(folder).map_err(unreadable)?;
        let path = fs::canonicalize(folder.join(relative)).map_err(unreadable)?;
        if path.starts_with(&folder) { Ok(path) } else { Err(refused("is a link that leaves the scene's folder")) }
    }
}

/// Reads a file that is neither a folder, a pipe nor a device, up to a size.
pub fn read_regular_file(path: &Path, limit_bytes: u64, location: &str) -> Result<Vec<u8>, SceneError> {
    let unreadable = |error: std::io::Error| {
        SceneError::new(
            SceneErrorCode::FileUnreadable,
            location,
            format!("cannot be read: {error}"),
            "check the path and its permissions",
        )
    };
    // Before opening: opening a pipe would wait for its other end.
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(SceneError::new(
            SceneErrorCode::FileNotRegular,
            location,
            format!("`{}` is a {}", path.display(), if metadata.is_dir() { "folder" } else { "pipe or device" }),
            "name a regular file",
        ));
    }
    let too_large = |bytes: u64| {
        SceneError::new(
            SceneErrorCode::FileTooLarge,
            location,
            format!("{bytes} bytes or more where {limit_bytes} are allowed"),
            "split it, or make its images smaller",
        )
    };
    if metadata.len() > limit_bytes {
        return Err(too_large(metadata.len()));
    }
    // It may grow while it is read.
    let mut bytes = memory::with_room(metadata.len() as usize + 1, location)?;
    File::open(path).and_then(|file| file.take(limit_bytes + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > limit_bytes { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

/// Decodes `%41` and the like, once; none when a sequence is malformed or the result is not UTF-8.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut decoded = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        if byte == b'%' {
            let (digits, after) = after.split_first_chunk::<2>()?;
            let digit = |d: u8| char::from(d).to_digit(16);
            decoded.push((digit(digits[0])? * 16 + digit(digits[1])?) as u8);
            rest = after;
        } else {
            decoded.push(byte);
            rest = after;
        }
    }
    String::from_utf8(decoded).ok()
}
