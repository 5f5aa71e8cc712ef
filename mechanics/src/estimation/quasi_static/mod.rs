//! Sparse logs: what is held between samples, and how far the machine can have moved where nothing saw it.
//!
//! Rows of a log with a sample a second or less have neither velocities nor accelerations of their own. In such a
//! log a row without neighbours is static: it holds the last known sample, at rest. [`UnobservedMotion`] gives the
//! range of every signal that the stated greatest rates and accelerations allow at that row and until the next one.

mod motion;
mod range;
mod reach;
mod sparse;
mod usable;

pub use motion::{SampleMemory, UnobservedMotion};
pub use range::{Exceeded, MotionRange, Span};
pub use sparse::{Sparseness, sparseness};
