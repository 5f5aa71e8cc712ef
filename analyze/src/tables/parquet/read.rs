//! Reads a whole table.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use polars::prelude::{ParquetReader, SerReader};

use super::UNITS;
use crate::tables::table::Table;

/// Reads a table with its units.
///
/// # Errors
/// The file is not a Parquet file that can be read.
pub fn read(path: &Path) -> Result<Table> {
    // the library may panic on damaged bytes
    let read = catch_unwind(AssertUnwindSafe(|| read_file(path)));
    let read = read.unwrap_or_else(|_| Err(anyhow!("a damaged Parquet file")));
    read.with_context(|| format!("{}: cannot be read", path.display()))
}

fn read_file(path: &Path) -> Result<Table> {
    let mut reader = ParquetReader::new(File::open(path)?);
    let metadata = reader.get_metadata()?.clone();
    let pairs = metadata.key_value_metadata().iter().flatten();
    let mut units = pairs.filter(|pair| pair.key == UNITS);
    let units: BTreeMap<String, String> = match units.find_map(|pair| pair.value.as_ref()) {
        Some(text) => serde_json::from_str(text)?,
        None => BTreeMap::new(),
    };
    let mut table = Table::default();
    for column in reader.finish()?.into_columns() {
        let unit = units.get(column.name().as_str()).cloned();
        table.add_series(unit.map(Cow::from), column.take_materialized_series());
    }
    Ok(table)
}
