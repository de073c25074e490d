//! Every call of a small render fails once in each way that the specification allows: an error of the right kind comes
//! back, nothing leaks, and the next try succeeds or says that the device is lost.

use crate::faults::{Faults, Happened};
use crate::run_under_layer;
use ash::vk;
use mica_gpu::{Device, DeviceOptions, Error, Executor, Timing, Validation};
use mica_graph::Graph;
use mica_render::scene::Scene;
use mica_render::{OcclusionBackend, RenderError, Renderer, View, embedded_scene};
use std::sync::{Mutex, PoisonError};

/// What the library warned of: validation's messages, wherever they were kept.
static WARNED: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Collect;

impl log::Log for Collect {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().starts_with("mica_gpu::messages")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            WARNED.lock().unwrap_or_else(PoisonError::into_inner).push(record.args().to_string());
        }
    }

    fn flush(&self) {}
}

fn start() -> Faults {
    log::set_logger(&Collect).expect("there is no other");
    log::set_max_level(log::LevelFilter::Warn);
    Faults::open()
}

/// Validation has nothing to say, about leaks either if everything was dropped.
fn assert_silence(after: &dyn std::fmt::Debug) {
    let said = std::mem::take(&mut *WARNED.lock().unwrap_or_else(PoisonError::into_inner));
    assert!(said.is_empty(), "after {after:?} validation said:\n{}", said.join("\n"));
}

fn open() -> Result<Executor, Error> {
    let device = Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })?;
    Executor::new(device)
}

/// A scene and what is seen of it.
struct Stage {
    scene: Scene,
    view: View,
}

impl Stage {
    /// The embedded sphere.
    fn new() -> Self {
        let scene = embedded_scene("sphere").expect("it is embedded").load().expect("it is sound");
        let view = View::new(scene.default_camera(), [16, 9]);
        Self { scene, view }
    }

    /// Nobody knows what came of the uploads of a frame that failed: each try has a renderer of its own.
    fn renderer(&self, method: &str) -> Renderer {
        let scene = self.scene.clone();
        let mut renderer = Renderer::new(scene, &[], None, OcclusionBackend::None).expect("the scene is sound");
        renderer.set_method(None, method).expect("the method exists");
        renderer
    }

    fn render(&self, executor: &mut Executor) -> Result<Vec<u8>, Error> {
        render(executor, &mut self.renderer("smooth"), &self.view)
    }
}

fn render(executor: &mut Executor, renderer: &mut Renderer, view: &View) -> Result<Vec<u8>, Error> {
    let mut graph = Graph::new();
    let frame = renderer.frame(&mut graph, view, None).expect("the frame is declared");
    let download = graph.download_image(&frame.radiance);
    let mut run = executor.run(graph, Timing::Isolated)?;
    Ok(run.take(download))
}

/// Whether the error is of the kind that the result asks for.
pub fn check_kind(error: &Error, happened: &Happened) {
    use vk::Result as R;
    let fits = match happened.result {
        R::ERROR_OUT_OF_HOST_MEMORY
        | R::ERROR_OUT_OF_DEVICE_MEMORY
        | R::ERROR_OUT_OF_POOL_MEMORY
        | R::ERROR_FRAGMENTED_POOL
        | R::ERROR_FRAGMENTATION
        | R::ERROR_MEMORY_MAP_FAILED => matches!(error, Error::OutOfMemory { .. }),
        R::ERROR_DEVICE_LOST => matches!(error, Error::DeviceLost { .. }),
        R::TIMEOUT => matches!(error, Error::Timeout { .. }),
        R::ERROR_SURFACE_LOST_KHR => matches!(error, Error::SurfaceLost),
        _ => true,
    };
    let memory_or_loss = matches!(error, Error::OutOfMemory { .. } | Error::DeviceLost { .. } | Error::Timeout { .. });
    assert!(fits, "{happened:?}: {error:?}");
    assert_eq!(error.exit_code(), if memory_or_loss { 4 } else { 3 }, "{happened:?}: {error:?}");
    let said = error.to_string();
    assert!(!said.is_empty() && !said.contains('\n'), "{happened:?}: {said}");
}

/// Calls whose failure costs nothing that a picture needs: names in messages; the cache of pipelines; extensions of the
/// device, which are then not used; times; a wait that is made once more, and memory that is asked for in a smaller piece.
fn may_be_ignored(name: &str, result: vk::Result) -> bool {
    let is_of_use_only = [
        "vkSetDebugUtilsObjectNameEXT",
        "vkCreatePipelineCache",
        "vkGetPipelineCacheData",
        "vkEnumerateDeviceExtensionProperties",
        "vkAllocateMemory",
        "vkMapMemory",
    ];
    is_of_use_only.contains(&name)
        || matches!(result, vk::Result::INCOMPLETE | vk::Result::NOT_READY)
        || (name == "vkWaitForFences" && !matches!(result, vk::Result::ERROR_DEVICE_LOST | vk::Result::TIMEOUT))
}

/// Which call fails how.
#[derive(Clone, Copy, Default)]
pub struct Turn {
    pub call: u32,
    pub choice: u32,
}

