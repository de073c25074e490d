//! A hundred thousand mutated files of every format, in bounded memory: none panics, aborts or hangs.

use mica_fuzz::Format;
use std::io::Write;
use std::path::Path;
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

/// Building them takes a tree of its own, so that a run of tests only looks at them.
#[test]
fn every_format_has_a_target_for_cargo_fuzz() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
    assert_eq!(manifest.matches("[[bin]]").count(), Format::ALL.len());
    for name in Format::ALL.map(Format::name) {
        assert!(manifest.contains(&format!("name = \"{name}\"\npath = \"fuzz_targets/{name}.rs\"")), "{name}");
        let target = std::fs::read_to_string(folder.join(format!("fuzz_targets/{name}.rs"))).expect("a target");
        assert!(target.contains(&format!("mica_fuzz::{name}(bytes)")), "{name}: {target}");
    }
}

#[test]
fn a_format_that_does_not_exist_is_named() {
    let (ok, said) = fuzz(&["--format", "gif"]);
    assert!(!ok && said.contains("gif is none of gltf, glb"), "{said}");
}
