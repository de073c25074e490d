//! What a user may get wrong: each mistake is one line that says what and where, ends with code 2 and leaves no file.

use super::*;
use std::fs;

/// Runs a render that is wrong in one way; the error must mention each of the words, and no file may be left.
#[track_caller]
fn wrong(arguments: &[&str], words: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = in_folder(folder.path(), "a.exr");
    let output = run(&[&["render", "-o", &picture], arguments].concat());
    let error = failed_in_one_line(&output, 2);
    for word in words {
        assert!(error.contains(word), "{word} in {error}");
    }
    assert_eq!(String::from_utf8_lossy(&output.stdout), "");
    assert_eq!(names_in(folder.path()), Vec::<String>::new());
}

#[test]
fn scenes_that_cannot_be_read() {
    wrong(&["shoo"], &["shoo", "shoe, "]);
    wrong(&["missing/scene.glb"], &["missing/scene.glb", "FILE_UNREADABLE"]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    wrong(&[folder.path().to_str().expect("a plain name")], &["FILE_NOT_REGULAR"]);
    let text = in_folder(folder.path(), "text.glb");
    fs::write(&text, "hello").expect("a file");
    wrong(&[&text], &["text.glb"]);
    let cut = in_folder(folder.path(), "cut.glb");
    fs::write(&cut, b"glTF\x02\0\0\0\xff\0\0\0").expect("a file");
    wrong(&[&cut], &["cut.glb", "INVALID_GLB"]);
    wrong(&["a\nb\u{1b}[31m.glb"], &["a\\nb"]);
}

#[test]
fn scenes_whose_environment_is_elsewhere() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = triangle(folder.path(), r#"{"environment":"../sky.exr"}"#);
    wrong(&[&scene], &["triangle.gltf", "../sky.exr", "--env"]);
}

#[test]
fn sizes_and_counts_out_of_range() {
    for size in ["0x0", "64", "64x", "-4x4", "1e3x5", "99999x99999", "64x36x2", "4294967296x1"] {
        wrong(&["--size", size], &["--size", "1 to 16384"]);
    }
    wrong(&["--frames", "many"], &["--frames", "many"]);
    wrong(&["--samples", "0"], &["--samples", "0"]);
    wrong(&["--exposure", "99"], &["--exposure", "-32 to 32"]);
    wrong(&["--env-rotate", "NaN"], &["--env-rotate", "finite"]);
}

#[test]
fn edits_that_cannot_be_made() {
    let base = [&["--frames", "0", "--method", "smooth"], &SMALL[..]].concat();
    let wrong_edit = |edit: &str, words: &[&str]| wrong(&[&base[..], &["--edit", edit]].concat(), words);
    wrong_edit("count", &["KEY=VALUE", "light="]);
    wrong_edit("lihgt=none", &["lihgt"]);
    wrong_edit("light=sun", &["light=sun", "dir:X,Y,Z"]);
    wrong_edit("size=0x0", &["size=0x0", "1 to 16384"]);
    wrong_edit("camera=1,2,3", &["camera=1,2,3", "EYE:TARGET:FOV_DEG"]);
    wrong_edit("env-rotate=NaN", &["env-rotate=NaN", "finite"]);
    wrong_edit("env=somewhere", &["somewhere", "studio"]);
    wrong_edit("env=missing.exr", &["missing.exr"]);
    wrong_edit("move=0:1,2", &["move=0:1,2", "INSTANCE:X,Y,Z"]);
    wrong_edit("move=99:1,2,3", &["move=99:1,2,3", "counted from 0"]);
    wrong_edit("hat:count=1", &["hat", "flakes"]);
}

#[test]
fn settings_that_no_method_has_or_takes() {
    wrong(&["--method", "magic"], &["magic", "wang2020"]);
    wrong(&["--set", "alpha=7"], &["alpha=7", "0.001 to 1"]);
    wrong(&["--set", "alpha=NaN"], &["alpha=NaN", "0.001 to 1"]);
    wrong(&["--set", "count=-1"], &["count=-1", "0 to 1e12"]);
    wrong(&["--set", "gamma_deg=180"], &["gamma_deg=180", "30"]);
    wrong(&["--set", "seed=0.5"], &["seed=0.5", "whole number"]);
    wrong(&["--set", "color=1,2,3"], &["color=1,2,3", "0 to 1"]);
    wrong(&["--set", "cuont=3"], &["cuont", "count"]);
    wrong(&["--set", "count"], &["count", "KEY=VALUE"]);
    wrong(&["--method", "smooth", "--set", "samples=4"], &["samples", "smooth"]);
    wrong(&["--glint", "count=3"], &["MATERIAL:KEY=VALUE"]);
    wrong(&["--glint", "hat:count=3"], &["hat", "ruby"]);
    wrong(&["--edit", "alpha=7"], &["alpha=7", "0.001 to 1"]);
    wrong(&["--edit", "hat:count=3"], &["hat"]);
}

#[test]
fn light_that_makes_no_sense() {
    wrong(&["--env", "marsh"], &["marsh", "overcast"]);
    wrong(&["--env", "missing.exr"], &["missing.exr", "FILE_UNREADABLE"]);
    for constant in ["constant:1,1", "constant:1,1,x", "constant:-1,0,0", "constant:inf,0,0"] {
        wrong(&["--env", constant], &["constant:R,G,B"]);
    }
    for light in
        ["sun", "point:0,0,0", "dir:0,0,0,1,1,1", "spot:0,0,0,1,1,1", "point:NaN,0,0,1,1,1", "dir:0,1,0,1,1,-1"]
    {
        wrong(&["--light", light], &["--light", light]);
    }
    let lights = ["--light", "point:0,1,0,1,1,1"].repeat(40);
    wrong(&lights, &["lights"]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = in_folder(folder.path(), "text.exr");
    fs::write(&text, "hello").expect("a file");
    wrong(&["--env", &text], &["text.exr", "OpenEXR"]);
}

#[test]
fn cameras_that_see_nothing() {
    for camera in
        ["1,0,0", "0,0,0:0,0,0:40", "NaN,0,0:0,0,0:40", "1,0,0:0,0,0:0", "1,0,0:0,0,0:180", "1e30,0,0:0,0,0:40"]
    {
        wrong(&["--camera", camera], &["--camera", camera]);
    }
}

#[test]
fn options_that_do_not_exist_or_do_not_go_together() {
    wrong(&["--szie", "4x4"], &["--szie", "--size"]);
    wrong(&["--occlusion", "magic"], &["magic", "bvh"]);
    wrong(&["--cache", "x", "--no-cache"], &["--cache", "--no-cache"]);
    wrong(&["--timing", "never"], &["never", "isolated"]);
    failed_in_one_line(&run(&[]), 2);
    assert!(failed_in_one_line(&run(&["rendr"]), 2).contains("rendr"));
}

#[test]
fn outputs_that_cannot_be_written_are_told_before_rendering() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("dir.exr")).expect("a folder");
    let directory = in_folder(folder.path(), "dir.exr");
    let missing = in_folder(folder.path(), "missing/a.exr");
    let long = in_folder(folder.path(), &format!("{}.exr", "x".repeat(300)));
    let twice = in_folder(folder.path(), "twice.png");
    wrong(&["-o", "picture.jpeg"], &["picture.jpeg", ".exr or .png"]);
    wrong(&["-o", "-"], &[".exr or .png"]);
    wrong(&["-o", &directory], &["dir.exr", "folder"]);
    wrong(&["-o", &missing], &["missing", "make it first"]);
    wrong(&["-o", &long], &["name too long"]);
    wrong(&["-o", &twice, "-o", &twice], &["twice"]);
    // Nobody can make files there, whatever the user's rights.
    wrong(&["-o", "/proc/a.exr"], &["/proc/a.exr"]);
    wrong(&["--json", "/proc/a.json"], &["/proc/a.json"]);
    wrong(&["--json", &missing], &["missing"]);
    assert_eq!(names_in(folder.path()), ["dir.exr"]);
}

