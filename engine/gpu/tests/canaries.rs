//! Proof that validation is really there: mistakes made on purpose, and what the layer says to them.
//!
//! The tests of this crate trust that a wrong barrier is reported. If one of these fails, that trust is not earned.
//! Known limits of the layer are tested too, so that a better one is noticed.

use crate::common::host::Host;
use crate::common::{bind, compute};
use ash::vk;
use mica_gpu::{Device, DeviceOptions, Executor, HostBuffer, Message, Timing, Validation};
use mica_graph::{
    Access, BindingKind, Buffer, Extent, Format, Graph, Lifetime, Resource, Shader, Slot, Step, Use, Work,
};
use std::sync::Arc;

const BUFFER_BYTES: u64 = 1024;

/// Runs a frame under one kind of validation and returns what that said.
fn said_by(validation: Validation, declare: impl FnOnce(&mut Graph)) -> Vec<Message> {
    let device = Device::new(&DeviceOptions { validation, ..DeviceOptions::default() }).expect("a device");
    let mut executor = Executor::new(device.clone()).expect("an executor");
    let mut graph = Graph::new();
    declare(&mut graph);
    executor.run(graph, Timing::Overlapped).expect("lavapipe runs it all the same");
    device.take_messages()
}

/// Declares a dispatch that changes `changed` and says that it reads it: the planner sees no conflict. The pass is
/// kept because it claims to write something that outlives the frame, a different thing each time.
fn dispatch_in_secret(graph: &mut Graph, shader: &'static Shader, changed: &Arc<Resource>) {
    let witness = Buffer::new("witness", 16, Lifetime::Scene);
    let kept = Use { slot: Slot::None, ..bind(0, witness.resource(), Access::StorageWrite) };
    graph.push(shader.name, dispatch(shader), vec![bind(0, changed, Access::StorageRead), kept]);
}

fn dispatch(shader: &'static Shader) -> Work {
    Work::Compute { shader, params: Vec::new(), groups: [1, 1, 1] }
}

/// Adds 1 to each word of a buffer.
fn increment() -> &'static Shader {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(binding = 0) buffer B0 { uint b0[]; };
        void main() { b0[gl_GlobalInvocationID.x] += 1; }";
    compute("increment", glsl, [64, 1, 1], 0, &[(0, BindingKind::StorageBuffer, Access::StorageReadWrite)])
}

fn ids(messages: &[Message]) -> Vec<&str> {
    messages.iter().map(|message| message.id.as_str()).collect()
}

const KINDS: [Validation; 3] = [Validation::Core, Validation::Synchronization, Validation::GpuAssisted];

/// A shader with push constants that its layout has not: against the rules of a call.
fn misfit(graph: &mut Graph) {
    let glsl = "
        layout(local_size_x = 64) in;
        layout(push_constant) uniform Params { uint value; };
        layout(binding = 0) buffer B0 { uint b0[]; };
        void main() { b0[gl_GlobalInvocationID.x] = value; }";
    let bindings = [(0, BindingKind::StorageBuffer, Access::StorageWrite)];
    let without_params = compute("without_params", glsl, [64, 1, 1], 0, &bindings);
    let buffer = graph.buffer("buffer", 256);
    let uses = vec![bind(0, buffer.resource(), Access::StorageWrite)];
    graph.push("without_params", dispatch(without_params), uses);
    graph.download(&buffer);
}

/// A copy of an image that nothing orders after the dispatch that writes it: a hazard.
fn hazard(graph: &mut Graph) {
    let glsl = "
        layout(local_size_x = 8, local_size_y = 8) in;
        layout(binding = 0, r32ui) uniform writeonly uimage2D b0;
        void main() { imageStore(b0, ivec2(gl_GlobalInvocationID.xy), uvec4(1)); }";
    let write = compute("write", glsl, [8, 8, 1], 0, &[(0, BindingKind::StorageImage, Access::StorageWrite)]);
    let mut image = graph.image("image", Format::R32Uint, Extent::new(8, 8));
    graph.clear(&mut image, 0.0);
    dispatch_in_secret(graph, write, image.resource());
    graph.download_image(&image);
}

/// A dispatch that writes to a buffer of 64 words, each word so far from its place.
fn writes(graph: &mut Graph, beyond: u32) {
    let glsl = format!(
        "layout(local_size_x = 64) in;
        layout(binding = 0) buffer B0 {{ uint b0[]; }};
        void main() {{ b0[gl_GlobalInvocationID.x + {beyond}u] = 1; }}"
    );
    let bindings = [(0, BindingKind::StorageBuffer, Access::StorageWrite)];
    let write = compute("write", &glsl, [64, 1, 1], 0, &bindings);
    let buffer = graph.buffer("buffer", 256);
    graph.push("write", dispatch(write), vec![bind(0, buffer.resource(), Access::StorageWrite)]);
    graph.download(&buffer);
}

#[test]
fn f45_a_frame_without_a_mistake_is_passed_by_every_kind_of_validation() {
    for kind in KINDS {
        assert_eq!(said_by(kind, |graph| writes(graph, 0)), [], "{kind:?}");
    }
}

#[test]
fn f45_a_shader_that_does_not_fit_its_pipeline_layout_is_reported() {
    let said = said_by(Validation::Core, misfit);
    assert!(ids(&said).iter().any(|id| id.starts_with("VUID-")), "{said:?}");
}

