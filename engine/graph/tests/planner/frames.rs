//! Random frames of every kind of pass and resource. Each is well defined: it reads no byte that nothing wrote.

use crate::random::{Random, mix, mix_name};
use crate::shaders::{COMPUTE, RASTER};
use mica_graph::{
    Access, Buffer, Description, Download, Draw, Effects, Extent, Format, Graph, Image, ImageDesc, Lifetime, Pass,
    Plan, Requirements, Resource, ResourceId, Slot, Stages, Use, Work,
};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A frame as declared, kept to be compared with its plan.
pub struct Frame {
    images: Vec<Image>,
    buffers: Vec<Buffer>,
    /// Its passes; no two have the same name.
    pub passes: Vec<Pass>,
    /// Which resources each pass writes only in part: a pass's name and a resource.
    pub partial: BTreeSet<(String, ResourceId)>,
    /// What it exports.
    pub exports: BTreeSet<ResourceId>,
}

/// What the simulated device needs for a resource: more than its content, and more the more it is used for.
pub fn requirements(resource: &Resource, accesses: &BTreeSet<Access>) -> Requirements {
    let hash = mix_name(&resource.name);
    let padding = hash % 5 + accesses.iter().map(|&access| access as u64 % 3).sum::<u64>();
    Requirements { bytes: resource.bytes() + padding, alignment: 1 << ((hash >> 8) % 6) }
}

impl Frame {
    /// The frame of a seed.
    pub fn random(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut frame = Self::with_resources(&mut random);
        let mut writer = Writer { defined: BTreeSet::new(), recent: Vec::new(), downloads: 0 };
        writer.defined.extend(frame.resources().filter(|it| it.lifetime != Lifetime::Frame).map(|it| it.id));
        for number in 0..4 + random.below(20) {
            writer.add_pass(&mut frame, number, &mut random);
        }
        for image in &frame.images {
            if writer.defined.contains(&image.resource().id) && random.percent(20) {
                frame.exports.insert(image.resource().id);
            }
        }
        frame
    }

    fn with_resources(random: &mut Random) -> Self {
        let lifetimes = [Lifetime::Settings, Lifetime::Scene, Lifetime::Host];
        let formats = [Format::Rgba8, Format::Rg32Float, Format::Depth32];
        let extents = [Extent::new(1, 2), Extent::new(2, 2), Extent::volume(1, 2, 2)];
        let mut frame = Self {
            images: Vec::new(),
            buffers: Vec::new(),
            passes: Vec::new(),
            partial: BTreeSet::new(),
            exports: BTreeSet::new(),
        };
        for number in 0..5 + random.below(14) {
            let lifetime = if random.percent(75) { Lifetime::Frame } else { lifetimes[random.below(lifetimes.len())] };
            if random.percent(60) {
                let mut desc = ImageDesc::new(formats[random.below(3)], extents[random.below(3)]);
                if random.percent(15) {
                    desc.mips = 2;
                    desc.layers = random.below(3) as u32;
                }
                frame.images.push(Image::new(format!("image{number}"), desc, lifetime));
            } else {
                let bytes = 1 + random.below(40) as u64;
                frame.buffers.push(Buffer::new(format!("buffer{number}"), bytes, lifetime));
            }
        }
        frame
    }

    /// All resources, used or not.
    pub fn resources(&self) -> impl Iterator<Item = &Arc<Resource>> {
        self.images.iter().map(Image::resource).chain(self.buffers.iter().map(Buffer::resource))
    }

    /// The frame, declared.
    pub fn graph(&self) -> Graph {
        let mut graph = Graph::new();
        for pass in &self.passes {
            graph.push(pass.name.clone(), pass.work.clone(), pass.uses.clone());
        }
        for image in self.images.iter().filter(|image| self.exports.contains(&image.resource().id)) {
            graph.export(image);
        }
        graph
    }

    /// The frame, planned.
    pub fn plan(&self) -> Plan {
        Plan::new(self.graph(), &requirements).expect("random frames are well formed")
    }

    /// Whether the use leaves nothing of what was there before.
    pub fn replaces_all(&self, pass: &Pass, used: &Use) -> bool {
        used.access.writes() && !self.partial.contains(&(pass.name.clone(), used.resource.id))
    }
}

/// Adds passes that read only what is defined.
struct Writer {
    defined: BTreeSet<ResourceId>,
    recent: Vec<ResourceId>,
    downloads: u32,
}

