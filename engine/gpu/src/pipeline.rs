//! Pipelines, made on first use from what a shader says of itself.

use crate::device::{Device, c_string};
use crate::error::{Call, Error};
use crate::features::Feature;
use crate::pipeline_cache::{NOT_KEPT, PipelineCache};
use crate::shader_limits;
use crate::vulkan_types as to_vk;
use ash::vk;
use mica_graph::{BindingKind, Effects, Format, Sampler, Shader, Stage};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A pipeline with its layouts. Plain handles: they live as long as the executor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pipeline {
    pub(crate) raw: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub(crate) bind_point: vk::PipelineBindPoint,
    pub(crate) params_stages: vk::ShaderStageFlags,
}

/// The formats that a raster pipeline draws into; none for compute.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Attachments {
    pub(crate) colors: Vec<Format>,
    pub(crate) depth: Option<Format>,
}

/// The pipelines that an executor has made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelinesMade {
    /// How many: one for each shader, variant and set of effects that a frame ran.
    pub count: usize,
    /// How long that took, in nanoseconds.
    pub ns: u64,
}

/// All pipelines made so far.
pub(crate) struct Pipelines {
    device: Arc<Device>,
    pub(crate) cache: PipelineCache,
    samplers: HashMap<Sampler, vk::Sampler>,
    /// By the shader's address (shaders are statics, so it is their identity) and the effects that it is specialised for.
    made: HashMap<(usize, Effects, Attachments), Pipeline>,
    /// How long they took.
    took: Duration,
}

impl Pipelines {
    pub(crate) fn new(device: Arc<Device>, path: Option<PathBuf>) -> Result<Self, Error> {
        let cache = PipelineCache::new(&device, path)?;
        let mut pipelines =
            Self { device, cache, samplers: HashMap::new(), made: HashMap::new(), took: Duration::ZERO };
        for kind in [Sampler::Nearest, Sampler::Linear, Sampler::LinearWrapU] {
            // SAFETY: the description asks for no feature.
            let sampler =
                unsafe { pipelines.device.raw.create_sampler(&to_vk::sampler(kind), None) }.call("vkCreateSampler")?;
            pipelines.samplers.insert(kind, sampler);
        }
        Ok(pipelines)
    }

    /// How many there are, and how long it took to make them.
    pub(crate) fn made(&self) -> PipelinesMade {
        PipelinesMade { count: self.made.len(), ns: self.took.as_nanos() as u64 }
    }

    /// The pipeline of a shader for certain attachments.
    pub(crate) fn get(
        &mut self,
        pass: &str,
        shader: &'static Shader,
        effects: Effects,
        attachments: &Attachments,
    ) -> Result<Pipeline, Error> {
        let key = (std::ptr::from_ref(shader) as usize, effects, attachments.clone());
        if let Some(pipeline) = self.made.get(&key) {
            return Ok(*pipeline);
        }
        if let Some(why) = shader_limits::exceeded(shader, &self.device.info.limits) {
            return Err(Error::BadPass { pass: pass.to_owned(), why });
        }
        if let Some(feature) = capabilities(shader).find(|feature| !self.device.has(*feature)) {
            let instead =
                if feature == Feature::RayQuery { "the occlusion of Mica's own trees" } else { "another method" };
            let what = format!("the shader needs {}, which this device lacks; use {instead}", feature.name());
            return Err(Error::Unsupported { pass: pass.to_owned(), what });
        }
        let name = if shader.variant.is_empty() {
            shader.name.to_owned()
        } else {
            format!("{} {}", shader.name, shader.variant)
        };
        // What drivers do with damaged code is theirs to choose: they never see it.
        let start = Instant::now();
        let is_whole = shader.stages.iter().all(|stage| shader_limits::is_whole(stage.spirv));
        let made =
            if is_whole { self.make(shader, effects, attachments) } else { Err(vk::Result::ERROR_INVALID_SHADER_NV) };
        let made = made.map_err(|result| match result {
            vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => Error::OutOfMemory {
                what: format!("the pipeline of pass {pass}"),
                bytes: 0,
                detail: result.to_string(),
            },
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { pass: Some(pass.to_owned()) },
            _ => Error::Pipeline { pass: pass.to_owned(), shader: name.clone(), result },
        })?;
        self.took += start.elapsed();
        self.device.set_name(made.raw, &name);
        self.cache.is_changed = true;
        self.made.insert(key, made);
        Ok(made)
    }

