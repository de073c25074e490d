//! `mica bench`: what is measured, on whatever the device offers. No figure of time is judged.

use crate::occlusion::expects_ray_queries;
use crate::{Json, failed_in_one_line, in_folder, json, run, succeeded};

/// A bench that is over in no time.
const QUICK: [&str; 8] = ["bench", "--occlusion", "--size", "48x27", "--rays", "500", "--rounds", "2"];

fn bench(scenes: &[&str]) -> Vec<Json> {
    let text = succeeded(run(&[&QUICK[..], &["--json", "-"], scenes].concat()));
    text.lines().map(json).collect()
}

fn kinds(line: &Json) -> Vec<(&str, &str)> {
    let rays = line["rays"].as_array().into_iter().flatten();
    rays.map(|rays| (rays["rays"].as_str().unwrap_or_default(), rays["question"].as_str().unwrap_or_default()))
        .collect()
}

#[test]
fn every_body_answers_the_same_rays_in_one_run() {
    let lines = bench(&["plane"]);
    let bodies: Vec<&str> = lines.iter().filter_map(|line| line["body"].as_str()).collect();
    assert_eq!(bodies, ["bvh", "ray-query"]);
    let (bvh, ray_query) = (&lines[0], &lines[1]);
    for line in &lines {
        assert_eq!(line["schema"], "mica-bench-occlusion-1");
        assert_eq!((&line["scene"], &line["size"]), (&Json::from("plane"), &Json::from(vec![48, 27])));
        assert!(line["device"]["driver"].is_string() && line["triangles"].as_u64() > Some(0));
        assert_eq!((&line["rounds"]["warmup"], &line["rounds"]["measured"]), (&Json::from(1), &Json::from(2)));
    }
    assert!(bvh["not_offered"].is_null(), "every device has the hierarchy of its host: {bvh}");
    let mut offered = vec![bvh];
    match ray_query["not_offered"].as_str() {
        Some(why) => {
            assert!(!expects_ray_queries(), "ray queries are expected: {why}");
            assert!(why.contains("VK_KHR_ray_query"), "{why}");
            assert!(ray_query["rays"].is_null() && ray_query["ready"].is_null(), "{ray_query}");
        }
        None => offered.push(ray_query),
    }
    for line in &offered {
        let all = ["camera", "diffuse", "shadow"].map(|rays| ["any", "closest"].map(|question| (rays, question)));
        assert_eq!(kinds(line), all.concat());
        let bytes = line["memory"]["bytes"].as_u64().expect("bytes");
        let parts = line["memory"]["resources"].as_array().expect("a list");
        assert_eq!(parts.iter().filter_map(|part| part["bytes"].as_u64()).sum::<u64>(), bytes);
        let triangles = line["triangles"].as_f64().expect("a number");
        assert_eq!(line["memory"]["bytes_per_triangle"].as_f64(), Some(bytes as f64 / triangles));
        let ready = &line["ready"];
        assert!(ready["wall_ns"]["min"].as_u64() > Some(0) && ready["threads"].as_u64() > Some(0), "{ready}");
        assert!(ready["wall_ns"]["min"].as_u64() <= ready["wall_ns"]["median"].as_u64());
        let steps = ready["steps"].as_array().expect("a list");
        assert!(
            steps.iter().any(|step| step["step"].as_str().is_some_and(|step| step.starts_with("build"))),
            "{ready}"
        );
        for rays in line["rays"].as_array().expect("a list") {
            let count = rays["count"].as_u64().expect("a number");
            match rays["rays"].as_str() {
                Some("camera") => assert_eq!(count, 48 * 27),
                Some("diffuse") => assert_eq!(count, 500),
                // Lit is what the camera sees of the plane, or less.
                _ => assert!((1..=500).contains(&count), "{rays}"),
            }
            assert_eq!(rays["cut_short"], 0);
            // Below its camera's horizon the plane fills the picture, and nothing lies above it.
            let blocked = rays["blocked"].as_u64().expect("a number");
            match rays["rays"].as_str() {
                Some("camera") => assert!(blocked > count / 4 && blocked < count, "{rays}"),
                _ => assert_eq!(blocked, 0, "{rays}"),
            }
            if !rays["ns"].is_null() {
                assert!(rays["mrays_per_s"].as_f64() > Some(0.0), "{rays}");
            }
        }
    }
    for rays in ray_query["rays"].as_array().into_iter().flatten() {
        assert_eq!(rays["beside"]["body"], "bvh");
        assert_eq!(rays["beside"]["differ_in_blocked"], 0, "{rays}");
    }
    assert!(bvh["rays"][0]["beside"].is_null(), "the first body stands alone");
}

#[test]
fn people_get_a_table_and_scripts_a_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let text = succeeded(run(&[&QUICK[..], &["--json", &path, "sphere", "plane"]].concat()));
    for word in ["sphere:", "plane:", "ready to answer", "bvh Mray/s", "bytes a triangle", "cut short", "bench.jsonl"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    // The sphere has no light.
    assert!(text.contains("left out: shadow rays"), "{text}");
    assert!(text.contains("ray-query Mray/s") != text.contains("ray-query is not offered: the device lacks"), "{text}");
    let lines: Vec<Json> = std::fs::read_to_string(&path).expect("lines").lines().map(json).collect();
    let scenes: Vec<&str> = lines.iter().filter_map(|line| line["scene"].as_str()).collect();
    assert_eq!(scenes, ["sphere", "sphere", "plane", "plane"]);
    assert_eq!(kinds(&lines[0]).len(), 4);
    assert_eq!(lines[0]["left_out"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_failure_keeps_what_was_measured_before() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let output = run(&[&QUICK[..], &["--json", &path, "--quiet", "plane", "no_such_scene"]].concat());
    assert!(failed_in_one_line(&output, 2).contains("no_such_scene"));
    assert_eq!(std::fs::read_to_string(&path).expect("lines").lines().count(), 2);
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    for (arguments, code, part) in [
        (&["bench", "--occlusion", "--rays", "0"][..], 2, "--rays"),
        (&["bench", "--occlusion", "--rounds", "0"], 2, "--rounds"),
        (&["bench", "--occlusion", "--rays", "4294967295"], 2, "rays at once"),
        (&["bench", "--occlusion", "--size", "16384x16384"], 2, "--size"),
        (&["bench", "--occlusion", "--json", "missing/a.jsonl"], 2, "missing"),
        (&["bench", "--occlusion", "--device", "nobody"], 3, "nobody"),
    ] {
        let error = failed_in_one_line(&run(arguments), code);
        assert!(error.contains(part), "{error}");
    }
}
