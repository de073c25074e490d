//! Processes that are asked to end, lose their terminal, abort or are killed: F34 and F35.

use super::programs::*;
use serde_json::Value as Json;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn signal(child: &Child, names: &[&str]) {
    for name in names {
        let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
    }
}

/// What a program is run through so that it hears hangups, also where the tests themselves run under nohup.
const HEARS_HANGUPS: [&str; 2] = ["env", "--default-signal=HUP"];

/// A render of many samples that has begun; its pictures are in the folder when it ends.
fn long_render(folder: &Path, through_words: &[&str]) -> (Child, impl Iterator<Item = String> + use<>) {
    let [picture, report] = ["a.exr", "a.json"].map(|name| in_folder(folder, name));
    let mut command = if through_words.is_empty() { mica() } else { through(through_words) };
    let mut child = command
        .args(RENDER)
        // Samples that take long enough for two signals within one.
        .args(["--size", "320x240", "--samples", "1000000", "-o", &picture, "--json", &report])
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
        let (mut child, lines) = long_render(folder.path(), &[]);
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
    let (mut child, lines) = long_render(folder.path(), &[]);
    // Both wait for it when it goes on.
    signal(&child, &["STOP", "INT", "TERM", "CONT"]);
    let after: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(after, ["mica: interrupted again: what was under way is given up"]);
    assert_eq!(names_in(folder.path()), [""; 0]);
}

#[test]
fn f34_who_is_asked_to_end_before_there_is_anything_to_keep_says_so_and_ends() {
    for (name, bit) in [("INT", 1), ("TERM", 14)] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = in_folder(folder.path(), "a.png");
        // A million triangles are made first.
        let mut render = mica();
        let child = render.args(["render", "drift", "--quiet", "-o", &path]).stderr(Stdio::piped()).spawn();
        let child = child.expect("mica starts");
        wait_until("a handler", || {
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
            let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).map(str::trim);
            mask.and_then(|mask| u64::from_str_radix(mask, 16).ok()).is_some_and(|mask| mask >> bit & 1 == 1)
        });
        signal(&child, &[name]);
        let error = failed(&child.wait_with_output().expect("it ends"), 130, &[]);
        assert_eq!(error, "mica: interrupted\n");
        assert_eq!(names_in(folder.path()), [""; 0]);
    }
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
    let error = failed(&child.wait_with_output().expect("it ends"), 130, &[]);
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
    for kill in 1..=50 {
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

/// How long the slowest thing here takes on the slowest machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits for something to become true.
#[track_caller]
fn wait_until(what: &str, mut is_true: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_true() {
        assert!(begun.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A terminal of its own, which goes when its program is killed, as when a window is closed.
#[test]
fn f34_a_bench_whose_terminal_is_closed_keeps_its_lines_and_ends() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [path, code, script] = ["bench.jsonl", "code", "script"].map(|name| in_folder(folder.path(), name));
    // The first shell dies with its terminal, and with it all that it runs hears of that; the second one lives on to tell how
    // the program ended.
    let words: Vec<&str> = [&BENCH[..10], &["--json", &path]].concat();
    let run = format!("trap : HUP; {} {}; echo $? > {code}", mica().get_program().display(), words.join(" "));
    fs::write(&script, run).expect("a file");
    let mut terminal = Command::new(HEARS_HANGUPS[0])
        .envs(mica().get_envs().filter_map(|(name, value)| Some((name, value?))))
        .args([HEARS_HANGUPS[1], "script"])
        .args(["--quiet", "--command", &format!("sh {script}; true"), "/dev/null"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .expect("script is part of Debian's bsdutils");
    wait_until("a first line", || !whole_lines(&path).is_empty());
    terminal.kill().expect("it is ours");
    terminal.wait().expect("it ended");
    wait_until("an end", || fs::read_to_string(&code).is_ok_and(|code| code.ends_with('\n')));
    assert_eq!(fs::read_to_string(&code).expect("it was there"), "130\n");
    let kept = fs::read_to_string(&path).expect("a file");
    assert!(kept.ends_with('\n') && sittings(&path).len() < all_sittings().len(), "{kept}");
    succeeded(&mica().args(BENCH).args(["--json", &path]).output().expect("mica starts"));
    assert!(fs::read_to_string(&path).is_ok_and(|now| now.starts_with(&kept)));
    assert_eq!(sittings(&path).last(), all_sittings().last());
}

#[test]
fn f34_a_hangup_ends_a_render_in_good_order_unless_it_is_to_be_ignored() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, lines) = long_render(folder.path(), &HEARS_HANGUPS);
    signal(&child, &["HUP"]);
    let last = lines.last().unwrap_or_default();
    assert_eq!(child.wait().expect("it ends").code(), Some(130), "{last}");
    assert!(last.starts_with("mica: interrupted after"), "{last}");
    assert_eq!(names_in(folder.path()), ["a.exr", "a.json"]);

    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, lines) = long_render(folder.path(), &["nohup"]);
    signal(&child, &["HUP"]);
    std::thread::sleep(Duration::from_millis(200));
    assert!(child.try_wait().expect("its own child").is_none(), "it ended by a signal that is to be ignored");
    signal(&child, &["INT"]);
    drop(lines);
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
}

/// As drivers and allocations that fail end a process.
#[test]
fn f34_an_abort_ends_with_the_code_for_memory_and_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, lines) = long_render(folder.path(), &[]);
    signal(&child, &["ABRT"]);
    assert_eq!(lines.collect::<Vec<_>>(), [""; 0]);
    assert_eq!(child.wait().expect("it ends").code(), Some(4));
    assert_eq!(names_in(folder.path()), [""; 0]);
}
