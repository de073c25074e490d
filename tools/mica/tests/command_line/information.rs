//! Commands that render nothing, or next to nothing: scenes, methods, explain, doctor, help.

use super::*;
use std::io::Read;
use std::process::Stdio;

#[test]
fn every_method_says_what_it_can_be_set_to() {
    let report = json(&succeeded(run(&["methods", "--json"])));
    assert_eq!(report["default"], "wang2020");
    let methods = report["methods"].as_array().expect("a list");
    let names: Vec<&str> = methods.iter().filter_map(|method| method["name"].as_str()).collect();
    let known = "smooth flakes jakob wang2018 wang2020 atanasov zirr_kaplanyan wang_bowles shopf chermain deliot_belcour kemppinen";
    assert_eq!(names, known.split(' ').collect::<Vec<_>>());
    for method in methods {
        assert!(method["citation"].as_str().is_some_and(|text| !text.is_empty()));
        let claim = method["claim"].as_str().unwrap_or_default();
        assert!(["pixels", "distribution", "mean", "look"].contains(&claim), "{claim}");
        assert_eq!(method["mean_between"].as_array().map(Vec::len), Some(2));
        let settings = method["settings"].as_array().expect("a list");
        for key in ["count", "alpha", "gamma_deg", "seed", "uv_scale", "color"] {
            let setting = settings.iter().find(|setting| setting["key"] == key).expect("a setting that all have");
            assert!(setting["default"] != Json::Null && setting["range"].is_array() && setting["unit"].is_string());
        }
    }
    let text = succeeded(run(&["methods"]));
    assert!(text.contains("gamma_deg") && text.contains("Wang"), "{text}");
}

#[test]
fn every_embedded_scene_says_how_it_glints() {
    let report = json(&succeeded(run(&["scenes", "--json"])));
    let scenes = report["scenes"].as_array().expect("a list");
    for name in ["shoe", "snow", "cloth", "dress", "car", "plane", "sphere", "drift"] {
        let scene = scenes.iter().find(|scene| scene["name"] == name).expect("an embedded scene");
        let glinting = scene["glinting_materials"].as_array().expect("a list");
        assert!(glinting.iter().all(|material| material["count"].as_f64() > Some(0.0)) && !glinting.is_empty());
    }
    let drift = scenes.iter().find(|scene| scene["name"] == "drift").expect("an embedded scene");
    assert!(drift["triangles"].as_u64() > Some(1_000_000), "{}", drift["triangles"]);
    assert!(report["environments"].as_array().is_some_and(|names| names.len() >= 2));
    assert!(succeeded(run(&["scenes"])).contains("shoe"));
}

#[test]
fn a_plan_is_explained_without_rendering() {
    let words = [&["explain"], &QUICK[..], &["--json"]].concat();
    let report = json(&succeeded(run(&words)));
    let passes = report["passes"].as_array().expect("a list");
    let of = |name: &str| passes.iter().find(|pass| pass["name"] == name);
    let prefilter = of("prefilter").expect("a pass of the default method");
    assert_eq!(prefilter["once"], true);
    assert!(prefilter["reads"].as_array().is_some_and(|reads| !reads.is_empty()));
    // What comes after the tables and yet not in every frame.
    assert_eq!(of("upload materials").expect("a part of the scene")["once"], true);
    let composite = of("composite").expect("a pass of the default method");
    assert_eq!(composite["once"], false);
    assert!(
        composite["writes"]
            .as_array()
            .is_some_and(|writes| writes.iter().any(|used| used["bytes"].as_u64() >= Some(24 * 18 * 16)))
    );
    let first = &report["first_frame"];
    assert!(first["shared_bytes"].as_u64() < first["unshared_bytes"].as_u64());
    assert!(report["later_frames"]["passes"].as_u64() < first["passes"].as_u64());
    // The sphere has no lights of its own, hence no shadows.
    let left_out = report["left_out"].as_array().expect("a list");
    assert!(left_out.iter().any(|left_out| left_out["what"] == "shadows" && left_out["why"].as_str() != Some("")));

    let text = succeeded(run(&[&["explain"], &QUICK[..]].concat()));
    for word in ["prefilter", "reads", "writes", "left out", "shadows", "barriers", "side by side"] {
        assert!(text.contains(word), "{word} in {text}");
    }
}

#[test]
fn a_light_brings_shadows_into_the_plan() {
    let light = ["--light", "dir:0,-1,0,1,1,1", "--json"];
    let report = json(&succeeded(run(&[&["explain"], &QUICK[..], &light].concat())));
    let has =
        |list: &str, key: &str| report[list].as_array().expect("a list").iter().any(|entry| entry[key] == "shadows");
    assert!(has("passes", "name") && !has("left_out", "what"));
}

