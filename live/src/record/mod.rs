//! The recorder: samples, verdicts and commands of a session into MCAP files that replay, and that
//! `tipwatch analyze --estimator causal` reproduces.
//!
//! ```text
//!     shared memory -> this thread:  -> pending -> writer -> sync
//!                      checks, encodes  64 MiB     8 ms      200 ms, at once after an alarm
//! ```
//! Nobody waits for the recorder: it is a reader with a queue of two seconds. What it misses is recorded as
//! a gap.

mod cdr;
mod encode;
mod folder;
mod pending;
mod preamble;
mod program;
mod repair;
mod retention;
mod segment;
mod session_recorder;
mod sync;
mod topics;
mod writer;

pub(crate) use cdr::Cdr;
pub(crate) use encode::verdict as verdict_message;
pub use program::record;
pub use session_recorder::RecordOptions;
pub(crate) use topics::verdict as verdict_topic;
pub use writer::RecordCounts;
