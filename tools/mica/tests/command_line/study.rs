//! `mica accuracy -o` and `mica bench`: what is kept, how it goes on, and that it comes out the same. No time is judged.

use crate::{Json, failed_in_one_line, in_folder, json, mica, names_in, run, succeeded};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A study that is over in no time: two methods, of one rung each, on a sphere that fills a small picture.
const SMALL: [&str; 12] = [
    "sphere",
    "--quick",
    "--size",
    "32x18",
    "--seconds",
    "0",
    "--method",
    "smooth",
    "--method",
    "flakes",
    "--rounds",
    "2",
];

fn study(folder: &Path, more: &[&str]) -> String {
    succeeded(run(&[&["accuracy", "-o", folder.to_str().expect("a plain name")], &SMALL[..], more].concat()))
}

fn lines(folder: &Path, name: &str) -> Vec<Json> {
    std::fs::read_to_string(folder.join(name)).expect("lines").lines().map(json).collect()
}

/// The last line of each point.
fn points(folder: &Path, name: &str) -> Vec<Json> {
    let mut points: Vec<Json> = Vec::new();
    let of = |point: &Json| ["place", "content", "method", "rung"].map(|key| point[key].to_string());
    for line in lines(folder, name) {
        points.retain(|point| of(point) != of(&line));
        points.push(line);
    }
    points
}

/// The errors of all points, by method and rung.
fn errors(folder: &Path) -> Vec<(String, String, String)> {
    let mut all: Vec<(String, String, String)> = points(folder, "points.jsonl")
        .iter()
        .map(|point| (point["method"].to_string(), point["rung"].to_string(), point["errors"].to_string()))
        .collect();
    all.sort();
    all
}

#[test]
fn a_study_goes_on_where_it_ended_and_comes_out_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (first, second) = (folder.path().join("made/first"), folder.path().join("second"));
    let text = study(&first, &[]);
    for word in ["sphere 32x18", "W1", "most 2000", "4 points measured, 4 in all", "first/index.html"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    let points = points(&first, "points.jsonl");
    for point in &points {
        assert_eq!(point["schema"], "mica-point-1");
        let build = point["machine"]["build"].as_str().expect("a build");
        assert!(build.starts_with(env!("CARGO_PKG_VERSION")) && build.ends_with(')'), "{build}");
        let cost = &point["cost"];
        let least = |key: &str| cost[key]["low"].as_f64().expect("a number");
        let value = |key: &str| cost[key]["value"].as_f64().expect("a number");
        for key in ["glints", "frame", "ratio"] {
            assert!(least(key) < value(key) && value(key) < cost[key]["high"].as_f64().expect("a number"), "{cost}");
        }
        let of_sittings =
            cost["sittings"].as_array().expect("a list").iter().map(|rounds| rounds.as_array().map(Vec::len));
        assert_eq!(of_sittings.collect::<Vec<_>>(), [Some(1); 3]);
        assert!(value("frame") > 0.0 && !cost["passes"].as_array().expect("a list").is_empty());
        // What glints need holds all tables of the method, and not the scene.
        let bytes = cost["glint_bytes"].as_u64().expect("bytes");
        let rows = cost["memory"].as_array().expect("a list");
        let all: u64 = rows.iter().filter_map(|row| row["bytes"].as_u64()).sum();
        assert!(bytes > 0 && bytes < all, "{bytes} of {all}");
        let of_tables = rows.iter().filter(|row| row["lifetime"] == "settings").filter_map(|row| row["bytes"].as_u64());
        assert!(bytes >= of_tables.sum(), "{cost}");
        let environment = rows.iter().find(|row| row["name"] == "environment").expect("it is shown");
        assert!(bytes + environment["bytes"].as_u64().expect("bytes") <= all, "{cost}");
        for picture in point["pictures"].as_array().expect("two") {
            let path = first.join(picture.as_str().expect("a path"));
            assert_eq!(image::open(path).expect("a picture").into_rgb8().dimensions(), (32, 18));
        }
    }
    // Only the reference's method has the reference's flakes.
    let rel_mse = |method: &str| {
        let point = points.iter().rfind(|point| point["method"] == method).expect("it was measured");
        point["errors"]["rel_mse"]["value"].as_f64().expect("a number")
    };
    assert!(rel_mse("flakes") < 0.5 * rel_mse("smooth"), "{} {}", rel_mse("flakes"), rel_mse("smooth"));
    let floor = &lines(&first, "references.jsonl")[0]["floor"];
    assert!(floor["rel_mse"]["value"].as_f64() > Some(rel_mse("flakes")), "other flakes: {floor}");
    assert!(points[0]["errors"]["path"]["flicker"]["value"].is_number());

    // A kill in the middle of a line: what came before it is kept, bit by bit, and its reference too.
    let file = first.join("points.jsonl");
    let whole = std::fs::read_to_string(&file).expect("lines");
    let before = errors(&first);
    let kept: usize = whole.lines().take(3).map(|line| line.len() + 1).sum();
    std::fs::write(&file, &whole[..kept + 40]).expect("written");
    assert!(study(&first, &[]).contains("1 points measured, 4 in all"));
    let now = std::fs::read_to_string(&file).expect("lines");
    assert_eq!(now[..kept], whole[..kept]);
    assert_eq!(lines(&first, "references.jsonl").len(), 1);
    assert_eq!(errors(&first), before);
    assert!(study(&first, &[]).contains("0 points measured, 4 in all"));
    assert!(
        study(&first, &["--lighting", "environment", "--method", "shopf"]).contains("6 points measured, 10 in all")
    );

    study(&second, &[]);
    assert_eq!(errors(&second), before);
    for name in names_in(&second.join("pictures")).iter().map(|name| format!("pictures/{name}")) {
        assert_eq!(std::fs::read(second.join(&name)).ok(), std::fs::read(first.join(&name)).ok(), "{name}");
    }
}