impl Turn {
    /// The next way of the same call, or the first of the next call; `None` once a call was not made.
    pub fn next(self, happened: &Happened) -> Option<Self> {
        let (_, choices) = happened.call?;
        let Self { call, choice } = self;
        Some(if choice + 1 < choices { Self { call, choice: choice + 1 } } else { Self { call: call + 1, choice: 0 } })
    }
}

/// That what was done while a call failed came to a good end of either kind.
fn check<T>(done: &Result<T, Error>, happened: &Happened) {
    match (done, happened.call) {
        (Err(error), Some(_)) => check_kind(error, happened),
        (Ok(_), Some((name, _))) => assert!(may_be_ignored(name, happened.result), "{happened:?} was not noticed"),
        (Ok(_), None) => {}
        (Err(error), None) => panic!("nothing failed, and yet: {error}"),
    }
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn fail_every_call_of_opening() {
    let faults = start();
    let mut turn = Some(Turn::default());
    let mut calls = 0;
    while let Some(Turn { call, choice }) = turn {
        let (opened, happened) = faults.during(None, call, choice, open);
        check(&opened, &happened);
        drop(opened);
        assert_silence(&happened);
        turn = turn.and_then(|turn| turn.next(&happened));
        calls = happened.calls;
    }
    drop(open().expect("the next try succeeds"));
    assert!(calls > 15, "only {calls} calls could fail");
}

#[test]
fn f24_f25_every_call_of_opening_a_device_may_fail_in_any_way() {
    run_under_layer("calls::fail_every_call_of_opening", "");
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn fail_every_call_of_a_render() {
    let faults = start();
    let stage = Stage::new();
    let mut device = open().expect("a device").device().clone();
    let mut executor = Executor::new(device.clone()).expect("an executor");
    let expected = stage.render(&mut executor).expect("nothing fails");
    drop(executor);
    let (mut turn, mut calls) = (Some(Turn::default()), 0);
    while let Some(Turn { call, choice }) = turn {
        let mut executor = Executor::new(device.clone()).expect("an executor");
        let (first, happened) = faults.during(None, call, choice, || stage.render(&mut executor));
        check(&first, &happened);
        // What is left over does not hang on the way of failing.
        let is_lost = matches!(first, Err(Error::DeviceLost { .. } | Error::Timeout { .. }));
        let second = if choice == 0 || is_lost { stage.render(&mut executor) } else { Ok(expected.clone()) };
        match (&first, second) {
            (Err(Error::DeviceLost { .. } | Error::Timeout { .. }), second) => {
                assert!(matches!(second, Err(Error::DeviceLost { .. })), "after {happened:?}: {second:?}");
                drop((executor, device));
                device = open().expect("a new device").device().clone();
            }
            (Ok(first), Ok(second)) => assert!(*first == expected && second == expected, "after {happened:?}"),
            (Err(_), Ok(second)) => assert!(second == expected, "after {happened:?}"),
            (_, Err(error)) => panic!("after {happened:?} the next try failed: {error}"),
        }
        assert_silence(&happened);
        turn = turn.and_then(|turn| turn.next(&happened));
        calls = happened.calls;
    }
    drop(device);
    assert_silence(&"the end");
    assert!(calls > 60, "only {calls} calls could fail");
}

#[test]
fn f24_f25_f27_every_call_of_a_render_may_fail_in_any_way_and_the_next_try_succeeds() {
    run_under_layer("calls::fail_every_call_of_a_render", "");
}

#[test]
#[ignore = "is run under the layer by the test below"]
fn lose_the_device_at_every_submission_and_wait() {
    let faults = start();
    const LOST: u32 = 2;
    let stage = Stage::new();
    for name in [c"vkQueueSubmit2", c"vkWaitForFences"] {
        for call in 0.. {
            let mut executor = open().expect("a device");
            let mut renderer = stage.renderer("wang2020");
            renderer.set(None, "samples", "1").expect("a setting");
            renderer.set(None, "depth", "2").expect("a setting");
            let (done, happened) = faults.during(Some(name), call, LOST, || {
                match renderer.precompute(&mut executor, None, &mut |_, _, _| {}) {
                    Err(RenderError::Gpu(error)) => return Err(error),
                    other => drop(other.expect("the tables fit")),
                }
                render(&mut executor, &mut renderer, &stage.view)
            });
            check(&done, &happened);
            if let Err(first) = &done {
                assert!(matches!(first, Error::DeviceLost { .. }), "{first:?}");
                let second = stage.render(&mut executor);
                assert!(matches!(second, Err(Error::DeviceLost { .. })), "{second:?}");
            }
            drop(executor);
            assert_silence(&happened);
            if happened.call.is_none() {
                assert!(call > 1, "tables and frame are submissions of their own, and there were {call}");
                break;
            }
        }
    }
}

#[test]
fn f25_a_device_lost_at_any_submission_or_wait_is_said_and_cleaned_up() {
    run_under_layer("calls::lose_the_device_at_every_submission_and_wait", "");
}
