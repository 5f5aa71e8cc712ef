//! Attempts to write on a disk that may fail.

use std::time::{Duration, Instant};

/// Time before writing is retried after a failure.
const RETRY_PERIOD: Duration = Duration::from_secs(1);

/// The last failure to write, as long as it lasts.
#[derive(Debug, Default)]
pub(super) struct Tries(Option<Instant>);

impl Tries {
    /// Returns the number of attempts to make now. The last write gets two, because no later attempt follows in a new file, and
    /// the file that fails may be at its limit.
    pub(super) fn now(&self, is_last: bool) -> u8 {
        match self.0 {
            _ if is_last => 2,
            Some(at) if at.elapsed() < RETRY_PERIOD => 0,
            _ => 1,
        }
    }

    /// Writing has failed; told once.
    pub(super) fn fail(&mut self, error: &anyhow::Error) {
        if self.0.replace(Instant::now()).is_none() {
            eprintln!("record: {error:#}; retrying in a new file");
        }
    }

    /// Something was written.
    pub(super) fn succeed(&mut self) {
        if self.0.take().is_some() {
            eprintln!("record: writing has resumed");
        }
    }
}
