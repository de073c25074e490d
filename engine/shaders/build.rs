//! Compiles shaders_glsl/, and the fixtures of this crate's tests, and writes the Rust derived from them.

#[path = "build/mod.rs"]
mod build;

use build::compile::Tools;
use build::problem::Problem;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    for variable in Tools::VARIABLES {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    for file in ["build.rs", "build"] {
        println!("cargo::rerun-if-changed={file}");
    }
    let tools = Tools::from_environment();
    if let Err(problems) = tools.check() {
        report(problems);
        return;
    }
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    write(&manifest.join("../../shaders_glsl"), &out.join("shaders"), &tools);
    // The tests include these; the library does not.
    write(&manifest.join("tests/fixtures"), &out.join("fixtures"), &tools);
}

/// Compiles the GLSL below `root` and writes `out`/mod.rs; errors become errors of cargo.
fn write(root: &Path, out: &Path, tools: &Tools) {
    // Cargo watches a folder with all that is in it.
    println!("cargo::rerun-if-changed={}", root.display());
    match build::generate(root, out, tools) {
        Ok(generated) => {
            for warning in generated.warnings {
                println!("cargo::warning={warning}");
            }
            if let Err(error) = fs::write(out.join("mod.rs"), generated.rust) {
                println!("cargo::error=cannot write to {}: {error}", out.display());
            }
        }
        Err(problems) => report(problems),
    }
}

/// Makes errors of cargo, which fail the build when this program has ended.
fn report(problems: Vec<Problem>) {
    for problem in problems {
        println!("cargo::error={problem}");
    }
}
