//! The graph's words in Vulkan's: formats, stages, accesses and usages.

use ash::vk;
use mica_graph::{Access, BindingKind, Extent, Format, ImageDesc, Sampler, Stage, Stages};
use std::collections::BTreeSet;

pub(crate) fn format(format: Format) -> vk::Format {
    match format {
        Format::Rgba8 => vk::Format::R8G8B8A8_UNORM,
        Format::Rgba8Srgb => vk::Format::R8G8B8A8_SRGB,
        Format::R32Uint => vk::Format::R32_UINT,
        Format::Rg32Uint => vk::Format::R32G32_UINT,
        Format::R32Float => vk::Format::R32_SFLOAT,
        Format::Rg32Float => vk::Format::R32G32_SFLOAT,
        Format::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
        Format::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
        Format::Depth32 => vk::Format::D32_SFLOAT,
    }
}

pub(crate) fn aspect(format: Format) -> vk::ImageAspectFlags {
    match format {
        Format::Depth32 => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

pub(crate) fn extent(extent: Extent) -> vk::Extent3D {
    vk::Extent3D { width: extent.width, height: extent.height, depth: extent.depth }
}

/// Size of a level of detail.
pub(crate) fn mip_extent(desc: &ImageDesc, mip: u32) -> vk::Extent3D {
    let size = |texels: u32| (texels >> mip).max(1);
    vk::Extent3D { width: size(desc.extent.width), height: size(desc.extent.height), depth: size(desc.extent.depth) }
}

pub(crate) fn image_type(desc: &ImageDesc) -> vk::ImageType {
    if desc.extent.depth > 1 { vk::ImageType::TYPE_3D } else { vk::ImageType::TYPE_2D }
}

pub(crate) fn view_type(desc: &ImageDesc) -> vk::ImageViewType {
    match (desc.extent.depth, desc.layers) {
        (2.., _) => vk::ImageViewType::TYPE_3D,
        (_, 0) => vk::ImageViewType::TYPE_2D,
        _ => vk::ImageViewType::TYPE_2D_ARRAY,
    }
}

/// Every texel of an image.
pub(crate) fn whole_image(desc: &ImageDesc) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect(desc.format),
        base_mip_level: 0,
        level_count: desc.mips,
        base_array_layer: 0,
        layer_count: desc.layers.max(1),
    }
}

/// All layers of one level of detail.
pub(crate) fn mip_layers(desc: &ImageDesc, mip: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: aspect(desc.format),
        mip_level: mip,
        base_array_layer: 0,
        layer_count: desc.layers.max(1),
    }
}

pub(crate) fn image_usage(accesses: &BTreeSet<Access>) -> vk::ImageUsageFlags {
    accesses.iter().fold(vk::ImageUsageFlags::empty(), |usage, access| {
        usage
            | match access {
                Access::StorageRead | Access::StorageWrite | Access::StorageReadWrite => vk::ImageUsageFlags::STORAGE,
                Access::Sampled => vk::ImageUsageFlags::SAMPLED,
                Access::ColorWrite => vk::ImageUsageFlags::COLOR_ATTACHMENT,
                Access::DepthWrite => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
                Access::TransferRead => vk::ImageUsageFlags::TRANSFER_SRC,
                Access::TransferWrite | Access::TransferUpdate => vk::ImageUsageFlags::TRANSFER_DST,
                // Buffers only; the use itself is refused where the pass is prepared.
                Access::Uniform | Access::IndirectRead | Access::BuildRead | Access::BuildWrite | Access::Traverse => {
                    vk::ImageUsageFlags::empty()
                }
            }
    })
}

/// The usages that need a view; an image without any of them must not have one.
pub(crate) const VIEWED: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
    vk::ImageUsageFlags::STORAGE.as_raw()
        | vk::ImageUsageFlags::SAMPLED.as_raw()
        | vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw()
        | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT.as_raw(),
);

/// What acceleration structures are built from, in addition, where the device has any.
pub(crate) const BUILD_USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS.as_raw()
        | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR.as_raw(),
);

/// What every buffer may be used for: none of it costs anything on a buffer, and who uses it next is not known.
pub(crate) const BUFFER_USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::UNIFORM_BUFFER.as_raw()
        | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw()
        | vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw(),
);

