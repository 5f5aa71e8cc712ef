//! Foundations of every other folder: options, rows and their table, provenance, files, errors, numbers, terminal output.

pub(crate) mod built;
pub mod clip;
pub mod error_text;
pub mod estimated;
pub(crate) mod fetched;
pub mod file_hash;
pub(crate) mod files;
pub mod frame;
mod in_order;
pub(crate) mod lock;
pub(crate) mod memory;
pub mod number;
pub mod options;
pub mod output_place;
pub mod predicted;
pub(crate) mod progress;
pub mod provenance;
pub mod recovered;
#[cfg(test)]
pub(crate) mod rigid;
pub mod rows;
pub mod scratch_file;
pub mod shared;
pub(crate) mod state_source;
pub(crate) mod stderr;
pub(crate) mod stdout;
pub mod storage_error;
pub(crate) mod support_sets;
pub mod table;
pub(crate) mod transfer_text;
pub mod verdicts;
pub(crate) mod widening;
