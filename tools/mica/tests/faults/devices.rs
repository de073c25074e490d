//! Loaders, drivers and devices that are missing, poor or failing. A layer below the program plays them.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output};

/// A folder for what a test writes, the layer's description among it.
struct Place(tempfile::TempDir);

/// What makes a picture quickly, unless a test wants something else.
const QUICK: [[&str; 2]; 4] = [["--size", "8x6"], ["--frames", "0"], ["--method", "smooth"], ["--occlusion", "none"]];

/// The words of a render that is quick where these arguments leave it to be.
fn render<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let rest = QUICK.iter().filter(|pair| !arguments.contains(&pair[0])).flatten().copied();
    ["render", "--quiet", "sphere"].into_iter().chain(arguments.iter().copied()).chain(rest).collect()
}

const OUT_OF_DEVICE_MEMORY: i32 = -2;
const INITIALIZATION_FAILED: i32 = -3;
const DEVICE_LOST: i32 = -4;
const EXTENSION_NOT_PRESENT: i32 = -7;
const INCOMPATIBLE_DRIVER: i32 = -9;
const INVALID_SHADER: i32 = -1_000_012_000;
const TIMEOUT: i32 = 2;

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn argument(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("temporary folders have plain names").to_owned()
    }

    fn mica(&self, environment: &[(&str, OsString)], arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_mica"))
            .args(arguments)
            .env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"))
            .env_remove("RUST_LOG")
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .output()
            .expect("mica starts")
    }

    /// Runs the program while the layer plays these faults.
    fn under(&self, faults: &str, arguments: &[&str]) -> Output {
        self.mica(&mica_fault_layer::environment(self.0.path(), &[], faults), arguments)
    }

    /// Renders while the layer plays these faults.
    fn render(&self, faults: &str, arguments: &[&str]) -> Output {
        let picture = self.argument("a.exr");
        self.under(faults, &render(&[&["-o", &picture], arguments].concat()))
    }

    /// Renders, which has to end with this code and one line that has all the words, and leaves no picture.
    #[track_caller]
    fn fails(&self, faults: &str, arguments: &[&str], code: i32, words: &[&str]) {
        let _ = std::fs::remove_file(self.argument("a.exr"));
        let output = self.render(faults, arguments);
        assert_ends(&output, code, words);
        assert!(!Path::new(&self.argument("a.exr")).exists(), "{faults}: a picture is left");
    }
}

/// The exit code, and one line on stderr with all the words.
#[track_caller]
fn assert_ends(output: &Output, code: i32, words: &[&str]) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{error}");
    assert!(error.starts_with("mica: ") && error.lines().count() == 1, "{error}");
    for word in words {
        assert!(error.contains(word), "{word} is not in: {error}");
    }
}

