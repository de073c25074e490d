//! `mica accuracy`: tables and contact sheets.

use crate::{failed_in_one_line, in_folder, json, run, succeeded};

/// The smooth limit against the law of the count: it has no dark pixels and no variance where the law has both, and its
/// mean where the cone is narrow beside the lobe. The table and the lines say the same.
#[test]
fn counts_say_how_far_a_method_is_from_the_law() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = in_folder(folder.path(), "made/here");
    let text = succeeded(run(&["accuracy", "--counts", "--quick", "--method", "smooth", "-o", &output]));
    let lines = std::fs::read_to_string(in_folder(folder.path(), "made/here/counts.jsonl")).expect("lines");
    let rows: Vec<serde_json::Value> = lines.lines().map(json).collect();
    assert_eq!(rows.len(), 21);
    assert_eq!(text.lines().filter(|line| line.starts_with("smooth")).count(), 21);
    for row in &rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert_eq!((row["schema"].as_str(), row["method"].as_str()), (Some("mica-counts-1"), Some("smooth")));
        assert!(row["device"]["name"].is_string());
        assert!((number("none_error") + (-number("lit")).exp()).abs() < 1e-9, "no pixel is dark: {row}");
        assert!(number("variance_ratio") < 0.05, "nothing varies: {row}");
        if number("alpha") > 0.2 {
            assert!((number("mean_ratio") - 1.0).abs() < 0.01, "{row}");
        } else {
            // A cone of 6 degrees sees a good part of the lobe: its mean is below the lobe's middle.
            assert!((1.05..1.25).contains(&number("mean_ratio")), "{row}");
        }
    }
}

/// Each rung is in the table and in the file, and a second run appends to what is there. Two charts of which a rung takes
/// milliseconds stand for all.
#[test]
fn exactness_is_appended_to_the_folder_of_a_study() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "exactness.jsonl");
    let earlier = "{\"schema\":\"other\"}\n";
    std::fs::write(&path, earlier).expect("a file");
    let output = folder.path().to_str().expect("temporary folders have plain names");
    let charts = ["--chart", "arithmetic", "--chart", "count_law"];
    let text = succeeded(run(&[&["accuracy", "--exactness", "--quick", "-o", output], &charts[..]].concat()));
    let lines = std::fs::read_to_string(&path).expect("lines");
    let added = lines.strip_prefix(earlier).expect("what was there stays");
    let mut found = std::collections::BTreeSet::new();
    for line in added.lines().map(json) {
        let word = |key: &str| line[key].as_str().unwrap_or_else(|| panic!("{key} in {line}")).to_owned();
        assert_eq!(word("schema"), "mica-exactness-1");
        assert!(text.contains(&word("rung")) && text.contains(&word("case")) && text.contains(&word("per")), "{line}");
        assert!(line["error"]["value"].is_f64() && line["ns"]["value"].is_f64(), "{line}");
        assert!(line["machine"]["build"].is_string(), "{line}");
        found.insert(word("chart"));
    }
    assert!(found.iter().eq(["arithmetic", "count_law"]), "{found:?}");
    assert!(found.iter().all(|chart| text.contains(chart)), "{text}");

    let once = added.lines().count();
    succeeded(run(&["accuracy", "--exactness", "--chart", "arithmetic", "--quick", "--quiet", "-o", output]));
    let lines = std::fs::read_to_string(&path).expect("lines");
    let of_both =
        lines.strip_prefix(earlier).and_then(|lines| lines.strip_prefix(added)).expect("what was there stays");
    assert!((1..once).contains(&of_both.lines().count()), "one chart of two: {of_both}");
}

#[test]
fn a_sheet_shows_each_method_on_each_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "sheet.png");
    let text = succeeded(run(&["accuracy", "--sheet", &path, "--size", "24x16", "--method", "smooth"]));
    assert!(text.contains("7 tiles"), "{text}");
    let sheet = image::open(&path).expect("a picture").into_rgb8();
    let name = 16 * "smooth".len() as u32 + 16;
    assert_eq!(sheet.dimensions(), (name + 7 * (24 + 8), 32 + 16 + 8));
    let tiles: Vec<Vec<u8>> = (0..7)
        .map(|tile| image::imageops::crop_imm(&sheet, name + tile * 32, 32, 24, 16).to_image().into_raw())
        .collect();
    for (index, tile) in tiles.iter().enumerate() {
        assert!(tile.iter().max() > tile.iter().min(), "tile {index} shows something");
        assert!(tiles[..index].iter().all(|other| other != tile), "tile {index} is a scene of its own");
    }
}

#[test]
fn what_cannot_be_measured_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = in_folder(folder.path(), "file");
    std::fs::write(&file, "x").expect("a file");
    for (arguments, part) in [
        (&["accuracy"][..], "--counts"),
        (&["accuracy", "--counts", "--method", "none"], "none"),
        (&["accuracy", "--counts", "-o", &file], "file"),
        (&["accuracy", "--sheet", "a.exr"], ".png"),
        (&["accuracy", "--sheet", "missing/a.png"], "missing"),
        (&["accuracy", "--sheet", "a.png", "--size", "2000x10"], "1024"),
        (&["accuracy", "--sheet", "a.png", "--size", "20x10", "--size", "30x10"], "one --size"),
        (&["accuracy", "--exactness", "--chart", "magic"], "lit_probability"),
        (&["accuracy", "--counts", "--chart", "arithmetic"], "--exactness"),
        (&["accuracy", "--counts", "--device", "nobody"], "nobody"),
    ] {
        let error = failed_in_one_line(&run(arguments), if part == "nobody" { 3 } else { 2 });
        assert!(error.contains(part), "{error}");
    }
}
