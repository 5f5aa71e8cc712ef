//! Analyses the logs of a fleet in parallel, and builds a data set and a page from them.
//!
//! ```text
//!     inputs -> workers: one_log -> store (state/) -> merge -> data_set (logs/, events/, comparisons/), page (fleet.html)
//!     -------- run, task --------                     --------------- gather ---------------
//!                                                            `query` asks it in SQL
//! ```
//! `store` is the single source: one record per finished log, written once. Everything else is built from
//! all records at the end. A run may therefore be killed at any time, resumed, or split over many
//! processes and machines, without losing a log or counting it twice. Which engine starts the processes
//! does not matter: `task` is one log, `run` with a shard is a part of the logs.

mod attempts;
mod data_set;
mod failure;
mod fleet_file;
mod gather;
mod inputs;
mod merge;
mod one_log;
mod outliers;
mod page;
mod place;
mod policy_result;
mod record;
mod request;
mod run;
mod shard;
mod store;
mod task;
mod totals;
mod version;
mod workers;

pub use data_set::{Answer, NotAnswered, TABLES, query};
pub use failure::FailureKind;
pub use fleet_file::Fleet;
pub use gather::{PAGE, gather, totals_of};
pub use inputs::RequestedLogs;
pub use request::{
    DEFAULT_ATTEMPTS, Gate, Gathering, MOST_JOBS, Output, Reports, Request, Screen, Update,
};
pub use run::screen;
pub use shard::Shard;
pub use task::{Task, TaskResult};
pub use totals::Totals;
