//! Ctrl-C, and its like of other programs: ends at once while there is nothing to lose, and otherwise after the frame under
//! way.

use crate::error::{Failure, INTERRUPTED};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user wants to end.
pub struct Interrupt {
    /// What the next Ctrl-C does: end at once, or set `requested`.
    at_once: Arc<AtomicBool>,
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Ctrl-C, or a polite request to end, ends the process at once, with the code for it.
    pub fn new() -> Result<Self, Failure> {
        let interrupt = Self { at_once: Arc::new(AtomicBool::new(true)), requested: Arc::default() };
        // A terminal that is closed, unless `nohup` asked for that to be survived.
        let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        let signals: Vec<i32> = [SIGINT, SIGTERM].into_iter().chain(hangup).collect();
        match interrupt.listen(&signals) {
            Ok(()) => Ok(interrupt),
            Err(error) => Err(Failure::bad_input(format!("Ctrl-C cannot be handled: {error}"))),
        }
    }

    /// Hears signals on a thread of their own, which may say why the process ends: a handler may not.
    fn listen(&self, signals: &[i32]) -> io::Result<()> {
        let ending = Arc::new(AtomicBool::new(false));
        for signal in signals {
            // Where nobody reads the line, the next one ends the process without.
            flag::register_conditional_shutdown(*signal, i32::from(INTERRUPTED), ending.clone())?;
        }
        let mut heard = Signals::new(signals)?;
        let (at_once, requested) = (self.at_once.clone(), self.requested.clone());
        let listener = std::thread::Builder::new().name("signals".to_owned());
        listener.spawn(move || {
            for _ in heard.forever() {
                let again = requested.swap(true, Ordering::SeqCst);
                // The first one of a graceful section does not end the process, the second does.
                if !at_once.swap(true, Ordering::SeqCst) {
                    continue;
                }
                ending.store(true, Ordering::SeqCst);
                let what = if again { "interrupted again: what was under way is given up" } else { "interrupted" };
                // Nobody may be left to hear it.
                let _ = writeln!(io::stderr(), "mica: {what}");
                low_level::exit(i32::from(INTERRUPTED));
            }
        })?;
        Ok(())
    }

    /// From here on there is something to keep: the first Ctrl-C is only remembered.
    pub fn defer(&self) {
        self.at_once.store(false, Ordering::SeqCst);
    }

    /// Whether Ctrl-C was pressed.
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::SeqCst)
    }
}

/// Whether who started the process had a signal ignored, by the mask that Linux shows; elsewhere it is taken for no.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::is_ignored;
    use signal_hook::consts::{SIGPIPE, SIGSEGV};

    #[test]
    fn what_is_ignored_is_known() {
        // Rust ignores the one before `main`, and handles the other.
        assert!(is_ignored(SIGPIPE) && !is_ignored(SIGSEGV));
    }
}
