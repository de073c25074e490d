//! Faults, by the numbers that the design gives them: each ends in the exit code and the single line of the contract, in
//! bounded memory and time, and leaves no part of a file behind.

mod cache_and_values;
mod devices;
mod files;
mod full_disks;
mod outputs;
mod pictures;
mod programs;
mod signals;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// The address space of the program, KiB: what a device in software takes, and little more.
const MEMORY_KIB: u64 = 2 << 20;
/// The most time on processors, seconds: unlike time on the wall, it is the same on a machine that does other things.
const PROCESSOR_SECONDS: u64 = 10;
/// What waits for longer than this waits for something that never comes.
const PATIENCE: Duration = Duration::from_secs(120);
/// What makes a picture quickly, where one is to be made.
const QUICK: [&str; 6] = ["--size", "8x6", "--frames", "0", "--method", "smooth"];

/// Runs the program in bounded memory; panics when it takes too long.
#[track_caller]
fn mica_within(memory_kib: u64, arguments: &[&str]) -> Output {
    let mut child = Command::new("sh")
        .args([
            "-c",
            &format!("ulimit -v {memory_kib} && ulimit -t {PROCESSOR_SECONDS} && exec \"$0\" \"$@\""),
            env!("CARGO_BIN_EXE_mica"),
        ])
        .args(arguments)
        .env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"))
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a shell");
    let start = Instant::now();
    // All that is printed fits into a pipe.
    while child.try_wait().expect("its own child").is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().expect("its own child");
            panic!("mica {arguments:?} did not end within {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    child.wait_with_output().expect("its own child")
}

/// A folder for a faulty file, and one for the picture that must not come of it.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir(folder.path().join("out")).expect("a folder");
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A path as an argument.
    fn argument(&self, name: &str) -> String {
        self.path(name).to_str().expect("temporary folders have plain names").to_owned()
    }

    /// Writes a file and returns its path as an argument.
    fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), bytes).expect("a file");
        self.argument(name)
    }

    /// Renders with these arguments, and keeps what is said.
    #[track_caller]
    fn render(&self, memory_kib: u64, arguments: &[&str]) -> Output {
        let picture = self.argument("out/a.exr");
        mica_within(memory_kib, &[&["render", "--quiet", "-o", &picture], &QUICK[..], arguments].concat())
    }

    /// Renders with these arguments, which must be refused with the exit code, in one line that mentions the words.
    #[track_caller]
    fn fails(&self, code: i32, memory_kib: u64, arguments: &[&str], words: &[&str]) {
        let output = self.render(memory_kib, arguments);
        programs::failed(&output, code, words);
        assert_eq!(String::from_utf8_lossy(&output.stdout), "");
        assert_eq!(self.written(), 0, "files are left of {arguments:?}");
    }

    /// Renders with these arguments, which are bad input: what is wrong, and what to do about it.
    #[track_caller]
    fn refused(&self, arguments: &[&str], words: &[&str]) {
        self.fails(2, MEMORY_KIB, arguments, words);
    }

    /// Renders with these arguments, which are to work; what was warned of.
    #[track_caller]
    fn rendered(&self, arguments: &[&str]) -> String {
        let output = self.render(MEMORY_KIB, arguments);
        let said = String::from_utf8(output.stderr).expect("stderr is UTF-8");
        assert!(output.status.success(), "{arguments:?}: {}: {said}", output.status);
        assert!(said.lines().all(|line| line.starts_with("warning: ")), "{said}");
        assert_eq!(self.written(), 1);
        said
    }

    fn written(&self) -> usize {
        std::fs::read_dir(self.path("out")).expect("the folder is there").count()
    }
}
