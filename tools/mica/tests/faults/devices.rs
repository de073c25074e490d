//! Loaders, drivers and devices that are missing, poor or failing. A layer below the program plays them.

use super::programs::{failed, failed_after_warnings, mica};
use serde_json::Value as Json;
use std::ffi::OsString;
use std::path::Path;
use std::process::Output;
use std::time::{Duration, Instant};

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

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn argument(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("temporary folders have plain names").to_owned()
    }

    fn mica(&self, environment: &[(&str, OsString)], arguments: &[&str]) -> Output {
        mica()
            .args(arguments)
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
        failed(&output, code, words);
        assert!(!Path::new(&self.argument("a.exr")).exists(), "{faults}: a picture is left");
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
    failed(&output, 3, &["no Vulkan loader", "libvulkan1"]);
}

#[test]
fn f20_without_a_driver_the_package_is_named_and_the_oracle_still_answers() {
    let place = Place::new();
    let nowhere = environment(&[("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")]);
    let output = place.mica(&nowhere, &render(&[]));
    failed(&output, 3, &["no Vulkan driver", "mesa-vulkan-drivers", "VK_DRIVER_FILES"]);
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
    let picture = |faults: &str| {
        assert_works(&place.render(faults, &[]));
        std::fs::read(place.argument("a.exr")).expect("a picture")
    };
    let expected = picture("");
    for allocation in 0.. {
        // One that fails is made once more, smaller, and then there is none.
        assert!(picture(&format!("vkAllocateMemory@{allocation}={OUT_OF_DEVICE_MEMORY}")) == expected);
        let faults = format!("vkAllocateMemory@{allocation}+={OUT_OF_DEVICE_MEMORY}");
        if place.render(&faults, &[]).status.success() {
            assert!(allocation > 0, "nothing was allocated");
            break;
        }
        place.fails(&faults, &[], 4, &["out of memory"]);
    }
    assert!(
        picture(&format!("largestAllocation={}", 12 << 20)) == expected,
        "blocks are larger, and nothing needs them"
    );
    place.fails("largestAllocation=4096", &[], 4, &["out of memory"]);
    place.fails(&format!("vkAllocateMemory@0+={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
    place.fails(&format!("vkCreateInstance@0={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
    place.fails(&format!("vkCreateDevice@0={OUT_OF_DEVICE_MEMORY}"), &[], 4, &["out of memory"]);
}

/// What is said of the one loss that is made up for.
const ONCE_MORE: &str = "warning: the device was lost";

#[test]
fn f25_a_device_lost_for_good_ends_in_one_line_after_one_more_try() {
    let place = Place::new();
    for call in
        ["vkQueueSubmit2@0", "vkWaitForFences@0", "vkGetQueryPoolResults@0", "vkCreateDevice@0", "vkQueueSubmit2@2"]
    {
        let _ = std::fs::remove_file(place.argument("a.exr"));
        let output = place.render(&format!("{call}+={DEVICE_LOST}"), &["--frames", "2"]);
        let (warnings, _) = failed_after_warnings(&output, 4, &["the device was lost"]);
        assert!(warnings.starts_with(ONCE_MORE) && warnings.lines().count() == 1, "{call}: {warnings}");
        assert!(!Path::new(&place.argument("a.exr")).exists(), "{call}: a picture is left");
    }
}

#[test]
fn f25_a_device_that_is_lost_once_is_replaced_and_the_picture_is_the_same() {
    let place = Place::new();
    let arguments = ["--frames", "2", "--samples", "2"];
    let picture = |faults: &str| {
        let said = assert_works(&place.render(faults, &arguments));
        (std::fs::read(place.argument("a.exr")).expect("a picture"), said)
    };
    let (expected, silence) = picture("");
    assert_eq!(silence, "");
    for call in ["vkQueueSubmit2@0", "vkQueueSubmit2@2", "vkWaitForFences@1", "vkWaitForFences@3", "vkCreateDevice@0"] {
        let (bytes, said) = picture(&format!("{call}={DEVICE_LOST}"));
        assert!(said.starts_with(ONCE_MORE) && said.lines().count() == 1, "{call}: {said}");
        assert!(bytes == expected, "{call}: another picture");
    }
}

/// The lines of a bench's standard output.
fn lines(output: &Output) -> Vec<Json> {
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().map(|line| serde_json::from_str(line).expect("a whole line")).collect()
}

const RAYS: [&str; 10] = ["bench", "--occlusion", "--size", "24x18", "--rays", "100", "--rounds", "2", "--json", "-"];

#[test]
fn f25_a_bench_that_loses_the_device_goes_on_once_and_keeps_what_was_measured() {
    let place = Place::new();
    let bench = [&RAYS[..], &["plane", "sphere"]].concat();
    let whole = place.under("", &bench);
    assert_works(&whole);
    let all = lines(&whole).len();
    // The later the losses begin, the more is kept, and less than all of it.
    let mut kept = Vec::new();
    for submission in [0, 12, 24, 48, 96, 192, 384] {
        let lost = place.under(&format!("vkQueueSubmit2@{submission}+={DEVICE_LOST}"), &bench);
        if lost.status.success() {
            break;
        }
        let (warnings, _) = failed_after_warnings(&lost, 4, &["the device was lost"]);
        assert!(warnings.starts_with(ONCE_MORE), "{warnings}");
        kept.push(lines(&lost).len());
        let once = place.under(&format!("vkQueueSubmit2@{submission}={DEVICE_LOST}"), &bench);
        assert!(assert_works(&once).starts_with(ONCE_MORE));
        assert_eq!(lines(&once).len(), all, "a loss at submission {submission} took lines");
    }
    assert!(kept.is_sorted() && kept[0] == 0 && kept.iter().any(|kept| (1..all).contains(kept)), "{kept:?} of {all}");
}

#[test]
fn f25_a_bench_of_methods_measures_the_point_of_a_lost_device_again() {
    let place = Place::new();
    let bench =
        ["bench", "sphere", "--size", "8x6", "--method", "smooth", "--method", "zirr_kaplanyan", "--rounds", "1"];
    let bench = [&bench[..], &["--json", "-", "--quiet"]].concat();
    let names = |output: &Output| lines(output).iter().map(|line| line["method"].to_string()).collect::<Vec<_>>();
    let whole = place.under("", &bench);
    assert_works(&whole);
    let expected = names(&whole);
    assert!(expected.len() >= 2, "{expected:?}");
    // In the first point, in a later one, and in the sittings after all points: as far as there are so many submissions.
    let mut losses = 0;
    for submission in [3, 20, 40, 60, 80] {
        let output = place.under(&format!("vkQueueSubmit2@{submission}={DEVICE_LOST}"), &bench);
        losses += usize::from(assert_works(&output).starts_with(ONCE_MORE));
        assert_eq!(names(&output), expected, "a loss at submission {submission}");
    }
    assert!(losses >= 3, "only {losses} losses");
    // Twice: the second point that loses its device is left out, by name.
    let output = place.under(&format!("vkQueueSubmit2@3={DEVICE_LOST};vkQueueSubmit2@5={DEVICE_LOST}"), &bench);
    let (warnings, _) = failed_after_warnings(&output, 4, &["left out"]);
    assert!(warnings.lines().count() == 2 && warnings.contains("is left out: the device was lost"), "{warnings}");
}

/// An hour's wait in a second, as on processors frames may take that long.
#[test]
fn f26_a_device_that_hangs_is_given_up_once_and_not_waited_for_again() {
    let place = Place::new();
    for submission in 0..2 {
        let start = Instant::now();
        place.fails(&format!("hang={submission}/3600"), &["--frames", "2"], 4, &["did not finish within"]);
        assert!(start.elapsed() >= Duration::from_secs(1), "it was not waited for");
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

/// Every number of a report that is a time.
fn times(report: &Json) -> Vec<f64> {
    fn collect(value: &Json, is_time: bool, found: &mut Vec<f64>) {
        match value {
            Json::Object(fields) => {
                fields.iter().for_each(|(key, value)| {
                    collect(value, is_time || key == "ns" || key.ends_with("_ns"), found);
                });
            }
            Json::Array(all) => all.iter().for_each(|value| collect(value, is_time, found)),
            Json::Number(number) if is_time => found.extend(number.as_f64()),
            _ => {}
        }
    }
    let mut found = Vec::new();
    collect(report, false, &mut found);
    found
}

#[test]
fn f40_a_clock_that_jumps_or_runs_backwards_gives_no_time_and_one_that_wraps_the_right_one() {
    let place = Place::new();
    let json = place.argument("a.json");
    let begun = Instant::now();
    let report = |faults: &str| {
        assert_works(&place.render(faults, &["--frames", "3", "--no-cache", "--json", &json]));
        let text = std::fs::read_to_string(&json).expect("a report");
        let report: Json = serde_json::from_str(&text).expect("JSON");
        let most_ns = begun.elapsed().as_nanos() as f64;
        assert!(times(&report).iter().all(|ns| (0.0..most_ns).contains(ns)), "{faults}: {report}");
        let passes = report["passes"].as_array().expect("passes");
        let known = passes.iter().filter(|pass| pass["median_ns"].is_u64()).count();
        (known, passes.len(), report)
    };
    let (known, all, right) = report("");
    assert!(known == all && right["frame_ns"]["overlapped_median"].is_u64(), "{right}");
    let (known, ..) = report("clock=wrap;timestampValidBits=36");
    assert_eq!(known, all, "a counter that wraps is understood");
    let (known, _, back) = report("clock=back");
    assert_eq!(known, 0, "{back}");
    assert!(back["frame_ns"]["overlapped_median"].is_null() && back["frame_ns"]["isolated_sum"].is_null(), "{back}");
    assert!(back["frame_ns"]["overlapped_cpu_median"].is_u64(), "the system's own clock is another: {back}");
    let (known, _, jump) = report("clock=jump");
    assert!((1..all).contains(&known), "only the pass in which it jumps has no time: {jump}");
    assert!(jump["frame_ns"]["overlapped_median"].is_null() && jump["frame_ns"]["isolated_sum"].is_null(), "{jump}");

    // For people, too: a dash stands for what is not known.
    let output = place.under("clock=back", &["render", "sphere", "--size", "8x6", "--frames", "2", "--no-cache"]);
    assert_works(&output);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("frame: - ms as it runs") && text.contains("- ms pass by pass"), "{text}");
    let bench = [&RAYS[..], &["plane"]].concat();
    for clock in ["clock=back", "clock=jump"] {
        let output = place.under(clock, &bench);
        let text = assert_works(&output);
        assert!(lines(&output).iter().flat_map(times).all(|ns| (0.0..60e9).contains(&ns)), "{clock}: {text}");
    }
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
    failed(&on("no such device"), 3, &["no such device", "0 ", "1 "]);
    failed(&on("2"), 3, &["'2'", "0 ", "1 "]);
    // Unplugged between being found and being opened.
    let lost = place.render(&format!("vkCreateDevice@0+={DEVICE_LOST}"), &[]);
    failed_after_warnings(&lost, 4, &["the device was lost"]);
    place.fails(&format!("vkCreateDevice@0+={INITIALIZATION_FAILED}"), &[], 3, &["cannot be used"]);
}

#[test]
fn f45_validation_that_is_asked_for_and_not_there_is_an_error() {
    let place = Place::new();
    let nowhere = environment(&[("VK_LAYER_PATH", "/nonexistent")]);
    let output = place.mica(&nowhere, &render(&["--validation"]));
    failed(&output, 3, &["no Vulkan validation", "vulkan-validationlayers"]);
}
