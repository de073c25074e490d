//! Renders: what is reported, what is written, what an edit makes anew, and that the same command gives the same bytes.

use super::*;
use exr::prelude::{AttributeValue, MetaData, Text};
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

fn names(list: &Json) -> Vec<&str> {
    list.as_array().expect("a list").iter().filter_map(|entry| entry["name"].as_str()).collect()
}

#[test]
fn a_report_holds_what_the_contract_says() {
    let report = report(&[&QUICK]);
    assert_eq!(report["schema"], "mica-render-1");
    assert_eq!((&report["scene"], &report["method"]), (&Json::from("sphere"), &Json::from("wang2020")));
    assert_eq!(report["size"], serde_json::json!([24, 18]));
    assert_eq!(report["occlusion"], "bvh");
    for key in ["name", "driver", "api"] {
        assert!(report["device"][key].as_str().is_some_and(|text| !text.is_empty()), "{key}");
    }
    let settings = report["settings"].as_object().and_then(|materials| materials.values().next()).expect("a material");
    assert_eq!((&settings["samples"], &settings["depth"]), (&Json::from(1), &Json::from(3)));
    assert!(report["frames"]["warmup"].as_u64() >= Some(2));
    assert_eq!(report["frames"]["measured"], 1);

    let passes = report["passes"].as_array().expect("a list");
    let all = names(&report["passes"]);
    let once: Vec<&str> =
        passes.iter().filter(|pass| pass["once"] == true).filter_map(|pass| pass["name"].as_str()).collect();
    for name in ["dpf", "dpf_accumulate", "prefilter", "quadtree"] {
        assert!(once.contains(&name), "{name} in {once:?}");
    }
    for name in [
        "visibility",
        "surface",
        "base",
        "glints",
        "occlusion",
        "blur_glints",
        "blur_visibility",
        "composite",
        "tonemap",
    ] {
        assert!(all.contains(&name) && !once.contains(&name), "{name} in {all:?}");
    }
    let mut unique = all.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), all.len(), "{all:?}");
    for pass in passes {
        let [min, median, max] = ["min_ns", "median_ns", "max_ns"].map(|key| pass[key].as_u64().expect("a time"));
        assert!(min <= median && median <= max, "{pass}");
    }
    // A pass that runs twice in a frame, once for each axis, is one row.
    let blur = passes.iter().find(|pass| pass["name"] == "blur_glints").expect("a blur");
    assert_eq!(blur["runs"], 2);

    let every_frame = passes.iter().filter(|pass| pass["once"] == false);
    let sum: u64 = every_frame.filter_map(|pass| pass["median_ns"].as_u64()).sum();
    assert_eq!(report["frame_ns"]["isolated_sum"], sum);
    assert!(report["frame_ns"]["overlapped_median"].as_u64() > Some(0));
    let glints = report["glint_ns"].as_u64().expect("a time");
    assert!(glints > 0 && glints < sum);

    let memory = report["memory"].as_array().expect("a list");
    assert!(memory.iter().any(|row| row["name"].as_str().is_some_and(|name| name.starts_with("quadtree_nodes"))));
    for row in memory {
        assert!(row["bytes"].as_u64() > Some(0), "{row}");
        assert!(["frame", "scene", "settings"].iter().any(|lifetime| row["lifetime"] == *lifetime), "{row}");
    }
    assert_eq!(report["image"]["nonfinite"], 0);
    assert!(report["image"]["max"].as_f64() > Some(0.0));
    assert!(report["image"]["mean"].as_array().is_some_and(|mean| mean.len() == 3));
    assert_eq!(report["interrupted"], false);
}

#[test]
fn two_runs_give_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [a_exr, b_exr, a_png, b_png] = ["a.exr", "b.exr", "a.png", "b.png"].map(|name| in_folder(folder.path(), name));
    let words = [&["render"], &QUICK[..], &["--samples", "2"]].concat();
    succeeded(run(&[&words[..], &["--frames", "0", "-o", &a_exr, "-o", &a_png]].concat()));
    // Neither tables that were kept nor the frames that are measured may show.
    succeeded(run(&[&words[..], &["--frames", "2", "--no-cache", "-o", &b_exr, "-o", &b_png]].concat()));
    let read = |path: &str| fs::read(path).expect("a file");
    assert!(read(&a_exr) == read(&b_exr), "the .exr differ");
    assert!(read(&a_png) == read(&b_png), "the .png differ");
    assert_eq!(names_in(folder.path()), ["a.exr", "a.png", "b.exr", "b.png"]);
}

