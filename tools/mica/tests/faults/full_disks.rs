//! Disks that are full: a file system of a few thousand bytes, and where none can be had a limit on the size of files. F32,
//! and F39 of a cache.

use super::programs::*;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The program, on a disk where no file may grow beyond so many bytes. Newer lavapipes keep device memory in files, which such
/// a limit ends too: outputs are the same on any driver, so Debian's own serves where it is installed.
pub fn mica_below_a_limit(most_bytes: u64) -> Command {
    const DEBIANS: &str = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json";
    let mut command = through(&["prlimit", &format!("--fsize={most_bytes}")]);
    if Path::new(DEBIANS).exists() {
        command.env("VK_DRIVER_FILES", DEBIANS);
    }
    command
}

/// What of `unshare` lets this user mount a file system that nobody else sees; none where the system forbids it.
fn mounting() -> Option<&'static [&'static str]> {
    static WORDS: OnceLock<Option<&[&str]>> = OnceLock::new();
    *WORDS.get_or_init(|| {
        let ways: [&[&str]; 2] = [&["unshare", "--mount"], &["unshare", "--user", "--map-root-user", "--mount"]];
        let folder = tempfile::tempdir().expect("a temporary folder");
        let works = |words: &&&[&str]| {
            let mut command = Command::new(words[0]);
            command.args(&words[1..]).args(["mount", "-t", "tmpfs", "none"]).arg(folder.path());
            command.output().is_ok_and(|output| output.status.success())
        };
        ways.iter().find(works).copied()
    })
}

/// A small file system, full after a few pages.
struct Disk {
    /// Where the program finds it.
    at: tempfile::TempDir,
    /// Where its content comes when the program has ended.
    left: tempfile::TempDir,
    unshare: &'static [&'static str],
}

/// What of a file system counts: it is taken a page at a time.
const PAGE: u64 = 4096;
/// What takes the first page.
const OLD: &str = "old";

impl Disk {
    /// None, and a word about it that `ci/test` hears, where no file system can be mounted.
    fn new(test: &str) -> Option<Self> {
        let folder = || tempfile::tempdir().expect("a temporary folder");
        let disk = mounting().map(|unshare| Self { at: folder(), left: folder(), unshare });
        if disk.is_none() {
            // Past the harness, which keeps what is printed by tests that pass to itself; on a line of its own.
            let line = format!("\nweaker: {test}: no file system can be mounted here, so files have a limit instead\n");
            let _ = std::io::stderr().write_all(line.as_bytes());
        }
        disk
    }

    fn path(&self, name: &str) -> String {
        in_folder(self.at.path(), name)
    }

    /// Runs the program where the disk has so many pages, the first one taken by a file.
    #[track_caller]
    fn run(&self, pages: u64, arguments: &[&str]) -> Output {
        self.run_through(&[], pages, arguments)
    }

