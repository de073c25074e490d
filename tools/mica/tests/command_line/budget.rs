//! Budgets: what is chosen, what is measured again, and what is said where nothing fits.

use super::*;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

/// A view with enough pixels in a band of scale for an error to be defined, and nothing slow to compile.
const VIEW: [&str; 5] = ["sphere", "--size", "48x36", "--env", "none"];
const LIGHT: [&str; 2] = ["--light", "dir:-0.3,-0.5,-1,3,3,3"];
const KEMPPINEN: [&str; 2] = ["--method", "kemppinen"];
/// What everything fits, and what nothing does whose time is known at all.
const ENDLESS: [&str; 2] = ["--budget-ms", "1e9"];
const IMPOSSIBLE: [&str; 2] = ["--budget-ms", "0.000001"];

/// Renders into the cache of a folder, no frame of the picture timed.
fn render(cache: &Path, arguments: &[&[&str]]) -> Output {
    let cache = cache.to_str().expect("temporary folders have plain names");
    let words = [&["render", "--frames", "0", "--json", "-", "--cache", cache], &VIEW[..], &LIGHT, &arguments.concat()];
    run(&words.concat())
}

fn chosen(cache: &Path, arguments: &[&[&str]]) -> Json {
    json(&succeeded(render(cache, arguments)))
}

