//! Outputs that cannot be, caches that others share or that cannot be used, and readers that leave: F33 and F37 to F39.

use super::full_disks::mica_below_a_limit;
use super::programs::*;
use mica_render::Cache;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime};

/// The program without the right to write where permissions say no, which a superuser has.
fn mica_bound_by_permissions(read_only: &Path) -> Command {
    let probe = read_only.join("probe");
    if File::create(&probe).is_err() {
        return mica();
    }
    fs::remove_file(probe).expect("it was made");
    through(&["setpriv", "--bounding-set=-dac_override,-dac_read_search"])
}

fn read_only(folder: &Path) {
    let mut permissions = fs::metadata(folder).expect("a folder").permissions();
    permissions.set_readonly(true);
    fs::set_permissions(folder, permissions).expect("its owner may");
}

/// The scene or the device is not there either: outputs are looked at first.
#[test]
fn f33_an_output_that_cannot_be_is_told_before_anything_is_rendered() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let closed = folder.path().join("closed");
    fs::create_dir_all(closed.join("taken.png")).expect("folders");
    fs::write(folder.path().join("file"), "x").expect("a file");
    let of = |name: &str| in_folder(folder.path(), name);
    read_only(&closed);
    for (path, part) in [
        (of("closed/a.png"), "closed/a.png"),
        (of("closed/taken.png"), "taken.png"),
        (of("missing/a.png"), "missing/a.png"),
        (of("file/a.png"), "file/a.png"),
        (of("a\nb.png"), "a\\nb.png"),
        (of("a\u{7f}.png"), "a\\u{7f}.png"),
    ] {
        for command in [
            &["render", "nowhere.glb", "-o", &path][..],
            &["render", "nowhere.glb", "--json", &path],
            &["bench", "nowhere.glb", "--json", &path],
            &["accuracy", "--device", "nowhere", "--sheet", &path],
        ] {
            let output = mica_bound_by_permissions(&closed).args(command).output().expect("it starts");
            let error = failed(&output, 2, &[part]);
            assert!(!error.contains("nowhere"), "{command:?}: {error}");
        }
    }
    for name in ["closed/study", "file", "a\nb"] {
        let words = ["accuracy", "nowhere.glb", "-o", &of(name)];
        let output = mica_bound_by_permissions(&closed).args(words).output().expect("it starts");
        assert!(!failed(&output, 2, &[]).contains("nowhere"));
    }
    assert_eq!(names_in(folder.path()), ["closed", "file"]);
    assert_eq!(names_in(&closed), ["taken.png"]);
}

/// How many times a process of [`f37_a_process_alone_reads_what_it_stored`] stores its entry.
const ROUNDS: &str = "MICA_TEST_ROUNDS";
/// The cache that it uses.
const FOLDER: &str = "MICA_TEST_CACHE";
const PAYLOAD_BYTES: usize = 200_000;

/// A process that stores entries and reads what is there.
fn contender(folder: &Path, rounds: u32) -> Child {
    let program = std::env::current_exe().expect("this program");
    Command::new(program)
        .args(["--exact", "outputs::f37_a_process_alone_reads_what_it_stored"])
        .env(FOLDER, folder)
        .env(ROUNDS, rounds.to_string())
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts")
}

fn check_entry(cache: &Cache) {
    if let Some(bytes) = cache.load("table").expect("an entry is whole or not there") {
        assert!(bytes.len() == PAYLOAD_BYTES && bytes.iter().all(|byte| *byte == bytes[0]), "a mixture");
    }
}

/// Alone, or in company where another test starts it as one of many.
#[test]
fn f37_a_process_alone_reads_what_it_stored() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let folder = std::env::var_os(FOLDER).map_or_else(|| own.path().to_owned(), Into::into);
    let rounds = std::env::var(ROUNDS).map_or(2, |rounds| rounds.parse().expect("a number"));
    let cache = Cache::new(folder);
    for round in 0..rounds {
        let byte = (std::process::id().wrapping_add(round) % 256) as u8;
        cache.store("table", &vec![byte; PAYLOAD_BYTES]).expect("stored");
        check_entry(&cache);
    }
    assert!(cache.load("table").is_ok_and(|entry| entry.is_some()));
}

