//! Files and their disks, signals, and caches that others share or that cannot be used.

use mica_render::Cache;
use serde_json::Value as Json;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// A render that is over in no time.
const RENDER: [&str; 9] = ["render", "sphere", "--size", "24x18", "--method", "smooth", "--frames", "0", "--quiet"];
/// A bench of two points, each with a line after its first sitting and one after its last.
const BENCH: [&str; 11] =
    ["bench", "sphere", "--size", "8x6", "--size", "9x6", "--method", "smooth", "--rounds", "1", "--quiet"];

/// The program, with a cache that the tests share and keep.
fn mica() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mica"));
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command.env_remove("RUST_LOG");
    command
}

fn succeeded(output: &Output) -> String {
    assert!(output.status.success(), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("stdout is UTF-8")
}

/// Exactly one line on stderr and this exit code.
#[track_caller]
fn failed_in_one_line(output: &Output, code: i32) -> String {
    let error = String::from_utf8(output.stderr.clone()).expect("stderr is UTF-8");
    assert_eq!(output.status.code(), Some(code), "{}: {error}", output.status);
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
    folder.join(name).to_str().expect("temporary folders have plain names").to_owned()
}

/// The program, on a disk where no file may grow beyond so many bytes. Newer lavapipes keep device memory in files, which such
/// a limit ends too: outputs are the same on any driver, so Debian's own serves where it is installed.
fn mica_on_full_disk(most_bytes: u64) -> Command {
    const DEBIANS: &str = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json";
    let mut command = through(&["prlimit", &format!("--fsize={most_bytes}")]);
    if Path::new(DEBIANS).exists() {
        command.env("VK_DRIVER_FILES", DEBIANS);
    }
    command
}

/// The program, started by another one.
fn through(words: &[&str]) -> Command {
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

fn signal(child: &Child, names: &[&str]) {
    for name in names {
        let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
    }
}

/// The lines of a file that are whole.
fn whole_lines(path: &str) -> Vec<Json> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    text[..whole].lines().map(|line| serde_json::from_str(line).expect("a whole line is readable")).collect()
}

/// The size of each point, and how many sittings it has.
fn sittings(path: &str) -> Vec<(String, usize)> {
    let of =
        |point: &Json| (point["place"]["size"].to_string(), point["cost"]["sittings"].as_array().map_or(0, Vec::len));
    let mut all: Vec<_> = whole_lines(path).iter().map(of).collect();
    all.sort();
    all
}

fn all_sittings() -> Vec<(String, usize)> {
    [("[8,6]", 1), ("[8,6]", 3), ("[9,6]", 1), ("[9,6]", 3)].map(|(size, count)| (size.to_owned(), count)).to_vec()
}

#[test]
fn f32_a_full_disk_leaves_the_old_file_and_no_part_of_a_new_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let outputs = ["a.exr", "a.json", "a.png"];
    for name in outputs {
        fs::write(folder.path().join(name), "old").expect("a file");
    }
    for name in outputs {
        let option = if name == "a.json" { "--json" } else { "-o" };
        let mut command = mica_on_full_disk(100);
        command.args(RENDER).args(["--no-cache", option, &in_folder(folder.path(), name)]);
        let error = failed_in_one_line(&command.output().expect("it starts"), 2);
        assert!(error.contains(name) && error.contains("File too large"), "{error}");
        assert_eq!(fs::read(folder.path().join(name)).ok().as_deref(), Some(&b"old"[..]), "{name}");
        assert_eq!(names_in(folder.path()), outputs);
    }
}

#[test]
fn f32_a_full_disk_keeps_whole_lines_and_the_next_run_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let words = [&BENCH[..], &["--no-cache", "--json", &path]].concat();
    let bench = |most_bytes| mica_on_full_disk(most_bytes).args(&words).output().expect("it starts");
    failed_in_one_line(&bench(100), 2);
    assert_eq!(fs::read(&path).ok().as_deref(), Some(&b""[..]), "a part of a line is left");
    // Room for a line and a half.
    failed_in_one_line(&bench(4500), 2);
    let kept = fs::read_to_string(&path).expect("a file");
    assert!(kept.ends_with('\n') && !whole_lines(&path).is_empty(), "{kept}");
    succeeded(&bench(1 << 20));
    assert!(fs::read_to_string(&path).is_ok_and(|now| now.starts_with(&kept)));
    assert_eq!(sittings(&path), all_sittings());

    // What has no end is not read for lines.
    let output = mica().args(BENCH).args(["--json", "/dev/full"]).output().expect("mica starts");
    assert!(failed_in_one_line(&output, 2).contains("/dev/full"));
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
            let error = failed_in_one_line(&output, 2);
            assert!(error.contains(part) && !error.contains("nowhere"), "{command:?}: {error}");
        }
    }
    for name in ["closed/study", "file", "a\nb"] {
        let words = ["accuracy", "nowhere.glb", "-o", &of(name)];
        let output = mica_bound_by_permissions(&closed).args(words).output().expect("it starts");
        assert!(!failed_in_one_line(&output, 2).contains("nowhere"));
    }
    assert_eq!(names_in(folder.path()), ["closed", "file"]);
    assert_eq!(names_in(&closed), ["taken.png"]);
}

