//! Reads a whole table.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use polars::prelude::{DataType, ParquetReader, SerReader};

use super::UNITS;
use crate::tables::collect::of_frame;
use crate::tables::table::Table;

/// Reads a table with its units.
///
/// # Errors
/// The file is not a Parquet file that can be read, or has columns of types that no table of this program has.
pub fn read(path: &Path) -> Result<Table> {
    // the library may panic on damaged bytes
    let read = catch_unwind(AssertUnwindSafe(|| read_file(path)));
    let read = read.unwrap_or_else(|_| Err(anyhow!("a damaged Parquet file")));
    read.with_context(|| format!("{}: cannot be read", path.display()))
}

fn read_file(path: &Path) -> Result<Table> {
    let file = File::open(path)?;
    let mut reader = ParquetReader::new(file.try_clone()?);
    let metadata = reader.get_metadata()?.clone();
    let pairs = metadata.key_value_metadata().iter().flatten();
    let mut units = pairs.filter(|pair| pair.key == UNITS);
    let units: BTreeMap<String, String> = match units.find_map(|pair| pair.value.as_ref()) {
        Some(text) => serde_json::from_str(text)?,
        None => BTreeMap::new(),
    };
    let mut table = Table::default();
    // column by column: a long log has no room for a copy
    for index in 0..reader.schema()?.len() {
        let mut reader = ParquetReader::new(file.try_clone()?).with_projection(Some(vec![index]));
        reader.set_metadata(metadata.clone());
        for column in reader.finish()?.columns() {
            let name = column.name().as_str();
            let values = match column.dtype() {
                DataType::Date => of_frame(&column.cast(&DataType::Int32)?),
                _ => of_frame(column),
            };
            let values = values.with_context(|| {
                let found = column.dtype();
                format!("column {name}: expected numbers, texts or lists of them, found {found}")
            })?;
            table.add_values(name, units.get(name).cloned().map(Cow::from), values);
        }
    }
    Ok(table)
}
