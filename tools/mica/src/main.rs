//! Mica without a window: renders, measures and explains glints.

mod accuracy;
mod args;
mod bench;
mod budget;
mod build;
mod change;
mod charts;
mod doctor;
mod edit;
mod environment_choice;
mod error;
mod explain;
mod interrupt;
mod measure;
mod methods;
mod occlusion_choice;
mod oracle;
mod output;
mod page;
mod picture;
mod progress;
mod render;
mod render_help;
mod report;
mod report_text;
mod scene_choice;
mod scenes;
mod session;
mod spare;
mod stability;
mod study;
mod table;

use args::{Cli, Command};
use clap::Parser;
use error::{BAD_INPUT, Failure, NO_MEMORY, one_line};
use interrupt::Interrupt;
use signal_hook::consts::SIGABRT;
use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn main() -> ExitCode {
    show_warnings();
    quiet_loader_panics();
    end_aborts_with_a_code();
    let done = Interrupt::new().and_then(|interrupt| {
        output::survive_size_limits()?;
        match Cli::try_parse() {
            Ok(cli) => dispatch(&cli.command, &interrupt),
            Err(error) => usage(&error),
        }
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // Nobody is left to hear that this one line cannot be written.
            let _ = writeln!(std::io::stderr(), "mica: {failure}");
            ExitCode::from(failure.code)
        }
    }
}

fn dispatch(command: &Command, interrupt: &Interrupt) -> Result<(), Failure> {
    match command {
        Command::Render(args) => render::render(args, interrupt),
        Command::Scenes(args) => scenes::scenes(args),
        Command::Methods(args) => methods::methods(args),
        Command::Explain(args) => explain::explain(args),
        Command::Bench(args) => bench::bench(args, interrupt),
        Command::Accuracy(args) => accuracy::accuracy(args, interrupt),
        Command::Doctor(args) => doctor::doctor(args),
        Command::Oracle(args) => oracle::oracle(args),
        Command::Stability(args) => stability::stability(args, interrupt),
    }
}

/// Help and version go to stdout; mistakes become one line.
fn usage(error: &clap::Error) -> Result<(), Failure> {
    if error.exit_code() == 0 {
        return output::print(&error.render().to_string());
    }
    let text = error.render().to_string();
    // clap explains in paragraphs: what is wrong, tips, the usage, where help is.
    let mut paragraphs = text.split("\n\n").map(|paragraph| {
        let words: Vec<&str> = paragraph.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        words.join(" ")
    });
    let what = paragraphs.next().unwrap_or_default();
    let what = what.strip_prefix("error: ").unwrap_or(&what).to_owned();
    let tips: Vec<String> = paragraphs.filter(|paragraph| paragraph.starts_with("tip: ")).collect();
    let line = std::iter::once(what).chain(tips).chain(std::iter::once("see `mica help`".to_owned()));
    Err(Failure::with_code(BAD_INPUT, line.collect::<Vec<_>>().join("; ")))
}

/// The library's log on stderr, warnings and errors unless `RUST_LOG` says otherwise. Of a cache that cannot be used the first
/// line says all.
fn show_warnings() {
    let not_kept = AtomicBool::new(false);
    let env = env_logger::Env::default().default_filter_or("warn");
    env_logger::Builder::from_env(env)
        .format(move |to, record| {
            if record.target() == mica_gpu::NOT_KEPT && not_kept.swap(true, Ordering::Relaxed) {
                return Ok(());
            }
            let level = match record.level() {
                log::Level::Warn => "warning".to_owned(),
                level => level.as_str().to_lowercase(),
            };
            writeln!(to, "{level}: {}", one_line(&record.args().to_string()))
        })
        .init();
}

/// Decoders of scenes and images may panic on hostile files. That is caught where they are called and reported there,
/// in one line, so the panic itself is only of interest to who debugs it.
fn quiet_loader_panics() {
    let default = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if scene_choice::reads() {
            log::debug!("{info}");
        } else {
            default(info);
        }
    }));
}

/// An allocation that fails, here or in a driver, says so in one line and aborts: scripts shall see the code for it.
fn end_aborts_with_a_code() {
    let always = Arc::new(AtomicBool::new(true));
    if let Err(error) = signal_hook::flag::register_conditional_shutdown(SIGABRT, i32::from(NO_MEMORY), always) {
        log::debug!("aborts end as they do: {error}");
    }
}