/// The scene of a file is what it holds, not its name; a point is kept while its pictures are, and its line is of this form.
#[test]
fn what_changed_or_is_lost_is_measured_again_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("scene.glb");
    let made = folder.path().join("made");
    let embedded = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../assets/scenes/{name}.glb"));
        std::fs::copy(path, &scene).expect("copied");
    };
    let measured = || {
        let paths = [&made, &scene].map(|path| path.to_str().expect("a plain name"));
        let again = ["--quick", "--size", "16x9", "--seconds", "0", "--method", "smooth", "--rounds", "2"];
        succeeded(run(&[&["accuracy", "-o", paths[0], paths[1]], &again[..]].concat()))
    };
    embedded("sphere");
    assert!(measured().contains("1 points measured, 1 in all"));
    assert!(measured().contains("0 points measured, 1 in all"));
    embedded("cloth");
    assert!(measured().contains("1 points measured, 2 in all"));

    let points = points(&made, "points.jsonl");
    let [before, after] = [0, 1].map(|k| (points[k]["content"].to_string(), points[k]["errors"].to_string()));
    assert!(before.0 != after.0 && before.1 != after.1, "{points:?}");
    std::fs::remove_file(made.join(points[1]["pictures"][0].as_str().expect("a path"))).expect("it was there");
    assert!(measured().contains("1 points measured, 2 in all"));

    // The reference is there for whoever looks, even where every point is.
    let reference = made.join(lines(&made, "references.jsonl")[1]["pictures"][1].as_str().expect("a path"));
    let whole = std::fs::read(&reference).expect("a file");
    for cut in [0, whole.len() / 2] {
        std::fs::write(&reference, &whole[..cut]).expect("written");
        assert!(measured().contains("0 points measured, 2 in all"));
        assert!(std::fs::read(&reference).is_ok_and(|bytes| bytes == whole), "after {cut} bytes");
    }

    let file = made.join("points.jsonl");
    let older = std::fs::read_to_string(&file).expect("lines").replace("mica-point-1", "mica-point-0");
    std::fs::write(&file, older).expect("written");
    assert!(measured().contains("1 points measured, 1 in all"));
}

#[test]
fn an_interrupt_keeps_what_is_finished_and_a_second_process_waits_outside() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "study");
    let arguments =
        ["accuracy", "-o", &path, "sphere", "--quick", "--size", "32x18", "--rounds", "10000", "--seconds", "1e6"];
    let child = mica()
        .args(arguments)
        .args(["--method", "smooth"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("mica starts");
    let points = folder.path().join("study/points.jsonl");
    let begun = Instant::now();
    while !points.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let error = failed_in_one_line(&run(&[&arguments[..], &["--method", "shopf"]].concat()), 2);
    assert!(error.contains("another mica"), "{error}");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(sent.success());
    let error = failed_in_one_line(&child.wait_with_output().expect("it ends"), 130);
    assert!(error.contains("0 points") && error.contains("goes on"), "{error}");
    assert_eq!(std::fs::read_to_string(&points).ok().as_deref(), Some(""));
}

#[test]
fn a_bench_times_methods_and_goes_on_in_its_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let bench = |more: &[&str]| {
        let arguments = ["bench", "sphere", "--size", "24x18", "--method", "smooth", "--rounds", "1", "--json", &path];
        succeeded(run(&[&arguments[..], more].concat()))
    };
    let text = bench(&[]);
    assert!(text.contains("glints ms") && text.contains("1 points measured") && !text.contains("W1"), "{text}");
    assert!(bench(&[]).contains("0 points measured"));
    assert!(bench(&["--size", "32x18"]).contains("1 points measured"));
    let points = lines(folder.path(), "bench.jsonl");
    let sizes: Vec<String> = points.iter().map(|point| point["place"]["size"].to_string()).collect();
    // A line after the first sitting, and one after the last.
    assert_eq!(sizes, ["[24,18]", "[24,18]", "[32,18]", "[32,18]"]);
    assert!(points.iter().all(|point| point["errors"].is_null()));
    let rounds = |point: &Json| point["cost"]["sittings"].as_array().map(Vec::len);
    assert_eq!(points.iter().map(rounds).collect::<Vec<_>>(), [Some(1), Some(3), Some(1), Some(3)], "{points:?}");

    // The command of a point renders it.
    let command = points[2]["command"].as_str().expect("a command").to_owned();
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    let output = mica().args(&words).current_dir(folder.path()).output().expect("mica starts");
    succeeded(output);
    let rendered = image::open(folder.path().join("point.png")).expect("a picture");
    assert_eq!((rendered.width(), rendered.height()), (32, 18));
}