    fn make(
        &self,
        shader: &'static Shader,
        effects: Effects,
        attachments: &Attachments,
    ) -> Result<Pipeline, vk::Result> {
        let device = &self.device.raw;
        let set_layout = self.set_layout(shader)?;
        let stages = shader.stages.iter().fold(vk::ShaderStageFlags::empty(), |all, it| all | to_vk::stage(it.stage));
        let params = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: shader.params_bytes }];
        let set_layouts = [set_layout];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        if shader.params_bytes > 0 {
            info = info.push_constant_ranges(&params);
        }
        // SAFETY: the set layout is alive and the range within the device's limit.
        let layout = unsafe { device.create_pipeline_layout(&info, None) }.inspect_err(|_| {
            // SAFETY: nothing uses the layout.
            unsafe { device.destroy_descriptor_set_layout(set_layout, None) }
        })?;
        let called_for = Specialization::new(shader.effects, effects);
        let made = if stages == vk::ShaderStageFlags::COMPUTE {
            self.compute(shader, &called_for, layout).map(|raw| (raw, vk::PipelineBindPoint::COMPUTE))
        } else {
            self.raster(shader, &called_for, attachments, layout).map(|raw| (raw, vk::PipelineBindPoint::GRAPHICS))
        };
        let (raw, bind_point) = made.inspect_err(|_| {
            // SAFETY: nothing uses the layouts.
            unsafe {
                device.destroy_pipeline_layout(layout, None);
                device.destroy_descriptor_set_layout(set_layout, None);
            }
        })?;
        Ok(Pipeline { raw, layout, set_layout, bind_point, params_stages: stages })
    }

    fn set_layout(&self, shader: &Shader) -> Result<vk::DescriptorSetLayout, vk::Result> {
        let samplers: Vec<[vk::Sampler; 1]> = shader
            .bindings
            .iter()
            .map(|binding| match binding.kind {
                BindingKind::Sampler(kind) => [self.samplers[&kind]],
                _ => [vk::Sampler::null()],
            })
            .collect();
        let bindings: Vec<vk::DescriptorSetLayoutBinding<'_>> = shader
            .bindings
            .iter()
            .zip(&samplers)
            .map(|(binding, sampler)| {
                let layout = vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.slot)
                    .descriptor_type(to_vk::descriptor_type(binding.kind))
                    .descriptor_count(1)
                    .stage_flags(to_vk::shader_stages(binding.stages));
                match binding.kind {
                    BindingKind::Sampler(_) => layout.immutable_samplers(sampler),
                    _ => layout,
                }
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the samplers are alive and outlive the layout.
        unsafe { self.device.raw.create_descriptor_set_layout(&info, None) }
    }

    fn compute(
        &self,
        shader: &Shader,
        called_for: &Specialization,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, vk::Result> {
        let modules = Modules::new(&self.device, shader)?;
        let specialization = called_for.info();
        let stages = modules.stages(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stages[0]).layout(layout);
        // SAFETY: the module and the layout are alive, and the layout was made from the shader's own bindings.
        let made = unsafe { self.device.raw.create_compute_pipelines(self.cache.raw, &[info], None) };
        one_of(made)
    }

    fn raster(
        &self,
        shader: &Shader,
        called_for: &Specialization,
        attachments: &Attachments,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, vk::Result> {
        let modules = Modules::new(&self.device, shader)?;
        let specialization = called_for.info();
        let stages = modules.stages(&specialization);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(attachments.depth.is_some())
            .depth_write_enable(attachments.depth.is_some())
            .depth_compare_op(vk::CompareOp::GREATER);
        let written = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let blends = vec![written; attachments.colors.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let colors: Vec<vk::Format> = attachments.colors.iter().map(|format| to_vk::format(*format)).collect();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&colors)
            .depth_attachment_format(attachments.depth.map_or(vk::Format::UNDEFINED, to_vk::format));
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut rendering);
        // SAFETY: modules, layout and every state live until the call returns; dynamic rendering is enabled.
        let made = unsafe { self.device.raw.create_graphics_pipelines(self.cache.raw, &[info], None) };
        one_of(made)
    }
}

impl Drop for Pipelines {
    /// The executor has waited for the device.
    fn drop(&mut self) {
        if let Err(error) = self.cache.flush(&self.device) {
            log::warn!(target: NOT_KEPT, "the pipeline cache was not written: {error}");
        }
        if !self.device.may_destroy() {
            return;
        }
        let device = &self.device.raw;
        // SAFETY: the device has finished all work, and nothing else holds these handles.
        unsafe {
            for pipeline in self.made.values() {
                device.destroy_pipeline(pipeline.raw, None);
                device.destroy_pipeline_layout(pipeline.layout, None);
                device.destroy_descriptor_set_layout(pipeline.set_layout, None);
            }
            for sampler in self.samplers.values() {
                device.destroy_sampler(*sampler, None);
            }
            device.destroy_pipeline_cache(self.cache.raw, None);
        }
    }
}

/// The values of the specialisation constants that a shader asks about.
struct Specialization {
    entries: Vec<vk::SpecializationMapEntry>,
    values: Vec<u8>,
}

impl Specialization {
    fn new(asked: Effects, called_for: Effects) -> Self {
        let mut specialization = Self { entries: Vec::new(), values: Vec::new() };
        for effect in asked.iter() {
            let value = vk::Bool32::from(called_for.contains(effect)).to_ne_bytes();
            specialization.entries.push(
                vk::SpecializationMapEntry::default()
                    .constant_id(effect.bits().trailing_zeros())
                    .offset(specialization.values.len() as u32)
                    .size(value.len()),
            );
            specialization.values.extend(value);
        }
        specialization
    }

    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.values)
    }
}