#[test]
fn a_full_disk_is_reported_and_its_device_stays() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let link = folder.path().join("full.exr");
    std::os::unix::fs::symlink("/dev/full", &link).expect("a link");
    let words = [&["render"], &SMALL[..], &["--method", "smooth", "--frames", "0", "--quiet"]].concat();
    let link = link.to_str().expect("a plain name");
    for output in [["-o", link], ["--json", "/dev/full"]] {
        let error = failed_in_one_line(&run(&[&words[..], &output].concat()), 2);
        assert!(error.contains("No space left"), "{error}");
    }
    assert_eq!(names_in(folder.path()), ["full.exr"]);
    assert!(fs::metadata("/dev/full").is_ok_and(|full| !full.is_file()));

    let full = fs::File::options().write(true).open("/dev/full").expect("the device is there");
    let output = mica().arg("methods").stdout(full).output().expect("mica starts");
    assert!(failed_in_one_line(&output, 2).contains("stdout"));
}

#[test]
fn devices_that_are_not_there() {
    let output = run(&["render", "sphere", "--size", "8x8", "--device", "abacus"]);
    let error = failed_in_one_line(&output, 3);
    assert!(error.contains("abacus"), "{error}");
    failed_in_one_line(&run(&["explain", "sphere", "--device", "99"]), 3);
    let output = run(&["doctor", "--device", "abacus"]);
    assert!(failed_in_one_line(&output, 3).contains("abacus"));
}

#[test]
fn more_memory_than_there_is_ends_with_its_own_code() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = in_folder(folder.path(), "a.exr");
    let output = run(&["render", "sphere", "--size", "1024x1024", "--memory", "32", "-o", &picture]);
    let error = failed_in_one_line(&output, 4);
    assert!(error.contains("--size") && error.contains("--memory"), "{error}");
    assert_eq!(names_in(folder.path()), Vec::<String>::new());
}
