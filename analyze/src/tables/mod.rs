//! Machine-readable results: table columns, Parquet files, `summary.json`, topics of `derived.mcap`.

pub(crate) mod derived;
pub(crate) mod parquet;
pub mod summary;
pub mod table;