    /// The same, started by another one.
    #[track_caller]
    fn run_through(&self, words: &[&str], pages: u64, arguments: &[&str]) -> Output {
        const SCRIPT: &str = r#"
            mount -t tmpfs -o size="$1" none "$2" && printf old > "$2/$4" || exit 99
            at=$2 left=$3
            shift 4
            "$@"
            code=$?
            cp -R "$at/." "$left/" || exit 99
            exit $code"#;
        for name in names_in(self.left.path()) {
            let path = self.left.path().join(name);
            if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }.expect("it is ours");
        }
        let [at, left] = [&self.at, &self.left].map(|folder| folder.path().to_str().expect("a plain name"));
        let bytes = (pages * PAGE).to_string();
        let script = ["sh", "-c", SCRIPT, "sh", &bytes, at, left, OLD];
        let output = through(&[self.unshare, &script, words].concat()).args(arguments).output().expect("it starts");
        assert_ne!(output.status.code(), Some(99), "{}", String::from_utf8_lossy(&output.stderr));
        let old = fs::read_to_string(self.left.path().join(OLD)).expect("it was there");
        assert_eq!(old, OLD, "what was there is changed by {arguments:?}");
        output
    }

    /// The files that are left, but the first.
    fn files(&self) -> Vec<PathBuf> {
        let mut folders = vec![self.left.path().to_owned()];
        let mut files = Vec::new();
        while let Some(folder) = folders.pop() {
            for name in names_in(&folder) {
                let path = folder.join(name);
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files.retain(|path| *path != self.left.path().join(OLD));
        files
    }
}

const FULL: &str = "No space left on device";

#[test]
fn f32_every_command_that_writes_to_a_full_disk_says_so_and_leaves_no_part_of_a_file() {
    let Some(disk) = Disk::new("f32_every_command_that_writes_to_a_full_disk_says_so_and_leaves_no_part_of_a_file")
    else {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let picture = in_folder(folder.path(), "a.exr");
        let output = mica_below_a_limit(100).args(RENDER).args(["--no-cache", "-o", &picture]).output();
        failed(&output.expect("it starts"), 2, &["a.exr", "File too large"]);
        assert_eq!(names_in(folder.path()), [""; 0]);
        return;
    };
    let [exr, png, json, lines, folder] = ["a.exr", "a.png", "a.json", "a.jsonl", "folder"].map(|name| disk.path(name));
    let render =
        ["render", "sphere", "--size", "64x48", "--method", "smooth", "--frames", "0", "--quiet", "--no-cache"];
    let study = ["--quick", "--size", "4x3", "--method", "smooth", "--rounds", "1", "--seconds", "0.1", "--no-cache"];
    let commands: [&[&str]; 9] = [
        &[&render[..], &["-o", &exr]].concat(),
        &[&render[..], &["-o", &png]].concat(),
        &[&render[..], &["--json", &json]].concat(),
        &[&BENCH[..], &["--no-cache", "--json", &lines]].concat(),
        &[
            "bench",
            "--occlusion",
            "--size",
            "24x18",
            "--rays",
            "100",
            "--rounds",
            "1",
            "--quiet",
            "plane",
            "--json",
            &json,
        ],
        &["accuracy", "--quiet", "--counts", "--quick", "--method", "flakes", "--no-cache", "-o", &folder],
        &[&["accuracy", "--quiet", "plane"], &study[..], &["-o", &folder]].concat(),
        &["stability", "H01", "--quiet", "--json", &json],
        &["stability", "--quiet", "--sweeps", &folder],
    ];
    for words in commands {
        let named = words.last().expect("a file or folder");
        failed(&disk.run(1, words), 2, &[FULL, named, "cannot be written"]);
        // Lines have a file that may be empty; nothing else has one.
        for file in disk.files() {
            let is_lines = file.extension().is_some_and(|extension| extension == "jsonl");
            let bytes = fs::metadata(&file).expect("it was found").len();
            assert!(is_lines && bytes == 0, "{words:?} left {bytes} bytes of {}", file.display());
        }
    }
    // The first of two files fits, the second does not, nor a part of it.
    let both = [&render[..], &["-o", &png, "-o", &exr]].concat();
    failed(&disk.run(3, &both), 2, &[FULL, "a.exr"]);
    let names: Vec<_> = disk.files().iter().filter_map(|file| file.file_name()?.to_str().map(str::to_owned)).collect();
    assert_eq!(names, ["a.png"], "what was finished is kept");
    assert!(
        fs::read(&disk.files()[0]).is_ok_and(|bytes| bytes.ends_with(b"IEND\xaeB`\x82")),
        "the picture is not whole"
    );
}

#[test]
fn f32_a_bench_on_a_full_disk_keeps_the_lines_that_fitted_whole() {
    let Some(disk) = Disk::new("f32_a_bench_on_a_full_disk_keeps_the_lines_that_fitted_whole") else { return };
    let path = disk.path("bench.jsonl");
    let words = [&BENCH[..], &["--no-cache", "--json", &path]].concat();
    // A page more for each, so that the disk is full in the midst of other lines.
    let mut counts = Vec::new();
    for pages in 2..=3 {
        failed(&disk.run(pages, &words), 2, &[FULL, "bench.jsonl"]);
        let kept = disk.left.path().join("bench.jsonl");
        let text = fs::read_to_string(&kept).expect("a file");
        assert!(text.ends_with('\n') && text.len() as u64 <= (pages - 1) * PAGE, "a part of a line is left: {text}");
        counts.push(whole_lines(kept.to_str().expect("a plain name")).len());
    }
    assert!(counts[0] >= 1 && counts[1] > counts[0], "{counts:?}");
}

#[test]
fn f32_f39_a_cache_on_a_full_disk_is_one_warning_and_changes_no_picture() {
    let Some(disk) = Disk::new("f32_f39_a_cache_on_a_full_disk_is_one_warning_and_changes_no_picture") else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = in_folder(folder.path(), "a.exr");
    let wang = ["--method", "wang2020", "--set", "samples=1", "--set", "depth=3"];
    let words =
        [&["render", "sphere", "--size", "8x6", "--frames", "0", "--quiet", "-o", &picture], &wang[..]].concat();
    succeeded(&mica().args(&words).arg("--no-cache").output().expect("mica starts"));
    let expected = fs::read(&picture).expect("a picture");
    let output = disk.run(1, &[&words[..], &["--cache", &disk.path("cache")]].concat());
    succeeded(&output);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.starts_with("warning: ") && said.lines().count() == 1 && said.contains(FULL), "{said}");
    assert!(fs::read(&picture).is_ok_and(|bytes| bytes == expected), "another picture");
    assert_eq!(disk.files(), [""; 0].map(PathBuf::from), "a part of an entry is left");
}

