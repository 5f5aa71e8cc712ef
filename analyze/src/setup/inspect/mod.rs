//! `inspect`: contents of a log before any analysis: topics, clocks, gaps, damage, and the topic of each
//! signal with the reason.

mod can;
mod contents;
mod document;
mod print;

pub use can::{Described, read_databases};
pub(crate) use can::{KnownSignal, MOST_IDS, Reading, descriptions_of};
pub use contents::inspect;
pub use document::Inspection;
pub use print::print;
