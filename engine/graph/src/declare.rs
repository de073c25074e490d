//! What should happen in a frame: passes in order, each with the resources it uses.

use crate::resource::{Buffer, Extent, Format, Image, ImageDesc, Lifetime, Resource};
use crate::shader::{Access, Bind, Effects, Shader, Slot, Stages};
use crate::structure::{MeshRange, StructureInstance};
use std::sync::Arc;

/// One resource in one pass.
#[derive(Clone, Debug)]
pub struct Use {
    /// The resource.
    pub resource: Arc<Resource>,
    /// Where it is attached.
    pub slot: Slot,
    /// What is done with it.
    pub access: Access,
    /// In which stages.
    pub stages: Stages,
}

/// One draw of a raster pass; vertices are pulled from buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draw {
    /// How many vertices.
    pub vertices: u32,
    /// `gl_InstanceIndex`.
    pub instance: u32,
}

/// How many groups of a compute shader run.
#[derive(Clone, Copy, Debug)]
pub enum Over<'a> {
    /// One invocation for each texel.
    Texels(Extent),
    /// So many groups along x, y and z as stand in a buffer: three `u32` at the offset.
    Counted(&'a Buffer, u64),
}

/// What a pass does.
#[derive(Clone, Debug)]
pub enum Work {
    /// Runs a compute shader over so many groups.
    Compute {
        /// The shader.
        shader: &'static Shader,
        /// Push constants.
        params: Vec<u8>,
        /// Groups along x, y and z.
        groups: [u32; 3],
    },
    /// Runs a compute shader over a number of groups read from a buffer.
    ComputeIndirect {
        /// The shader.
        shader: &'static Shader,
        /// Push constants.
        params: Vec<u8>,
        /// Where the three group counts lie in the buffer used as [`Access::IndirectRead`].
        offset: u64,
    },
    /// Draws triangles into cleared attachments, the nearest kept (reversed depth: 1 near, 0 far).
    Raster {
        /// The shader.
        shader: &'static Shader,
        /// Push constants.
        params: Vec<u8>,
        /// The draws.
        draws: Arc<[Draw]>,
        /// Size of the attachments.
        extent: Extent,
    },
    /// Copies bytes of the host into a whole resource.
    Upload {
        /// The bytes; for images as in [`ImageDesc::bytes`].
        data: Arc<[u8]>,
    },
    /// Copies bytes of the host into a part of a buffer.
    Update {
        /// The bytes.
        data: Arc<[u8]>,
        /// Where in the buffer the first of them goes.
        offset: u64,
    },
    /// Copies a whole resource to the host.
    Download {
        /// What the result is asked for by.
        download: Download,
    },
    /// Copies a whole resource onto another of the same description.
    Copy,
    /// Fills a buffer with a 32-bit word, or an image with the float of the same bits.
    Fill {
        /// The word.
        word: u32,
    },
    /// Builds bottom levels over triangles. Its uses are indices, positions, and then in turn each structure and its
    /// scratch.
    BuildMeshes {
        /// Where each lies in the two buffers.
        meshes: Arc<[MeshRange]>,
    },
    /// Builds a top level. Its uses are the bottom levels, each once, then the structure and its scratch.
    BuildInstances {
        /// Each placement.
        instances: Arc<[StructureInstance]>,
    },
    /// Copies a bottom level into one without spare room.
    Compact,
}

impl Work {
    /// The shader, where there is one.
    pub fn shader(&self) -> Option<&'static Shader> {
        match self {
            Self::Compute { shader, .. } | Self::ComputeIndirect { shader, .. } | Self::Raster { shader, .. } => {
                Some(shader)
            }
            _ => None,
        }
    }
}

/// The promise of a resource's bytes after the frame has run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Download(pub u32);

/// One pass.
#[derive(Clone, Debug)]
pub struct Pass {
    /// Name in the plan, the timing table, debug labels and errors.
    pub name: String,
    /// Why it is there, for `explain`; empty if it always is.
    pub why: String,
    /// What it does.
    pub work: Work,
    /// What it uses.
    pub uses: Vec<Use>,
    /// The effects that it is specialised for: of those that its shader asks about, the ones that are called for.
    pub effects: Effects,
}

/// A frame: what should happen.
#[derive(Debug)]
pub struct Graph {
    pub(crate) passes: Vec<Pass>,
    pub(crate) exports: Vec<Arc<Resource>>,
    pub(crate) downloads: u32,
    why: String,
    effects: Effects,
}

impl Default for Graph {
    fn default() -> Self {
        Self { passes: Vec::new(), exports: Vec::new(), downloads: 0, why: String::new(), effects: Effects::ALL }
    }
}

impl Graph {
    /// An empty frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// An image that lives until its last use in this frame.
    pub fn image(&mut self, name: impl Into<String>, format: Format, extent: Extent) -> Image {
        Image::new(name, ImageDesc::new(format, extent), Lifetime::Frame)
    }

