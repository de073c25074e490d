//! The report of a study as it is read: drawn from lines, opened in a real browser.

use super::{failed_in_one_line, names_in, run, succeeded};
use mica_accuracy::{Cost, Errors, Estimate, Machine, POINT_SCHEMA, Place, Point, REFERENCE_SCHEMA, ReferenceLine};
use std::path::Path;
use std::process::Command;

fn about(value: f64) -> Estimate {
    Estimate { value, low: value * 0.9, high: value * 1.1 }
}

fn machine() -> Machine {
    let [device, driver, occlusion, build] =
        ["a device", "a driver <1>", "bvh", "0.1.0 (1234567)"].map(ToOwned::to_owned);
    Machine { device, driver, occlusion, build }
}

fn errors(w1: f64) -> Errors {
    Errors {
        pixels: 1000,
        left_out: 0,
        mean_ratio: Estimate { value: 0.97, low: 0.9, high: 1.05 },
        variance_ratio: about(0.8),
        w1: about(w1),
        rel_mse: about(w1),
        flip: about(0.02),
        hdr_flip: about(0.03),
        energy_per_glint: about(1.2),
        bands: Vec::new(),
        path: None,
    }
}

fn point(scene: &str, method: &str, milliseconds: f64, w1: f64) -> Point {
    let cost = Cost {
        clock: "cpu".to_owned(),
        sittings: vec![vec![[2e7, 1e7]; 3]],
        glints: about(milliseconds * 1e6),
        frame: about(1e8),
        ratio: about(1.0 + milliseconds / 100.0),
        passes: vec![("glints".to_owned(), about(milliseconds * 1e6))],
        tables: 0.0,
        precomputation: 0.0,
        glint_bytes: 4096,
        memory: Vec::new(),
    };
    Point {
        schema: POINT_SCHEMA.to_owned(),
        place: Place { scene: scene.to_owned(), lighting: "own".to_owned(), size: [16, 9] },
        method: method.to_owned(),
        rung: "printed".to_owned(),
        set: vec![("samples".to_owned(), "1".to_owned())],
        claim: "look".to_owned(),
        machine: machine(),
        content: String::new(),
        effort: "quick".to_owned(),
        command: format!("mica render {scene} --method {method} -o point.exr"),
        errors: Some(errors(w1)),
        cost,
        pictures: Some(["pictures/a.png".to_owned(), "pictures/b.png".to_owned()]),
    }
}

fn line(point: &Point) -> String {
    serde_json::to_string(point).expect("JSON")
}

/// A study's folder with these lines of points, a reference of the first's place, and pictures.
fn study(lines: &[String], scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).expect("a file");
    std::fs::create_dir(folder.path().join("pictures")).expect("a folder");
    for (name, shade) in [("a", 90), ("b", 10), ("reference", 200)] {
        image::RgbImage::from_pixel(16, 9, image::Rgb([shade, 40, 40]))
            .save(folder.path().join(format!("pictures/{name}.png")))
            .expect("a picture");
    }
    let reference = ReferenceLine {
        schema: REFERENCE_SCHEMA.to_owned(),
        place: point(scene, "", 1.0, 1.0).place,
        machine: machine(),
        content: String::new(),
        effort: "quick".to_owned(),
        samples: 41,
        noise: 0.01,
        floor: errors(0.02),
        pictures: ["pictures/reference.png".to_owned(), "references/a.exr".to_owned()],
    };
    write("references.jsonl", (serde_json::to_string(&reference).expect("JSON") + "\n").as_bytes());
    write("points.jsonl", lines.join("\n").as_bytes());
    folder
}

fn redraw(folder: &Path) -> String {
    succeeded(run(&["accuracy", "--redraw", "-o", folder.to_str().expect("a plain name")]));
    std::fs::read_to_string(folder.join("index.html")).expect("a page")
}

