//! What stands behind the graph's handles: resources that outlive frames, the memory that a frame's own share, and
//! what a host brings.

mod frame_memory;

use crate::borrow::{HostBuffer, HostImage};
use crate::device::Device;
use crate::error::Error;
use crate::memory::{self, BufferObject, ImageObject, Memory, Object};
use crate::structures;
use crate::vulkan_types as to_vk;
use ash::vk;
use frame_memory::Shared;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use mica_graph::{
    Access, BufferDesc, Description, ImageDesc, Lifetime, Placement, Plan, Resource, ResourceId, StructureDesc, Usage,
    Work,
};
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, Weak};

/// Bytes that something takes, for reports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryRow {
    /// The resource, `frame (shared)` for all resources of frames together, or `staging`.
    pub name: String,
    /// Bytes of device memory.
    pub bytes: u64,
    /// How long they are taken.
    pub lifetime: Lifetime,
}

pub(crate) struct Resources {
    device: Arc<Device>,
    pub(crate) memory: Memory,
    persistent: HashMap<ResourceId, Persistent>,
    hosts: HashMap<ResourceId, Host>,
    shared: Option<Shared>,
    garbage: Vec<Garbage>,
    requirements: RefCell<HashMap<(Description, vk::ImageUsageFlags), vk::MemoryRequirements>>,
    granularity: u64,
}

/// A resource that outlives frames.
struct Persistent {
    handle: Weak<Resource>,
    row: MemoryRow,
    object: Object,
    allocation: Allocation,
    last_frame: u64,
    /// The frame that took it to the general layout; `None` for images that no frame has used yet.
    defined_by: Option<u64>,
    /// What a bottom level needs once it is compacted; known after the frame that built it.
    compacted_bytes: Option<u64>,
    /// Whether a frame has built it, if it is a structure.
    is_built: bool,
    /// The bottom levels that a top level refers to: they have to stay as long as it does, and each frame that uses it
    /// uses them.
    holds: Vec<Arc<Resource>>,
}

/// A resource of the host.
pub(crate) struct Host {
    handle: Weak<Resource>,
    pub(crate) brought: Brought,
}

#[derive(Clone, Copy)]
pub(crate) enum Brought {
    Image(HostImage, ImageDesc),
    Buffer(HostBuffer, u64),
}

/// What is destroyed once the device is done with it.
struct Garbage {
    objects: Vec<Object>,
    allocation: Option<Allocation>,
    last_frame: u64,
}

impl Resources {
    pub(crate) fn new(device: Arc<Device>, limit: Option<u64>) -> Result<Self, Error> {
        let memory = Memory::new(device.clone(), limit)?;
        // SAFETY: the physical device is of this instance.
        let properties = unsafe { device.instance.get_physical_device_properties(device.physical) };
        Ok(Self {
            device,
            memory,
            persistent: HashMap::new(),
            hosts: HashMap::new(),
            shared: None,
            garbage: Vec::new(),
            requirements: RefCell::default(),
            granularity: properties.limits.buffer_image_granularity.max(1),
        })
    }

    /// What this device needs to store a resource of a frame. Size and alignment are whole pages of
    /// `bufferImageGranularity`, so that an image and a buffer may be neighbours anywhere.
    pub(crate) fn requirements(
        &self,
        resource: &Resource,
        accesses: &BTreeSet<Access>,
    ) -> Result<vk::MemoryRequirements, Error> {
        let usage = to_vk::image_usage(accesses);
        let key = (resource.description, usage);
        if let Some(known) = self.requirements.borrow().get(&key) {
            return Ok(*known);
        }
        memory::check_resource(&self.device, &resource.name, &resource.description, usage)?;
        let mut found = vk::MemoryRequirements2::default();
        let mut of_buffer = |desc| {
            let info = memory::buffer_info(&self.device, desc);
            let query = vk::DeviceBufferMemoryRequirements::default().create_info(&info);
            // SAFETY: the size is within the device's limit, and not zero as the planner checked.
            unsafe { self.device.raw.get_device_buffer_memory_requirements(&query, &mut found) };
        };
        match &resource.description {
            Description::Buffer(desc) => of_buffer(*desc),
            Description::Scratch(desc) => {
                of_buffer(BufferDesc { bytes: structures::sizes(&self.device, &resource.name, desc)?.scratch });
            }
            Description::Structure(_) if resource.lifetime == Lifetime::Frame => {
                let why = "an acceleration structure outlives the frame: give it another lifetime".to_owned();
                return Err(Error::BadResource { resource: resource.name.clone(), why });
            }
            Description::Structure(desc) => {
                let size = self.structure_bytes(&resource.name, desc)?;
                return Ok(vk::MemoryRequirements { size, alignment: 1, memory_type_bits: 0 });
            }
            Description::Image(desc) => {
                let info = memory::image_info(desc, usage);
                let query = vk::DeviceImageMemoryRequirements::default().create_info(&info);
                // SAFETY: the driver said that it supports this description.
                unsafe { self.device.raw.get_device_image_memory_requirements(&query, &mut found) };
            }
        }
        let mut found = found.memory_requirements;
        found.alignment = found.alignment.max(self.granularity);
        found.size = found.size.next_multiple_of(self.granularity);
        self.requirements.borrow_mut().insert(key, found);
        Ok(found)
    }

