//! A device borrowed from a host: the same pixels, nothing submitted, and resources that stay the host's.

use crate::common::host::Host;
use crate::common::{Checked, bind, bytes_of, color, compute, depth, raster, words};
use ash::vk;
use mica_gpu::{Device, Error, Executor, Feature, HostBuffer, HostImage, HostState, Timing, Version};
use mica_graph::{Access, BindingKind, Buffer, Draw, Extent, Format, Graph, Image, ImageDesc, Lifetime, Shader, Work};
use std::sync::LazyLock;

const EXTENT: Extent = Extent::new(40, 24);

static FAN: LazyLock<&Shader> = LazyLock::new(|| {
    let vertex = "
        layout(location = 0) out vec3 radiance;
        void main() {
          float angle = 2.1 * float(gl_VertexIndex) + 0.3 * float(gl_InstanceIndex);
          gl_Position = vec4(0.9 * sin(angle), 0.9 * cos(angle), 0.1 * float(gl_InstanceIndex + 1), 1);
          radiance = vec3(angle, exp(-angle), sin(3 * angle));
        }";
    let fragment = "
        layout(location = 0) in vec3 radiance;
        layout(location = 0) out vec4 color;
        void main() { color = vec4(radiance, 1); }";
    raster("fan", (vertex, fragment), 0, &["color"], &[])
});

static SHARPEN: LazyLock<&Shader> = LazyLock::new(|| {
    let glsl = "
        layout(local_size_x = 8, local_size_y = 8) in;
        layout(push_constant) uniform Params { float weight; };
        layout(binding = 0) uniform texture2D b0;
        layout(binding = 1) uniform sampler b1;
        layout(binding = 2, rgba32f) uniform writeonly image2D b2;
        void main() {
          ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(b2);
          if (any(greaterThanEqual(at, size))) return;
          vec2 texel = 1.0 / vec2(size), uv = (vec2(at) + 0.5) * texel;
          vec4 centre = textureLod(sampler2D(b0, b1), uv, 0);
          vec4 around = textureLod(sampler2D(b0, b1), uv + 0.3 * texel, 0);
          imageStore(b2, at, centre + weight * (centre - around));
        }";
    let bindings = [
        (0, BindingKind::SampledImage, Access::Sampled),
        (1, BindingKind::Sampler(mica_graph::Sampler::Linear), Access::Sampled),
        (2, BindingKind::StorageImage, Access::StorageWrite),
    ];
    compute("sharpen", glsl, [8, 8, 1], 4, &bindings)
});

/// Draws a fan and sharpens it into `target`.
fn picture(graph: &mut Graph, target: &Image) {
    let radiance = graph.image("radiance", Format::Rgba32Float, EXTENT);
    let depths = graph.image("depth", Format::Depth32, EXTENT);
    let draws = (0..7).map(|instance| Draw { vertices: 3, instance }).collect();
    let uses = vec![color(0, radiance.resource()), depth(depths.resource())];
    graph.push("fan", Work::Raster { shader: *FAN, params: Vec::new(), draws, extent: EXTENT }, uses);
    let uses = vec![bind(0, radiance.resource(), Access::Sampled), bind(2, target.resource(), Access::StorageWrite)];
    let groups = [EXTENT.width.div_ceil(8), EXTENT.height.div_ceil(8), 1];
    graph.push("sharpen", Work::Compute { shader: *SHARPEN, params: bytes_of(&[0.5_f32.to_bits()]), groups }, uses);
}

fn target(lifetime: Lifetime) -> Image {
    Image::new("target", ImageDesc::new(Format::Rgba32Float, EXTENT), lifetime)
}

/// The picture on a device of our own.
fn own_pixels() -> Vec<u8> {
    let checked = Checked::new();
    let mut executor = checked.executor();
    let target = target(Lifetime::Frame);
    let mut graph = Graph::new();
    picture(&mut graph, &target);
    let download = graph.download_image(&target);
    executor.run(graph, Timing::Overlapped).expect("the frame runs").take(download)
}

