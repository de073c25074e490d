//! Acceleration structures on a device: how large they become, what they are, and the commands that build them.

use crate::device::Device;
use crate::error::{Call, Error};
use crate::memory::BufferObject;
use ash::{khr, vk};
use mica_graph::{StructureDesc, StructureInstance, TrianglesDesc};

/// What a device with ray queries offers beside.
pub(crate) struct Support {
    pub(crate) functions: khr::acceleration_structure::Device,
    /// What the address of scratch memory is a multiple of.
    scratch_alignment: u64,
    most_triangles: u64,
    most_instances: u64,
}

impl Support {
    pub(crate) fn new(instance: &ash::Instance, device: &ash::Device, physical: vk::PhysicalDevice) -> Self {
        let mut limits = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the physical device is of this instance and has the extension, which the caller enabled.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
        Self {
            functions: khr::acceleration_structure::Device::new(instance, device),
            scratch_alignment: limits.min_acceleration_structure_scratch_offset_alignment.max(1).into(),
            most_triangles: limits.max_primitive_count,
            most_instances: limits.max_instance_count,
        }
    }
}

/// A structure with the buffer that it lies in. Plain handles: whoever made it destroys it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StructureObject {
    pub(crate) raw: vk::AccelerationStructureKHR,
    pub(crate) buffer: vk::Buffer,
    /// What a top level refers to it by.
    pub(crate) address: vk::DeviceAddress,
}

/// Bytes of a structure and of the working space of its build.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    pub(crate) structure: u64,
    pub(crate) scratch: u64,
}

/// Bytes of a vertex in the positions that are built from.
pub(crate) const VERTEX_BYTES: u64 = 12;
/// Bytes of an index.
pub(crate) const INDEX_BYTES: u64 = 4;
/// Bytes of an instance as the device reads it.
const INSTANCE_BYTES: usize = size_of::<vk::AccelerationStructureInstanceKHR>();
/// What the address of instances is a multiple of.
pub(crate) const INSTANCE_ALIGNMENT: u64 = 16;
/// Bits of an instance's custom index.
const INDEX_BITS: u32 = 24;

/// How a structure is built: its flags, geometry and number of primitives, without addresses.
struct Shape {
    geometry: vk::AccelerationStructureGeometryKHR<'static>,
    kind: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    primitives: u32,
}

impl Shape {
    fn of(desc: &StructureDesc) -> Self {
        match desc {
            StructureDesc::Triangles(triangles) | StructureDesc::Compacted { triangles, .. } => {
                Self::over_triangles(triangles, 0, 0)
            }
            StructureDesc::Instances { count } => Self::over_instances(*count, 0),
        }
    }

    fn over_triangles(desc: &TrianglesDesc, indices: vk::DeviceAddress, positions: vk::DeviceAddress) -> Self {
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: positions })
            .vertex_stride(VERTEX_BYTES)
            .max_vertex(desc.vertices.saturating_sub(1))
            .index_type(vk::IndexType::UINT32)
            .index_data(vk::DeviceOrHostAddressConstKHR { device_address: indices });
        let flags = if desc.opaque { vk::GeometryFlagsKHR::OPAQUE } else { vk::GeometryFlagsKHR::empty() };
        Self {
            geometry: vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
                .flags(flags),
            kind: vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            flags: vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE
                | vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION,
            primitives: desc.triangles,
        }
    }

    fn over_instances(count: u32, records: vk::DeviceAddress) -> Self {
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: records });
        Self {
            geometry: vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::INSTANCES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { instances }),
            kind: vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            flags: vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE,
            primitives: count,
        }
    }

    fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.kind)
            .flags(self.flags)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(std::slice::from_ref(&self.geometry))
    }
}

