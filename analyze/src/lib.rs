//! Analysis of whole logs: from a log and a machine file to tables, a summary and a report.
//!
//! [`run::analyse`] gives an [`Analysis`](analysis::Analysis); [`output::write`] writes its files.

pub mod analysis;
pub mod cli;
pub mod demo;
mod detect;
pub mod events;
pub mod inspect;
pub mod load;
mod notes;
pub mod options;
pub mod output;
mod parquet;
mod progress;
pub mod provenance;
pub mod report;
pub mod run;
pub mod summary;
pub mod table;