#[test]
fn f45_a_missing_barrier_between_a_dispatch_and_a_copy_is_reported_by_synchronisation_validation_alone() {
    for kind in KINDS {
        let said = said_by(kind, hazard);
        let reported = ids(&said).contains(&"SYNC-HAZARD-READ-AFTER-WRITE");
        assert_eq!(reported, kind == Validation::Synchronization, "{kind:?}: {said:?}");
    }
}

#[test]
fn f45_a_write_beyond_a_buffer_is_reported_by_gpu_assisted_validation_alone() {
    for kind in KINDS {
        let said = said_by(kind, |graph| writes(graph, 64));
        assert_eq!(!said.is_empty(), kind == Validation::GpuAssisted, "{kind:?}: {said:?}");
    }
}

#[test]
fn a_missing_barrier_between_two_fills_is_reported() {
    let host = Host::new();
    let (buffer, memory) = storage_buffer(&host);
    let commands = host.begin();
    // SAFETY: the buffer is alive; that nothing orders the two fills is the point.
    unsafe {
        host.device.cmd_fill_buffer(commands, buffer, 0, vk::WHOLE_SIZE, 1);
        host.device.cmd_fill_buffer(commands, buffer, 0, vk::WHOLE_SIZE, 2);
    }
    host.end_and_submit(commands);
    let said = host.take_messages();
    destroy(&host, buffer, memory);
    assert!(said.iter().any(|text| text.contains("SYNC-HAZARD-WRITE-AFTER-WRITE")), "{said:?}");
}

/// Layer 1.3.239 does not see two dispatches that change one storage buffer without a barrier, though it sees a copy
/// after a dispatch. The random frames therefore compare numbers too. If this is reported one day, turn
/// the assertion round.
#[test]
fn a_missing_barrier_between_two_dispatches_on_a_buffer_is_missed() {
    let host = Host::new();
    let device = host.lend();
    let mut executor = Executor::new(device).expect("an executor");
    let (buffer, memory) = storage_buffer(&host);
    // One buffer under two names: the planner cannot know that the two passes conflict.
    let increment = increment();
    let mut graph = Graph::new();
    let names = ["one name", "another name"].map(|name| Buffer::new(name, BUFFER_BYTES, Lifetime::Host));
    for name in &names {
        let (leaves_stages, leaves_access) = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE);
        // SAFETY: the buffer outlives the executor.
        unsafe { executor.bind_host_buffer(name, HostBuffer { buffer, leaves_stages, leaves_access }) };
        graph.push("increment", dispatch(increment), vec![bind(0, name.resource(), Access::StorageReadWrite)]);
    }
    let commands = host.begin();
    // SAFETY: the command buffer was just begun, and is submitted and waited for below.
    let recorded = unsafe { executor.record(graph, commands, Timing::Overlapped) }.expect("the frame is recorded");
    let barriers = recorded.plan().steps.iter().filter(|step| matches!(step, Step::Synchronize { .. })).count();
    assert_eq!(barriers, 0, "the frame has no barrier between the dispatches");
    host.end_and_submit(commands);
    // SAFETY: the host waited for the frame.
    unsafe { executor.finish(recorded) }.expect("the frame is finished");
    let said = host.take_messages();
    drop((executor, names));
    destroy(&host, buffer, memory);
    assert!(said.is_empty(), "the layer sees more than it did, which is good news: require it. {said:?}");
}

/// Hazards between two submissions are seen with one more switch, which has to be in the environment when the process
/// starts. Both sides are tested: which of them runs is up to that environment.
#[test]
fn a_missing_barrier_between_two_submissions_is_reported_with_its_switch_only() {
    let switch = "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT";
    let is_on = std::env::var("VK_LAYER_ENABLES").is_ok_and(|enables| enables.contains(switch));
    let host = Host::new();
    let (buffer, memory) = storage_buffer(&host);
    let commands = [1, 2].map(|word| {
        let commands = host.begin();
        // SAFETY: the buffer is alive; that nothing orders the two submissions is the point.
        unsafe { host.device.cmd_fill_buffer(commands, buffer, 0, vk::WHOLE_SIZE, word) };
        host.end(commands);
        commands
    });
    host.submit(&commands);
    let said = host.take_messages();
    destroy(&host, buffer, memory);
    let reported = said.iter().any(|text| text.contains("SYNC-HAZARD"));
    assert_eq!(reported, is_on, "VK_LAYER_ENABLES has {switch}: {is_on}; {said:?}");
}

fn storage_buffer(host: &Host) -> (vk::Buffer, vk::DeviceMemory) {
    let usage = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::STORAGE_BUFFER;
    let info = vk::BufferCreateInfo::default().size(BUFFER_BYTES).usage(usage);
    // SAFETY: the description is valid, and the memory is made for the buffer.
    unsafe {
        let buffer = host.device.create_buffer(&info, None).expect("a buffer");
        let memory = host.allocate(host.device.get_buffer_memory_requirements(buffer));
        host.device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
        (buffer, memory)
    }
}

fn destroy(host: &Host, buffer: vk::Buffer, memory: vk::DeviceMemory) {
    // SAFETY: the host waited for its submissions.
    unsafe {
        host.device.destroy_buffer(buffer, None);
        host.device.free_memory(memory, None);
    }
}
