//! Writes and reads tables as Parquet with units and provenance in the file metadata.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use arrow_schema::{DataType, Fields, Schema};
use parquet::arrow::ArrowSchemaConverter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::arrow::arrow_writer::{ArrowColumnWriter, ArrowRowGroupWriterFactory, compute_leaves};
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;
use rayon::prelude::*;

use super::table::Table;
use crate::base::provenance::Provenance;

/// Key of the metadata that maps columns to units (JSON).
const UNITS: &str = "tipwatch.units";
/// Key of the metadata with the provenance (JSON).
const PROVENANCE: &str = "tipwatch.provenance";
/// Rows of a row group. What is encoded of one is held until it is full.
const ROWS_OF_GROUP: usize = 1 << 16;
/// Rows of a page: what is held before it is compressed.
const ROWS_OF_PAGE: usize = 1 << 13;

/// The provenance as an entry of a table's metadata.
///
/// # Errors
/// It cannot be expressed in JSON.
pub(crate) fn provenance_entry(provenance: &Provenance) -> Result<(&'static str, String)> {
    Ok((PROVENANCE, serde_json::to_string(provenance)?))
}

/// Writes a whole table with its units and the provenance.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write(table: &Table, provenance: &Provenance, path: &Path) -> Result<()> {
    write_with(table, &[provenance_entry(provenance)?], path)
}

/// Writes a whole table with its units and further metadata.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_with(table: &Table, more: &[(&str, String)], path: &Path) -> Result<()> {
    let mut writer = TableWriter::create(path, table, more)?;
    writer.write(table)?;
    writer.finish()
}

/// Writes a table block by block; all cores encode its columns.
pub(crate) struct TableWriter {
    path: String,
    fields: Fields,
    file: SerializedFileWriter<BufWriter<File>>,
    groups: ArrowRowGroupWriterFactory,
    /// The columns of the row group that is being filled; empty between row groups.
    columns: Vec<ArrowColumnWriter>,
    rows_in_group: usize,
    groups_written: usize,
}

impl TableWriter {
    /// Creates a file for blocks with the columns of `like`. The metadata key `tipwatch.units` maps columns to
    /// units (JSON), the given keys and values are added.
    ///
    /// # Errors
    /// The file cannot be created.
    pub(crate) fn create(path: &Path, like: &Table, more: &[(&str, String)]) -> Result<Self> {
        let fields = like.fields();
        let file =
            File::create(path).with_context(|| format!("{}: cannot be created", path.display()))?;
        let schema = Arc::new(Schema::new(fields.clone()));
        let root = ArrowSchemaConverter::new()
            .convert(&schema)?
            .root_schema_ptr();
        let file = SerializedFileWriter::new(
            BufWriter::with_capacity(1 << 20, file),
            root,
            Arc::new(properties(like, more)?),
        )?;
        Ok(Self {
            path: path.display().to_string(),
            groups: ArrowRowGroupWriterFactory::new(&file, schema),
            fields,
            file,
            columns: Vec::new(),
            rows_in_group: 0,
            groups_written: 0,
        })
    }

    /// Adds the rows of a block.
    ///
    /// # Errors
    /// The file cannot be written, or the block has other columns.
    pub(crate) fn write(&mut self, block: &Table) -> Result<()> {
        if block.fields() != self.fields {
            bail!("{}: a block of the table has other columns", self.path);
        }
        if block.rows() == 0 {
            return Ok(());
        }
        if self.columns.is_empty() {
            self.columns = self.groups.create_column_writers(self.groups_written)?;
        }
        (self.columns.par_iter_mut().zip(block.columns()))
            .zip(&self.fields[..])
            .try_for_each(|((writer, column), field)| {
                // no column is a structure: each has one leaf
                compute_leaves(field, column.array())?
                    .iter()
                    .try_for_each(|leaf| writer.write(leaf))
            })
            .with_context(|| format!("{}: cannot be written", self.path))?;
        self.rows_in_group += block.rows();
        if self.rows_in_group >= ROWS_OF_GROUP {
            self.end_group()?;
        }
        Ok(())
    }

    /// Adds an entry to the metadata of the file.
    pub(crate) fn add_metadata(&mut self, key: &str, value: String) {
        self.file
            .append_key_value_metadata(KeyValue::new(key.into(), value));
    }

