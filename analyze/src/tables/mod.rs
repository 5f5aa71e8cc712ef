//! Machine-readable results: table columns, Parquet files, `summary.json`, topics of `derived.mcap`.

pub(crate) mod derived;
pub mod events;
pub mod parquet;
pub mod samples;
pub mod states;
pub mod studies;
pub mod summary;
pub mod table;
