//! Finds the events of a log: light and lifting wheels, tipping edges, input gaps and faults.

pub(crate) mod detect;
mod episodes;
mod event;
mod evidence;
mod finding;
mod inputs;

pub use event::*;
pub use finding::Finding;
