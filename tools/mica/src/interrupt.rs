//! Ctrl-C: ends at once while there is nothing to lose, and otherwise after the frame under way.

use crate::error::{Failure, INTERRUPTED};
use signal_hook::consts::SIGINT;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user wants to end.
pub struct Interrupt {
    /// What the next Ctrl-C does: end at once, or set `requested`.
    at_once: Arc<AtomicBool>,
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Ctrl-C ends the process at once, with the code for it.
    pub fn new() -> Result<Self, Failure> {
        let interrupt = Self { at_once: Arc::new(AtomicBool::new(true)), requested: Arc::default() };
        let register = || {
            // In this order: the first Ctrl-C of a graceful section does not end the process, the second does.
            signal_hook::flag::register_conditional_shutdown(
                SIGINT,
                i32::from(INTERRUPTED),
                interrupt.at_once.clone(),
            )?;
            signal_hook::flag::register(SIGINT, interrupt.at_once.clone())?;
            signal_hook::flag::register(SIGINT, interrupt.requested.clone())
        };
        match register() {
            Ok(_) => Ok(interrupt),
            Err(error) => Err(Failure::bad_input(format!("Ctrl-C cannot be handled: {error}"))),
        }
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
