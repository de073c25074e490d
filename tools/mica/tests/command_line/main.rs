//! The command line as a user meets it: what is printed, what is written, and how it ends.

mod accuracy;
mod bench;
mod budget;
mod edits;
mod information;
mod mistakes;
mod occlusion;
mod oracle;
mod render;
mod report;
mod stability;
mod study;

use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A scene so small that it is rendered in no time.
const SMALL: [&str; 3] = ["sphere", "--size", "24x18"];
/// The same with settings that make the tables of the default method small too.
const QUICK: [&str; 7] = ["sphere", "--size", "24x18", "--set", "samples=1", "--set", "depth=3"];

/// The program, with a cache that the tests share and keep.
fn mica() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mica"));
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command.env_remove("RUST_LOG");
    command
}

fn run(arguments: &[&str]) -> Output {
    mica().args(arguments).output().expect("mica starts")
}

/// Renders with one frame measured, and returns the report.
fn report(arguments: &[&[&str]]) -> Json {
    json(&succeeded(run(&[&["render", "--frames", "1", "--json", "-"], &arguments.concat()[..]].concat())))
}

fn succeeded(output: Output) -> String {
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("stdout is UTF-8")
}

fn json(text: &str) -> Json {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Exactly one line on stderr, nothing on stdout, and this exit code.
fn failed_in_one_line(output: &Output, code: i32) -> String {
    let error = String::from_utf8(output.stderr.clone()).expect("stderr is UTF-8");
    assert_eq!(output.status.code(), Some(code), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    assert!(error.starts_with("mica: ") && error.ends_with('\n'), "{error}");
    assert!(!error.contains("panicked"), "{error}");
    error
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A path in a folder, as an argument.
fn in_folder(folder: &Path, name: &str) -> String {
    let path: PathBuf = folder.join(name);
    path.to_str().expect("temporary folders have plain names").to_owned()
}

/// Writes a scene of one triangle that does not glint, with these extras, and returns its path.
fn triangle(folder: &Path, extras: &str) -> String {
    let path = in_folder(folder, "triangle.gltf");
    let document = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0],"extras":EXTRAS}],
        "nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,BYTES"}]}"#;
    // The corners (0,0,0), (1,0,0) and (0,1,0).
    let bytes = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    std::fs::write(&path, document.replace("EXTRAS", extras).replace("BYTES", bytes)).expect("a file");
    path
}