    pub(crate) fn bind_host(&mut self, resource: &Arc<Resource>, brought: Brought) {
        self.hosts.insert(resource.id, Host { handle: Arc::downgrade(resource), brought });
    }

    /// The host's resources that a plan uses.
    pub(crate) fn hosts_of(&self, plan: &Plan) -> Vec<Brought> {
        plan.resources.iter().filter_map(|usage| self.hosts.get(&usage.resource.id)).map(|host| host.brought).collect()
    }

    /// Everything a plan uses, created where it is not there yet. Frames below `oldest_unfinished` are done.
    pub(crate) fn resolve(
        &mut self,
        plan: &Plan,
        frame: u64,
        oldest_unfinished: u64,
    ) -> Result<HashMap<ResourceId, Object>, Error> {
        self.collect(oldest_unfinished);
        let placed: Vec<(&Usage, Placement)> =
            plan.resources.iter().filter_map(|usage| Some((usage, usage.placement?))).collect();
        self.place(plan.shared_bytes, &placed, frame, oldest_unfinished)?;
        let mut objects = HashMap::new();
        if let Some(shared) = &self.shared {
            objects.extend(placed.iter().map(|(usage, _)| usage.resource.id).zip(shared.objects.iter().copied()));
        }
        for usage in &plan.resources {
            let object = match usage.resource.lifetime {
                Lifetime::Frame => continue,
                Lifetime::Host => self.host_object(&usage.resource)?,
                Lifetime::Settings | Lifetime::Scene => self.persistent_object(&usage.resource, frame)?,
            };
            objects.insert(usage.resource.id, object);
        }
        Ok(objects)
    }

    /// Whether a frame has built a structure.
    pub(crate) fn is_built(&self, id: ResourceId) -> bool {
        self.persistent.get(&id).is_some_and(|persistent| persistent.is_built)
    }

    /// Takes note of the structures that a recorded frame builds, and of what they refer to.
    pub(crate) fn note_builds(&mut self, plan: &Plan) {
        for pass in &plan.passes {
            let written = pass.uses.iter().filter(|used| used.access == Access::BuildWrite);
            for used in written {
                if let Some(structure) = self.persistent.get_mut(&used.resource.id) {
                    structure.is_built = true;
                    if matches!(pass.work, Work::BuildInstances { .. }) {
                        let read = pass.uses.iter().filter(|used| used.access == Access::BuildRead);
                        structure.holds = read.map(|used| used.resource.clone()).collect();
                    }
                }
            }
        }
    }

    /// The persistent images of a plan that are still undefined. The frame takes them to the general layout.
    pub(crate) fn take_undefined(&mut self, plan: &Plan, frame: u64) -> Vec<ImageObject> {
        let mut images = Vec::new();
        for usage in &plan.resources {
            let Some(persistent) = self.persistent.get_mut(&usage.resource.id) else { continue };
            if let (Object::Image(image), None) = (persistent.object, persistent.defined_by) {
                images.push(image);
            }
            persistent.defined_by.get_or_insert(frame);
        }
        images
    }

    /// Takes back what `take_undefined` gave out for a frame that did not come to run.
    pub(crate) fn give_back_undefined(&mut self, frame: u64) {
        for persistent in self.persistent.values_mut().filter(|it| it.defined_by == Some(frame)) {
            persistent.defined_by = None;
        }
    }

    /// Destroys what nobody can ask for any more and no unfinished frame uses.
    pub(crate) fn collect(&mut self, oldest_unfinished: u64) {
        self.hosts.retain(|_, host| host.handle.strong_count() > 0);
        let done = |last_frame: u64| last_frame < oldest_unfinished;
        let unused = |it: &Persistent| it.handle.strong_count() == 0 && done(it.last_frame);
        // Once more wherever something went: a top level lets go of what it held.
        while self.persistent.values().any(unused) {
            for (_, persistent) in self.persistent.extract_if(|_, it| unused(it)) {
                let Persistent { object, allocation, last_frame, .. } = persistent;
                self.garbage.push(Garbage { objects: vec![object], allocation: Some(allocation), last_frame });
            }
        }
        let (finished, waiting) = self.garbage.drain(..).partition(|garbage| done(garbage.last_frame));
        self.garbage = waiting;
        self.destroy(finished);
    }

