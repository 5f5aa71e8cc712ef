//! What programs read of an analysis: the columns of the tables, `summary.json`, the topics of `derived.mcap`.

pub(crate) mod derived;
pub(crate) mod parquet;
pub mod summary;
pub mod table;