#[test]
fn a_second_start_reads_what_the_first_one_made() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cache = in_folder(folder.path(), "cache");
    let start = |method: &str, name: &str| {
        let path = in_folder(folder.path(), name);
        let of_method = ["--method", method, "--env", "dusk", "--cache", &cache, "-o", &path];
        let report = report(&[&SMALL, &of_method]);
        (report, fs::read(path).expect("a picture"))
    };
    for (method, table) in
        [("wang2020", "prefilter"), ("kemppinen", "environment_specular"), ("flakes", "flake_counts")]
    {
        let (first, picture) = start(method, "first.exr");
        let (second, same) = start(method, "second.exr");
        assert!(picture == same, "{method}: another picture");
        let is_read = |report: &Json| {
            let updates = report["updates"].as_array().expect("a list");
            let update = updates.iter().find(|update| update["pass"] == table);
            update.unwrap_or_else(|| panic!("{table} in {updates:?}"))["why"] == "read from the cache"
        };
        // What makes no picture dear is not kept.
        let is_kept = table != "flake_counts";
        assert_eq!((is_read(&first), is_read(&second)), (false, is_kept), "{method}");
        let pipelines = |report: &Json| report["start"]["pipelines"].as_u64().expect("a number");
        assert_eq!(pipelines(&second) < pipelines(&first), is_kept, "{method}");
    }
    let cones = |name: &String| name.starts_with("environment_cone");
    assert_eq!(names_in(Path::new(&cache)).iter().filter(|name| cones(name)).count(), 1);
}

#[test]
fn an_exr_says_what_it_shows() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "a.exr");
    let report = report(&[&QUICK, &["--frames", "0", "--set", "count=12345", "-o", &path]]);
    let pixels = exr::prelude::read_first_rgba_layer_from_file(
        &path,
        |size, _| vec![[0.0_f32; 4]; size.area()],
        |pixels, at, (r, g, b, a): (f32, f32, f32, f32)| pixels[at.y() * 24 + at.x()] = [r, g, b, a],
    );
    let pixels = pixels.expect("a readable file").layer_data.channel_data.pixels;
    assert_eq!(pixels.len(), 24 * 18);
    let mean: f64 = pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64;
    let reported = report["image"]["mean"][1].as_f64().expect("a number");
    assert!((mean - reported).abs() < 1e-9 * mean, "{mean} and {reported}");
    // Linear and unclamped: the studio's lamps are brighter than white.
    assert!(pixels.iter().flatten().any(|channel| *channel > 1.0));

    let meta = MetaData::read_from_file(&path, false).expect("a readable file");
    let attributes = &meta.headers[0].own_attributes.other;
    let text = |name: &str| match attributes.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!((text("scene").as_str(), text("method").as_str()), ("sphere", "wang2020"));
    assert_eq!(json(&text("settings")), report["settings"]);
    assert!(text("settings").contains("12345"));
    assert!(text("camera").contains("degrees"));
    assert!(text("device").contains(report["device"]["name"].as_str().unwrap_or("?")));
}

#[test]
fn smooth_has_no_pass_and_no_byte_of_another_method() {
    let of_method = |method: &str| report(&[&SMALL, &["--method", method, "--frames", "1"]]);
    let (smooth, wang2020) = (of_method("smooth"), of_method("wang2020"));
    let glint_passes = [
        "dpf",
        "dpf_accumulate",
        "prefilter",
        "prefilter_probability",
        "quadtree",
        "glints",
        "occlusion",
        "blur_glints",
        "blur_visibility",
    ];
    let tables = ["dpf", "prefilter", "quadtree", "visibility"];
    for pass in glint_passes {
        assert!(names(&wang2020["passes"]).contains(&pass), "{pass}: a name of this test is out of date");
        assert!(!names(&smooth["passes"]).contains(&pass), "{pass}");
    }
    assert!(smooth["updates"].as_array().is_some_and(|updates| {
        updates.iter().all(|update| !glint_passes.iter().any(|pass| update["pass"] == *pass))
    }));
    for row in names(&smooth["memory"]) {
        assert!(!tables.iter().any(|table| row.starts_with(table)), "{row}");
    }
    let explained =
        |method: &str| json(&succeeded(run(&[&["explain", "--json", "--method", method], &SMALL[..]].concat())));
    let resources = explained("smooth");
    for resource in names(&resources["resources"]) {
        assert!(!tables.iter().any(|table| resource.starts_with(table)), "{resource}");
    }
    assert!(
        resources["left_out"]
            .as_array()
            .is_some_and(|effects| effects.iter().any(|effect| effect["what"] == "occlusion"))
    );
}