#[test]
fn f32_printing_to_a_full_disk_is_an_error() {
    let Some(disk) = Disk::new("f32_printing_to_a_full_disk_is_an_error") else { return };
    for words in [&["methods", "--json"][..], &["oracle", "--seeds", "2", "--json"]] {
        let output = disk.run_through(&["sh", "-c", r#"out=$0; exec "$@" > "$out""#, &disk.path("out")], 1, words);
        failed(&output, 2, &["stdout cannot be written", FULL]);
    }
}

#[test]
fn f32_a_limit_of_files_leaves_the_old_file_and_no_part_of_a_new_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let outputs = ["a.exr", "a.json", "a.png"];
    for name in outputs {
        fs::write(folder.path().join(name), "old").expect("a file");
    }
    for name in outputs {
        let option = if name == "a.json" { "--json" } else { "-o" };
        let mut command = mica_below_a_limit(100);
        command.args(RENDER).args(["--no-cache", option, &in_folder(folder.path(), name)]);
        failed(&command.output().expect("it starts"), 2, &[name, "File too large"]);
        assert_eq!(fs::read(folder.path().join(name)).ok().as_deref(), Some(&b"old"[..]), "{name}");
        assert_eq!(names_in(folder.path()), outputs);
    }
}

#[test]
fn f32_a_limit_of_files_keeps_whole_lines_and_the_next_run_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let words = [&BENCH[..], &["--no-cache", "--json", &path]].concat();
    let bench = |most_bytes| mica_below_a_limit(most_bytes).args(&words).output().expect("it starts");
    failed(&bench(100), 2, &[]);
    assert_eq!(fs::read(&path).ok().as_deref(), Some(&b""[..]), "a part of a line is left");
    // Room for a line and a half.
    failed(&bench(4500), 2, &[]);
    let kept = fs::read_to_string(&path).expect("a file");
    assert!(kept.ends_with('\n') && !whole_lines(&path).is_empty(), "{kept}");
    succeeded(&bench(1 << 20));
    assert!(fs::read_to_string(&path).is_ok_and(|now| now.starts_with(&kept)));
    assert_eq!(sittings(&path), all_sittings());

    // What has no end is not read for lines.
    let output = mica().args(BENCH).args(["--json", "/dev/full"]).output().expect("mica starts");
    failed(&output, 2, &["/dev/full"]);
}
