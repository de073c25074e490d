//! Descriptor set 0 of a pass, written from its uses and checked against its shader and the device's limits.

use crate::error::{Call, Error};
use crate::memory::{BufferObject, Object};
use crate::pipeline::Pipeline;
use crate::prepare::Preparation;
use crate::vulkan_types as to_vk;
use ash::vk;
use mica_graph::{Access, Binding, BindingKind, Shader, Slot, Use};

/// A set for the pass, with every binding of the shader filled.
pub(crate) fn write_set(
    preparation: &Preparation<'_, '_>,
    shader: &Shader,
    pipeline: &Pipeline,
) -> Result<vk::DescriptorSet, Error> {
    let device = &preparation.device.raw;
    let layouts = [pipeline.set_layout];
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(preparation.pool).set_layouts(&layouts);
    // SAFETY: the pool has room for every set of the plan, and the layout is alive.
    let sets = unsafe { device.allocate_descriptor_sets(&info) }.call("vkAllocateDescriptorSets")?;
    let set = sets[0];
    for binding in shader.bindings {
        if matches!(binding.kind, BindingKind::Sampler(_)) {
            continue;
        }
        let pass = preparation.pass;
        let Some(used) = pass.uses.iter().find(|used| used.slot == Slot::Binding(binding.slot)) else {
            let (pass, binding, slot) = (pass.name.clone(), binding.name.to_owned(), binding.slot);
            return Err(Error::MissingBinding { pass, binding, slot });
        };
        write_binding(preparation, set, binding, used)?;
    }
    Ok(set)
}

fn write_binding(
    preparation: &Preparation<'_, '_>,
    set: vk::DescriptorSet,
    binding: &Binding,
    used: &Use,
) -> Result<(), Error> {
    if !suits(binding.kind, used.access) {
        let why = format!("{:?} does not suit binding {}, a {:?}", used.access, binding.name, binding.kind);
        return Err(preparation.bad_use(used, &why));
    }
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .dst_binding(binding.slot)
        .descriptor_type(to_vk::descriptor_type(binding.kind));
    let general = vk::DescriptorImageInfo::default().image_layout(vk::ImageLayout::GENERAL);
    let mut image_info = [general];
    let mut buffer_info = [vk::DescriptorBufferInfo::default()];
    let mut structures = [vk::AccelerationStructureKHR::null()];
    let mut structure_info = vk::WriteDescriptorSetAccelerationStructureKHR::default();
    let write = match (preparation.object(used)?, binding.kind) {
        (Object::Image(image), BindingKind::SampledImage) => {
            image_info[0] = general.image_view(image.all);
            write.image_info(&image_info)
        }
        (Object::Image(image), BindingKind::StorageImage) => {
            image_info[0] = general.image_view(image.base);
            write.image_info(&image_info)
        }
        (Object::Buffer(buffer), BindingKind::StorageBuffer | BindingKind::UniformBuffer) => {
            check_range(preparation, binding.kind, used, buffer)?;
            buffer_info[0] = vk::DescriptorBufferInfo { buffer: buffer.buffer, offset: 0, range: buffer.bytes };
            write.buffer_info(&buffer_info)
        }
        (Object::Structure(structure), BindingKind::AccelerationStructure) => {
            structures[0] = structure.raw;
            structure_info = structure_info.acceleration_structures(&structures);
            write.descriptor_count(1).push_next(&mut structure_info)
        }
        _ => return Err(preparation.bad_use(used, &format!("binding {} is a {:?}", binding.name, binding.kind))),
    };
    // SAFETY: the set is new and in no command yet; the view or buffer is alive and was made for this kind of use.
    unsafe { preparation.device.raw.update_descriptor_sets(&[write], &[]) };
    Ok(())
}

/// Drivers create larger buffers without a word, and then shaders see a part of them.
fn check_range(
    preparation: &Preparation<'_, '_>,
    kind: BindingKind,
    used: &Use,
    buffer: BufferObject,
) -> Result<(), Error> {
    let limits = &preparation.device.info.limits;
    let (limit_name, limit) = match kind {
        BindingKind::UniformBuffer => ("maxUniformBufferRange", limits.max_uniform_buffer_range_bytes),
        _ => ("maxStorageBufferRange", limits.max_storage_buffer_range_bytes),
    };
    if buffer.bytes <= limit {
        return Ok(());
    }
    let (pass, resource) = (preparation.pass.name.clone(), used.resource.name.clone());
    Err(Error::BufferRange { pass, resource, bytes: buffer.bytes, limit_name, limit })
}

fn suits(kind: BindingKind, access: Access) -> bool {
    match kind {
        BindingKind::SampledImage => access == Access::Sampled,
        BindingKind::UniformBuffer => access == Access::Uniform,
        BindingKind::StorageImage | BindingKind::StorageBuffer => {
            matches!(access, Access::StorageRead | Access::StorageWrite | Access::StorageReadWrite)
        }
        BindingKind::AccelerationStructure => access == Access::Traverse,
        BindingKind::Sampler(_) => false,
    }
}