/// How many bytes the device wants for a structure, and for building it.
///
/// # Errors
/// If the device has no ray queries, or not for so many primitives.
pub(crate) fn sizes(device: &Device, what: &str, desc: &StructureDesc) -> Result<Sizes, Error> {
    let support = support(device, what)?;
    let bad = |why: String| Err(Error::BadResource { resource: what.to_owned(), why });
    let shape = Shape::of(desc);
    let most = match desc {
        StructureDesc::Instances { .. } => support.most_instances,
        _ => support.most_triangles,
    };
    if u64::from(shape.primitives) > most {
        return bad(format!("{} primitives are more than a structure of this device holds, {most}", shape.primitives));
    }
    if !matches!(desc, StructureDesc::Instances { .. }) && shape.primitives == 0 {
        return bad("it has no triangles: leave it out".to_owned());
    }
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    // SAFETY: the description is complete but for addresses, which the call does not look at.
    unsafe {
        support.functions.get_acceleration_structure_build_sizes(
            vk::AccelerationStructureBuildTypeKHR::DEVICE,
            &shape.info(),
            &[shape.primitives],
            &mut sizes,
        );
    }
    // The address is rounded up to the alignment, wherever the buffer comes to lie.
    let scratch = sizes.build_scratch_size.max(1) + support.scratch_alignment;
    Ok(Sizes { structure: sizes.acceleration_structure_size.max(1), scratch })
}

/// Makes the structure that lies in a buffer, with nothing in it yet.
pub(crate) fn create(
    device: &Device,
    what: &str,
    desc: &StructureDesc,
    buffer: BufferObject,
) -> Result<StructureObject, Error> {
    let support = support(device, what)?;
    let info = vk::AccelerationStructureCreateInfoKHR::default()
        .buffer(buffer.buffer)
        .size(buffer.bytes)
        .ty(Shape::of(desc).kind);
    // SAFETY: the buffer has memory, the size and the usage.
    let raw = unsafe { support.functions.create_acceleration_structure(&info, None) }.making(
        "vkCreateAccelerationStructureKHR",
        what,
        buffer.bytes,
    )?;
    device.set_name(raw, what);
    let query = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
    // SAFETY: the structure is alive.
    let address = unsafe { support.functions.get_acceleration_structure_device_address(&query) };
    Ok(StructureObject { raw, buffer: buffer.buffer, address })
}

/// Destroys a structure and its buffer.
///
/// # Safety
/// The device has finished all work that uses it, and nothing uses it afterwards.
pub(crate) unsafe fn destroy(device: &Device, structure: &StructureObject) {
    // SAFETY: as the caller promises.
    unsafe {
        if let Some(support) = &device.structures {
            support.functions.destroy_acceleration_structure(structure.raw, None);
        }
        device.raw.destroy_buffer(structure.buffer, None);
    }
}

/// The address of a buffer.
pub(crate) fn address(device: &Device, buffer: vk::Buffer) -> vk::DeviceAddress {
    let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
    // SAFETY: a device with structures has the feature, every buffer of ours the usage, and hosts promise it of theirs.
    unsafe { device.raw.get_buffer_device_address(&info) }
}

/// Instances as the device reads them, or what is wrong with one.
pub(crate) fn instance_records(
    instances: &[StructureInstance],
    address: impl Fn(&StructureInstance) -> Option<vk::DeviceAddress>,
) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(instances.len().max(1) * INSTANCE_BYTES);
    for (place, instance) in instances.iter().enumerate() {
        if instance.index >> INDEX_BITS != 0 {
            return Err(format!("instance {place} has index {}, which takes more than 24 bits", instance.index));
        }
        if !has_inverse(&instance.scene_from_local) {
            return Err(format!("instance {place} has a transform without an inverse"));
        }
        let Some(address) = address(instance) else {
            return Err(format!("instance {place} places a structure that the pass does not use"));
        };
        for row in instance.scene_from_local {
            bytes.extend(row.iter().flat_map(|value| value.to_ne_bytes()));
        }
        // Visible to every mask; both sides of its triangles block.
        let flags = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw();
        bytes.extend((instance.index | 0xff << INDEX_BITS).to_ne_bytes());
        bytes.extend((flags << INDEX_BITS).to_ne_bytes());
        bytes.extend(address.to_ne_bytes());
    }
    // The build reads none where there are none, but wants an address all the same.
    bytes.resize(bytes.len().max(INSTANCE_BYTES), 0);
    Ok(bytes)
}

/// Whether the three columns are finite and independent. In f64, where the products of no f32 come to nothing.
fn has_inverse(rows: &[[f32; 4]; 3]) -> bool {
    let [[a, b, c, _], [d, e, f, _], [g, h, i, _]] = rows.map(|row| row.map(f64::from));
    let determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    rows.iter().flatten().all(|value| value.is_finite()) && determinant != 0.0
}