    /// What takes how many bytes.
    pub(crate) fn rows(&self) -> Vec<MemoryRow> {
        let mut rows: Vec<MemoryRow> = self.persistent.values().map(|persistent| persistent.row.clone()).collect();
        rows.sort_by(|a, b| (a.lifetime, &a.name).cmp(&(b.lifetime, &b.name)));
        if let Some(shared) = &self.shared {
            let bytes = shared.allocation.size();
            rows.push(MemoryRow { name: "frame (shared)".to_owned(), bytes, lifetime: Lifetime::Frame });
        }
        rows
    }

    fn host_object(&self, resource: &Resource) -> Result<Object, Error> {
        let Some(host) = self.hosts.get(&resource.id) else {
            return Err(Error::Unbound { resource: resource.name.clone() });
        };
        Ok(match host.brought {
            Brought::Image(HostImage { image, view, .. }, desc) => {
                // The host promised every usage that the graph has.
                let usage = vk::ImageUsageFlags::from_raw(u32::MAX);
                Object::Image(ImageObject { image, desc, usage, all: view, base: view })
            }
            Brought::Buffer(HostBuffer { buffer, .. }, bytes) => Object::Buffer(BufferObject { buffer, bytes }),
        })
    }

    fn persistent_object(&mut self, resource: &Arc<Resource>, frame: u64) -> Result<Object, Error> {
        if let Some(persistent) = self.persistent.get_mut(&resource.id) {
            persistent.last_frame = frame;
            let (object, held) = (persistent.object, persistent.holds.clone());
            for bottom in held {
                if let Some(bottom) = self.persistent.get_mut(&bottom.id) {
                    bottom.last_frame = frame;
                }
            }
            return Ok(object);
        }
        let usage = match &resource.description {
            Description::Image(desc) => self.widest_usage(desc),
            _ => vk::ImageUsageFlags::empty(),
        };
        memory::check_resource(&self.device, &resource.name, &resource.description, usage)?;
        let (object, allocation) = match &resource.description {
            Description::Structure(desc) => {
                let bytes = self.structure_bytes(&resource.name, desc)?;
                let (structure, allocation) = self.memory.structure(&resource.name, desc, bytes)?;
                (Object::Structure(structure), allocation)
            }
            Description::Scratch(_) => {
                let why = "working space lasts for its build: give it the lifetime of a frame".to_owned();
                return Err(Error::BadResource { resource: resource.name.clone(), why });
            }
            Description::Image(desc) => {
                let (image, allocation) = self.memory.image(&resource.name, desc, usage)?;
                (Object::Image(image), allocation)
            }
            Description::Buffer(desc) => {
                let (buffer, allocation) = self.memory.buffer(&resource.name, *desc, MemoryLocation::GpuOnly)?;
                (Object::Buffer(buffer), allocation)
            }
        };
        let row = MemoryRow { name: resource.name.clone(), bytes: allocation.size(), lifetime: resource.lifetime };
        let handle = Arc::downgrade(resource);
        let persistent = Persistent {
            handle,
            row,
            object,
            allocation,
            last_frame: frame,
            defined_by: None,
            compacted_bytes: None,
            is_built: false,
            holds: Vec::new(),
        };
        self.persistent.insert(resource.id, persistent);
        Ok(object)
    }

    /// The bytes of a structure: what the device foresees, or what it said after the build that is to be compacted.
    fn structure_bytes(&self, what: &str, desc: &StructureDesc) -> Result<u64, Error> {
        let known = match desc {
            StructureDesc::Compacted { of, .. } => {
                self.persistent.get(of).and_then(|original| original.compacted_bytes)
            }
            _ => None,
        };
        known.map_or_else(|| Ok(structures::sizes(&self.device, what, desc)?.structure), Ok)
    }

    /// Notes what a bottom level needs once it is compacted.
    pub(crate) fn note_compacted(&mut self, id: ResourceId, bytes: u64) {
        if let Some(persistent) = self.persistent.get_mut(&id) {
            persistent.compacted_bytes = Some(bytes).filter(|bytes| *bytes > 0);
        }
    }