/// A render of many samples that has begun; its pictures are in the folder when it ends.
fn long_render(folder: &Path) -> (Child, impl Iterator<Item = String> + use<>) {
    let [picture, report] = ["a.exr", "a.json"].map(|name| in_folder(folder, name));
    let mut child = mica()
        .args(RENDER)
        .args(["--samples", "1000000", "-o", &picture, "--json", &report])
        .env("RUST_LOG", "info")
        .stderr(Stdio::piped())
        .spawn()
        .expect("mica starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("Ctrl-C keeps")), "the program ended early");
    (child, lines)
}

#[test]
fn f34_who_is_asked_to_end_keeps_the_samples_and_a_second_time_ends_at_once() {
    for name in ["INT", "TERM"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (mut child, lines) = long_render(folder.path());
        signal(&child, &[name]);
        let last = lines.last().unwrap_or_default();
        assert_eq!(child.wait().expect("it ends").code(), Some(130), "{last}");
        assert!(last.starts_with("mica: interrupted after"), "{last}");
        assert_eq!(names_in(folder.path()), ["a.exr", "a.json"]);
        let report = fs::read_to_string(folder.path().join("a.json")).expect("a file");
        let report: Json = serde_json::from_str(&report).expect("JSON");
        assert_eq!(report["interrupted"], true);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, lines) = long_render(folder.path());
    // Both wait for it when it goes on.
    signal(&child, &["STOP", "INT", "TERM", "CONT"]);
    let after: Vec<String> = lines.collect();
    assert_eq!((child.wait().expect("it ends").code(), after), (Some(130), Vec::new()));
    assert_eq!(names_in(folder.path()), [""; 0]);
}

#[test]
fn f34_a_bench_that_is_asked_to_end_keeps_its_lines_and_goes_on_with_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = in_folder(folder.path(), "bench.jsonl");
    let words = [&BENCH[..], &["--json", &path]].concat();
    let mut child = mica().args(&words).stderr(Stdio::piped()).spawn().expect("mica starts");
    while whole_lines(&path).is_empty() && child.try_wait().expect("it runs").is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    signal(&child, &["TERM"]);
    let error = failed_in_one_line(&child.wait_with_output().expect("it ends"), 130);
    assert!(error.contains("interrupted after") && error.contains("kept"), "{error}");
    let kept = fs::read_to_string(&path).expect("a file");
    assert!(!kept.is_empty() && kept.ends_with('\n'), "{kept}");
    succeeded(&mica().args(&words).output().expect("mica starts"));
    assert!(fs::read_to_string(&path).is_ok_and(|now| now.starts_with(&kept)));
    assert_eq!(sittings(&path).last(), all_sittings().last());
}

#[test]
fn f35_a_bench_that_is_killed_at_any_time_keeps_every_line_and_goes_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [path, undisturbed] = ["bench.jsonl", "undisturbed.jsonl"].map(|name| in_folder(folder.path(), name));
    let begun = Instant::now();
    succeeded(&mica().args(BENCH).args(["--json", &undisturbed]).output().expect("mica starts"));
    let whole = begun.elapsed();
    let mut kept = String::new();
    for kill in 1..=20 {
        let mut child = mica().args(BENCH).args(["--json", &path]).spawn().expect("mica starts");
        // Multiples of the golden ratio leave no part of the run out.
        std::thread::sleep(whole.mul_f64((f64::from(kill) * 0.618_033_988_75).fract()));
        child.kill().expect("it is ours");
        child.wait().expect("it ended");
        let now = fs::read_to_string(&path).unwrap_or_default();
        assert!(now.starts_with(&kept), "a line is lost: {kept} {now}");
        kept = now[..now.rfind('\n').map_or(0, |end| end + 1)].to_owned();
        whole_lines(&path);
        if sittings(&path).len() == all_sittings().len() {
            assert_eq!(sittings(&path), all_sittings());
            fs::remove_file(&path).expect("it is there");
            kept.clear();
        }
    }
    succeeded(&mica().args(BENCH).args(["--json", &path]).output().expect("mica starts"));
    assert_eq!(sittings(&path), all_sittings());
    assert_eq!(names_in(folder.path()), ["bench.jsonl", "undisturbed.jsonl"]);
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
    let mut children: Vec<Child> = (0..16).map(|_| contender(folder.path(), 12)).collect();
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
    let without_limit = picture("without.exr", mica_on_full_disk(1 << 40), &["--no-cache"]).0;
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).expect("a folder");
    read_only(&closed);
    let full = in_folder(folder.path(), "full");
    fs::write(folder.path().join("file"), "x").expect("a file");
    for (program, expected, cache, part) in [
        (mica(), &without, in_folder(folder.path(), "file/cache"), "file/cache"),
        (mica_bound_by_permissions(&closed), &without, in_folder(&closed, "cache"), "Permission denied"),
        // Room for the picture, and not for the tables.
        (mica_on_full_disk(100_000), &without_limit, full.clone(), "File too large"),
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