#[track_caller]
fn assert_works(output: &Output) -> String {
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn environment(pairs: &[(&'static str, &str)]) -> Vec<(&'static str, OsString)> {
    pairs.iter().map(|(name, value)| (*name, OsString::from(value))).collect()
}

#[test]
fn f19_without_a_loader_the_package_to_install_is_named() {
    let place = Place::new();
    std::fs::write(place.argument("libvulkan.so.1"), "not a library").expect("a file");
    let nowhere = [("LD_LIBRARY_PATH", place.0.path().into())];
    let output = place.mica(&nowhere, &render(&[]));
    assert_ends(&output, 3, &["no Vulkan loader", "libvulkan1"]);
}

#[test]
fn f20_without_a_driver_the_package_is_named_and_the_oracle_still_answers() {
    let place = Place::new();
    let nowhere = environment(&[("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")]);
    let output = place.mica(&nowhere, &render(&[]));
    assert_ends(&output, 3, &["no Vulkan driver", "mesa-vulkan-drivers", "VK_DRIVER_FILES"]);
    assert_works(&place.mica(&nowhere, &["oracle", "--seeds", "2"]));
    for result in [INCOMPATIBLE_DRIVER, INITIALIZATION_FAILED] {
        place.fails(&format!("vkCreateInstance@0={result}"), &[], 3, &["no Vulkan driver"]);
    }
    place.fails(&format!("vkEnumeratePhysicalDevices@0={INITIALIZATION_FAILED}"), &[], 3, &["no Vulkan driver"]);
}

#[test]
fn f21_an_extension_or_feature_that_is_missing_is_named_or_done_without() {
    let place = Place::new();
    let without = "without=VK_KHR_ray_query";
    place.fails(without, &["--occlusion", "ray-query"], 3, &["VK_KHR_ray_query"]);
    assert_works(&place.render(without, &["--occlusion", "auto"]));
    for feature in ["synchronization2", "dynamicRendering", "maintenance4", "shaderStorageImageExtendedFormats"] {
        place.fails(&format!("without={feature}"), &["--no-cache"], 3, &["lacks", feature]);
    }
    let refused = format!("vkCreateDevice@0+={EXTENSION_NOT_PRESENT}");
    place.fails(&refused, &["--no-cache"], 3, &["cannot be used", "vkCreateDevice"]);
}

/// The least that the specification asks of a device, and for bindings of a stage the least of any device with Vulkan 1.3
/// that is known (gpuinfo.org, Intel of 2015 and later).
const POOR: &str = "maxImageDimension2D=4096;maxStorageBufferRange=134217728;maxUniformBufferRange=16384;\
    maxPushConstantsSize=128;maxComputeWorkGroupInvocations=128;maxComputeWorkGroupCount=65535;\
    maxPerStageDescriptorStorageBuffers=64;maxPerStageDescriptorStorageImages=64;\
    maxPerStageDescriptorSampledImages=200";

#[test]
fn f22_a_device_of_low_limits_is_used_within_them_or_refused_by_the_limit_s_name() {
    let place = Place::new();
    let picture = place.argument("a.exr");
    let json = place.argument("a.json");
    // Validation is above the layer, and holds the calls against the low limits.
    let above = ["VK_LAYER_KHRONOS_validation"];
    let environment = mica_fault_layer::environment(place.0.path(), &above, POOR);
    let render = ["render", "--quiet", "--validation", "-o", &picture, "--json", &json];
    let all = ["sphere", "--size", "8x6", "--frames", "1", "--set", "samples=1", "--set", "depth=2"];
    assert_works(&place.mica(&environment, &[&render[..], &all[..]].concat()));
    let report = std::fs::read_to_string(&json).expect("a report");
    assert!(report.contains("\"validation\": []"), "{report}");

    place.fails(POOR, &["--size", "4097x2"], 2, &["4097x2", "4096"]);
    for limit in [
        "maxPushConstantsSize=4",
        "maxComputeWorkGroupInvocations=16",
        "maxPerStageDescriptorStorageBuffers=0",
        "maxPerStageDescriptorStorageImages=0",
        "maxPerStageDescriptorSampledImages=0",
    ] {
        let (name, most) = limit.split_once('=').expect("a limit");
        place.fails(limit, &[], 3, &[name, most, "pass "]);
    }
}

#[test]
fn f23_a_buffer_that_shaders_cannot_see_whole_is_refused_by_name() {
    let place = Place::new();
    place.fails("maxStorageBufferRange=256", &[], 4, &["buffer ", "maxStorageBufferRange", "256"]);
}

#[test]
fn f24_memory_that_runs_out_at_any_allocation_ends_in_one_line() {
    let place = Place::new();
    for allocation in 0.. {
        let faults = format!("vkAllocateMemory@{allocation}={OUT_OF_DEVICE_MEMORY}");
        if place.render(&faults, &[]).status.success() {
            assert!(allocation > 0, "nothing was allocated");
            break;
        }
        place.fails(&faults, &[], 4, &["out of memory"]);
    }
    place.fails(&format!("vkAllocateMemory@0+={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
    place.fails(&format!("vkCreateInstance@0={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
    place.fails(&format!("vkCreateDevice@0={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
}

#[test]
fn f25_a_device_lost_at_any_submission_or_wait_ends_in_one_line() {
    let place = Place::new();
    for call in ["vkQueueSubmit2@0", "vkWaitForFences@0", "vkGetQueryPoolResults@0", "vkCreateDevice@0"] {
        let frames = ["--frames", "2"];
        place.fails(&format!("{call}+={DEVICE_LOST}"), &frames, 4, &["the device was lost"]);
    }
    let later = ["--frames", "2", "--samples", "2"];
    for call in ["vkQueueSubmit2@2", "vkWaitForFences@2"] {
        place.fails(&format!("{call}={DEVICE_LOST}"), &later, 4, &["the device was lost"]);
    }
}

/// The lines of points that were measured before the device went are whole and there.
#[test]
fn f25_a_bench_that_loses_the_device_keeps_what_was_measured() {
    let place = Place::new();
    let bench = ["bench", "--occlusion", "--size", "24x18", "--rays", "100", "--rounds", "2", "--json", "-", "plane"];
    let lines = |output: &Output| {
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.lines().map(|line| serde_json::from_str(line).expect("a whole line")).collect::<Vec<serde_json::Value>>()
    };
    let whole = place.under("", &[&bench[..], &["sphere"]].concat());
    assert_works(&whole);
    let all = lines(&whole).len();
    // The later the loss, the more is kept, and less than all of it.
    let mut kept = Vec::new();
    for submission in [0, 12, 24, 48, 96, 192, 384] {
        let faults = format!("vkQueueSubmit2@{submission}={DEVICE_LOST}");
        let output = place.under(&faults, &[&bench[..], &["sphere"]].concat());
        if output.status.success() {
            break;
        }
        assert_ends(&output, 4, &["the device was lost"]);
        kept.push(lines(&output).len());
    }
    assert!(kept.is_sorted() && kept[0] == 0 && kept.iter().any(|kept| (1..all).contains(kept)), "{kept:?} of {all}");
}

#[test]
fn f26_a_device_that_hangs_is_given_up() {
    let place = Place::new();
    for wait in 0..2 {
        let faults = format!("vkWaitForFences@{wait}={TIMEOUT}");
        place.fails(&faults, &["--frames", "2"], 4, &["did not finish within"]);
    }
}

#[test]
fn f27_a_shader_that_the_driver_rejects_is_named() {
    let place = Place::new();
    for call in ["vkCreateComputePipelines", "vkCreateGraphicsPipelines", "vkCreateShaderModule"] {
        place.fails(&format!("{call}@0={INVALID_SHADER}"), &[], 3, &["the driver rejects shader", "pass "]);
    }
}

#[test]
fn f28_a_pipeline_cache_that_is_damaged_is_rebuilt() {
    let place = Place::new();
    let cache = place.argument("cache");
    let pipelines = || {
        let found = std::fs::read_dir(&cache).expect("a folder").flatten();
        let mut files = found.filter(|file| file.file_name().to_string_lossy().starts_with("pipelines-"));
        files.next().expect("a file of pipelines").path()
    };
    assert_works(&place.render("", &["--cache", &cache]));
    let whole = std::fs::read(pipelines()).expect("a file");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut of_another = whole.clone();
    of_another[20] ^= 0xff;
    for damaged in [&whole[..whole.len() - 1], &flipped, &of_another, b""] {
        std::fs::write(pipelines(), damaged).expect("a file");
        let said = assert_works(&place.render("", &["--cache", &cache]));
        assert!(said.contains("pipeline cache") && said.contains("it is rebuilt"), "{said}");
        assert_eq!(std::fs::read(pipelines()).expect("a file"), whole);
    }
}

#[test]
fn f40_a_device_without_timestamps_renders_and_says_that_it_measures_nothing() {
    let place = Place::new();
    let json = place.argument("a.json");
    assert_works(&place.render("timestampValidBits=0", &["--frames", "2", "--json", &json]));
    let text = std::fs::read_to_string(&json).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert!(report["frame_ns"]["overlapped_median"].is_null(), "{report}");
    let passes = report["passes"].as_array().expect("passes");
    assert!(!passes.is_empty() && passes.iter().all(|pass| pass["median_ns"].is_null()), "{report}");
}

#[test]
fn f44_of_two_devices_the_one_named_is_taken_and_a_wrong_name_lists_both() {
    let place = Place::new();
    let driver = std::env::var("VK_DRIVER_FILES").expect("tests are told which driver to use");
    let driver = Path::new(&driver);
    let folder = driver.parent().expect("a folder");
    // One driver under two names is two devices.
    let text = std::fs::read_to_string(driver).expect("a description");
    let text = text.replace("\"./", &format!("\"{}/", folder.display()));
    let files = ["one.json", "two.json"].map(|name| place.argument(name));
    files.iter().for_each(|file| std::fs::write(file, &text).expect("a file"));
    let both = environment(&[("VK_DRIVER_FILES", &files.join(":"))]);
    let on = |device: &str| place.mica(&both, &render(&["--device", device]));
    assert_works(&on("0"));
    assert_works(&on("1"));
    assert_ends(&on("no such device"), 3, &["no such device", "0 ", "1 "]);
    assert_ends(&on("2"), 3, &["'2'", "0 ", "1 "]);
    // Unplugged between being found and being opened.
    place.fails(&format!("vkCreateDevice@0+={DEVICE_LOST}"), &[], 4, &["the device was lost"]);
    place.fails(&format!("vkCreateDevice@0+={INITIALIZATION_FAILED}"), &[], 3, &["cannot be used"]);
}

#[test]
fn f45_validation_that_is_asked_for_and_not_there_is_an_error() {
    let place = Place::new();
    let nowhere = environment(&[("VK_LAYER_PATH", "/nonexistent")]);
    let output = place.mica(&nowhere, &render(&["--validation"]));
    assert_ends(&output, 3, &["no Vulkan validation", "vulkan-validationlayers"]);
}
