//! The recorder: samples, verdicts and commands of a session into MCAP files that replay, and that
//! `tipwatch analyze --estimator causal` reproduces.
//!
//! ```text
//!     shared memory -> this thread:  -> pending -> writer -> sync
//!                      checks, encodes  64 MiB     8 ms      200 ms, at once after an alarm
//! ```
//! Nobody waits for the recorder: it is a reader with a queue of two seconds. What it misses is recorded as
//! a gap. The black box is the same with a ring in memory between `pending` and the writer.

mod cdr;
mod clip_file;
mod clip_list;
#[cfg(test)]
mod clip_tests;
mod clip_writer;
mod encode;
mod folder;
mod latched_program;
mod pending;
mod preamble;
mod program;
mod repair;
mod retention;
mod ring;
mod segment;
mod session_recorder;
mod sync;
mod topics;
mod tries;
mod trigger;
mod writer;

pub(crate) use cdr::Cdr;
pub use clip_writer::ClipOptions;
pub(crate) use encode::verdict as verdict_message;
pub use program::record;
pub use session_recorder::RecordOptions;
pub(crate) use topics::verdict as verdict_topic;
pub use trigger::Trigger;
pub use writer::RecordCounts;
