//! Progress on stderr: only on a terminal, and only for work that has taken a second already.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(1);

/// Shows one piece of work after the other.
pub struct Progress {
    bar: ProgressBar,
    what: String,
    since: Instant,
    quiet: bool,
}

impl Progress {
    /// Nothing is shown yet; with `quiet`, nothing ever is.
    pub fn new(quiet: bool) -> Self {
        Self { bar: ProgressBar::hidden(), what: String::new(), since: Instant::now(), quiet }
    }

    /// Says how far a piece of work has come. A total of 0 stands for work whose end is unknown.
    pub fn update(&mut self, what: &str, done: u64, total: u64) {
        if self.what != what {
            self.clear();
            self.what = what.to_owned();
            self.since = Instant::now();
        }
        if self.quiet || self.since.elapsed() < PATIENCE {
            return;
        }
        if self.bar.is_hidden() {
            let template = if total == 0 { "{spinner} {msg} {elapsed}" } else { "{msg} [{bar:30}] {pos}/{len} {eta}" };
            let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
            // On anything but a terminal this target draws nothing.
            self.bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr()).with_style(style);
            self.bar.set_message(self.what.clone());
        }
        self.bar.set_length(total);
        self.bar.set_position(done);
        self.bar.tick();
    }

    /// Waits for work on another thread; `None` if that thread panicked.
    pub fn wait<T>(&mut self, what: &str, result: Receiver<T>) -> Option<T> {
        loop {
            self.update(what, 0, 0);
            match result.recv_timeout(Duration::from_millis(100)) {
                Ok(value) => return Some(value),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
    }

    /// Does a piece of work of unknown length, on this thread.
    pub fn during<T>(&mut self, what: &str, work: impl FnOnce() -> T) -> T {
        let (working, until_done) = mpsc::channel::<()>();
        let result = std::thread::scope(|scope| {
            let progress = &mut *self;
            scope.spawn(move || progress.wait(what, until_done));
            let result = work();
            drop(working);
            result
        });
        self.clear();
        result
    }

    /// Takes what is shown away.
    pub fn clear(&mut self) {
        self.bar.finish_and_clear();
        self.bar = ProgressBar::hidden();
        self.what.clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
