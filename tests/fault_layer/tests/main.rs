//! The library under a layer that lets each of its calls fail once, in each way that the call may fail.
//!
//! The loader takes layers from the environment that a process starts with: each test runs its body as a child.

mod calls;
mod faults;
mod moods;
mod present;

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What waits for longer than this waits for something that never comes.
const PATIENCE: Duration = Duration::from_secs(300);

/// Says that a test had nothing to show on this driver, so that `ci/test` asks it of another one.
fn not_shown(test: &str, why: &str) {
    // Past the harness, which keeps what is printed by tests that pass to itself; on a line of its own.
    let _ = std::io::stderr().write_all(format!("\nnot shown: {test}: {why}\n").as_bytes());
}

/// Runs an ignored test of this program under the layer.
#[track_caller]
fn run_under_layer(test: &str, faults: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "--ignored", "--nocapture", test])
        .envs(mica_fault_layer::environment(folder.path(), &[], faults))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the child starts");
    let start = Instant::now();
    // All that is printed fits into a pipe.
    while child.try_wait().expect("its own child").is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().expect("its own child");
            panic!("{test} did not end within {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().expect("its own child");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("1 passed"), "the child ran one test: {said}");
}