    /// Everything that the device can do with a format: later frames may use the image in ways that this one does not.
    fn widest_usage(&self, desc: &ImageDesc) -> vk::ImageUsageFlags {
        // SAFETY: the physical device is of this instance.
        let properties = unsafe {
            self.device.instance.get_physical_device_format_properties(self.device.physical, to_vk::format(desc.format))
        };
        let offered = properties.optimal_tiling_features;
        let attachments = [
            (vk::FormatFeatureFlags::COLOR_ATTACHMENT, vk::ImageUsageFlags::COLOR_ATTACHMENT),
            (vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        ];
        let all = [
            (vk::FormatFeatureFlags::SAMPLED_IMAGE, vk::ImageUsageFlags::SAMPLED),
            (vk::FormatFeatureFlags::STORAGE_IMAGE, vk::ImageUsageFlags::STORAGE),
            (vk::FormatFeatureFlags::TRANSFER_SRC, vk::ImageUsageFlags::TRANSFER_SRC),
            (vk::FormatFeatureFlags::TRANSFER_DST, vk::ImageUsageFlags::TRANSFER_DST),
        ];
        let drawable = desc.extent.depth == 1 && desc.mips == 1 && desc.layers <= 1;
        let attachments = attachments.iter().filter(|_| drawable);
        let fits = all.iter().chain(attachments).filter(|(feature, _)| offered.contains(*feature));
        fits.fold(vk::ImageUsageFlags::empty(), |usage, (_, one)| usage | *one)
    }

    fn destroy(&mut self, all: Vec<Garbage>) {
        for garbage in all {
            for object in &garbage.objects {
                // SAFETY: every frame that used the object is finished, and nothing refers to it any more.
                unsafe { memory::destroy(&self.device, object) };
            }
            if let Some(allocation) = garbage.allocation {
                self.memory.free(allocation);
            }
        }
    }
}

impl Drop for Resources {
    /// The executor has waited for the device.
    fn drop(&mut self) {
        if !self.device.may_destroy() {
            return;
        }
        let mut all: Vec<Garbage> = self.garbage.drain(..).collect();
        all.extend(self.persistent.drain().map(|(_, Persistent { object, allocation, .. })| Garbage {
            objects: vec![object],
            allocation: Some(allocation),
            last_frame: 0,
        }));
        if let Some(Shared { objects, allocation, .. }) = self.shared.take() {
            all.push(Garbage { objects, allocation: Some(allocation), last_frame: 0 });
        }
        self.destroy(all);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DeviceOptions, Executor, Timing};
    use mica_graph::{Buffer, Extent, Format, Graph, Image, MeshRange, Structure, TrianglesDesc};

    /// Drivers may keep the content of an image that is taken out of the undefined state twice, so no test of pixels
    /// would see that.
    #[test]
    fn a_persistent_image_is_taken_out_of_the_undefined_state_once() {
        let device = Device::new(&DeviceOptions::default()).expect("a device");
        let executor = Executor::new(device.clone()).expect("an executor");
        let mut resources = Resources::new(device, None).expect("no resources yet");
        let desc = ImageDesc::new(Format::R32Float, Extent::new(4, 4));
        let mut images = ["one", "other"].map(|name| Image::new(name, desc, Lifetime::Scene));
        let mut undefined = Vec::new();
        for (frame, count) in (1..).zip([1, 2, 2]) {
            let mut graph = Graph::new();
            for image in &mut images[..count] {
                graph.clear(image, 0.0);
            }
            let plan = executor.plan(graph).expect("a plan");
            resources.resolve(&plan, frame, frame).expect("there is memory");
            undefined.push(resources.take_undefined(&plan, frame).len());
        }
        assert_eq!(undefined, [1, 1, 0]);
    }

    /// Lavapipe says that a copy needs as much as the original, so no frame would show that its answer is heard.
    #[test]
    fn a_compacted_structure_is_as_large_as_the_device_says() {
        let device = Device::new(&DeviceOptions::default()).expect("a device");
        let mut executor = Executor::new(device.clone()).expect("an executor");
        let triangle = TrianglesDesc { triangles: 1, vertices: 3, opaque: true };
        let mut mesh = Structure::over_triangles("mesh", triangle, Lifetime::Scene);
        let mut graph = Graph::new();
        let [mut indices, mut positions] = ["indices", "positions"].map(|name| Buffer::new(name, 36, Lifetime::Scene));
        graph.fill(&mut indices, 0);
        graph.fill(&mut positions, 0);
        let range = MeshRange { first_index: 0, first_vertex: 0 };
        graph.build_meshes("build", &indices, &positions, [(&mut mesh, range)]);
        let ran = executor.run(graph, Timing::Overlapped);
        if !device.info().offers_ray_query() {
            assert!(matches!(ran, Err(Error::BadResource { .. })), "{ran:?}");
            return;
        }
        ran.expect("the frame runs");
        let resources = &mut executor.resources;
        let compacted = Structure::compacted(&mesh).expect("a bottom level");
        let bytes = |resources: &Resources| resources.structure_bytes("compacted", &compacted.desc()).expect("a size");
        let said = resources.persistent[&mesh.resource().id].compacted_bytes.expect("the device was asked");
        assert_eq!(bytes(resources), said);
        resources.note_compacted(mesh.resource().id, 256);
        assert_eq!(bytes(resources), 256);
        // Until it is known, there is room for all of it.
        resources.note_compacted(mesh.resource().id, 0);
        assert_eq!(bytes(resources), structures::sizes(&device, "mesh", &mesh.desc()).expect("sizes").structure);
    }
}