    /// A buffer that lives until its last use in this frame.
    pub fn buffer(&mut self, name: impl Into<String>, bytes: u64) -> Buffer {
        Buffer::new(name, bytes, Lifetime::Frame)
    }

    /// Says why the passes declared from here on are there; the next call replaces it.
    pub fn because(&mut self, why: impl Into<String>) {
        self.why = why.into();
    }

    /// Says which effects the passes declared from here on are called for; the next call replaces it. At first it is all.
    pub fn specialize(&mut self, effects: Effects) {
        self.effects = effects;
    }

    /// Runs a compute shader with one invocation for each texel of `extent`.
    pub fn pass<B: Bind>(&mut self, bind: B, params: B::Params, extent: Extent) {
        self.pass_named(B::SHADER.name, bind, params, extent);
    }

    /// As [`Graph::pass`], under another name, for a shader that serves twice in a frame.
    pub fn pass_named<B: Bind>(&mut self, name: impl Into<String>, bind: B, params: B::Params, extent: Extent) {
        let [x, y, z] = B::SHADER.group;
        let groups = [extent.width.div_ceil(x), extent.height.div_ceil(y), extent.depth.div_ceil(z)];
        let params = B::params_bytes(&params);
        let uses = uses_of(&bind);
        self.push(name, Work::Compute { shader: B::SHADER, params, groups }, uses);
    }

    /// Runs a compute shader over the groups counted in `arguments` (three `u32` at `offset`).
    pub fn pass_indirect<B: Bind>(&mut self, bind: B, params: B::Params, arguments: &Buffer, offset: u64) {
        self.pass_indirect_named(B::SHADER.name, bind, params, arguments, offset);
    }

    /// As [`Graph::pass_indirect`], under another name, for a shader that serves twice in a frame.
    pub fn pass_indirect_named<B: Bind>(
        &mut self,
        name: impl Into<String>,
        bind: B,
        params: B::Params,
        arguments: &Buffer,
        offset: u64,
    ) {
        let params = B::params_bytes(&params);
        let mut uses = uses_of(&bind);
        uses.push(Use {
            resource: arguments.resource.clone(),
            slot: Slot::None,
            access: Access::IndirectRead,
            stages: Stages::INDIRECT,
        });
        self.push(name, Work::ComputeIndirect { shader: B::SHADER, params, offset }, uses);
    }

    /// Runs a compute shader over what there is known of here or there.
    pub fn pass_over<B: Bind>(&mut self, bind: B, params: B::Params, over: Over) {
        match over {
            Over::Texels(extent) => self.pass(bind, params, extent),
            Over::Counted(arguments, offset) => self.pass_indirect(bind, params, arguments, offset),
        }
    }

    /// Draws into the attachments in `bind`, all of size `extent`, cleared first: colours to 0, depth to 0 (far).
    pub fn raster<B: Bind>(&mut self, bind: B, params: B::Params, draws: Arc<[Draw]>, extent: Extent) {
        let params = B::params_bytes(&params);
        let uses = uses_of(&bind);
        self.push(B::SHADER.name, Work::Raster { shader: B::SHADER, params, draws, extent }, uses);
    }

    /// Copies `data` into the whole of `buffer`.
    ///
    /// # Panics
    /// If the sizes differ: a mistake of the pass's author, not of any input.
    pub fn upload(&mut self, buffer: &mut Buffer, data: impl Into<Arc<[u8]>>) {
        self.upload_resource(&buffer.resource, data.into());
    }

    /// Copies `data` into `buffer` from byte `offset` on, and leaves the rest of it as it is.
    ///
    /// # Panics
    /// If there is no such part of the buffer, or no data: a mistake of the pass's author, not of any input.
    pub fn update(&mut self, buffer: &mut Buffer, offset: u64, data: impl Into<Arc<[u8]>>) {
        let (resource, data) = (&buffer.resource, data.into());
        let end = offset.saturating_add(data.len() as u64);
        let is_part = offset < end && end <= buffer.desc.bytes;
        assert!(is_part, "update of {}: it has no bytes {offset}..{end}", resource.name);
        let uses = vec![transfer(resource, Access::TransferUpdate)];
        self.push(format!("update {}", resource.name), Work::Update { data, offset }, uses);
    }

    /// Copies `data` into the whole of `image`, laid out as in [`ImageDesc::bytes`].
    ///
    /// # Panics
    /// If the sizes differ: a mistake of the pass's author, not of any input.
    pub fn upload_image(&mut self, image: &mut Image, data: impl Into<Arc<[u8]>>) {
        self.upload_resource(&image.resource, data.into());
    }

    fn upload_resource(&mut self, resource: &Arc<Resource>, data: Arc<[u8]>) {
        assert_eq!(resource.bytes(), data.len() as u64, "upload of {}: the data has another size", resource.name);
        let uses = vec![transfer(resource, Access::TransferWrite)];
        self.push(format!("upload {}", resource.name), Work::Upload { data }, uses);
    }

