//! Analysis of whole logs: from a log and a machine file to tables, a summary and a report.
//!
//! [`load`] reads machine and samples, [`run::analyse`] makes an [`Analysis`](analysis::Analysis) of
//! them, [`output::write`] writes its files: [`table`] lists the columns, [`summary`] the keys of
//! `summary.json`, [`report`] makes the page. [`inspect`] looks at a log without a machine.
//!
//! [`facts`] are what an analysis comes to in few numbers: a [`policy`] judges them, a [`screen`] collects
//! those of many logs, [`compare`] puts two analyses side by side.

#![forbid(unsafe_code)]

pub mod analysis;
pub mod base;
pub mod cli;
pub mod compare;
pub mod events;
pub mod load;
pub mod output;
mod page;
pub mod policy;
pub mod report;
pub mod screen;
pub mod setup;
pub mod suspension;
pub mod tables;
