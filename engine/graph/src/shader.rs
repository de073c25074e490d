//! What a compiled shader says of itself. The build writes these from the SPIR-V; nothing here is written by hand.

use crate::resource::Resource;
use std::ops::BitOr;
use std::sync::Arc;

/// One programmable stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// A compute shader.
    Compute,
    /// A vertex shader.
    Vertex,
    /// A fragment shader.
    Fragment,
}

/// A set of places in the pipeline where a use may happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct Stages(u32);

impl Stages {
    /// Nowhere.
    pub const NONE: Self = Self(0);
    /// Compute shaders.
    pub const COMPUTE: Self = Self(1);
    /// Vertex shaders.
    pub const VERTEX: Self = Self(1 << 1);
    /// Fragment shaders.
    pub const FRAGMENT: Self = Self(1 << 2);
    /// Writes of colour attachments.
    pub const COLOR_OUTPUT: Self = Self(1 << 3);
    /// Depth tests and writes.
    pub const DEPTH_TEST: Self = Self(1 << 4);
    /// Copies and fills.
    pub const TRANSFER: Self = Self(1 << 5);
    /// Builds of acceleration structures.
    pub const BUILD: Self = Self(1 << 6);
    /// The fetch of indirect arguments.
    pub const INDIRECT: Self = Self(1 << 7);

    /// The bits.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether every stage of `other` is among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether there are none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Each of these stages alone.
    pub fn iter(self) -> impl Iterator<Item = Self> {
        (0..u32::BITS).map(|bit| Self(1 << bit)).filter(move |&stage| self.contains(stage))
    }

    /// These and those.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOr for Stages {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

/// What a use does with the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Access {
    /// A storage image or buffer is read.
    StorageRead,
    /// A storage image or buffer is written without being read.
    StorageWrite,
    /// A storage image or buffer is read and written.
    StorageReadWrite,
    /// A texture is read.
    Sampled,
    /// A uniform buffer is read.
    Uniform,
    /// A colour attachment is cleared and written.
    ColorWrite,
    /// A depth attachment is cleared, tested and written.
    DepthWrite,
    /// A copy reads.
    TransferRead,
    /// A copy or a fill writes all of it.
    TransferWrite,
    /// A copy writes a part of it, and the rest stays.
    TransferUpdate,
    /// Arguments of an indirect dispatch are read.
    IndirectRead,
    /// An acceleration-structure build reads its inputs.
    BuildRead,
    /// An acceleration-structure build writes the structure or its scratch.
    BuildWrite,
    /// A shader traverses an acceleration structure.
    Traverse,
}

impl Access {
    /// Whether the bytes may change.
    pub const fn writes(self) -> bool {
        matches!(
            self,
            Self::StorageWrite
                | Self::StorageReadWrite
                | Self::ColorWrite
                | Self::DepthWrite
                | Self::TransferWrite
                | Self::TransferUpdate
                | Self::BuildWrite
        )
    }

    /// Whether what was there before matters.
    pub const fn reads(self) -> bool {
        !matches!(
            self,
            Self::StorageWrite | Self::ColorWrite | Self::DepthWrite | Self::TransferWrite | Self::BuildWrite
        )
    }
}

/// How a texture is filtered and what lies beyond its border; chosen by the sampler's name in the GLSL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampler {
    /// `sampler nearest`: nearest texel, clamped to the edge.
    Nearest,
    /// `sampler linear`: linear in texels and levels, clamped to the edge.
    Linear,
    /// `sampler linear_wrap_u`: as `linear`, repeated along u: equirectangular maps.
    LinearWrapU,
}

/// What a shader's binding holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BindingKind {
    /// An image read through a sampler or by texel.
    SampledImage,
    /// An image read or written by texel.
    StorageImage,
    /// A storage buffer.
    StorageBuffer,
    /// A uniform buffer.
    UniformBuffer,
    /// The top level of an acceleration structure.
    AccelerationStructure,
    /// A sampler; the executor supplies it.
    Sampler(Sampler),
}

/// One binding of descriptor set 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name in the GLSL.
    pub name: &'static str,
    /// The number in `layout(binding = N)`.
    pub slot: u32,
    /// What it holds.
    pub kind: BindingKind,
    /// What the shader does with it. Unused for samplers.
    pub access: Access,
    /// The stages that mention it.
    pub stages: Stages,
}

/// The code of one stage.
#[derive(Debug)]
pub struct StageCode {
    /// Which stage.
    pub stage: Stage,
    /// SPIR-V, with entry point `main`.
    pub spirv: &'static [u32],
}

/// A set of effects that a frame may call for, a bit each: what a shader does for an effect that is not called for is not compiled into
/// its pipeline. The bits are the numbers in `layout(constant_id = N)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Effects(u32);

impl Effects {
    /// None.
    pub const NONE: Self = Self(0);
    /// Every one.
    pub const ALL: Self = Self(u32::MAX);

    /// The one with the specialisation constant `id`, below 32.
    pub const fn one(id: u32) -> Self {
        Self(1 << id)
    }

    /// The bits.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether every one of `other` is among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether there are none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// These and those.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// What is among both.
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// These, and those if `called_for`.
    pub const fn and_if(self, called_for: bool, other: Self) -> Self {
        if called_for { self.union(other) } else { self }
    }

    /// These without those.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Each alone.
    pub fn iter(self) -> impl Iterator<Item = Self> {
        (0..u32::BITS).map(Self::one).filter(move |&one| self.contains(one))
    }
}

impl BitOr for Effects {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

/// A compiled shader: one compute stage, or a vertex and a fragment stage.
#[derive(Debug)]
pub struct Shader {
    /// File stem: the pass's name everywhere.
    pub name: &'static str,
    /// What the per-variant include resolved to, as `method=wang2020`; empty without variants.
    pub variant: &'static str,
    /// Its stages.
    pub stages: &'static [StageCode],
    /// Invocations in a group of a compute shader; 1, 1, 1 otherwise.
    pub group: [u32; 3],
    /// Its bindings, by slot.
    pub bindings: &'static [Binding],
    /// Bytes of push constants.
    pub params_bytes: u32,
    /// Names of the fragment stage's outputs, by location.
    pub outputs: &'static [&'static str],
    /// The effects that its code asks about.
    pub effects: Effects,
}

/// Where a use is attached to its shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// A descriptor: the number in `layout(binding = N)`.
    Binding(u32),
    /// A colour attachment: the number in `layout(location = N) out`.
    Color(u32),
    /// The depth attachment.
    Depth,
    /// Neither: copies, builds, indirect arguments.
    None,
}

/// The resources of one shader; generated as `shaders::<stem>::Bind`.
pub trait Bind {
    /// The shader.
    const SHADER: &'static Shader;
    /// Its push constants; `()` where it has none.
    type Params;
    /// Calls `visit` for each resource with its slot, access and stages, in slot order.
    #[expect(clippy::type_complexity, reason = "an alias would hide from implementors what they are to call")]
    fn visit(&self, visit: &mut dyn FnMut(&Arc<Resource>, Slot, Access, Stages));
    /// The push constants as bytes, each member at its offset in the GLSL block.
    fn params_bytes(params: &Self::Params) -> Vec<u8>;
}
