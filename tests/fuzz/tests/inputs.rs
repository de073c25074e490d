//! A hundred thousand mutated files of every format, in bounded memory: none panics, aborts or hangs.

use std::io::Write;
use std::process::Command;

/// The program, with what it says.
fn fuzz(arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_mica-fuzz")).args(arguments).output().expect("the program starts");
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (output.status.success(), said)
}

#[test]
fn a_hundred_thousand_mutated_files_of_each_format_do_no_harm() {
    let out = tempfile::tempdir().expect("a temporary folder");
    // What failed shall outlast the test.
    let out = out.keep();
    let (ok, said) = fuzz(&["--inputs", "100000", "--out", &out.display().to_string()]);
    // Straight to stderr: the figures shall be seen in a run that passes, too.
    let _ = std::io::stderr().write_all(said.as_bytes());
    assert!(ok, "{said}");
    assert!(said.contains("100,000 inputs each of gltf, glb, exr, hdr, png, jpeg, cache: no panic, abort or hang"));
    std::fs::remove_dir(out).expect("nothing failed, so nothing was written");
}

#[test]
fn a_format_that_does_not_exist_is_named() {
    let (ok, said) = fuzz(&["--format", "gif"]);
    assert!(!ok && said.contains("gif is none of gltf, glb"), "{said}");
}
