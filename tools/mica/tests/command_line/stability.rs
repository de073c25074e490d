//! `mica stability`: what it prints and writes. What the cases themselves find is tested with the whole program.

use crate::{Json, failed_in_one_line, in_folder, json, run, succeeded};

#[test]
fn a_case_is_measured_printed_and_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "found.json");
    let text = succeeded(run(&["stability", "h07", "--json", &path]));
    for word in ["H07", "Small angles", "naive", "stable", "tolerance", "holds", "1 of 1 within tolerance"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    let found = json(&std::fs::read_to_string(&path).expect("it was written"));
    assert_eq!((&found["schema"], &found["held"]), (&Json::from("mica-stability-1"), &Json::from(1)));
    let case = &found["cases"][0];
    assert_eq!((&case["id"], &case["holds"], &case["naive_fails"]), (&"H07".into(), &true.into(), &true.into()));
    let check = &case["checks"][0];
    let worst = check["stable"]["worst"].as_f64().expect("a number");
    assert!(worst > 0.0 && worst <= check["tolerance"].as_f64().expect("a number"), "{check}");
    assert!(case["inputs"].as_u64() > Some(1000), "{case}");
    let printed = json(&succeeded(run(&["stability", "H07", "--json", "-"])));
    assert_eq!(printed["cases"], found["cases"], "the same inputs, the same errors");
}

#[test]
fn functions_of_one_number_are_tried_by_their_names_and_what_is_finished_is_taken_over() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "found.json");
    let text = succeeded(run(&["stability", "clamped_integral", "--json", &path]));
    for word in ["clamped_integral", "1e-15 <= y <= 1e6", "holds", "1 of 1 within their bounds"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    assert!(!text.contains("H01"), "{text}");
    let found = json(&std::fs::read_to_string(&path).expect("it was written"));
    assert!(found["helpers"][0]["inputs"].as_u64() > Some(50_000_000), "{found}");
    // A mark that only what was taken over can bear.
    let marked = found.to_string().replace("1e-15 <= y", "from 1e-15");
    std::fs::write(&path, &marked).expect("it is written");
    let all = json(&succeeded(run(&["stability", "H07", "clamped_integral", "--resume", &path, "--json", "-"])));
    assert_eq!((all["helpers"][0]["domain"].as_str(), &all["held"]), (Some("from 1e-15 <= 1e6"), &Json::from(1)));
    std::fs::write(&path, all.to_string().replace("Small angles", "no")).expect("it is written");
    let again = json(&succeeded(run(&["stability", "H07", "--resume", &path, "--json", "-"])));
    assert_eq!((&again["cases"], &again["helpers"]), (&all["cases"], &Json::Null));
    for (wrong, why) in [(marked.replace("quick", "full"), "effort"), ("{}".to_owned(), "no report")] {
        std::fs::write(&path, wrong).expect("it is written");
        let error = failed_in_one_line(&run(&["stability", "H07", "--resume", &path]), 2);
        assert!(error.contains(why) && error.contains("found.json"), "{error}");
    }
}

#[test]
fn forms_say_who_renders_with_them() {
    let text = succeeded(run(&["stability", "H07", "H25"]));
    for word in ["library only", "atanasov, wang2018 and 3 more"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    let found = json(&succeeded(run(&["stability", "H07", "--json", "-"])));
    let form = &found["cases"][0]["stable_forms"][0];
    assert_eq!((&form["name"], &form["used_by"]), (&"angle_between".into(), &"".into()));
}

#[test]
fn what_is_no_case_is_refused_in_one_line() {
    for wrong in ["H45", "H00", "7", "angles"] {
        let error = failed_in_one_line(&run(&["stability", wrong]), 2);
        assert!(error.contains("H01 to H44"), "{error}");
    }
}

#[test]
fn sweeps_are_drawn_and_say_what_holds() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = in_folder(folder.path(), "made/sweeps");
    let text = succeeded(run(&["stability", "--sweeps", &made]));
    assert_eq!(text.lines().filter(|line| line.ends_with(", holds")).count(), 8, "{text}");
    let lines = std::fs::read_to_string(folder.path().join("made/sweeps/sweeps.jsonl")).expect("lines");
    for line in lines.lines().map(json) {
        let name = line["name"].as_str().expect("a name");
        let svg = std::fs::read_to_string(folder.path().join(format!("made/sweeps/{name}.svg"))).expect("a chart");
        for series in line["series"].as_array().expect("a list") {
            // As XML has apostrophes.
            let words = series["name"].as_str().expect("a name").replace('\'', "&#39;");
            assert!(svg.contains(&words), "{name}: {words}");
            assert!(series["points"].as_array().is_some_and(|points| points.len() > 10), "{name}: {words}");
        }
        image::open(folder.path().join(format!("made/sweeps/{name}.png"))).expect("a picture");
    }
    let error = failed_in_one_line(&run(&["stability", "H07", "--sweeps", &made]), 2);
    assert!(error.contains("--sweeps"), "{error}");
}