#[test]
fn the_doctor_finds_a_machine_that_renders() {
    let report = json(&succeeded(run(&["doctor", "--json"])));
    assert_eq!(report["works"], true);
    assert!(report["trial"]["ns"].as_u64() > Some(0));
    assert!(
        report["devices"].as_array().is_some_and(|devices| devices.iter().any(|device| device["unusable"].is_null()))
    );
    let devices = report["devices"].as_array().expect("a list");
    let tried = devices.iter().find(|device| device["index"] == report["trial"]["index"]).expect("the device tried");
    assert_eq!(report["occlusion"], tried["occlusion"]);
    let text = succeeded(run(&["doctor"]));
    for device in devices.iter().filter(|device| device["unusable"].is_null()) {
        let Json::Object(occlusion) = &device["occlusion"] else { panic!("{device}") };
        let [body, why] = ["body", "why"].map(|key| occlusion[key].as_str().expect("a text"));
        assert!(body == "bvh" || body == "ray-query" && device["ray_query"] == true, "{device}");
        assert_eq!(device["ray_query"] == true, device["ray_query_lacks"] == serde_json::json!([]), "{device}");
        assert!(text.contains(&format!("\n  occlusion: {body}, because {why}; ray queries ")), "{text}");
    }
    let alone = matches!(&devices[..], [only] if only["kind"] == "CPU" && only["ray_query"] == false);
    assert_eq!(text.contains("VK_DRIVER_FILES=$(ci/drivers)"), alone, "{text}");
}

#[test]
fn the_doctor_asks_what_arithmetic_does() {
    let report = json(&succeeded(run(&["doctor", "--canaries", "--json"])));
    let canaries = report["canaries"].as_array().expect("a list");
    let text = succeeded(run(&["doctor", "--canaries"]));
    for canary in canaries {
        let [name, question, found, means] =
            ["name", "question", "found", "means"].map(|key| canary[key].as_str().expect("a text"));
        assert!(![name, question, found, means].contains(&""), "{canary}");
        assert!(text.contains(&format!("\ncanary {name}: {question}\n  {found}\n  {means}\n")), "{text}");
    }
    let names: Vec<&str> = canaries.iter().filter_map(|canary| canary["name"].as_str()).collect();
    for name in ["loop_limit", "contraction", "fma", "nan_selection", "denormals", "half_floats", "precision_log"] {
        assert!(names.contains(&name), "{names:?}");
    }
    let unasked = json(&succeeded(run(&["doctor", "--json"])));
    assert!(unasked.get("canaries").is_none() && !succeeded(run(&["doctor"])).contains("canary"), "{unasked}");
}

/// Runs the program where no driver can be found.
fn without_a_driver(arguments: &[&str]) -> Output {
    let mut command = mica();
    // The second is what loaders before 1.3.207 read.
    command.args(arguments).env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    command.output().expect("mica starts")
}

#[test]
fn without_a_driver_the_doctor_names_the_package() {
    let output = without_a_driver(&["doctor"]);
    assert_eq!(output.status.code(), Some(3));
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(error.lines().count(), 1, "{error}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("apt install mesa-vulkan-drivers"), "{text}");
    let report = without_a_driver(&["doctor", "--json"]);
    let report = json(&String::from_utf8_lossy(&report.stdout));
    assert_eq!((&report["works"], &report["missing"][0]["needed"]), (&Json::from(false), &Json::from(true)));
}

#[test]
fn without_a_driver_a_render_ends_with_its_own_code() {
    let error = failed_in_one_line(&without_a_driver(&["render", "sphere", "--size", "8x8"]), 3);
    assert!(error.contains("mesa-vulkan-drivers"), "{error}");
}

#[test]
fn help_and_version_go_to_stdout() {
    let help = succeeded(run(&["render", "--help"]));
    for option in ["--size", "--method", "--set", "--glint", "--env", "--light", "--camera", "--edit", "--json"] {
        assert!(help.contains(option), "{option}");
    }
    assert!(succeeded(run(&["--version"])).starts_with("mica "));
}

#[test]
fn a_reader_that_leaves_early_is_no_failure() {
    let mut child = mica().arg("methods").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("mica starts");
    drop(child.stdout.take());
    let mut error = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut error).expect("stderr is UTF-8");
    assert!(child.wait().expect("mica ends").success(), "{error}");
    assert_eq!(error, "");
}