/// A build, ready to be recorded.
pub(crate) struct Build {
    shape: Shape,
    to: vk::AccelerationStructureKHR,
    scratch: vk::DeviceAddress,
}

impl Build {
    /// Over triangles whose indices and positions begin at these addresses.
    pub(crate) fn over_triangles(
        device: &Device,
        desc: &TrianglesDesc,
        [indices, positions]: [vk::DeviceAddress; 2],
        to: &StructureObject,
        scratch: BufferObject,
    ) -> Self {
        let shape = Shape::over_triangles(desc, indices, positions);
        Self { shape, to: to.raw, scratch: aligned_scratch(device, scratch) }
    }

    /// Over so many instances, whose records are [`Build::read_instances_at`] some address.
    pub(crate) fn over_instances(device: &Device, count: u32, to: &StructureObject, scratch: BufferObject) -> Self {
        let shape = Shape::over_instances(count, 0);
        Self { shape, to: to.raw, scratch: aligned_scratch(device, scratch) }
    }

    /// The same build, from records at this address.
    pub(crate) fn read_instances_at(&self, records: vk::DeviceAddress) -> Self {
        Self { shape: Shape::over_instances(self.shape.primitives, records), ..*self }
    }

    /// What is built.
    pub(crate) fn to(&self) -> vk::AccelerationStructureKHR {
        self.to
    }
}

/// Records builds that do not depend on each other.
///
/// # Safety
/// The command buffer is in the recording state outside of any rendering; what is read, built and used as scratch is
/// alive until the device has finished, and in step with the commands before.
pub(crate) unsafe fn record(support: &Support, to: vk::CommandBuffer, builds: &[&Build]) {
    let ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR> = builds
        .iter()
        .map(|build| vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(build.shape.primitives))
        .collect();
    let ranges: Vec<&[vk::AccelerationStructureBuildRangeInfoKHR]> = ranges.iter().map(std::slice::from_ref).collect();
    let infos: Vec<vk::AccelerationStructureBuildGeometryInfoKHR<'_>> = builds
        .iter()
        .map(|build| {
            let scratch = vk::DeviceOrHostAddressKHR { device_address: build.scratch };
            build.shape.info().dst_acceleration_structure(build.to).scratch_data(scratch)
        })
        .collect();
    // SAFETY: as the caller promises.
    unsafe { support.functions.cmd_build_acceleration_structures(to, &infos, &ranges) };
}

/// Whether the device has ray queries, and if not, an error that says so.
pub(crate) fn support<'a>(device: &'a Device, what: &str) -> Result<&'a Support, Error> {
    device.structures.as_ref().ok_or_else(|| Error::BadResource {
        resource: what.to_owned(),
        why: format!(
            "acceleration structures need ray queries, and this device lacks {}; use the occlusion of Mica's own trees",
            device.info.ray_query_lacks.join(", ")
        ),
    })
}

fn aligned_scratch(device: &Device, scratch: BufferObject) -> vk::DeviceAddress {
    let alignment = device.structures.as_ref().map_or(1, |support| support.scratch_alignment);
    address(device, scratch.buffer).next_multiple_of(alignment)
}

/// Queries of one frame for the bytes that structures need once they are compacted.
pub(crate) struct SizeQueries {
    pub(crate) pool: vk::QueryPool,
    capacity: u32,
}

impl SizeQueries {
    pub(crate) fn new(device: &Device, capacity: u32) -> Result<Self, Error> {
        let capacity = capacity.next_power_of_two();
        let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(capacity);
        // SAFETY: the device has acceleration structures, or there would be none to ask about.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        Ok(Self { pool, capacity })
    }

    pub(crate) fn holds(&self, count: u32) -> bool {
        count <= self.capacity
    }

    /// The sizes; the frame that asked is finished.
    pub(crate) fn read(&self, device: &Device, count: u32) -> Result<Vec<u64>, Error> {
        let mut bytes = vec![0_u64; count as usize];
        if count > 0 {
            // SAFETY: the queries were reset and written by the frame, and each result has room for its value.
            unsafe { device.raw.get_query_pool_results(self.pool, 0, &mut bytes, vk::QueryResultFlags::TYPE_64) }
                .call("vkGetQueryPoolResults")?;
        }
        Ok(bytes)
    }
}