/// Runs a browser without a window; returns what it printed. Nothing may be complained of in its console.
fn browse(arguments: &[&str], url: &str) -> String {
    let profile = tempfile::tempdir().expect("a temporary folder");
    let output = Command::new("chromium")
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--window-size=1200,900"])
        .arg("--virtual-time-budget=3000")
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(arguments)
        .arg(url)
        .output()
        .unwrap_or_else(|error| {
            panic!("{error}: the Debian package `chromium` is needed; ci/setup --test installs it")
        });
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaints}");
    let said: Vec<&str> = complaints.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(said.is_empty(), "{said:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Opens the page; returns the document as scripts left it.
fn opened(folder: &Path, link: &str) -> String {
    browse(&["--dump-dom"], &format!("file://{}/index.html{link}", folder.display()))
}

/// How many colours a window shows. The page is in a frame: of a document that is scrolled, headless Chromium 156 shows
/// nothing.
fn colours_on_screen(folder: &Path, link: &str) -> usize {
    let (frame, screen) = (folder.join("frame.html"), folder.join("screen.png"));
    let html = format!("<iframe style=\"width:1180px;height:880px\" src=\"index.html{link}\"></iframe>");
    std::fs::write(&frame, html).expect("a file");
    browse(&[&format!("--screenshot={}", screen.display())], &format!("file://{}", frame.display()));
    let picture = image::open(&screen).expect("a screenshot").into_rgb8();
    picture.pixels().map(|pixel| pixel.0).collect::<std::collections::HashSet<_>>().len()
}

/// The text of the first element that has this attribute.
fn text_of<'a>(document: &'a str, attribute: &str) -> &'a str {
    let (_, after) = document.split_once(attribute).unwrap_or_else(|| panic!("no {attribute}"));
    let (_, text) = after.split_once('>').expect("the end of a tag");
    text.split('<').next().unwrap_or_default()
}

/// The document without what scripts read and templates hold.
fn seen(document: &str) -> String {
    let mut text = document.to_owned();
    for (from, to) in [("<script", "</script>"), ("<template", "</template>"), ("<style", "</style>")] {
        while let Some(start) = text.find(from) {
            let end = text[start..].find(to).map_or(text.len(), |end| start + end + to.len());
            text.replace_range(start..end, "");
        }
    }
    text
}

#[test]
fn a_link_to_a_point_shows_its_command_line_and_its_picture() {
    let lines = [
        line(&point("shoe", "smooth", 3.0, 0.6)),
        line(&point("shoe", "flakes", 300.0, 0.04)),
        line(&point("shoe", "wang2018", 400.0, 0.2)),
    ];
    let folder = study(&lines, "shoe");
    let page = redraw(folder.path());
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("src=\"//"));
    let first = seen(&opened(folder.path(), ""));
    // The most accurate of the front is looked at first.
    assert_eq!(text_of(&first, "data-command"), "mica render shoe --method flakes -o point.exr");
    let linked = seen(&opened(folder.path(), "#shoe-own-16x9/wang2018-printed"));
    assert_eq!(text_of(&linked, "data-command"), "mica render shoe --method wang2018 -o point.exr");
    assert_eq!(text_of(&linked, "data-tag-left"), "wang2018, printed");
    assert_eq!(text_of(&linked, "data-tag-right"), "reference");
    assert_eq!(text_of(&linked, "data-pictures"), "3 of 3 can be shown.");
    for link in ["", "#shoe-own-16x9/wang2018-printed"] {
        let colours = colours_on_screen(folder.path(), link);
        assert!(colours > 100, "{link}: {colours} colours");
    }
}