#[test]
fn a_guest_gets_the_pixels_of_a_device_of_our_own() {
    let expected = own_pixels();
    assert!(words(&expected).iter().filter(|word| **word != 0).count() > 1000, "there is something to see");
    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    for timing in [Timing::Isolated, Timing::Overlapped] {
        let target = target(Lifetime::Frame);
        let mut graph = Graph::new();
        picture(&mut graph, &target);
        let download = graph.download_image(&target);
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        let recorded = unsafe { executor.record(graph, commands, timing) }.expect("the frame is recorded");
        host.end_and_submit(commands);
        // SAFETY: the host waited for the frame.
        let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
        assert!(run.take(download) == expected, "the pixels differ");
        assert_eq!(run.passes.iter().all(|pass| pass.ns.is_some()), timing == Timing::Isolated);
        assert_eq!(run.frame_ns.is_some(), timing == Timing::Overlapped);
    }
}

#[test]
fn a_host_s_image_arrives_and_leaves_as_the_host_says() {
    let expected = own_pixels();
    let host = Host::new();
    let (image, view, memory) = host_image(&host);
    let (buffer, buffer_memory) = host_buffer(&host, expected.len() as u64);
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let target = target(Lifetime::Host);
    let none = HostState {
        layout: vk::ImageLayout::UNDEFINED,
        stages: vk::PipelineStageFlags2::NONE,
        access: vk::AccessFlags2::NONE,
    };
    let read = HostState {
        layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        stages: vk::PipelineStageFlags2::COPY,
        access: vk::AccessFlags2::TRANSFER_READ,
    };
    let mut graph = Graph::new();
    picture(&mut graph, &target);
    let commands = host.begin();
    // SAFETY: nothing is bound yet, so nothing can be recorded.
    let error = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect_err("the image is not bound");
    assert!(matches!(&error, Error::Unbound { resource } if resource == "target"), "{error:?}");

    for arrives in [none, read] {
        // SAFETY: the image outlives the executor, and is in the state that the last frame left it in.
        unsafe { executor.bind_host_image(&target, HostImage { image, view, arrives, leaves: read }) };
        let mut graph = Graph::new();
        picture(&mut graph, &target);
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        let recorded = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect("the frame is recorded");
        let region = vk::BufferImageCopy::default()
            .image_subresource(
                vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1),
            )
            .image_extent(vk::Extent3D { width: EXTENT.width, height: EXTENT.height, depth: 1 });
        // SAFETY: the frame left the image as a copy wants it; the buffer has room for it.
        unsafe {
            host.device.cmd_copy_image_to_buffer(commands, image, read.layout, buffer, &[region]);
        }
        host.end_and_submit(commands);
        // SAFETY: the host waited for the frame.
        unsafe { executor.finish(recorded) }.expect("the frame is finished");
    }
    // SAFETY: memory of buffers is visible to the host, and the copy was waited for.
    let pixels = unsafe {
        let at = host.device.map_memory(buffer_memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).expect("mapped");
        std::slice::from_raw_parts(at.cast::<u8>(), expected.len()).to_vec()
    };
    assert!(pixels == expected, "the pixels differ");
    drop(executor);
    // SAFETY: the host waited for its submissions, and the guest is gone.
    unsafe {
        host.device.destroy_image_view(view, None);
        host.device.destroy_image(image, None);
        host.device.free_memory(memory, None);
        host.device.destroy_buffer(buffer, None);
        host.device.free_memory(buffer_memory, None);
    }
}