/// Value, lower and upper end.
fn ends(estimate: &Json) -> [f64; 3] {
    ["value", "low", "high"].map(|end| estimate[end].as_f64().expect("a number"))
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The entries of points in a cache.
fn points_in(cache: &Path) -> Vec<PathBuf> {
    let names = names_in(cache);
    let points = names.iter().filter(|name| name.starts_with("budget-") && !name.ends_with("-reference.bin"));
    points.map(|name| cache.join(name)).collect()
}

#[test]
fn a_budget_is_measured_once_and_then_only_looked_up() {
    let cache = folder();
    let first = chosen(cache.path(), &[&KEMPPINEN, &ENDLESS]);
    let budget = &first["budget"];
    assert_eq!((&budget["measured"], &budget["kept"]), (&Json::from(2), &Json::from(0)));
    assert_eq!((&budget["metric"], &budget["goal"]), (&Json::from("w1"), &serde_json::json!({ "budget_ms": 1e9 })));
    let step = &budget["chosen"];
    assert_eq!((&step["method"], &first["method"]), (&Json::from("kemppinen"), &Json::from("kemppinen")));
    let [error, low, high] = ends(&step["error"]);
    assert!(error > 0.0 && low <= error && error <= high, "{step}");
    for time in ["glint_ns", "frame_ns"] {
        let [value, low, high] = ends(&step[time]);
        assert!(low <= value && value <= high && high > 0.0, "{step}");
    }
    // What is rendered is what was chosen.
    let repaired = step["set"]["repaired"] == "true";
    assert_eq!(first["settings"]["flakes"]["repaired"], repaired);
    assert!(!budget["next_better"].is_object(), "an endless budget buys the best there is");

    let second = chosen(cache.path(), &[&KEMPPINEN, &ENDLESS]);
    assert_eq!((&second["budget"]["measured"], &second["budget"]["kept"]), (&Json::from(0), &Json::from(2)));
    assert_eq!((&second["budget"]["chosen"], &second["image"]), (step, &first["image"]));

    // The command that is named shows the same.
    let command = step["command"].as_str().expect("a command");
    let words: Vec<&str> = command.split_whitespace().skip(1).chain(["--frames", "0", "--json", "-"]).collect();
    let again = json(&succeeded(run(&words)));
    assert_eq!((&again["image"], &again["settings"]), (&first["image"], &first["settings"]), "{command}");
    assert!(again["budget"].is_null());
}

#[test]
fn what_was_measured_of_another_view_is_not_taken_for_this_one() {
    let cache = folder();
    // A slow method far over the budget is timed in a frame or two, and its dearer rungs are not tried: the entry is all that
    // is wanted here.
    let entries = |arguments: &[&str]| {
        failed_in_one_line(&render(cache.path(), &[&["--method", "flakes"], &IMPOSSIBLE, arguments]), 2);
        points_in(cache.path()).len()
    };
    assert_eq!(entries(&[]), 1);
    for (count, other) in (2..).zip([
        &["--set", "count=3e5"][..],
        &["--size", "40x36"],
        &["--light", "point:0,3,3,9,9,9"],
        &["--env", "constant:1,1,1"],
        &["--camera", "0,0,4:0,0,0:30"],
        &["--occlusion", "none"],
        &["--metric", "flicker"],
    ]) {
        assert_eq!(entries(other), count, "{other:?}");
    }
    // One measurement tells all errors of a frame.
    assert_eq!(entries(&["--metric", "mean"]), 8);
    assert_eq!(entries(&[]), 8);
}

#[test]
fn an_error_is_reached_and_a_larger_budget_has_no_larger_error() {
    let cache = folder();
    // Few and quick methods: those of one after the other share their reference.
    // What noise hides counts as its upper end.
    let error_of = |step: &Json| {
        let [value, low, high] = ends(&step["error"]);
        if low <= 0.0 { high } else { value }
    };
    let error = |report: &Json| error_of(&report["budget"]["chosen"]);
    let best = chosen(cache.path(), &[&KEMPPINEN, &ENDLESS]);
    let reached = chosen(cache.path(), &[&KEMPPINEN, &["--target-error", &error(&best).to_string()]]);
    assert_eq!(reached["budget"]["measured"], 0);
    assert!(error(&reached) <= error(&best));
    let loose = chosen(cache.path(), &[&KEMPPINEN, &["--target-error", "1e9"]]);
    let time = |report: &Json| {
        let [value, low, high] = ends(&report["budget"]["chosen"]["glint_ns"]);
        if value <= high - low { high } else { value }
    };
    assert!(time(&loose) <= time(&best) && error(&loose) >= error(&best));
    // Just as much as the cheapest takes buys it, and what is better costs more.
    let tight = chosen(cache.path(), &[&KEMPPINEN, &["--budget-ms", &(time(&loose) * 1e-6 * 1.000_001).to_string()]]);
    assert!(error(&tight) >= error(&best));
    let better = &tight["budget"]["next_better"];
    if better.is_object() {
        assert!(error_of(better) < error(&tight), "{better}");
    }

    let refused = render(cache.path(), &[&KEMPPINEN, &["--target-error", "0"]]);
    let line = failed_in_one_line(&refused, 2);
    assert!(line.contains("the most accurate measured is kemppinen"), "{line}");
}

#[test]
fn an_impossible_budget_is_refused_with_what_the_cheapest_costs() {
    let cache = folder();
    let line = failed_in_one_line(&render(cache.path(), &[&KEMPPINEN, &IMPOSSIBLE]), 2);
    assert!(line.contains("nothing fits 0.000001 ms of glints: the cheapest measured is kemppinen"), "{line}");
    // What was only timed, as it is far over this budget, is held against the reference for a larger one.
    assert!(ends(&chosen(cache.path(), &[&KEMPPINEN, &ENDLESS])["budget"]["chosen"]["error"])[0] > 0.0);
}

#[test]
fn damaged_measurements_are_made_again() {
    let cache = folder();
    let smooth = ["--method", "smooth"];
    chosen(cache.path(), &[&smooth, &ENDLESS]);
    let [path] = &points_in(cache.path())[..] else { panic!("one view has one entry") };
    let whole = std::fs::read(path).expect("an entry");
    let mut damaged = whole.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x20;
    for bytes in [&damaged, &whole[..whole.len() - 1]] {
        std::fs::write(path, bytes).expect("a file");
        let output = render(cache.path(), &[&smooth, &ENDLESS]);
        let warning = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(warning.starts_with("warning: ") && warning.contains("damaged"), "{warning}");
        assert_eq!(json(&succeeded(output))["budget"]["measured"], 1);
    }
    assert_eq!(chosen(cache.path(), &[&smooth, &ENDLESS])["budget"]["measured"], 0, "it is whole again");
}

#[test]
fn an_interrupt_keeps_the_points_that_are_finished() {
    let cache = folder();
    let path = cache.path().to_str().expect("a plain name");
    let words = [&["render", "--frames", "0", "--cache", path], &VIEW[..], &LIGHT, &KEMPPINEN, &ENDLESS].concat();
    let mut child = mica().args(&words).env("RUST_LOG", "info").stderr(Stdio::piped()).spawn().expect("mica starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("measuring kemppinen")), "the program ended early");
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().is_ok_and(|status| status.success()));
    let last = lines.last().unwrap_or_default();
    assert_eq!(child.wait().expect("mica ends").code(), Some(130), "{last}");
    assert!(last.starts_with("mica: interrupted after measuring ") && last.contains("were kept"), "{last}");
    let report = chosen(cache.path(), &[&KEMPPINEN, &ENDLESS]);
    assert_eq!((&report["budget"]["measured"], &report["budget"]["kept"]), (&Json::from(1), &Json::from(1)));
}

#[test]
fn mistakes_with_budgets_are_told_before_anything_is_measured() {
    let cache = folder();
    for (arguments, what) in [
        (&["--budget-ms", "0"][..], "above 0"),
        (&["--budget-ms", "4", "--target-error", "1"], "cannot be used with"),
        (&["--budget-ms", "4", "--edit", "count=3"], "cannot be used with"),
        (&["--metric", "w1"], "--budget-ms"),
        (&["--budget-ms", "4", "--metric", "W2"], "hdr-flip"),
        (&["--budget-ms", "4", "--set", "samples=4"], "choose the method and its settings"),
        (&["--budget-ms", "4", "--set", "method=smooth"], "choose the method and its settings"),
        (&["--budget-ms", "4", "--glint", "flakes:depth=4"], "choose the method and its settings"),
        (&["--budget-ms", "4", "--method", "magic"], "no method `magic`"),
    ] {
        let line = failed_in_one_line(&render(cache.path(), &[arguments]), 2);
        assert!(line.contains(what), "{line}");
    }
    let scene = triangle(cache.path(), "{}");
    let line = failed_in_one_line(&run(&["render", &scene, "--size", "16x16", "--budget-ms", "4", "--no-cache"]), 2);
    assert!(line.contains("no material glints"), "{line}");
}
