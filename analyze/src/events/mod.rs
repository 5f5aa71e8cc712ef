//! Finds the events of a log: wheels that are light or lift, edges that tip, inputs that fail.

pub(crate) mod detect;
mod episodes;
mod event;
mod evidence;
mod inputs;

pub use event::*;
