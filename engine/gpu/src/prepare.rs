//! A plan made ready: every pass checked against the device and turned into commands that cannot fail.
//!
//! All that may go wrong happens here, before the first command is recorded, so that an error leaves the command buffer
//! of a host as it was.

use crate::descriptors::write_set;
use crate::device::Device;
use crate::error::Error;
use crate::memory::{BufferObject, ImageObject, Object};
use crate::pipeline::{Attachments, Pipeline, Pipelines};
use crate::structures::{self, Build, INDEX_BYTES, StructureObject, VERTEX_BYTES};
use crate::vulkan_types as to_vk;
use ash::vk;
use mica_graph::{
    Access, Description, Download, Draw, Extent, MeshRange, Pass, Plan, ResourceId, Shader, Slot, Stage, StructureDesc,
    StructureInstance, Use, Work,
};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

/// What a pass does, in handles.
pub(crate) enum Command<'a> {
    Compute {
        program: Program<'a>,
        groups: [u32; 3],
    },
    ComputeIndirect {
        program: Program<'a>,
        arguments: vk::Buffer,
        offset: u64,
    },
    Raster {
        program: Program<'a>,
        draws: &'a [Draw],
        extent: Extent,
        targets: Targets,
    },
    /// Some bytes of staging memory into a resource.
    Upload {
        to: Object,
        bytes: Range<usize>,
        data: &'a [u8],
    },
    /// Some bytes of staging memory into a part of a buffer.
    Update {
        to: vk::Buffer,
        offset: u64,
        bytes: Range<usize>,
        data: &'a [u8],
    },
    /// A resource into some bytes of staging memory.
    Download {
        from: Object,
        bytes: Range<usize>,
        download: Download,
    },
    Copy {
        from: Object,
        to: Object,
    },
    Fill {
        to: Object,
        word: u32,
    },
    /// Bottom levels, and the first of the queries for what they need once they are compacted.
    BuildMeshes {
        builds: Vec<Build>,
        first_query: u32,
    },
    /// A top level, from records in staging memory.
    BuildInstances {
        build: Build,
        records: Vec<u8>,
        bytes: Range<usize>,
    },
    Compact {
        from: vk::AccelerationStructureKHR,
        to: vk::AccelerationStructureKHR,
    },
}

/// A pipeline with its resources and push constants.
pub(crate) struct Program<'a> {
    pub(crate) pipeline: Pipeline,
    pub(crate) set: vk::DescriptorSet,
    pub(crate) params: &'a [u8],
}

/// What a raster pass draws into.
pub(crate) struct Targets {
    pub(crate) colors: Vec<vk::ImageView>,
    pub(crate) depth: Option<vk::ImageView>,
}

/// The commands of a plan, one for each pass, and the staging memory that they need.
pub(crate) struct Prepared<'a> {
    pub(crate) commands: Vec<Command<'a>>,
    pub(crate) staging_bytes: usize,
    /// Queries for sizes of compacted structures.
    pub(crate) size_queries: u32,
}

/// Bytes at the start of staging memory where isolated frames note which pass has begun, by its index plus 1. It is read
/// when a frame does not end: timestamps cannot be, as lavapipe waits for the device before it gives any.
pub(crate) const MARKER_BYTES: usize = 16;

/// Offsets in staging memory suit every format: the largest texel has 16 bytes.
const STAGING_ALIGNMENT: usize = 16;

/// Prepares all passes. `was_built` knows the structures that frames before have built.
pub(crate) fn prepare<'a>(
    device: &Device,
    pipelines: &mut Pipelines,
    pool: vk::DescriptorPool,
    plan: &'a Plan,
    objects: &HashMap<ResourceId, Object>,
    was_built: &dyn Fn(ResourceId) -> bool,
) -> Result<Prepared<'a>, Error> {
    let mut built = HashSet::new();
    let commands = Vec::with_capacity(plan.passes.len());
    let mut prepared = Prepared { commands, staging_bytes: MARKER_BYTES, size_queries: 0 };
    for pass in &plan.passes {
        let (staging, size_queries) = (&mut prepared.staging_bytes, &mut prepared.size_queries);
        let is_built = &|id| built.contains(&id) || was_built(id);
        let mut context = Preparation { device, pipelines, pool, pass, objects, is_built, staging, size_queries };
        let command = context.command()?;
        prepared.commands.push(command);
        let written = pass.uses.iter().filter(|used| used.access == Access::BuildWrite);
        built.extend(written.map(|used| used.resource.id));
    }
    Ok(prepared)
}

