//! Reads a whole table.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result, anyhow};
use arrow_array::RecordBatch;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::UNITS;
use crate::tables::table::Table;

/// Reads a table with its units.
///
/// # Errors
/// The file is not a Parquet file that can be read.
pub fn read(path: &Path) -> Result<Table> {
    let read = || {
        let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path)?)?;
        let file = reader.metadata().file_metadata();
        let rows = usize::try_from(file.num_rows())?;
        let units = file.key_value_metadata().into_iter().flatten();
        let units = units.filter(|pair| pair.key == UNITS);
        let units: BTreeMap<String, String> = match units.filter_map(|p| p.value.as_ref()).next() {
            Some(text) => serde_json::from_str(text)?,
            None => BTreeMap::new(),
        };
        let fields = reader.schema().fields().clone();
        let mut batches = reader.with_batch_size(rows.max(1)).build()?;
        let batch = batches.next().transpose()?;
        if batch.as_ref().map_or(0, RecordBatch::num_rows) != rows {
            return Err(anyhow!("expected {rows} rows in one piece"));
        }
        let mut table = Table::default();
        for (index, field) in fields.iter().enumerate() {
            let values = match &batch {
                Some(batch) => batch.column(index).clone(),
                None => arrow_array::new_empty_array(field.data_type()),
            };
            let unit = units.get(field.name()).cloned().map(Cow::from);
            table.add_array(field.name().clone(), unit, values);
        }
        Ok(table)
    };
    read().with_context(|| format!("{}: cannot be read", path.display()))
}
