//! What every other folder uses: options, rows and their table, provenance, files, errors, numbers, terminal output.

pub(crate) mod changed_states;
pub mod clip;
pub(crate) mod error_text;
pub mod estimated;
pub(crate) mod fetched;
pub mod file_hash;
pub(crate) mod files;
mod in_order;
pub(crate) mod lock;
pub(crate) mod memory;
pub(crate) mod number;
pub mod options;
pub mod output_place;
pub mod predicted;
pub(crate) mod progress;
pub mod provenance;
pub mod recovered;
pub mod rows;
pub(crate) mod scratch_file;
pub(crate) mod state_source;
pub(crate) mod stdout;
pub mod storage_error;
pub(crate) mod support_sets;
pub mod table;
pub(crate) mod transfer_text;
pub mod verdicts;
pub(crate) mod widening;
