//! What is wrong with a scene or an environment map, in one line: which file, where in it, what, and what to do.

use std::fmt;

/// Why a scene, an image in it or an environment map cannot be used.
///
/// Prints as one line: `scene.glb: meshes[2].primitives[0].indices: ACCESSOR_INDEX_OOB: ...; remedy`. Text taken from
/// the file is escaped and shortened, so that a hostile file cannot spoil a terminal or a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// The kind of defect.
    pub code: SceneErrorCode,
    /// The file, as the caller named it.
    pub file: String,
    /// Where in the file, such as `meshes[2].primitives[0].attributes.POSITION`; empty when it concerns the whole.
    pub location: String,
    /// What was found.
    pub what: String,
    /// What its author or user can do.
    pub remedy: &'static str,
}

impl SceneError {
    pub(crate) fn new(
        code: SceneErrorCode,
        location: impl Into<String>,
        what: impl Into<String>,
        remedy: &'static str,
    ) -> Self {
        Self { code, file: String::new(), location: location.into(), what: what.into(), remedy }
    }

    /// Names the file, unless a function nearer to the defect already did.
    pub(crate) fn in_file(mut self, file: &str) -> Self {
        if self.file.is_empty() {
            self.file = file.to_owned();
        }
        self
    }
}

impl std::error::Error for SceneError {}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", OneLine(&self.file))?;
        if !self.location.is_empty() {
            write!(f, "{}: ", OneLine(&self.location))?;
        }
        write!(f, "{}: {}; {}", self.code, OneLine(&self.what), self.remedy)
    }
}

/// Text from a file, fit to be printed: control characters escaped, cut after 400 characters.
pub(crate) struct OneLine<'a>(pub &'a str);

impl fmt::Display for OneLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (position, character) in self.0.chars().enumerate() {
            if position == 400 {
                return f.write_str("...");
            }
            if character.is_control() || matches!(character, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}') {
                write!(f, "{}", character.escape_default())?;
            } else {
                write!(f, "{character}")?;
            }
        }
        Ok(())
    }
}

macro_rules! codes {
    ($($(#[$doc:meta])* $variant:ident = $text:literal,)*) => {
        /// The kinds of defect, under the names that the glTF Validator gives to them where it knows them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum SceneErrorCode { $($(#[$doc])* $variant,)* }

        impl SceneErrorCode {
            /// The name that is printed, such as `ACCESSOR_INDEX_OOB`.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }
    };
}

codes! {
    /// A file cannot be opened or read.
    FileUnreadable = "FILE_UNREADABLE",
    /// A path names a folder, a pipe or a device.
    FileNotRegular = "FILE_NOT_REGULAR",
    /// A file or a data URI exceeds the limit on its size.
    FileTooLarge = "FILE_TOO_LARGE",
    /// The whole scene would take more memory than allowed.
    SceneTooLarge = "SCENE_TOO_LARGE",
    /// The machine, or the limit that the process runs under, has no memory for what a file holds.
    OutOfMemory = "OUT_OF_MEMORY",
    /// The file is none of the formats that are read.
    UnknownFormat = "UNKNOWN_FORMAT",
    /// The JSON is malformed or a value in it has the wrong type.
    InvalidJson = "INVALID_JSON",
    /// A binary glTF file is cut short, or its lengths contradict each other.
    InvalidGlb = "INVALID_GLB",
    /// Not glTF 2.
    UnknownVersion = "UNKNOWN_ASSET_MAJOR_VERSION",
    /// An extension is required that is not known here.
    UnsupportedExtension = "UNSUPPORTED_EXTENSION",
    /// Geometry is compressed by Draco or meshopt.
    UnsupportedCompression = "UNSUPPORTED_COMPRESSION",
    /// An index names an object that does not exist.
    UnresolvedReference = "UNRESOLVED_REFERENCE",
    /// A node is its own ancestor.
    NodeLoop = "NODE_LOOP",
    /// A node has several parents.
    NodeParentOverride = "NODE_PARENT_OVERRIDE",
    /// The hierarchy of nodes is too deep.
    NodeTooDeep = "NODE_TOO_DEEP",
    /// A scene lists a node that has a parent.
    SceneNonRootNode = "SCENE_NON_ROOT_NODE",
    /// A node's transform is no finite affine map.
    NodeTransform = "NODE_INVALID_TRANSFORM",
    /// An accessor reaches past its buffer view.
    AccessorTooLong = "ACCESSOR_TOO_LONG",
    /// An accessor's type does not fit its use.
    AccessorFormat = "ACCESSOR_INVALID_FORMAT",
    /// A triangle index names a vertex that does not exist.
    AccessorIndexOob = "ACCESSOR_INDEX_OOB",
    /// A position is not finite.
    AccessorInvalidFloat = "ACCESSOR_INVALID_FLOAT",
    /// A sparse accessor replaces an element that does not exist.
    SparseIndexOob = "ACCESSOR_SPARSE_INDEX_OOB",
    /// Attributes of one primitive have different lengths.
    UnequalCounts = "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT",
    /// A buffer view reaches past its buffer.
    BufferViewTooLong = "BUFFER_VIEW_TOO_LONG",
    /// A buffer view's stride is smaller than what it strides over.
    BufferViewStride = "BUFFER_VIEW_INVALID_BYTE_STRIDE",
    /// A buffer holds fewer bytes than it declares.
    BufferTooShort = "BUFFER_BYTE_LENGTH_MISMATCH",
    /// A URI points outside the scene's folder, or off this machine.
    NonRelativeUri = "NON_RELATIVE_URI",
    /// A data URI is not base64.
    InvalidDataUri = "INVALID_DATA_URI",
    /// An image is of an unread format, cut short or damaged.
    InvalidImage = "IMAGE_DATA_INVALID",
    /// An image exceeds the limit on its size.
    ImageTooLarge = "IMAGE_TOO_LARGE",
    /// A number lies outside its range.
    ValueNotInRange = "VALUE_NOT_IN_RANGE",
}

impl fmt::Display for SceneErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
