//! The program, started in various ways, and what came of it.

use serde_json::Value as Json;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// The program, with a cache that the tests share and keep.
pub fn mica() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mica"));
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command.env_remove("RUST_LOG");
    command
}

/// The program, started by another one.
pub fn through(words: &[&str]) -> Command {
    let program = mica();
    let mut command = Command::new(words[0]);
    command.args(&words[1..]).arg(program.get_program());
    for (key, value) in program.get_envs() {
        match value {
            Some(value) => command.env(key, value),
            None => command.env_remove(key),
        };
    }
    command
}

/// Success, with what was printed.
#[track_caller]
pub fn succeeded(output: &Output) -> String {
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("stdout is UTF-8")
}

/// This exit code and exactly one line on stderr that has all the words: the line.
#[track_caller]
pub fn failed(output: &Output, code: i32, words: &[&str]) -> String {
    let (warnings, line) = failed_after_warnings(output, code, words);
    assert_eq!(warnings, "", "before: {line}");
    line
}

/// The same, after any number of warnings: these, and the line.
#[track_caller]
pub fn failed_after_warnings(output: &Output, code: i32, words: &[&str]) -> (String, String) {
    let said = String::from_utf8(output.stderr.clone()).expect("stderr is UTF-8");
    assert_eq!(output.status.code(), Some(code), "{}: {said}", output.status);
    assert!(said.ends_with('\n'), "{said}");
    let end = said.trim_end_matches('\n').rfind('\n').map_or(0, |end| end + 1);
    let (warnings, line) = said.split_at(end);
    assert!(warnings.lines().all(|line| line.starts_with("warning: ")), "{said}");
    assert!(line.starts_with("mica: ") && !line.contains("panicked"), "{said}");
    for word in words {
        assert!(line.contains(word), "{word} is not in: {line}");
    }
    (warnings.to_owned(), line.to_owned())
}

pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A path in a folder, as an argument.
pub fn in_folder(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().expect("temporary folders have plain names").to_owned()
}

/// A render that is over in no time.
pub const RENDER: [&str; 9] = ["render", "sphere", "--size", "24x18", "--method", "smooth", "--frames", "0", "--quiet"];
/// A bench of two points, each with a line after its first sitting and one after its last.
pub const BENCH: [&str; 11] =
    ["bench", "sphere", "--size", "8x6", "--size", "9x6", "--method", "smooth", "--rounds", "1", "--quiet"];

/// The lines of a file that are whole.
pub fn whole_lines(path: &str) -> Vec<Json> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    text[..whole].lines().map(|line| serde_json::from_str(line).expect("a whole line is readable")).collect()
}

/// The size of each point, and how many sittings it has.
pub fn sittings(path: &str) -> Vec<(String, usize)> {
    let of =
        |point: &Json| (point["place"]["size"].to_string(), point["cost"]["sittings"].as_array().map_or(0, Vec::len));
    let mut all: Vec<_> = whole_lines(path).iter().map(of).collect();
    all.sort();
    all
}

/// Those of a bench that came to its end.
pub fn all_sittings() -> Vec<(String, usize)> {
    [("[8,6]", 1), ("[8,6]", 3), ("[9,6]", 1), ("[9,6]", 3)].map(|(size, count)| (size.to_owned(), count)).to_vec()
}