    /// Writes what is left and closes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(mut self) -> Result<()> {
        self.end_group()?;
        let closed = self.file.close();
        closed.with_context(|| format!("{}: cannot be written", self.path))?;
        Ok(())
    }

    fn end_group(&mut self) -> Result<()> {
        if self.columns.is_empty() {
            return Ok(());
        }
        let columns = std::mem::take(&mut self.columns);
        let chunks: Result<Vec<_>, _> = columns.into_par_iter().map(|c| c.close()).collect();
        let write = || {
            let mut group = self.file.next_row_group()?;
            for chunk in chunks? {
                chunk.append_to_row_group(&mut group)?;
            }
            group.close()
        };
        write().with_context(|| format!("{}: cannot be written", self.path))?;
        self.groups_written += 1;
        self.rows_in_group = 0;
        Ok(())
    }
}

/// How the columns are encoded, each by its type, and the metadata.
fn properties(like: &Table, more: &[(&str, String)]) -> Result<WriterProperties> {
    let units: BTreeMap<&str, &str> = (like.columns().iter())
        .filter_map(|column| Some((column.name(), column.unit()?)))
        .collect();
    let units = (UNITS, serde_json::to_string(&units)?);
    let metadata = std::iter::once(units).chain(more.iter().cloned());
    let metadata = metadata.map(|(key, value)| KeyValue::new(key.into(), value));
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("tipwatch ", env!("CARGO_PKG_VERSION")).into())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_data_page_row_count_limit(ROWS_OF_PAGE)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(metadata.collect()));
    for column in like.columns() {
        let encoding = match column.array().data_type() {
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
        if batch.as_ref().map_or(0, |batch| batch.num_rows()) != rows {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::cell::Value;

    /// Rows from `first` on, of every type that our tables have.
    fn block(first: i64, rows: i64) -> Table {
        let all = || first..first + rows;
        let mut table = Table::default();
        let times = all().map(|i| 1_700_000_000_123_456_789 + i * 10_000_001);
        table.add("time_ns", Some("ns"), times);
        let numbers: Vec<f64> = all()
            .map(|i| {
                if i % 7 == 3 {
                    f64::NAN
                } else {
                    (i as f64).sin()
                }
            })
            .collect();
        table.add_known("load_fl", "N", &numbers);
        table.add("valid", None, all().map(|i| i % 5 != 0));
        table.add(
            "verdict",
            None,
            all().map(|i| if i % 9 == 0 { "danger" } else { "safe" }),
        );
        table.add(
            "subject",
            None,
            all().map(|i| (i % 4 != 0).then(|| format!("wheel {}", i % 3))),
        );
        table.add("count", Some("draws"), all().map(|i| i as u32));
        let list = |i: i64| (i % 6 != 0).then(|| vec![Some(i as f64), None]);
        table.add("bins", Some("s"), all().map(list));
        let names = all().map(|i| (i % 8 != 0).then(|| vec!["a".to_string(); (i % 3) as usize]));
        table.add("reasons", None, names);
        table
    }

    #[test]
    fn blocks_read_back_as_one_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("blocks.parquet");
        let rows = ROWS_OF_GROUP as i64 + 1234;
        let metadata = [("key", "value".to_string())];
        let mut writer = TableWriter::create(&path, &block(0, 0), &metadata).unwrap();
        let mut at = 0;
        while at < rows {
            let next = (rows - at).min(5000);
            writer.write(&block(at, next)).unwrap();
            at += next;
        }
        writer.finish().unwrap();
        let (found, expected) = (read(&path).unwrap(), block(0, rows));
        assert_eq!(found.rows(), expected.rows());
        for (found, expected) in found.columns().iter().zip(expected.columns()) {
            assert!(
                found.is_same(expected),
                "{} {}",
                found.name(),
                expected.name()
            );
            assert_eq!(found.unit(), expected.unit(), "{}", expected.name());
        }
        let values: Vec<Value> = found.column("bins").unwrap().values().take(2).collect();
        let list = Value::List(vec![Value::Number(1.0), Value::Null]);
        assert_eq!(values, [Value::Null, list]);
    }

    #[test]
    fn a_block_with_other_columns_is_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("blocks.parquet");
        let mut writer = TableWriter::create(&path, &block(0, 0), &[]).unwrap();
        let mut other = block(0, 10);
        other.add("more", None, std::iter::repeat_n(true, 10));
        let error = writer.write(&other).unwrap_err();
        assert!(error.to_string().contains("other columns"), "{error}");
    }

    #[test]
    fn a_table_without_rows_keeps_its_columns() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.parquet");
        write_with(&block(0, 0), &[], &path).unwrap();
        let found = read(&path).unwrap();
        assert_eq!(found.rows(), 0);
        assert_eq!(found.columns().len(), block(0, 0).columns().len());
    }
}