#[test]
fn frames_in_flight_are_kept_apart_and_counted() {
    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let mut history = Buffer::new("history", 256, Lifetime::Scene);
    let mut frames = Vec::new();
    let mut first = Graph::new();
    first.fill(&mut history, 1);
    let commands = host.begin();
    // SAFETY: as for every frame below: begun, submitted in order, waited for before it is finished.
    let recorded = unsafe { executor.record(first, commands, Timing::Overlapped) }.expect("the frame is recorded");
    host.end(commands);
    frames.push((commands, recorded, None));
    let triple = compute(
        "triple",
        "layout(local_size_x = 64) in;
         layout(binding = 0) buffer B0 { uint b0[]; };
         void main() { b0[gl_GlobalInvocationID.x] *= 3; }",
        [64, 1, 1],
        0,
        &[(0, BindingKind::StorageBuffer, Access::StorageReadWrite)],
    );
    // The second frame needs more memory than the first, while that is still to be submitted.
    for bytes in [1024, 1 << 20] {
        let mut graph = Graph::new();
        let mut own = graph.buffer("own", bytes);
        // Layer 1.3.239 sees that a buffer is destroyed before its fill is submitted, but not so with copies.
        graph.fill(&mut own, 7);
        let mut sent = graph.buffer("sent", 4);
        graph.upload(&mut sent, bytes_of(&[bytes as u32]));
        let work = Work::Compute { shader: triple, params: Vec::new(), groups: [1; 3] };
        graph.push("triple", work, vec![bind(0, history.resource(), Access::StorageReadWrite)]);
        let downloads = [&history, &own, &sent].map(|buffer| graph.download(buffer));
        let commands = host.begin();
        // SAFETY: as above.
        let recorded = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect("the frame is recorded");
        // The layer notices what is destroyed too early only if the command buffer is whole by then.
        host.end(commands);
        frames.push((commands, recorded, Some(downloads)));
    }
    let commands = host.begin();
    // SAFETY: as above; nothing is recorded.
    let error = unsafe { executor.record(Graph::new(), commands, Timing::Overlapped) }.expect_err("three are open");
    assert!(matches!(error, Error::FramesInFlight(3)), "{error:?}");

    drop(history);
    host.submit(&frames.iter().map(|(commands, ..)| *commands).collect::<Vec<_>>());
    let mut seen = Vec::new();
    for (_, recorded, downloads) in frames {
        // SAFETY: the host waited for the frame.
        let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
        if let Some([history, own, sent]) = downloads {
            seen.push((words(&run.take(history))[5], words(&run.take(sent))[0]));
            assert!(words(&run.take(own)).iter().all(|word| *word == 7));
        }
    }
    assert_eq!(seen, [(3, 1024), (9, 1 << 20)]);
    executor.collect();
    assert!(executor.memory().iter().all(|row| row.name != "history"), "{:?}", executor.memory());
}

#[test]
fn frames_in_one_command_buffer_share_memory_without_a_hazard() {
    let expected = own_pixels();
    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let commands = host.begin();
    let frames = [(); 2].map(|()| {
        let target = target(Lifetime::Frame);
        let mut graph = Graph::new();
        picture(&mut graph, &target);
        let download = graph.download_image(&target);
        // SAFETY: the command buffer was begun, and is submitted once and waited for below.
        let recorded = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect("the frame is recorded");
        (recorded, download)
    });
    host.end_and_submit(commands);
    for (recorded, download) in frames {
        // SAFETY: the host waited for the frame.
        let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
        assert!(run.take(download) == expected, "the pixels differ");
    }
}

#[test]
fn a_guest_never_submits() {
    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let error = executor.run(Graph::new(), Timing::Overlapped).expect_err("the device is borrowed");
    assert!(matches!(error, Error::Borrowed), "{error:?}");
}

#[test]
fn a_host_that_enabled_too_little_is_told_what_is_missing() {
    let host = Host::new();
    let all: Vec<Feature> = Device::requirements().features.iter().map(|needed| needed.feature).collect();
    for (index, missing) in all.iter().enumerate() {
        let mut enabled = all.clone();
        enabled.remove(index);
        // SAFETY: the handles belong together, and less is said to be enabled than is.
        let error = unsafe { Device::borrow(host.description(&host.device, &enabled)) }.expect_err("one is missing");
        assert!(error.to_string().contains(missing.name()) && error.exit_code() == 3, "{error}");
    }
    let mut old = host.description(&host.device, &all);
    old.api_version = Version { major: 1, minor: 2, patch: 0 };
    // SAFETY: as above.
    let error = unsafe { Device::borrow(old) }.expect_err("1.2 is too old");
    assert!(error.to_string().contains("1.2.0"), "{error}");
    let mut elsewhere = host.description(&host.device, &all);
    elsewhere.queue_family = 99;
    // SAFETY: as above.
    let error = unsafe { Device::borrow(elsewhere) }.expect_err("there is no such family");
    assert!(error.to_string().contains("99"), "{error}");
}