impl Writer {
    fn add_pass(&mut self, frame: &mut Frame, number: usize, random: &mut Random) {
        let mut uses = Uses(Vec::new());
        let kind = random.below(100);
        let (what, work) = match kind {
            0..40 => self.compute(frame, &mut uses, random),
            40..55 => self.raster(frame, &mut uses, random),
            55..63 => self.transfer_to(frame, &mut uses, random),
            63..72 => self.copy(frame, &mut uses, random),
            72..80 => self.build(frame, &mut uses, random),
            _ => self.download(frame, &mut uses, random),
        };
        if uses.0.is_empty() {
            return;
        }
        let name = format!("{what}{number}");
        for used in &uses.0 {
            let storage = matches!(used.access, Access::StorageWrite | Access::StorageReadWrite);
            let attached = matches!(used.access, Access::ColorWrite | Access::DepthWrite);
            let defined = self.defined.contains(&used.resource.id);
            if (storage && defined && random.percent(50)) || (attached && !is_flat(&used.resource)) {
                frame.partial.insert((name.clone(), used.resource.id));
            }
        }
        for used in uses.0.iter().filter(|used| used.access.writes()) {
            self.defined.insert(used.resource.id);
            self.recent.push(used.resource.id);
        }
        frame.passes.push(Pass { name, why: String::new(), work, uses: uses.0, effects: Effects::NONE });
    }

    fn compute(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        self.reads(frame, uses, &[Stages::COMPUTE], random);
        let counts = random.choose(&self.readable(frame, |it| !is_image(it))).filter(|_| random.percent(20));
        if let Some(counts) = counts {
            uses.add(counts, Slot::None, Access::IndirectRead, Stages::INDIRECT);
        }
        for slot in 0..1 + random.below(2) as u32 {
            self.storage_write(frame, uses, 8 + slot, Stages::COMPUTE, random);
        }
        if counts.is_some() {
            ("indirect", Work::ComputeIndirect { shader: &COMPUTE, params: Vec::new(), offset: 0 })
        } else {
            ("compute", Work::Compute { shader: &COMPUTE, params: Vec::new(), groups: [1, 1, 1] })
        }
    }

    fn raster(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        self.reads(frame, uses, &[Stages::VERTEX, Stages::FRAGMENT, Stages::VERTEX | Stages::FRAGMENT], random);
        let mut extent = None;
        for location in 0..1 + random.below(2) as u32 {
            let fits =
                |it: &Resource| extent.is_none_or(|extent| extent_of(it) == Some(extent)) && may_attach(self, it);
            let image = self.target(frame, random, |it| is_image(it) && !uses.has(it) && fits(it));
            if let Some(image) = image {
                extent = extent_of(image);
                uses.add(image, Slot::Color(location), Access::ColorWrite, Stages::COLOR_OUTPUT);
            }
        }
        let fits = |it: &Resource| extent.is_none_or(|extent| extent_of(it) == Some(extent)) && may_attach(self, it);
        if let Some(image) = self.target(frame, random, |it| is_image(it) && !uses.has(it) && fits(it)) {
            extent = extent_of(image);
            uses.add(image, Slot::Depth, Access::DepthWrite, Stages::DEPTH_TEST);
        }
        if random.percent(20) {
            self.storage_write(frame, uses, 8, Stages::FRAGMENT, random);
        }
        let (draws, extent) = (Arc::<[Draw]>::from([]), extent.unwrap_or(Extent::new(1, 1)));
        ("raster", Work::Raster { shader: &RASTER, params: Vec::new(), draws, extent })
    }

    fn transfer_to(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        if random.percent(25) {
            // A part keeps the rest, so there has to be one.
            let buffers = self.readable(frame, |it| !is_image(it));
            if let Some(to) = random.choose(&buffers) {
                uses.add(to, Slot::None, Access::TransferUpdate, Stages::TRANSFER);
            }
            return ("update", Work::Update { data: vec![0; 4].into(), offset: 0 });
        }
        let Some(to) = self.target(frame, random, |_| true) else { return ("fill", Work::Fill { word: 0 }) };
        uses.add(to, Slot::None, Access::TransferWrite, Stages::TRANSFER);
        if random.percent(50) {
            ("upload", Work::Upload { data: vec![0; to.bytes() as usize].into() })
        } else {
            ("fill", Work::Fill { word: 0 })
        }
    }

    fn copy(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        if let Some(from) = random.choose(&self.readable(frame, is_image)) {
            let like = |it: &Resource| it.id != from.id && it.description == from.description;
            if let Some(to) = self.target(frame, random, like) {
                uses.add(from, Slot::None, Access::TransferRead, Stages::TRANSFER);
                uses.add(to, Slot::None, Access::TransferWrite, Stages::TRANSFER);
            }
        }
        ("copy", Work::Copy)
    }