pub(crate) fn stages(stages: Stages) -> vk::PipelineStageFlags2 {
    use vk::PipelineStageFlags2 as To;
    let table = [
        (Stages::COMPUTE, To::COMPUTE_SHADER),
        (Stages::VERTEX, To::VERTEX_SHADER),
        (Stages::FRAGMENT, To::FRAGMENT_SHADER),
        (Stages::COLOR_OUTPUT, To::COLOR_ATTACHMENT_OUTPUT),
        (Stages::DEPTH_TEST, To::EARLY_FRAGMENT_TESTS | To::LATE_FRAGMENT_TESTS),
        (Stages::TRANSFER, To::ALL_TRANSFER),
        (Stages::BUILD, To::ACCELERATION_STRUCTURE_BUILD_KHR),
        (Stages::INDIRECT, To::DRAW_INDIRECT),
    ];
    table.iter().filter(|(from, _)| stages.contains(*from)).fold(To::NONE, |all, (_, to)| all | *to)
}

pub(crate) fn access(access: Access) -> vk::AccessFlags2 {
    use vk::AccessFlags2 as To;
    match access {
        Access::StorageRead => To::SHADER_STORAGE_READ,
        Access::StorageWrite => To::SHADER_STORAGE_WRITE,
        Access::StorageReadWrite => To::SHADER_STORAGE_READ | To::SHADER_STORAGE_WRITE,
        Access::Sampled => To::SHADER_SAMPLED_READ,
        Access::Uniform => To::UNIFORM_READ,
        Access::ColorWrite => To::COLOR_ATTACHMENT_WRITE,
        Access::DepthWrite => To::DEPTH_STENCIL_ATTACHMENT_READ | To::DEPTH_STENCIL_ATTACHMENT_WRITE,
        Access::TransferRead => To::TRANSFER_READ,
        Access::TransferWrite | Access::TransferUpdate => To::TRANSFER_WRITE,
        Access::IndirectRead => To::INDIRECT_COMMAND_READ,
        Access::BuildRead => To::ACCELERATION_STRUCTURE_READ_KHR | To::SHADER_READ,
        Access::BuildWrite => To::ACCELERATION_STRUCTURE_READ_KHR | To::ACCELERATION_STRUCTURE_WRITE_KHR,
        Access::Traverse => To::ACCELERATION_STRUCTURE_READ_KHR,
    }
}

pub(crate) fn accesses<'a>(all: impl IntoIterator<Item = &'a Access>) -> vk::AccessFlags2 {
    all.into_iter().fold(vk::AccessFlags2::NONE, |flags, one| flags | access(*one))
}

pub(crate) fn shader_stages(stages: Stages) -> vk::ShaderStageFlags {
    let table = [
        (Stages::COMPUTE, vk::ShaderStageFlags::COMPUTE),
        (Stages::VERTEX, vk::ShaderStageFlags::VERTEX),
        (Stages::FRAGMENT, vk::ShaderStageFlags::FRAGMENT),
    ];
    table
        .iter()
        .filter(|(from, _)| stages.contains(*from))
        .fold(vk::ShaderStageFlags::empty(), |all, (_, to)| all | *to)
}

pub(crate) fn stage(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
    }
}

pub(crate) fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
        BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
        BindingKind::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        BindingKind::Sampler(_) => vk::DescriptorType::SAMPLER,
    }
}

pub(crate) fn sampler(sampler: Sampler) -> vk::SamplerCreateInfo<'static> {
    let (filter, mipmap, along_u) = match sampler {
        Sampler::Nearest => {
            (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST, vk::SamplerAddressMode::CLAMP_TO_EDGE)
        }
        Sampler::Linear => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR, vk::SamplerAddressMode::CLAMP_TO_EDGE),
        Sampler::LinearWrapU => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR, vk::SamplerAddressMode::REPEAT),
    };
    vk::SamplerCreateInfo::default()
        .mag_filter(filter)
        .min_filter(filter)
        .mipmap_mode(mipmap)
        .address_mode_u(along_u)
        .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE)
        .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
        .max_lod(vk::LOD_CLAMP_NONE)
}
