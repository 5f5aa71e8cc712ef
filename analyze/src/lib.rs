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
pub mod check_machine;
pub mod cli;
pub mod clock;
pub mod compare;
pub mod demo;
mod derived;
mod detect;
mod evaluation;
pub mod events;
mod evidence;
pub mod facts;
mod files;
pub mod first_machine;
pub mod imu_check;
mod input_events;
pub mod inspect;
mod linkage_force;
pub mod load;
pub mod model_comparison;
pub mod monte_carlo;
mod notes;
pub mod options;
pub mod output;
mod page;
mod parquet;
pub mod payload;
pub mod policy;
mod prevention;
mod progress;
pub mod provenance;
mod recorder_gaps;
pub mod report;
pub mod run;
pub mod screen;
pub mod sensitivity;
pub mod stabilise;
mod stdout;
pub mod summary;
mod svg;
pub mod table;
pub mod verdicts;
pub mod whatif;
