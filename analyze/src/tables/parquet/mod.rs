//! Tables as Parquet files, with units and provenance in the metadata of the file.

mod compress;
mod encode;
mod read;
mod schema;
mod write;

pub use read::read;
pub(crate) use write::{TableWriter, provenance_entry, write};

#[cfg(test)]
mod tests;

/// Key of the metadata that maps columns to units (JSON).
const UNITS: &str = "tipwatch.units";
/// Key of the metadata with the provenance (JSON).
const PROVENANCE: &str = "tipwatch.provenance";
