//! Writes tables as Parquet with units and provenance in the file metadata.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use polars::prelude::{KeyValueMetadata, ParquetCompression, ParquetWriter};

use crate::base::provenance::Provenance;
use crate::tables::table::Table;

/// Writes a table; the metadata key `tipwatch.units` maps columns to units (JSON), `tipwatch.provenance`
/// holds the provenance.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write(table: &mut Table, provenance: &Provenance, path: &Path) -> Result<()> {
    let provenance = serde_json::to_string(provenance)?;
    write_with(table, &[("tipwatch.provenance", provenance)], path)
}

/// Writes a table; the metadata key `tipwatch.units` maps columns to units (JSON), the given keys and
/// values are added.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_with(table: &mut Table, more: &[(&str, String)], path: &Path) -> Result<()> {
    let units: serde_json::Map<String, serde_json::Value> = table
        .units
        .iter()
        .map(|(name, unit)| (name.clone(), (*unit).into()))
        .collect();
    let units = ("tipwatch.units".to_string(), serde_json::to_string(&units)?);
    let more = more
        .iter()
        .map(|(key, value)| (key.to_string(), value.clone()));
    let metadata = KeyValueMetadata::from_static(std::iter::once(units).chain(more).collect());
    let file =
        File::create(path).with_context(|| format!("{}: cannot be created", path.display()))?;
    ParquetWriter::new(BufWriter::with_capacity(1 << 20, file))
        .with_compression(ParquetCompression::Lz4Raw)
        .with_key_value_metadata(Some(metadata))
        .finish(&mut table.frame)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    Ok(())
}
