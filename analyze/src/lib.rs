//! Analysis of whole logs: a log and a machine file in; tables, a summary and a report out.
//!
//! [`load`] reads machine and samples. [`analysis::run::analyse`] computes an
//! [`Analysis`](analysis::Analysis). [`output::write`] writes its files: [`tables`] for programs, the
//! [`report`] for people. [`setup`] helps to describe a machine before its first analysis.
//!
//! A [`policy`] judges the key figures of an analysis, a [`screen`] collects those of many logs,
//! [`compare`] compares two analyses. [`suspension`] replays a log with an active suspension.

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
