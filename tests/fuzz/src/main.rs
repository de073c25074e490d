//! Runs mutated files through every target: each format in a process of its own, whose memory is bounded and whose inputs
//! have a deadline, so that a panic, an abort and a hang all come to light, with the input that did it.

use mica_fuzz::{Format, input};
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

const USAGE: &str = "mica-fuzz [--inputs N] [--seed S] [--format NAME] [--out DIR], or mica-fuzz --replay NAME FILE";

/// The address space of a process that decodes, KiB: what a few small files need, and no more.
const MEMORY_KIB: u64 = 1 << 20;
/// No input takes a hundredth of this, on a machine that does nothing else.
const DEADLINE: Duration = Duration::from_secs(30);

fn main() -> ExitCode {
    match run(std::env::args().skip(1).collect()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("fuzz: {error}; {USAGE}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: Vec<String>) -> Result<bool, String> {
    if let [flag, format, file] = &arguments[..]
        && flag == "--replay"
    {
        let bytes = fs::read(file).map_err(|error| format!("{file}: {error}"))?;
        let read = named(format)?.read(&bytes);
        println!("{}", if read { "read" } else { "refused" });
        return Ok(true);
    }
    let mut plan = Plan { inputs: 100_000, seed: 1, formats: Format::ALL.to_vec(), out: std::env::temp_dir() };
    let mut child = None;
    for pair in arguments.chunks(2) {
        let [flag, value] = pair else { return Err(format!("`{}` lacks a value", pair[0])) };
        let number = || value.parse::<u64>().map_err(|_| format!("{flag} {value} is no number"));
        match flag.as_str() {
            "--inputs" => plan.inputs = number()?,
            "--seed" => plan.seed = number()?,
            "--format" => plan.formats = vec![named(value)?],
            "--out" => plan.out = PathBuf::from(value),
            // How this program calls itself.
            "--progress" => child = Some(PathBuf::from(value)),
            _ => return Err(format!("there is no {flag}")),
        }
    }
    match child {
        Some(progress) => read_all(&plan, &progress),
        None => supervise(&plan),
    }
}

fn named(name: &str) -> Result<Format, String> {
    let names = || Format::ALL.map(Format::name).join(", ");
    Format::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| format!("{name} is none of {}", names()))
}

/// What is to be tried.
struct Plan {
    inputs: u64,
    seed: u64,
    formats: Vec<Format>,
    /// Where inputs that failed are written.
    out: PathBuf,
}

/// In a process of its own: reads every input of the first format, and says which one is under way.
fn read_all(plan: &Plan, progress: &Path) -> Result<bool, String> {
    static PANICS: AtomicU64 = AtomicU64::new(0);
    static LAST: Mutex<String> = Mutex::new(String::new());
    // Panics of decoders that the renderer catches are counted, not printed.
    std::panic::set_hook(Box::new(|info| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string().replace('\n', " ");
    }));
    let format = plan.formats[0];
    let corpus = format.corpus();
    let progress = File::create(progress).map_err(|error| format!("{}: {error}", progress.display()))?;
    let mut read = 0;
    for index in 0..plan.inputs {
        progress.write_all_at(&index.to_le_bytes(), 0).map_err(|error| error.to_string())?;
        let bytes = input(format, &corpus, plan.seed, index);
        match catch_unwind(AssertUnwindSafe(|| format.read(&bytes))) {
            Ok(was_read) => read += u64::from(was_read),
            Err(_) => {
                eprintln!("{}", LAST.lock().unwrap_or_else(PoisonError::into_inner));
                return Ok(false);
            }
        }
    }
    let contained = match PANICS.load(Ordering::Relaxed) {
        0 => String::new(),
        count => {
            format!(", {count} panics contained, the last {}", LAST.lock().unwrap_or_else(PoisonError::into_inner))
        }
    };
    println!("{read} read{contained}");
    Ok(true)
}

/// Runs a process for each format, as many at a time as there are cores, and says how they ended.
fn supervise(plan: &Plan) -> Result<bool, String> {
    let queue = Mutex::new(plan.formats.clone().into_iter());
    let failed = AtomicU64::new(0);
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores.min(plan.formats.len()) {
            scope.spawn(|| {
                let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                while let Some(format) = next() {
                    let start = Instant::now();
                    match watch(plan, format) {
                        Ok(summary) => {
                            println!("fuzz: {}: {summary}, in {:.1} s", format.name(), start.elapsed().as_secs_f64());
                        }
                        Err(finding) => {
                            failed.fetch_add(1, Ordering::Relaxed);
                            println!("fuzz: {}: FAILED: {finding}", format.name());
                        }
                    }
                }
            });
        }
    });
    let names: Vec<&str> = plan.formats.iter().map(|format| format.name()).collect();
    let inputs = grouped(plan.inputs);
    let failed = failed.into_inner();
    let end = if failed == 0 { "no panic, abort or hang".to_owned() } else { format!("{failed} formats FAILED") };
    println!("fuzz: {inputs} inputs each of {}: {end}", names.join(", "));
    Ok(failed == 0)
}

/// Runs the process of one format to its end, or to that of its patience.
fn watch(plan: &Plan, format: Format) -> Result<String, String> {
    let progress = tempfile::NamedTempFile::new().map_err(|error| error.to_string())?;
    let mut child = spawn(plan, format, progress.path()).map_err(|error| error.to_string())?;
    let mut last = (0, Instant::now());
    let ended = loop {
        if let Some(status) = child.try_wait().map_err(|error| error.to_string())? {
            break Some(status);
        }
        let index = under_way(progress.as_file());
        if index != last.0 {
            last = (index, Instant::now());
        }
        if last.1.elapsed() > DEADLINE {
            // It may have ended meanwhile, which is as well.
            let _ = child.kill();
            break None;
        }
        thread::sleep(Duration::from_millis(20));
    };
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    let why = match ended {
        Some(status) if status.success() => return Ok(said(&output.stdout)),
        Some(status) => format!("{status}: {}", said(&output.stderr)),
        None => format!("no end within {} s", DEADLINE.as_secs()),
    };
    let index = under_way(progress.as_file());
    let path = plan.out.join(format!("mica-fuzz-{}-{index}.{}", plan.seed, format.name()));
    let bytes = input(format, &format.corpus(), plan.seed, index);
    let kept = match fs::write(&path, bytes) {
        Ok(()) => format!("the input is in {}", path.display()),
        Err(error) => format!("{} cannot be written: {error}", path.display()),
    };
    Err(format!("input {index} of seed {}: {why}; {kept}", plan.seed))
}

/// The input that a process works on.
fn under_way(progress: &File) -> u64 {
    let mut index = [0; 8];
    // Until the process has begun there is nothing to read.
    let _ = progress.read_exact_at(&mut index, 0);
    u64::from_le_bytes(index)
}

fn spawn(plan: &Plan, format: Format, progress: &Path) -> std::io::Result<Child> {
    Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY_KIB} && exec \"$0\" \"$@\"")])
        .arg(std::env::current_exe()?)
        .args(["--format", format.name(), "--inputs", &plan.inputs.to_string(), "--seed", &plan.seed.to_string()])
        .arg("--progress")
        .arg(progress)
        // The formats run side by side already.
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
}

/// 100000 as 100,000.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|group| str::from_utf8(group).ok()).collect();
    groups.join(",")
}