#[test]
fn what_is_on_the_front_stands_out_in_the_table_and_the_chart() {
    let lines = [
        line(&point("shoe", "smooth", 3.0, 0.6)),
        line(&point("shoe", "flakes", 300.0, 0.04)),
        line(&point("shoe", "wang2018", 400.0, 0.2)),
    ];
    let folder = study(&lines, "shoe");
    let page = seen(&redraw(folder.path()));
    let matrix = page.split("class=\"matrix\"").nth(1).and_then(|rest| rest.split("</table>").next()).expect("a table");
    let classes: Vec<&str> = matrix.split("<td class=\"").skip(1).filter_map(|cell| cell.split('"').next()).collect();
    assert_eq!(classes, ["front", "front", "beaten"]);
    assert!(
        !page.contains(
            "wang2018, printed: glint time, ms 400, Wasserstein-1 distance of pixel luminance / mean 0.2; on"
        )
    );
    let plots = names_in(&folder.path().join("plots"));
    assert!(plots.contains(&"shoe-own-16x9-w1.png".to_owned()) && plots.contains(&"shoe-own-16x9-w1.svg".to_owned()));
    assert!(!plots.iter().any(|name| name.contains("flicker")), "{plots:?}");
}

#[test]
fn words_that_look_like_tags_stay_words() {
    let scene = "</script><img src=x onerror=\"document.title='run'\">&.glb";
    let mut hostile = point(scene, "<i>method</i>", 3.0, 0.6);
    hostile.rung = "'\"><b>".to_owned();
    hostile.command = format!("mica render '{scene}'");
    hostile.pictures = Some(["../../etc/passwd".to_owned(), "/etc/passwd".to_owned()]);
    let folder = study(&[line(&hostile)], scene);
    redraw(folder.path());
    let document = opened(folder.path(), "");
    let seen = seen(&document);
    assert!(!seen.contains("<i>method") && !seen.contains("<img src=\"x\"") && !seen.contains("<title>run"));
    assert!(text_of(&seen, "data-command").starts_with("mica render '&lt;/script&gt;&lt;img src=x"));
    assert_eq!(text_of(&seen, "data-pictures"), "1 of 1 can be shown.");
}

#[test]
fn torn_lines_and_figures_that_are_no_numbers_leave_a_page_that_says_so() {
    let mut without_error = point("shoe", "jakob", 5.0, 0.1);
    without_error.errors = None;
    let mut dark = point("shoe", "shopf", 5.0, 0.1);
    dark.errors.as_mut().expect("errors").w1 = Estimate { value: 0.0, low: 0.0, high: 0.0 };
    dark.cost.glints = Estimate { value: -1e5, low: -3e5, high: 2e5 };
    let whole = line(&point("shoe", "smooth", 3.0, 0.6));
    let lines = [line(&without_error), line(&dark), whole.clone(), "{}".to_owned(), whole[..200].to_owned()];
    let folder = study(&lines, "shoe");
    let output = run(&["accuracy", "--redraw", "-o", folder.path().to_str().expect("a plain name")]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("2 lines are not of a study"));
    succeeded(output);
    let document = seen(&opened(folder.path(), "#shoe-own-16x9/jakob-printed"));
    assert!(document.contains("2 lines are left out of points.jsonl"));
    assert_eq!(text_of(&document, "data-command"), "mica render shoe --method jakob -o point.exr");
}

#[test]
fn a_folder_without_a_study_is_a_mistake_and_one_whose_lines_cannot_be_read_says_so() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |path: &Path, what: &str| {
        let error = failed_in_one_line(&run(&["accuracy", "--redraw", "-o", path.to_str().expect("a plain name")]), 2);
        assert!(error.contains(what), "{error}");
    };
    refused(&folder.path().join("missing"), "no such folder");
    refused(folder.path(), "nothing of a study");
    std::fs::write(folder.path().join("points.jsonl"), "").expect("a file");
    refused(folder.path(), "nothing of a study");
    assert!(!folder.path().join("index.html").exists());
    std::fs::write(folder.path().join("points.jsonl"), "{\"schema\":\"mica-point-0\"}\n").expect("a file");
    redraw(folder.path());
    let page = opened(folder.path(), "#nowhere/nothing");
    assert!(
        page.contains("Nothing has been measured yet.") && page.contains("1 line is left out of points.jsonl"),
        "{page}"
    );
}