    fn build(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        let inputs = self.readable(frame, |it| !is_image(it));
        for _ in 0..1 + random.below(2) {
            if let Some(input) = random.choose(&inputs) {
                uses.add(input, Slot::None, Access::BuildRead, Stages::BUILD);
            }
        }
        for _ in 0..2 {
            if let Some(to) = self.target(frame, random, |it| !is_image(it) && !uses.has(it)) {
                uses.add(to, Slot::None, Access::BuildWrite, Stages::BUILD);
            }
        }
        ("build", Work::Compact)
    }

    fn download(&mut self, frame: &Frame, uses: &mut Uses, random: &mut Random) -> (&'static str, Work) {
        let download = Download(self.downloads);
        if let Some(from) = random.choose(&self.readable(frame, |_| true)) {
            self.downloads += 1;
            uses.add(from, Slot::None, Access::TransferRead, Stages::TRANSFER);
        }
        ("download", Work::Download { download })
    }

    fn reads(&self, frame: &Frame, uses: &mut Uses, stages: &[Stages], random: &mut Random) {
        for slot in 0..random.below(4) as u32 {
            let all = self.readable(frame, |_| true);
            let recent: Vec<_> =
                all.iter().copied().filter(|it| self.recent.iter().rev().take(3).any(|id| *id == it.id)).collect();
            let from = if random.percent(70) && !recent.is_empty() { recent } else { all };
            let Some(resource) = random.choose(&from) else { return };
            let accesses: &[Access] = if is_image(resource) {
                &[Access::Sampled, Access::StorageRead]
            } else {
                &[Access::Uniform, Access::StorageRead, Access::Traverse]
            };
            let (access, stages) = (accesses[random.below(accesses.len())], stages[random.below(stages.len())]);
            uses.add(resource, Slot::Binding(slot), access, stages);
        }
    }

    fn storage_write(&self, frame: &Frame, uses: &mut Uses, slot: u32, stages: Stages, random: &mut Random) {
        if let Some(to) = self.target(frame, random, |it| !uses.has(it)) {
            let read_too = self.defined.contains(&to.id) && random.percent(40);
            let access = if read_too { Access::StorageReadWrite } else { Access::StorageWrite };
            uses.add(to, Slot::Binding(slot), access, stages);
        }
    }

    fn readable<'a>(&self, frame: &'a Frame, wanted: impl Fn(&Resource) -> bool) -> Vec<&'a Arc<Resource>> {
        frame.resources().filter(|it| self.defined.contains(&it.id) && wanted(it)).collect()
    }

    /// Something to write, more often than not fresh: then lives are short and memory is shared.
    fn target<'a>(
        &self,
        frame: &'a Frame,
        random: &mut Random,
        wanted: impl Fn(&Resource) -> bool,
    ) -> Option<&'a Arc<Resource>> {
        let all: Vec<_> = frame.resources().filter(|it| wanted(it)).collect();
        let fresh: Vec<_> = all.iter().copied().filter(|it| !self.defined.contains(&it.id)).collect();
        let from = if random.percent(70) && !fresh.is_empty() { fresh } else { all };
        random.choose(&from)
    }
}

/// The uses of a pass in the making.
struct Uses(Vec<Use>);

impl Uses {
    fn has(&self, resource: &Resource) -> bool {
        self.0.iter().any(|used| used.resource.id == resource.id)
    }

    fn add(&mut self, resource: &Arc<Resource>, slot: Slot, access: Access, stages: Stages) {
        self.0.push(Use { resource: resource.clone(), slot, access, stages });
    }
}

fn is_image(resource: &Resource) -> bool {
    matches!(resource.description, Description::Image(_))
}

fn extent_of(resource: &Resource) -> Option<Extent> {
    match resource.description {
        Description::Image(image) => Some(image.extent),
        _ => None,
    }
}

/// Whether drawing clears all of it.
fn is_flat(resource: &Resource) -> bool {
    matches!(resource.description, Description::Image(image) if image.mips == 1 && image.layers <= 1)
}

/// Drawing clears one level and layer: the others must be defined by then.
fn may_attach(writer: &Writer, resource: &Resource) -> bool {
    is_flat(resource) || writer.defined.contains(&resource.id)
}

/// The value of a byte that nothing has written: different at each place and time.
pub fn garbage(when: u64, byte: u64) -> u64 {
    mix(&[0xdead, when, byte])
}
