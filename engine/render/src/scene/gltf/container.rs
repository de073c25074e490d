//! The outermost layer of a file: JSON alone, or a binary glTF's chunks (glTF 2.0, section 4).
//!
//! `gltf::Glb` will not do (1.4.1): a declared length below 12 overflows in it, it refuses chunks of unknown kinds, which
//! are to be passed over, and its errors do not say where in the file they are.

use crate::scene::{SceneError, SceneErrorCode};

/// The document's text and, from a binary glTF, the first buffer's bytes.
pub struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

const JSON_CHUNK: &[u8; 4] = b"JSON";
const BINARY_CHUNK: &[u8; 4] = b"BIN\0";

/// Splits a file into its parts; every length in it is checked against what is there.
pub fn open(bytes: &[u8]) -> Result<Container<'_>, SceneError> {
    if bytes.starts_with(b"glTF") {
        return open_binary(bytes);
    }
    // Some editors put a byte order mark before the text; glTF forbids it, but nothing is ambiguous.
    let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match json.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'{') => Ok(Container { json, binary: None }),
        _ => Err(SceneError::new(
            SceneErrorCode::UnknownFormat,
            "",
            "neither a glTF document (JSON) nor a binary glTF",
            "give a .gltf or .glb file of glTF 2.0",
        )),
    }
}

fn open_binary(bytes: &[u8]) -> Result<Container<'_>, SceneError> {
    let cut_short = |location: &str, what: String| {
        SceneError::new(SceneErrorCode::InvalidGlb, location, what, "export or copy the file again")
    };
    let &[version, length] = words(bytes, 4)
        .as_ref()
        .ok_or_else(|| cut_short("header", format!("the file ends after {} of 12 bytes", bytes.len())))?;
    if version != 2 {
        return Err(SceneError::new(
            SceneErrorCode::UnknownVersion,
            "header",
            format!("binary glTF version {version}"),
            "export it as glTF 2.0",
        ));
    }
    let Some(declared) = bytes.get(..length as usize).filter(|declared| declared.len() >= 12) else {
        return Err(cut_short("header", format!("declares {length} bytes where the file has {}", bytes.len())));
    };

    let mut rest = &declared[12..];
    let mut container = Container { json: &[], binary: None };
    let mut chunk = 0;
    while !rest.is_empty() {
        let location = format!("chunk {chunk}");
        let Some([length, _]) = words(rest, 0) else {
            return Err(cut_short(&location, format!("its header has {} of 8 bytes", rest.len())));
        };
        let (kind, body) = (&rest[4..8], &rest[8..]);
        let Some((data, after)) = body.split_at_checked(length as usize) else {
            return Err(cut_short(&location, format!("declares {length} bytes where {} are left", body.len())));
        };
        match chunk {
            0 if kind == JSON_CHUNK => container.json = data,
            0 => return Err(cut_short(&location, "the first chunk is not JSON".to_owned())),
            1 if kind == BINARY_CHUNK => container.binary = Some(data),
            // Chunks of other kinds are to be ignored.
            _ => {}
        }
        rest = after;
        chunk += 1;
    }
    if chunk == 0 {
        return Err(cut_short("header", "there are no chunks".to_owned()));
    }
    Ok(container)
}

/// Two little-endian words.
fn words(bytes: &[u8], at: usize) -> Option<[u32; 2]> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    Some([word(at)?, word(at + 4)?])
}