#[test]
fn an_edit_makes_anew_what_depends_on_it_and_nothing_else() {
    let edits = ["count=2e5", "gamma_deg=3.5", "alpha=0.31", "color=0.5,0.25,1", "seed=9", "flakes:count=3e5"];
    let arguments: Vec<&str> = edits.iter().flat_map(|edit| ["--edit", edit]).collect();
    let report = report(&[&QUICK, &["--frames", "0"], &arguments]);
    let updates = report["updates"].as_array().expect("a list");
    let passes_of = |edit: &str| {
        let of_edit = updates.iter().filter(|update| update["edit"] == edit);
        let mut passes: Vec<&str> = of_edit.filter_map(|update| update["pass"].as_str()).collect();
        passes.sort_unstable();
        passes
    };
    assert_eq!(passes_of("count=2e5"), ["quadtree"]);
    assert_eq!(passes_of("seed=9"), ["quadtree"]);
    assert_eq!(passes_of("flakes:count=3e5"), ["quadtree"]);
    for edit in ["gamma_deg=3.5", "alpha=0.31"] {
        assert_eq!(passes_of(edit), ["dpf_accumulate", "prefilter", "prefilter_probability"], "{edit}");
    }
    // The colour is in what shaders read of each material, and no table depends on it.
    assert_eq!(passes_of("color=0.5,0.25,1"), [""; 0]);

    let quadtree = updates.iter().find(|update| update["edit"] == "count=2e5").expect("an update");
    assert_eq!((&quadtree["frame"], &quadtree["runs"]), (&Json::from(1), &Json::from(3)));
    assert!(quadtree["why"].as_str().is_some_and(|why| why.contains("count")));
    assert!(
        updates.iter().any(|update| update["frame"] == 0 && update["edit"].is_null() && update["pass"] == "quadtree")
    );
    // The report and the picture are of the last state.
    assert_eq!(report["settings"]["flakes"]["count"], 300_000);
    assert_eq!(report["settings"]["flakes"]["gamma_deg"], 3.5);
}

#[test]
fn a_picture_after_edits_is_the_picture_with_those_settings() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [edited, set, before] = ["edited.exr", "set.exr", "before.exr"].map(|name| in_folder(folder.path(), name));
    let words = [&["render", "--frames", "0", "--quiet"], &QUICK[..]].concat();
    succeeded(run(&[&words[..], &["--edit", "count=2e5", "--edit", "alpha=0.3", "-o", &edited]].concat()));
    succeeded(run(&[&words[..], &["--set", "count=2e5", "--glint", "flakes:alpha=0.3", "-o", &set]].concat()));
    succeeded(run(&[&words[..], &["-o", &before]].concat()));
    let read = |path: &str| fs::read(path).expect("a file");
    assert!(read(&edited) == read(&set));
    assert!(read(&edited) != read(&before), "the settings change nothing, so the comparison above says nothing");
}

#[test]
fn timing_measures_what_was_asked_for() {
    let of = |timing: &str| report(&[&SMALL, &["--method", "smooth", "--frames", "3", "--timing", timing]]);
    let isolated = of("isolated");
    assert!(isolated["frame_ns"]["isolated_sum"].is_u64() && isolated["frame_ns"]["overlapped_median"].is_null());
    let overlapped = of("overlapped");
    assert!(overlapped["frame_ns"]["isolated_sum"].is_null() && overlapped["frame_ns"]["overlapped_median"].is_u64());
    assert_eq!(overlapped["frames"]["measured"], 3);
    assert_eq!(names(&overlapped["passes"]), names(&isolated["passes"]));
}

