//! SIGINT and SIGTERM: a program that is asked to stop shuts down in order.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, SIGTERM};

/// Set by the first of the signals; the handlers are installed when it is first used.
static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| {
    let asked = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&asked))
            .expect("SIGINT and SIGTERM can be caught");
    }
    asked
});

/// The process was asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

/// Starts to catch the signals.
pub fn listen() {
    LazyLock::force(&ASKED);
}

/// Checks for a signal.
///
/// # Errors
/// The process was asked to stop.
pub fn check() -> Result<(), Interrupted> {
    if ASKED.load(Ordering::Relaxed) {
        Err(Interrupted)
    } else {
        Ok(())
    }
}
