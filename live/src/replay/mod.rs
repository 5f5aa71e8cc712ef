//! Replay: the samples of a log into shared memory, as a machine would publish them.

mod log;
mod send;

pub use log::{LogSamples, session_of};
pub use send::{ReplayCounts, ReplayOptions, Speed, replay};