#[test]
fn what_was_asked_for_is_what_is_lit_and_seen() {
    let base = [&SMALL[..], &["--method", "smooth", "--frames", "0"]].concat();
    let of = |arguments: &[&str]| report(&[&base, arguments]);
    let mean = |report: &Json| report["image"]["mean"][0].as_f64().expect("a number");
    let dark = of(&["--env", "none", "--no-lights"]);
    assert_eq!((mean(&dark), &dark["lights"]), (0.0, &Json::from(0)));
    assert_eq!(dark["environment"]["name"], "none");
    // Nothing of the sphere is seen from here: each pixel is the sky.
    let away = ["--camera", "0,0,50:0,0,100:30"];
    let sky = of(&[&["--env", "constant:0.25,0.5,2"], &away[..]].concat());
    assert_eq!(sky["image"]["mean"], serde_json::json!([0.25, 0.5, 2.0]));
    assert!((sky["camera"]["forward"][2].as_f64().expect("a number") - 1.0).abs() < 1e-12);
    let lit = of(&["--env", "none", "--light", "dir:0,-1,-1,3,3,3"]);
    assert!(mean(&lit) > 0.0 && lit["lights"] == 1);
    let shaded = of(&["--env", "none", "--light", "point:0,100,100,3,3,3", "--occlusion", "none"]);
    assert_eq!((&shaded["occlusion"], &shaded["lights"]), (&Json::from("none"), &Json::from(1)));
}

#[test]
fn a_scene_that_says_nothing_of_light_gets_a_sky() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let environment = |extras: &str, arguments: &[&str]| {
        let scene = triangle(folder.path(), extras);
        report(&[&[&scene, "--size", "16x16", "--frames", "0"], arguments])["environment"]["name"].clone()
    };
    assert_eq!(environment("{}", &[]), "overcast");
    assert_eq!(environment("{}", &["--light", "dir:0,0,-1,1,1,1"]), "none");
    assert_eq!(environment(r#"{"environment":"dusk"}"#, &[]), "dusk");
    assert_eq!(environment(r#"{"environment":"dusk"}"#, &["--env", "studio"]), "studio");
}

#[test]
fn settings_without_effect_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = triangle(folder.path(), "{}");
    let output = run(&["render", &scene, "--size", "16x16", "--frames", "0", "--quiet", "--set", "count=3"]);
    let warning = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && warning.lines().count() == 1, "{warning}");
    assert!(warning.starts_with("warning: ") && warning.contains("no material glints"), "{warning}");
}

#[test]
fn the_validation_layer_has_nothing_to_say() {
    let report =
        report(&[&QUICK, &["--samples", "2", "--validation", "--light", "dir:0,-1,-1,3,3,3", "--edit", "count=2e5"]]);
    assert_eq!(report["validation"], serde_json::json!([]));
}

#[test]
fn the_table_names_passes_files_and_memory_and_quiet_prints_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [picture, report] = ["a.png", "a.json"].map(|name| in_folder(folder.path(), name));
    let words = [&["render", "--frames", "1", "-o", &picture, "--json", &report], &QUICK[..]].concat();
    let text = succeeded(run(&words));
    for word in
        ["every frame", "visibility", "built once", "quadtree", "memory", "staging", "left out", &picture, &report]
    {
        assert!(text.contains(word), "{word} in {text}");
    }
    assert_eq!(json(&fs::read_to_string(&report).expect("a file"))["schema"], "mica-render-1");
    assert_eq!(succeeded(run(&[&words[..], &["--quiet"]].concat())), "");
}

#[test]
fn an_interrupted_render_keeps_its_samples() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [picture, report] = ["a.exr", "a.json"].map(|name| in_folder(folder.path(), name));
    let words = ["render", "--method", "smooth", "--samples", "1000000", "--quiet", "-o", &picture, "--json", &report];
    let mut child = mica()
        .args([&words[..], &SMALL].concat())
        .env("RUST_LOG", "info")
        .stderr(Stdio::piped())
        .spawn()
        .expect("mica starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("Ctrl-C keeps")), "the program ended early");
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().is_ok_and(|status| status.success()));
    let last = lines.last().unwrap_or_default();
    assert_eq!(child.wait().expect("mica ends").code(), Some(130), "{last}");
    assert!(last.starts_with("mica: interrupted after"), "{last}");
    assert_eq!(names_in(folder.path()), ["a.exr", "a.json"]);
    let report = json(&fs::read_to_string(&report).expect("a file"));
    assert_eq!(report["interrupted"], true);
    assert!(report["samples"].as_u64().is_some_and(|samples| (1..1_000_000).contains(&samples)));
    assert!(MetaData::read_from_file(&picture, true).is_ok());
}
