//! Analyses the logs of a fleet in parallel, and builds a data set and a page from them.
//!
//! ```text
//!     inputs -> workers: one_log -> store (state/) -> merge -> data_set (logs/, events/), page (fleet.html)
//! ```
//! `store` is the single source: one record per finished log, written atomically. Everything else is
//! built from all records at the end. A run may therefore be killed at any time, resumed, or split over
//! many processes, without losing a log or counting it twice.

mod data_set;
mod fleet_file;
mod identity;
mod inputs;
mod merge;
mod one_log;
mod page;
mod policy_result;
mod record;
mod request;
mod run;
mod store;
mod totals;
mod version;
mod workers;

pub use fleet_file::Fleet;
pub use request::{Gate, Request, Screen, Shard, Update};
pub use run::{gather, screen};
pub use totals::Totals;