#[test]
fn a_place_that_cannot_be_measured_is_said_and_the_others_go_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    // The sphere has no lights, and the file is no scene.
    let broken = in_folder(folder.path(), "none.glb");
    std::fs::write(&broken, "x").expect("written");
    let output = run(&[
        "bench",
        "sphere",
        &broken,
        "--size",
        "24x18",
        "--method",
        "smooth",
        "--rounds",
        "1",
        "--lighting",
        "lights",
        "--lighting",
        "own",
        "--json",
        &path,
    ]);
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    for part in ["sphere has no lights", "none.glb"] {
        assert!(error.lines().any(|line| line.starts_with("warning: ") && line.contains(part)), "{error}");
    }
    // What was said is not said again.
    let last = error.lines().last().unwrap_or_default();
    assert!(last.starts_with("mica: ") && last.contains("left out") && !last.contains("lights"), "{error}");
    assert_eq!(points(folder.path(), "bench.jsonl").len(), 1);
}

#[test]
fn what_cannot_be_studied_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = in_folder(folder.path(), "file");
    std::fs::write(&file, "x").expect("a file");
    let prose = in_folder(folder.path(), "prose");
    std::fs::write(&prose, "not JSON\n").expect("a file");
    let inside = in_folder(folder.path(), "file/study");
    let fine = in_folder(folder.path(), "study");
    for (arguments, part) in [
        (&["accuracy", "-o", &file, "plane"][..], "name a folder"),
        (&["accuracy", "-o", &inside, "plane"], "name a folder"),
        (&["accuracy", "-o", &fine, "plane", "--lighting", "dark"], "dark"),
        (&["accuracy", "-o", &fine, "plane", "--size", "0x5"], "--size"),
        (&["accuracy", "-o", &fine, "plane", "--seconds", "-1"], "seconds"),
        (&["accuracy", "-o", &fine, "plane", "--rounds", "0"], "--rounds"),
        (&["accuracy", "-o", &fine, "plane", "--method", "magic"], "magic"),
        (&["accuracy", "--counts", "plane"], "--counts"),
        (&["bench", "plane", "--method", "magic"], "magic"),
        (&["bench", "plane", "none.glb"], "no such file"),
        (&["accuracy", "-o", &fine, "plane", "nowhere"], "embedded are"),
        (&["bench", "plane", "--json", &file], "another file"),
        (&["bench", "plane", "--json", &prose], "another file"),
        (&["bench", "plane", "--rays", "7"], "--occlusion"),
        (&["bench", "plane", "--json", &inside], "file/study"),
        (&["bench", "--occlusion", "--size", "8x8", "--size", "9x9"], "one --size"),
    ] {
        let error = failed_in_one_line(&run(arguments), 2);
        assert!(error.contains(part), "{error}");
    }
    assert_eq!(std::fs::read_to_string(&file).expect("it is there"), "x");
}

#[test]
fn a_missing_device_ends_a_study_and_a_bench_at_once_and_nothing_that_was_kept_is_lost() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kept = folder.path().join("study");
    let path = kept.to_str().expect("a plain name");
    let small = ["sphere", "--quick", "--size", "32x18", "--seconds", "0", "--rounds", "1", "--method", "smooth"];
    succeeded(run(&[&["accuracy", "-o", path], &small[..]].concat()));
    let files = || ["points.jsonl", "references.jsonl"].map(|name| std::fs::read(kept.join(name)).expect("lines"));
    let before = files();
    let places = ["sphere", "plane", "--size", "32x18", "--size", "40x30", "--device", "nobody"];
    for command in [&["accuracy", "-o", path, "--quick"][..], &["bench"]] {
        let line = failed_in_one_line(&run(&[command, &places].concat()), 3);
        assert!(line.contains("nobody") && !line.contains("left out"), "{line}");
    }
    assert_eq!(files(), before);
}