/// Shader modules, for as long as a pipeline is made from them.
struct Modules<'a> {
    device: &'a Device,
    made: Vec<(Stage, vk::ShaderModule)>,
}

impl<'a> Modules<'a> {
    fn new(device: &'a Device, shader: &Shader) -> Result<Self, vk::Result> {
        let mut modules = Self { device, made: Vec::new() };
        for code in shader.stages {
            let info = vk::ShaderModuleCreateInfo::default().code(code.spirv);
            // SAFETY: the build compiled and validated the SPIR-V.
            let module = unsafe { device.raw.create_shader_module(&info, None) }?;
            device.set_name(module, &c_string(shader.name).to_string_lossy());
            modules.made.push((code.stage, module));
        }
        if modules.made.is_empty() { Err(vk::Result::ERROR_INITIALIZATION_FAILED) } else { Ok(modules) }
    }

    fn stages<'b>(&self, specialization: &'b vk::SpecializationInfo<'b>) -> Vec<vk::PipelineShaderStageCreateInfo<'b>> {
        let stage = |(stage, module): &(Stage, vk::ShaderModule)| {
            let info = vk::PipelineShaderStageCreateInfo::default().stage(to_vk::stage(*stage)).module(*module);
            info.name(c"main").specialization_info(specialization)
        };
        self.made.iter().map(stage).collect()
    }
}

impl Drop for Modules<'_> {
    fn drop(&mut self) {
        for (_, module) in &self.made {
            // SAFETY: pipelines keep no reference to the modules that they were made from.
            unsafe { self.device.raw.destroy_shader_module(*module, None) };
        }
    }
}

fn one_of(made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>) -> Result<vk::Pipeline, vk::Result> {
    match made {
        Ok(pipelines) => pipelines.first().copied().ok_or(vk::Result::ERROR_UNKNOWN),
        Err((_, result)) => Err(result),
    }
}

/// The optional features that a shader's code declares it uses: the OpCapability instructions, which come first.
fn capabilities(shader: &Shader) -> impl Iterator<Item = Feature> {
    const HEADER_WORDS: usize = 5;
    /// OpCapability of one operand: two words, opcode 17.
    const CAPABILITY: u32 = 2 << 16 | 17;
    let instructions = shader.stages.iter().map(|stage| stage.spirv.get(HEADER_WORDS..).unwrap_or_default());
    let declared = instructions.flat_map(|code| code.chunks_exact(2).take_while(|pair| pair[0] == CAPABILITY));
    declared.filter_map(|pair| match pair[1] {
        10 => Some(Feature::Float64),
        11 => Some(Feature::Int64),
        4472 => Some(Feature::RayQuery),
        _ => None,
    })
}