/// One pass on its way to a command.
pub(crate) struct Preparation<'a, 'b> {
    pub(crate) device: &'b Device,
    pipelines: &'b mut Pipelines,
    pub(crate) pool: vk::DescriptorPool,
    pub(crate) pass: &'a Pass,
    objects: &'b HashMap<ResourceId, Object>,
    /// Whether a frame or a pass before has built a structure.
    is_built: &'b dyn Fn(ResourceId) -> bool,
    staging: &'b mut usize,
    size_queries: &'b mut u32,
}

impl<'a> Preparation<'a, '_> {
    fn command(&mut self) -> Result<Command<'a>, Error> {
        for used in &self.pass.uses {
            self.check_use(used)?;
        }
        match &self.pass.work {
            Work::Compute { shader, params, groups } => {
                let most = self.device.info.limits.max_groups;
                if groups.iter().zip(most).any(|(groups, most)| *groups > most) {
                    return Err(self.bad_pass(format!("{groups:?} groups are more than this device runs, {most:?}")));
                }
                self.check_stages(shader, &[Stage::Compute])?;
                Ok(Command::Compute {
                    program: self.program(shader, params, &Attachments::default())?,
                    groups: *groups,
                })
            }
            Work::ComputeIndirect { shader, params, offset } => {
                self.check_stages(shader, &[Stage::Compute])?;
                let used = self.used_as(Access::IndirectRead)?;
                let Object::Buffer(arguments) = self.object(used)? else {
                    return Err(self.bad_use(used, "group counts lie in a buffer"));
                };
                if offset % 4 != 0 || offset.checked_add(12).is_none_or(|end| end > arguments.bytes) {
                    return Err(self.bad_use(used, "it holds no three group counts at the offset"));
                }
                let program = self.program(shader, params, &Attachments::default())?;
                Ok(Command::ComputeIndirect { program, arguments: arguments.buffer, offset: *offset })
            }
            Work::Raster { shader, params, draws, extent } => {
                self.check_stages(shader, &[Stage::Vertex, Stage::Fragment])?;
                let (attachments, targets) = self.targets(shader)?;
                let program = self.program(shader, params, &attachments)?;
                Ok(Command::Raster { program, draws, extent: *extent, targets })
            }
            Work::Upload { data } => {
                let used = self.used_as(Access::TransferWrite)?;
                if data.len() as u64 != used.resource.bytes() {
                    return Err(self.bad_use(used, "the data has another size"));
                }
                Ok(Command::Upload { to: self.object(used)?, bytes: self.stage(used)?, data })
            }
            Work::Update { data, offset } => {
                let used = self.used_as(Access::TransferUpdate)?;
                let (to, count) = (self.buffer(used)?, data.len() as u64);
                if count == 0 || offset.checked_add(count).is_none_or(|end| end > to.bytes) {
                    return Err(self.bad_use(used, "the data is no part of it"));
                }
                let bytes = self.stage_bytes(used, count)?;
                Ok(Command::Update { to: to.buffer, offset: *offset, bytes, data })
            }
            Work::Download { download } => {
                let used = self.used_as(Access::TransferRead)?;
                Ok(Command::Download { from: self.object(used)?, bytes: self.stage(used)?, download: *download })
            }
            Work::Copy => {
                let (from, to) = (self.used_as(Access::TransferRead)?, self.used_as(Access::TransferWrite)?);
                if from.resource.description != to.resource.description {
                    return Err(self.bad_use(to, "a copy goes to a resource of the same description"));
                }
                Ok(Command::Copy { from: self.object(from)?, to: self.object(to)? })
            }
            Work::Fill { word } => {
                let used = self.used_as(Access::TransferWrite)?;
                let to = self.object(used)?;
                if matches!(to, Object::Buffer(buffer) if buffer.bytes % 4 != 0) {
                    return Err(self.bad_use(used, "its size is no multiple of four bytes"));
                }
                Ok(Command::Fill { to, word: *word })
            }
            Work::BuildMeshes { meshes } => self.build_meshes(meshes),
            Work::BuildInstances { instances } => self.build_instances(instances),
            Work::Compact => {
                let (from, to) = (self.used_as(Access::BuildRead)?, self.used_as(Access::BuildWrite)?);
                Ok(Command::Compact { from: self.structure(from)?.raw, to: self.structure(to)?.raw })
            }
        }
    }

    fn build_meshes(&mut self, meshes: &[MeshRange]) -> Result<Command<'a>, Error> {
        let [indices, positions, written @ ..] = &self.pass.uses[..] else {
            return Err(self.bad_pass("it uses no indices and positions".to_owned()));
        };
        let (pairs, rest) = written.as_chunks::<2>();
        if !rest.is_empty() || pairs.len() != meshes.len() {
            return Err(self.bad_pass(format!("{} uses do not make {} builds", written.len(), meshes.len())));
        }
        let read = [self.buffer(indices)?, self.buffer(positions)?];
        let addresses = read.map(|buffer| structures::address(self.device, buffer.buffer));
        let mut builds = Vec::with_capacity(meshes.len());
        for ([structure, scratch], range) in pairs.iter().zip(meshes) {
            let Description::Structure(StructureDesc::Triangles(desc)) = &structure.resource.description else {
                return Err(self.bad_use(structure, "it is not made over triangles"));
            };
            let first = [u64::from(range.first_index) * INDEX_BYTES, u64::from(range.first_vertex) * VERTEX_BYTES];
            let counts = [3 * u64::from(desc.triangles) * INDEX_BYTES, u64::from(desc.vertices) * VERTEX_BYTES];
            if (0..2).any(|which| first[which] + counts[which] > read[which].bytes) {
                return Err(self.bad_use(structure, "its mesh does not lie within the indices and positions"));
            }
            let to = self.structure(structure)?;
            let addresses = [addresses[0] + first[0], addresses[1] + first[1]];
            builds.push(Build::over_triangles(self.device, desc, addresses, &to, self.buffer(scratch)?));
        }
        let first_query = *self.size_queries;
        *self.size_queries += builds.len() as u32;
        Ok(Command::BuildMeshes { builds, first_query })
    }

    fn build_instances(&mut self, instances: &[StructureInstance]) -> Result<Command<'a>, Error> {
        let [.., to, scratch] = &self.pass.uses[..] else {
            return Err(self.bad_pass("it uses no structure and no scratch".to_owned()));
        };
        let count = match &to.resource.description {
            Description::Structure(StructureDesc::Instances { count }) if *count as usize == instances.len() => *count,
            _ => return Err(self.bad_use(to, &format!("it is not made over {} instances", instances.len()))),
        };
        let address = |instance: &StructureInstance| match self.objects.get(&instance.structure) {
            Some(Object::Structure(structure)) => Some(structure.address),
            _ => None,
        };
        let records = structures::instance_records(instances, address).map_err(|why| self.bad_pass(why))?;
        let build = Build::over_instances(self.device, count, &self.structure(to)?, self.buffer(scratch)?);
        let bytes = self.stage_bytes(to, records.len() as u64)?;
        Ok(Command::BuildInstances { build, records, bytes })
    }

    /// Whether the resource was made for its use.
    fn check_use(&self, used: &Use) -> Result<(), Error> {
        if let Description::Structure(desc) = &used.resource.description {
            self.check_structure(used, desc)?;
        }
        let buffers_only = matches!(
            used.access,
            Access::Uniform | Access::IndirectRead | Access::BuildRead | Access::BuildWrite | Access::Traverse
        );
        let structures_also = matches!(used.access, Access::BuildRead | Access::BuildWrite);
        let images_only = matches!(used.access, Access::Sampled | Access::ColorWrite | Access::DepthWrite);
        match self.object(used)? {
            Object::Image(_) if buffers_only => Err(self.bad_use(used, "it is an image")),
            Object::Buffer(_) if images_only || used.access == Access::Traverse => {
                Err(self.bad_use(used, "it is a buffer"))
            }
            Object::Structure(_) if !structures_also && used.access != Access::Traverse => {
                Err(self.bad_use(used, "it is an acceleration structure"))
            }
            Object::Image(image) if !image.usage.contains(to_vk::image_usage(&BTreeSet::from([used.access]))) => {
                let why = format!("this device has no {:?} images for {:?}", image.desc.format, used.access);
                Err(self.bad_use(used, &why))
            }
            _ => Ok(()),
        }
    }

    /// Whether a structure that is read has been built, and is of the level that is wanted.
    fn check_structure(&self, used: &Use, desc: &StructureDesc) -> Result<(), Error> {
        let is_top = matches!(desc, StructureDesc::Instances { .. });
        match used.access {
            Access::Traverse if !is_top => {
                Err(self.bad_use(used, "rays are asked of a top level, and it is a bottom level"))
            }
            Access::BuildRead if is_top => Err(self.bad_use(used, "it is a top level")),
            access if access.reads() && !(self.is_built)(used.resource.id) => {
                Err(self.bad_use(used, "nothing has built it"))
            }
            _ => Ok(()),
        }
    }

    fn check_stages(&self, shader: &Shader, wanted: &[Stage]) -> Result<(), Error> {
        let has = |stage: &Stage| shader.stages.iter().any(|code| code.stage == *stage);
        if shader.stages.len() == wanted.len() && wanted.iter().all(has) {
            return Ok(());
        }
        Err(self.bad_pass(format!("shader {} does not have the stages {wanted:?}", shader.name)))
    }

    fn program(
        &mut self,
        shader: &'static Shader,
        params: &'a [u8],
        attachments: &Attachments,
    ) -> Result<Program<'a>, Error> {
        if params.len() != shader.params_bytes as usize {
            let (given, wants) = (params.len(), shader.params_bytes);
            return Err(self.bad_pass(format!("{given} bytes of push constants for a shader of {wants}")));
        }
        let pipeline = self.pipelines.get(&self.pass.name, shader, self.pass.effects, attachments)?;
        let set = write_set(self, shader, &pipeline)?;
        Ok(Program { pipeline, set, params })
    }

    fn targets(&self, shader: &Shader) -> Result<(Attachments, Targets), Error> {
        let mut attachments = Attachments::default();
        let mut targets = Targets { colors: Vec::new(), depth: None };
        for (location, name) in shader.outputs.iter().enumerate() {
            let location = location as u32;
            let found = self.pass.uses.iter().find(|used| used.slot == Slot::Color(location));
            let Some(used) = found else {
                let (pass, binding) = (self.pass.name.clone(), format!("output {name}"));
                return Err(Error::MissingBinding { pass, binding, slot: location });
            };
            let image = self.target(used, Access::ColorWrite)?;
            attachments.colors.push(image.desc.format);
            targets.colors.push(image.base);
        }
        if let Some(used) = self.pass.uses.iter().find(|used| used.slot == Slot::Depth) {
            let image = self.target(used, Access::DepthWrite)?;
            attachments.depth = Some(image.desc.format);
            targets.depth = Some(image.base);
        }
        Ok((attachments, targets))
    }

    fn target(&self, used: &Use, access: Access) -> Result<ImageObject, Error> {
        match self.object(used)? {
            Object::Image(image) if used.access == access => Ok(image),
            _ => Err(self.bad_use(used, &format!("an attachment of this slot is an image used as {access:?}"))),
        }
    }

    /// Takes room for a resource in staging memory.
    fn stage(&mut self, used: &Use) -> Result<Range<usize>, Error> {
        self.stage_bytes(used, used.resource.bytes())
    }

    fn stage_bytes(&mut self, used: &Use, bytes: u64) -> Result<Range<usize>, Error> {
        let from = self.staging.next_multiple_of(STAGING_ALIGNMENT);
        let to = usize::try_from(bytes).ok().and_then(|bytes| from.checked_add(bytes));
        let to = to.ok_or_else(|| self.bad_use(used, "it is larger than the memory of this machine"))?;
        *self.staging = to;
        Ok(from..to)
    }

    pub(crate) fn object(&self, used: &Use) -> Result<Object, Error> {
        self.objects.get(&used.resource.id).copied().ok_or_else(|| self.bad_use(used, "the plan does not know it"))
    }

    fn buffer(&self, used: &Use) -> Result<BufferObject, Error> {
        match self.object(used)? {
            Object::Buffer(buffer) => Ok(buffer),
            _ => Err(self.bad_use(used, "it is not a buffer")),
        }
    }

    fn structure(&self, used: &Use) -> Result<StructureObject, Error> {
        match self.object(used)? {
            Object::Structure(structure) => Ok(structure),
            _ => Err(self.bad_use(used, "it is not an acceleration structure")),
        }
    }

    fn used_as(&self, access: Access) -> Result<&'a Use, Error> {
        let pass = self.pass;
        pass.uses
            .iter()
            .find(|used| used.access == access)
            .ok_or_else(|| self.bad_pass(format!("it uses no resource as {access:?}")))
    }

    pub(crate) fn bad_use(&self, used: &Use, why: &str) -> Error {
        Error::BadUse { pass: self.pass.name.clone(), resource: used.resource.name.clone(), why: why.to_owned() }
    }

    fn bad_pass(&self, why: String) -> Error {
        Error::BadPass { pass: self.pass.name.clone(), why }
    }
}
