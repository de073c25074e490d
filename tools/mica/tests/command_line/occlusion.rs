//! Who answers about occlusion: what suits the device, or what was asked for; and how many rays that took.

use super::*;

/// A light above, which throws shadows.
const LIT: [&str; 4] = ["--method", "smooth", "--light", "dir:-0.3,-1,-0.2,3,3,3"];

/// What the doctor says, on drivers other than those the tests run on where `drivers` names any.
fn doctor(drivers: Option<&str>, arguments: &[&str]) -> Json {
    json(&succeeded(on(drivers).args(["doctor", "--json"]).args(arguments).output().expect("mica starts")))
}

fn on(drivers: Option<&str>) -> Command {
    let mut command = mica();
    if let Some(drivers) = drivers {
        command.env("VK_DRIVER_FILES", drivers);
    }
    command
}

/// Asks for ray queries on a device of the doctor's list: they are used, or refused with what is missing.
fn ask_for_ray_queries(device: &Json, drivers: Option<&str>, arguments: &[&str]) {
    let mut command = on(drivers);
    command.args(["render", "plane", "--size", "160x90", "--frames", "1", "--json", "-", "--occlusion", "ray-query"]);
    let output = command.args(LIT).args(arguments).output().expect("mica starts");
    if device["ray_query"] == true {
        let report = json(&succeeded(output));
        assert_eq!(report["occlusion"], "ray-query");
        assert_eq!(report["occlusion_why"], "--occlusion ray-query asks for it");
        assert_eq!(report["device"]["driver"], device["driver"]);
        assert!(report["rays"][0]["rays"].as_u64() > Some(0), "{}", report["rays"]);
        return;
    }
    let error = failed_in_one_line(&output, 3);
    let lacks = device["ray_query_lacks"].as_array().expect("a list");
    assert!(!lacks.is_empty(), "{device}");
    for lacking in lacks.iter().chain([&device["name"], &device["driver"]]) {
        assert!(error.contains(lacking.as_str().expect("a text")), "{lacking} in {error}");
    }
    assert!(error.contains("bvh") && error.contains("--device") && error.contains("mica doctor"), "{error}");
}

/// Whether the environment says that there are ray queries: what misses them then fails.
pub fn expects_ray_queries() -> bool {
    std::env::var("MICA_EXPECT").is_ok_and(|expected| expected == "ray-query")
}

#[test]
fn ray_queries_are_used_where_they_are_offered_and_else_refused_with_what_is_missing() {
    let report = doctor(None, &[]);
    let device = &report["devices"][report["trial"]["index"].as_u64().expect("a device that works") as usize];
    assert!(!expects_ray_queries() || device["ray_query"] == true, "MICA_EXPECT=ray-query, and there is {device}");
    ask_for_ray_queries(device, None, &[]);
}

#[test]
fn a_render_takes_what_the_doctor_says_unless_it_is_told_otherwise() {
    let of = |occlusion: &str| report(&[&SMALL, &LIT, &["--occlusion", occlusion]]);
    let (chosen, auto) = (&doctor(None, &[])["occlusion"], of("auto"));
    assert_eq!((&auto["occlusion"], &auto["occlusion_why"]), (&chosen["body"], &chosen["why"]));
    for asked in ["bvh", "none"] {
        let report = of(asked);
        assert_eq!(
            (&report["occlusion"], &report["occlusion_why"]),
            (&Json::from(asked), &Json::from(format!("--occlusion {asked} asks for it")))
        );
    }
    let text = succeeded(run(&[&["explain", "--occlusion", "bvh"], &SMALL[..]].concat()));
    assert!(text.contains("occlusion: bvh, because --occlusion bvh asks for it"), "{text}");
}

#[test]
fn rays_are_counted_by_pass_and_put_beside_its_time() {
    let of = |arguments: &[&str]| report(&[&SMALL, &LIT, arguments])["rays"].clone();
    let traced = of(&["--occlusion", "bvh"]);
    let shadows = &traced.as_array().expect("a list")[0];
    assert_eq!((&shadows["pass"], &shadows["cut_short"]), (&Json::from("shadows"), &Json::from(0)));
    // One light: of the pixels that show the sphere or the ground, each that faces it asks once.
    assert!(shadows["rays"].as_u64().is_some_and(|rays| (20..=24 * 18).contains(&rays)), "{traced}");
    assert!(shadows["mrays_per_s"].as_f64() > Some(0.0), "{traced}");

    let unmeasured = of(&["--occlusion", "bvh", "--frames", "0"]);
    assert_eq!((&unmeasured[0]["rays"], &unmeasured[0]["mrays_per_s"]), (&shadows["rays"], &Json::Null));
    let twice = of(&["--occlusion", "bvh", "--frames", "0", "--light", "dir:-0.3,-1,-0.2,1,1,1"]);
    assert_eq!(twice[0]["rays"].as_u64(), shadows["rays"].as_u64().map(|rays| 2 * rays), "a second light doubles them");
    assert_eq!(of(&["--occlusion", "none"]), serde_json::json!([]));

    let text = succeeded(run(&[&["render", "--frames", "1", "--occlusion", "bvh"], &SMALL[..], &LIT].concat()));
    let line = format!("\nrays: shadows {}, ", shadows["rays"]);
    assert!(text.contains(&line) && text.contains(" million a second\n"), "{text}");
}

/// What `ci/drivers` says, for both of the drivers that `ci/setup --test` provides.
fn both_drivers() -> Option<String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ci/drivers");
    let output = Command::new(script).output().expect("the script starts");
    let drivers = String::from_utf8(output.stdout).expect("paths are UTF-8").trim().to_owned();
    if output.status.success() {
        return Some(drivers);
    }
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!expects_ray_queries(), "{error}");
    eprintln!("not run on both drivers: {error}");
    None
}

#[test]
fn of_two_drivers_each_is_listed_is_chosen_by_its_version_and_keeps_its_own_pipelines() {
    let Some(drivers) = both_drivers() else { return };
    let cache = tempfile::tempdir().expect("a temporary folder");
    let cached = ["--cache", cache.path().to_str().expect("a plain name")];
    let listed = doctor(Some(&drivers), &[]);
    let devices = listed["devices"].as_array().expect("a list");
    assert_eq!(devices.len(), drivers.split(':').count(), "{drivers}: {listed}");
    assert!(devices.iter().any(|device| device["ray_query"] == true), "{listed}");
    for device in devices {
        let driver = device["driver"].as_str().expect("a text");
        let version = driver.split(' ').find(|word| word.starts_with(|c: char| c.is_ascii_digit())).expect("a version");
        ask_for_ray_queries(device, Some(&drivers), &[&["--device", version], &cached[..]].concat());
        let tried = doctor(Some(&drivers), &["--device", version]);
        assert_eq!((&tried["trial"]["index"], &tried["occlusion"]), (&device["index"], &device["occlusion"]));
    }
    // What one driver kept must not be in the way of the other.
    for device in devices.iter().chain(devices) {
        let index = device["index"].to_string();
        let words = [&["render", "--frames", "0", "--json", "-", "--device", &index], &SMALL[..], &LIT, &cached];
        let output = on(Some(&drivers)).args(words.concat()).output().expect("mica starts");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "");
        assert_eq!(json(&succeeded(output))["device"]["driver"], device["driver"]);
    }
    let kept = names_in(cache.path());
    assert_eq!(kept.iter().filter(|name| name.starts_with("pipelines-")).count(), devices.len(), "{kept:?}");
}
