//! SIGINT and SIGTERM: a program that is asked to stop shuts down in order.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);
static LISTENING: Once = Once::new();

/// The process was asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted;

extern "C" fn note(_signal: libc::c_int) {
    ASKED.store(true, Ordering::Relaxed);
}

/// Starts to catch the signals.
#[allow(
    unsafe_code,
    reason = "signals have no safe interface in the standard library"
)]
pub fn listen() {
    LISTENING.call_once(|| {
        for signal in [libc::SIGINT, libc::SIGTERM] {
            // SAFETY: an action of zeros is valid, and the handler does nothing but store to an atomic.
            unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                action.sa_sigaction = note as extern "C" fn(libc::c_int) as libc::sighandler_t;
                libc::sigaction(signal, &raw const action, std::ptr::null_mut());
            }
        }
    });
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