#[test]
fn f37_processes_that_share_a_cache_read_whole_entries() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut children: Vec<Child> = (0..32).map(|_| contender(folder.path(), 100)).collect();
    for child in &mut children {
        assert!(child.wait().expect("it ends").success());
    }
    assert_eq!(names_in(folder.path()), ["table.bin"]);
}

#[test]
fn f38_a_kill_while_an_entry_is_written_leaves_the_old_one_and_what_it_left_goes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cache = Cache::new(folder.path());
    cache.store("table", &vec![7; PAYLOAD_BYTES]).expect("stored");
    let temporaries = || names_in(folder.path()).into_iter().filter(|name| name != "table.bin").collect::<Vec<_>>();
    let mut kills = 0;
    while kills < 5 || temporaries().is_empty() {
        assert!(kills < 1000, "no kill came between write and rename");
        let mut child = contender(folder.path(), u32::MAX);
        // It writes for most of its life.
        std::thread::sleep(Duration::from_millis(40 + kills % 17));
        child.kill().expect("it is ours");
        child.wait().expect("it ended");
        check_entry(&cache);
        kills += 1;
    }
    let left = temporaries();
    cache.store("table", b"new").expect("stored");
    assert_eq!(temporaries(), left, "they may be of a process that still writes");
    let two_days_ago = SystemTime::now() - Duration::from_secs(2 * 24 * 3600);
    for name in &left {
        let file = File::options().write(true).open(folder.path().join(name)).expect("it is there");
        file.set_modified(two_days_ago).expect("a time");
    }
    cache.store("table", b"newer").expect("stored");
    assert_eq!(names_in(folder.path()), ["table.bin"]);
    assert_eq!(cache.load("table").expect("readable").as_deref(), Some(&b"newer"[..]));
}

/// The method's tables, and the driver's pipelines.
#[test]
fn f39_a_cache_that_cannot_be_used_is_one_warning_and_a_run_without() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // A table of a megabyte that is made quickly.
    let table = ["--set", "dpf=counted", "--set", "dpf_flakes=1000"];
    let words =
        [&["render", "sphere", "--size", "24x18", "--frames", "0", "--method", "wang2018"], &table[..]].concat();
    let picture = |name: &str, mut command: Command, cache: &[&str]| {
        let path = in_folder(folder.path(), name);
        let output = command.args(&words).args(["--quiet", "-o", &path]).args(cache).output().expect("it starts");
        succeeded(&output);
        (fs::read(path).expect("a picture"), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (without, silence) = picture("without.exr", mica(), &["--no-cache"]);
    assert_eq!(silence, "");
    // Another driver may round otherwise.
    let without_limit = picture("without.exr", mica_below_a_limit(1 << 40), &["--no-cache"]).0;
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).expect("a folder");
    read_only(&closed);
    let full = in_folder(folder.path(), "full");
    fs::write(folder.path().join("file"), "x").expect("a file");
    for (program, expected, cache, part) in [
        (mica(), &without, in_folder(folder.path(), "file/cache"), "file/cache"),
        (mica_bound_by_permissions(&closed), &without, in_folder(&closed, "cache"), "Permission denied"),
        // Room for the picture, and not for the tables.
        (mica_below_a_limit(100_000), &without_limit, full.clone(), "File too large"),
    ] {
        let (bytes, warning) = picture("a.exr", program, &["--cache", &cache]);
        assert!(bytes == *expected, "{cache}");
        assert_eq!(warning.lines().count(), 1, "{warning}");
        assert!(warning.starts_with("warning: ") && warning.contains(part), "{warning}");
        assert!(warning.contains("goes on without it"), "{warning}");
    }
    assert!(names_in(Path::new(&full)).iter().all(|name| name.starts_with("pipelines-")), "a part of a table is left");
}

#[test]
fn a_reader_that_leaves_ends_nothing_and_hears_nothing_more() {
    let mut child = mica()
        .args(RENDER)
        .args(["--json", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("mica starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()), (Some(0), String::new()));
    let closed = Command::new("sh").args(["-c", r#""$0" methods >&-"#]).arg(mica().get_program()).output();
    assert_eq!(closed.map(|output| (output.status.code(), output.stderr)).ok(), Some((Some(0), Vec::new())));
}
