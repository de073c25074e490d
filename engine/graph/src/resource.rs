//! Images and buffers: handles that say what a resource is, not where it lies.

use crate::structure::StructureDesc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Size of an image in texels, or of a dispatch in invocations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Extent {
    /// Texels along x.
    pub width: u32,
    /// Texels along y.
    pub height: u32,
    /// Texels along z: 1 for all but volumes.
    pub depth: u32,
}

impl Extent {
    /// A flat extent.
    pub const fn new(width: u32, height: u32) -> Self {
        Self { width, height, depth: 1 }
    }

    /// A row of invocations, for passes over a list.
    pub const fn line(count: u32) -> Self {
        Self { width: count, height: 1, depth: 1 }
    }

    /// A volume.
    pub const fn volume(width: u32, height: u32, depth: u32) -> Self {
        Self { width, height, depth }
    }

    /// How many texels there are.
    pub const fn texels(self) -> u64 {
        (self.width as u64 * self.height as u64).saturating_mul(self.depth as u64)
    }
}

/// How one texel is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Four 8-bit values in 0..1.
    Rgba8,
    /// Four 8-bit values, red, green and blue sRGB-encoded; read as linear values.
    Rgba8Srgb,
    /// One 32-bit unsigned integer.
    R32Uint,
    /// Two 32-bit unsigned integers.
    Rg32Uint,
    /// One 32-bit float.
    R32Float,
    /// Two 32-bit floats.
    Rg32Float,
    /// Four 16-bit floats.
    Rgba16Float,
    /// Four 32-bit floats.
    Rgba32Float,
    /// A 32-bit float depth buffer.
    Depth32,
}

impl Format {
    /// Bytes of one texel.
    pub const fn bytes(self) -> u64 {
        match self {
            Self::Rgba8 | Self::Rgba8Srgb | Self::R32Uint | Self::R32Float | Self::Depth32 => 4,
            Self::Rg32Uint | Self::Rg32Float | Self::Rgba16Float => 8,
            Self::Rgba32Float => 16,
        }
    }
}

/// What an image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageDesc {
    /// Storage of one texel.
    pub format: Format,
    /// Size of the first level; a depth above 1 makes a volume.
    pub extent: Extent,
    /// Levels of detail, at least 1.
    pub mips: u32,
    /// Array layers: 0 is an image without layers, 1 or more an array of them.
    pub layers: u32,
}

impl ImageDesc {
    /// A flat image of one level and no layers.
    pub const fn new(format: Format, extent: Extent) -> Self {
        Self { format, extent, mips: 1, layers: 0 }
    }

    /// Bytes of all texels, tightly packed: what an upload carries (level by level, and in each level layer by layer).
    pub fn bytes(&self) -> u64 {
        let Extent { width, height, depth } = self.extent;
        if self.extent.texels() == 0 {
            return 0;
        }
        let level = |mip: u32| {
            let size = |texels: u32| texels.checked_shr(mip).unwrap_or(0).max(1);
            Extent::volume(size(width), size(height), size(depth)).texels()
        };
        let texels = (0..self.mips).fold(0, |sum: u64, mip| sum.saturating_add(level(mip)));
        texels.saturating_mul(self.format.bytes()).saturating_mul(u64::from(self.layers.max(1)))
    }
}

/// What a buffer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferDesc {
    /// Size, at least 1.
    pub bytes: u64,
}

/// How long the content of a resource is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Lifetime {
    /// Until its last use in the frame that declared it; its memory is shared with others.
    Frame,
    /// Until the settings it was built for change.
    Settings,
    /// As long as the scene.
    Scene,
    /// The host's: it brings the memory and keeps it.
    Host,
}

impl Lifetime {
    /// The word used in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frame => "frame",
            Self::Settings => "settings",
            Self::Scene => "scene",
            Self::Host => "host",
        }
    }
}

/// Identity of a resource, unique in the process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ResourceId(pub u64);

/// What resources differ in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Description {
    /// An image.
    Image(ImageDesc),
    /// A buffer.
    Buffer(BufferDesc),
    /// An acceleration structure.
    Structure(StructureDesc),
    /// Working space for a build of such a structure.
    Scratch(StructureDesc),
}

/// What stands behind a handle. Executors key their memory by [`Resource::id`] and may free it once no handle is left.
#[derive(Debug)]
pub struct Resource {
    /// Identity.
    pub id: ResourceId,
    /// Name in plans, labels, reports and errors.
    pub name: String,
    /// What it is.
    pub description: Description,
    /// How long its content is needed.
    pub lifetime: Lifetime,
}

impl Resource {
    pub(crate) fn new(name: impl Into<String>, description: Description, lifetime: Lifetime) -> Arc<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        let id = ResourceId(NEXT.fetch_add(1, Ordering::Relaxed));
        Arc::new(Self { id, name: name.into(), description, lifetime })
    }

    /// The bytes its content takes, tightly packed; a guess for what only the device knows the size of.
    pub fn bytes(&self) -> u64 {
        match &self.description {
            Description::Image(image) => image.bytes(),
            Description::Buffer(buffer) => buffer.bytes,
            Description::Structure(structure) | Description::Scratch(structure) => structure.bytes(),
        }
    }
}

/// An image. Neither `Copy` nor `Clone`: a pass that takes `&Image` reads it, one that takes `&mut Image` writes it.
#[derive(Debug)]
pub struct Image {
    pub(crate) resource: Arc<Resource>,
    pub(crate) desc: ImageDesc,
}

impl Image {
    /// An image that outlives the frame. Its memory is allocated at its first use and freed after the last handle is dropped.
    pub fn new(name: impl Into<String>, desc: ImageDesc, lifetime: Lifetime) -> Self {
        Self { resource: Resource::new(name, Description::Image(desc), lifetime), desc }
    }

    /// What it is.
    pub fn desc(&self) -> ImageDesc {
        self.desc
    }

    /// Size of its first level.
    pub fn extent(&self) -> Extent {
        self.desc.extent
    }

    /// What stands behind the handle.
    pub fn resource(&self) -> &Arc<Resource> {
        &self.resource
    }
}

/// A buffer. Neither `Copy` nor `Clone`: a pass that takes `&Buffer` reads it, one that takes `&mut Buffer` writes it.
#[derive(Debug)]
pub struct Buffer {
    pub(crate) resource: Arc<Resource>,
    pub(crate) desc: BufferDesc,
}

impl Buffer {
    /// A buffer that outlives the frame. Its memory is allocated at its first use and freed after the last handle is dropped.
    pub fn new(name: impl Into<String>, bytes: u64, lifetime: Lifetime) -> Self {
        let desc = BufferDesc { bytes };
        Self { resource: Resource::new(name, Description::Buffer(desc), lifetime), desc }
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.desc.bytes
    }

    /// What stands behind the handle.
    pub fn resource(&self) -> &Arc<Resource> {
        &self.resource
    }
}