/// The host enables what is required and nothing that is optional: a shader with f64 or 64-bit integers is refused before
/// the driver sees it, in one line, and others still run.
#[test]
fn shaders_that_need_what_the_host_has_not_enabled_are_refused() {
    let host = Host::new();
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let write = |kind: &str, number: &str| {
        let glsl = format!(
            "#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
            layout(local_size_x = 64) in;
            layout(binding = 0) writeonly buffer B0 {{ uint b0[]; }};
            void main() {{ {kind} n = {kind}(gl_GlobalInvocationID.x) + {number}; b0[gl_GlobalInvocationID.x] = uint(n); }}"
        );
        compute("write", &glsl, [64, 1, 1], 0, &[(0, BindingKind::StorageBuffer, Access::StorageWrite)])
    };
    for (kind, number, missing) in
        [("double", "0.5lf", Some("shaderFloat64")), ("uint64_t", "1UL", Some("shaderInt64")), ("float", "0.5", None)]
    {
        let shader = write(kind, number);
        let mut graph = Graph::new();
        let buffer = graph.buffer("buffer", 256);
        let work = Work::Compute { shader, params: Vec::new(), groups: [1; 3] };
        graph.push("reference", work, vec![bind(0, buffer.resource(), Access::StorageWrite)]);
        graph.download(&buffer);
        let commands = host.begin();
        // SAFETY: the command buffer was just begun, and is submitted and waited for below.
        match (unsafe { executor.record(graph, commands, Timing::Overlapped) }, missing) {
            (Err(error), Some(missing)) => {
                let said = error.to_string();
                assert!(matches!(&error, Error::Unsupported { pass, .. } if pass == "reference"), "{error:?}");
                assert!(said.contains(missing) && !said.contains('\n') && error.exit_code() == 3, "{said}");
                host.end(commands);
            }
            (Ok(recorded), None) => {
                host.end_and_submit(commands);
                // SAFETY: the host waited for the frame.
                unsafe { executor.finish(recorded) }.expect("the frame is finished");
            }
            (result, missing) => panic!("{kind}: {missing:?} is missing, and {:?}", result.err()),
        }
    }
}

#[test]
fn a_host_s_buffer_is_read_and_written_in_place() {
    let host = Host::new();
    let (raw, memory) = host_buffer(&host, 256);
    let mut executor = Executor::new(host.lend()).expect("an executor");
    let lent = HostBuffer {
        buffer: raw,
        leaves_stages: vk::PipelineStageFlags2::ALL_TRANSFER,
        leaves_access: vk::AccessFlags2::TRANSFER_WRITE,
    };
    let buffer = Buffer::new("of the host", 256, Lifetime::Host);
    // SAFETY: the buffer outlives the executor.
    unsafe { executor.bind_host_buffer(&buffer, lent) };
    let mut graph = Graph::new();
    let download = graph.download(&buffer);
    let commands = host.begin();
    // SAFETY: the buffer has a usage for fills; the frame is recorded after them, and waited for below.
    let recorded = unsafe {
        host.device.cmd_fill_buffer(commands, raw, 0, vk::WHOLE_SIZE, 99);
        executor.record(graph, commands, Timing::Overlapped)
    }
    .expect("the frame is recorded");
    // SAFETY: the frame leaves the buffer to be written by a copy.
    unsafe { host.device.cmd_fill_buffer(commands, raw, 0, vk::WHOLE_SIZE, 0) };
    host.end_and_submit(commands);
    // SAFETY: the host waited for the frame.
    let mut run = unsafe { executor.finish(recorded) }.expect("the frame is finished");
    assert_eq!(words(&run.take(download)), [99; 64]);
    drop(executor);
    // SAFETY: the host waited for its submissions, and the guest is gone.
    unsafe {
        host.device.destroy_buffer(raw, None);
        host.device.free_memory(memory, None);
    }
}

fn host_image(host: &Host) -> (vk::Image, vk::ImageView, vk::DeviceMemory) {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(vk::Format::R32G32B32A32_SFLOAT)
        .extent(vk::Extent3D { width: EXTENT.width, height: EXTENT.height, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_SRC);
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: 0,
        level_count: 1,
        base_array_layer: 0,
        layer_count: 1,
    };
    // SAFETY: the descriptions are valid, and the memory is made for the image.
    unsafe {
        let image = host.device.create_image(&info, None).expect("an image");
        let memory = host.allocate(host.device.get_image_memory_requirements(image));
        host.device.bind_image_memory(image, memory, 0).expect("it is bound");
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R32G32B32A32_SFLOAT)
            .subresource_range(range);
        (image, host.device.create_image_view(&info, None).expect("a view"), memory)
    }
}

fn host_buffer(host: &Host, bytes: u64) -> (vk::Buffer, vk::DeviceMemory) {
    let usage = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
    let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
    // SAFETY: the description is valid, and the memory is made for the buffer.
    unsafe {
        let buffer = host.device.create_buffer(&info, None).expect("a buffer");
        let memory = host.allocate(host.device.get_buffer_memory_requirements(buffer));
        host.device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
        (buffer, memory)
    }
}