    /// Copies `buffer` to the host once it is final for this frame.
    pub fn download(&mut self, buffer: &Buffer) -> Download {
        self.download_resource(&buffer.resource)
    }

    /// Copies `image` to the host, laid out as in [`ImageDesc::bytes`].
    pub fn download_image(&mut self, image: &Image) -> Download {
        self.download_resource(&image.resource)
    }

    fn download_resource(&mut self, resource: &Arc<Resource>) -> Download {
        let download = Download(self.downloads);
        self.downloads += 1;
        let uses = vec![transfer(resource, Access::TransferRead)];
        self.push(format!("download {}", resource.name), Work::Download { download }, uses);
        download
    }

    /// Copies the whole of one image onto another of the same description.
    ///
    /// # Panics
    /// If the descriptions differ: a mistake of the pass's author, not of any input.
    pub fn copy_image(&mut self, from: &Image, to: &mut Image) {
        assert_eq!(from.desc, to.desc, "copy of {} onto {}: they differ", from.resource.name, to.resource.name);
        let uses = vec![transfer(&from.resource, Access::TransferRead), transfer(&to.resource, Access::TransferWrite)];
        self.push(format!("copy {}", from.resource.name), Work::Copy, uses);
    }

    /// Fills a buffer whose size is a multiple of four bytes with a word.
    pub fn fill(&mut self, buffer: &mut Buffer, word: u32) {
        let uses = vec![transfer(&buffer.resource, Access::TransferWrite)];
        self.push(format!("fill {}", buffer.resource.name), Work::Fill { word }, uses);
    }

    /// Sets every channel of an image.
    pub fn clear(&mut self, image: &mut Image, value: f32) {
        let uses = vec![transfer(&image.resource, Access::TransferWrite)];
        self.push(format!("clear {}", image.resource.name), Work::Fill { word: value.to_bits() }, uses);
    }

    /// Keeps an image of this frame, and what it is made from, from being culled: the host reads it.
    pub fn export(&mut self, image: &Image) {
        self.exports.push(image.resource.clone());
    }

    /// The passes declared so far.
    pub fn passes(&self) -> &[Pass] {
        &self.passes
    }

    /// Runs one shader wherever another is declared, so that two forms of a pass can be compared in the same frame; returns how
    /// often it was. Both have the same bindings, parameters and groups, or nothing is exchanged.
    pub fn exchange(&mut self, declared: &'static Shader, other: &'static Shader) -> usize {
        let interface = |of: &'static Shader| (of.bindings, of.params_bytes, of.group, of.outputs, of.effects);
        if interface(declared) != interface(other) {
            return 0;
        }
        let mut exchanged = 0;
        for pass in &mut self.passes {
            if let Work::Compute { shader, .. } | Work::ComputeIndirect { shader, .. } | Work::Raster { shader, .. } =
                &mut pass.work
                && std::ptr::eq(*shader, declared)
            {
                *shader = other;
                exchanged += 1;
            }
        }
        exchanged
    }

    /// Copies to a resource what the passes declared since there were so many would make of it, in their place: under the name of
    /// the last of them, and for another reason.
    ///
    /// # Panics
    /// If the sizes differ: a mistake of the pass's author, not of any input.
    pub fn upload_instead(&mut self, passes: usize, resource: &Arc<Resource>, data: Arc<[u8]>, why: &str) {
        let name = self.passes.last().filter(|_| passes < self.passes.len()).map(|pass| pass.name.clone());
        self.passes.truncate(passes);
        self.upload_resource(resource, data);
        if let Some(upload) = self.passes.last_mut() {
            why.clone_into(&mut upload.why);
            upload.name = name.unwrap_or_else(|| std::mem::take(&mut upload.name));
        }
    }

    /// Appends a pass of another graph with other work: everything else is as there.
    pub fn push_with(&mut self, pass: &Pass, work: Work) {
        self.passes.push(Pass { work, ..pass.clone() });
    }

    /// Appends a pass as it is. Passes of shaders are better declared with [`Graph::pass`], whose uses cannot be wrong.
    pub fn push(&mut self, name: impl Into<String>, work: Work, uses: Vec<Use>) {
        let effects = work.shader().map_or(Effects::NONE, |shader| shader.effects.intersection(self.effects));
        self.passes.push(Pass { name: name.into(), why: self.why.clone(), work, uses, effects });
    }
}

fn uses_of<B: Bind>(bind: &B) -> Vec<Use> {
    let mut uses = Vec::new();
    bind.visit(&mut |resource, slot, access, stages| {
        uses.push(Use { resource: resource.clone(), slot, access, stages });
    });
    uses
}

fn transfer(resource: &Arc<Resource>, access: Access) -> Use {
    Use { resource: resource.clone(), slot: Slot::None, access, stages: Stages::TRANSFER }
}
