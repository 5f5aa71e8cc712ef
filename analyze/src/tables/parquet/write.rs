//! Writes tables block by block.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use parquet::basic::Encoding;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use polars::prelude::{DataType, Series};
use rayon::prelude::*;

use super::encode::{Chunk, encode};
use super::schema::schema;
use super::{PROVENANCE, UNITS};
use crate::base::provenance::Provenance;
use crate::tables::table::Table;

/// Rows of a page, which is compressed as a whole.
const ROWS_OF_PAGE: usize = 1 << 13;
/// Rows of a row group, which is held in memory before it is encoded, one column after the other on each core.
pub(super) const ROWS_OF_GROUP: usize = 2 * ROWS_OF_PAGE;

/// Returns the provenance as an entry of a table's metadata.
///
/// # Errors
/// The provenance cannot be expressed in JSON.
pub(crate) fn provenance_entry(provenance: &Provenance) -> Result<(&'static str, String)> {
    Ok((PROVENANCE, serde_json::to_string(provenance)?))
}

/// Writes a whole table with its units and the provenance.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write(table: &Table, provenance: &Provenance, path: &Path) -> Result<()> {
    let mut writer = TableWriter::create(path, table, &[provenance_entry(provenance)?])?;
    writer.write(table)?;
    writer.finish()
}

/// Writes a table block by block; all cores encode its columns. The bytes of the file depend on the rows alone,
/// not on how they are divided into blocks.
pub(crate) struct TableWriter {
    path: String,
    /// Names and types of the columns.
    columns: Vec<(String, DataType)>,
    file: SerializedFileWriter<BufWriter<File>>,
    /// Values of each column that do not fill a row group yet.
    waiting: Vec<Series>,
    rows_waiting: usize,
}

impl TableWriter {
    /// Creates a file for blocks with the columns of `like`. The metadata key `tipwatch.units` maps columns to
    /// units (JSON), the given keys and values are added.
    ///
    /// # Errors
    /// The file cannot be created.
    pub(crate) fn create(path: &Path, like: &Table, more: &[(&str, String)]) -> Result<Self> {
        let file =
            File::create(path).with_context(|| format!("{}: cannot be created", path.display()))?;
        Self::begin(file, path, like, more)
    }

    /// Begins a table in an empty file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn begin(
        file: File,
        path: &Path,
        like: &Table,
        more: &[(&str, String)],
    ) -> Result<Self> {
        let file = SerializedFileWriter::new(
            BufWriter::with_capacity(1 << 20, file),
            schema(like)?,
            Arc::new(properties(like, more)?),
        )?;
        Ok(Self {
            path: path.display().to_string(),
            columns: (like.names_and_types())
                .map(|(name, of)| (name.to_owned(), of.clone()))
                .collect(),
            file,
            waiting: like
                .columns()
                .iter()
                .map(|column| column.series().clear())
                .collect(),
            rows_waiting: 0,
        })
    }

    /// Adds the rows of a block.
    ///
    /// # Errors
    /// The file cannot be written, or the block has other columns.
    pub(crate) fn write(&mut self, block: &Table) -> Result<()> {
        let columns = self.columns.iter().map(|(name, of)| (name.as_str(), of));
        if !block.names_and_types().eq(columns) {
            bail!("{}: a block of the table has other columns", self.path);
        }
        let mut at = 0;
        while at < block.rows() {
            let rows = (ROWS_OF_GROUP - self.rows_waiting).min(block.rows() - at);
            for (waiting, column) in self.waiting.iter_mut().zip(block.columns()) {
                waiting.append(&column.series().slice(at as i64, rows))?;
            }
            self.rows_waiting += rows;
            at += rows;
            if self.rows_waiting == ROWS_OF_GROUP {
                self.write_group()?;
            }
        }
        Ok(())
    }

    /// Adds an entry to the metadata of the file.
    pub(crate) fn add_metadata(&mut self, key: &str, value: String) {
        self.file
            .append_key_value_metadata(KeyValue::new(key.into(), value));
    }

    /// Writes the remaining rows and closes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(mut self) -> Result<()> {
        self.write_group()?;
        let closed = self.file.close();
        closed.with_context(|| format!("{}: cannot be written", self.path))?;
        Ok(())
    }

    /// Encodes, compresses and writes the waiting rows.
    fn write_group(&mut self) -> Result<()> {
        if self.rows_waiting == 0 {
            return Ok(());
        }
        let mut write = || {
            let (schema, properties) = (self.file.schema_descr(), self.file.properties());
            let columns = schema.columns().par_iter().zip(&self.waiting);
            let chunks: Vec<Chunk> = columns
                .map(|(column, values)| encode(Arc::clone(column), Arc::clone(properties), values))
                .collect::<Result<_, _>>()?;
            let mut group = self.file.next_row_group()?;
            for (bytes, closed) in chunks {
                group.append_column(&bytes, closed)?;
            }
            group.close()
        };
        write().with_context(|| format!("{}: cannot be written", self.path))?;
        for waiting in &mut self.waiting {
            *waiting = waiting.clear();
        }
        self.rows_waiting = 0;
        Ok(())
    }
}

/// Returns the settings of the writer: the encoding of each column by its type, and the metadata.
fn properties(like: &Table, more: &[(&str, String)]) -> Result<WriterProperties> {
    let units: BTreeMap<&str, &str> = (like.columns().iter())
        .filter_map(|column| Some((column.name(), column.unit()?)))
        .collect();
    let units = (UNITS, serde_json::to_string(&units)?);
    let metadata = std::iter::once(units).chain(more.iter().cloned());
    let metadata = metadata.map(|(key, value)| KeyValue::new(key.into(), value));
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("tipwatch ", env!("CARGO_PKG_VERSION")).into())
        .set_data_page_row_count_limit(ROWS_OF_PAGE)
        .set_data_page_size_limit(usize::MAX)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(metadata.collect()));
    for column in like.columns() {
        let encoding = match column.series().dtype() {
            // neighbours share sign, exponent and first digits: bytes of equal rank compress together
            DataType::Float32 | DataType::Float64 => Encoding::BYTE_STREAM_SPLIT,
            // times rise in nearly equal steps
            DataType::Int64 => Encoding::DELTA_BINARY_PACKED,
            _ => continue,
        };
        let path = ColumnPath::from(column.name());
        properties = properties
            .set_column_dictionary_enabled(path.clone(), false)
            .set_column_encoding(path, encoding);
    }
    Ok(properties.build())
}
