//! Finds the events of a log: light and lifting wheels, tipping edges, input gaps and faults.

mod causes;
pub(crate) mod detect;
mod episodes;
mod event;
mod evidence;
mod finding;
mod inputs;
mod normal;
mod onset;
pub(crate) mod split_rule;
mod tipping;

pub(crate) use event::TIP_OVER_RAD;
pub use event::*;
pub use finding::Finding;
