//! The library under a layer that lets each of its calls fail once, in each way that the call may fail.
//!
//! The loader takes layers from the environment that a process starts with: each test runs its body as a child.

mod calls;
mod faults;
mod present;

use std::process::Command;

/// Runs an ignored test of this program under the layer.
fn run_under_layer(test: &str, faults: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "--ignored", "--nocapture", test])
        .envs(mica_fault_layer::environment(folder.path(), &[], faults))
        .output()
        .expect("the child starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("1 passed"), "the child ran one test: {said}");
}
