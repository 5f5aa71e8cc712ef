//! The smoother: estimates each row from past and future samples of a log.
//!
//! A forward pass over all samples finds implausible spans and keeps the state of every filter at the first row of each
//! block. From it each block of rows is smoothed independently of the others: its filters run on past its end until
//! later samples no longer matter, and the backward pass starts there. Only a few blocks are in memory at a time.

mod bias_pass;
mod block;
mod fault_search;
mod forward;
mod history_reader;
mod pass;
mod sorted_samples;
mod source;
mod whole;

pub use block::{BlockSmoother, BlockWorker, ROWS_PER_BLOCK};
pub use pass::Pass;
pub use sorted_samples::visit_by_stamp;
pub(super) use sorted_samples::{Chunk, SortedSamples};
pub use source::{SampleSource, SensorSamples};
pub use whole::{SmoothedRows, smooth};
