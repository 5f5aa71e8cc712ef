//! Reads a whole table.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::str;

use anyhow::{Context, Result, anyhow, bail};
use parquet::basic::{LogicalType, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::{ColumnDescriptor, Type};

use super::UNITS;
use super::schema::{ELEMENT, EMPTY_LIST, VALUE};
use crate::tables::series::{Known, Lists, Series, Texts};
use crate::tables::table::Table;
use crate::tables::values::Values;

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
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let file = reader.metadata().file_metadata();
    let units = file.key_value_metadata().into_iter().flatten();
    let units = units.filter(|pair| pair.key == UNITS);
    let units: BTreeMap<String, String> = match units.filter_map(|p| p.value.as_ref()).next() {
        Some(text) => serde_json::from_str(text)?,
        None => BTreeMap::new(),
    };
    let columns = file.schema_descr().columns();
    let fields = file.schema_descr().root_schema().get_fields();
    if columns.len() != fields.len() {
        bail!("expected columns of values or of lists, found structures");
    }
    let mut table = Table::default();
    for (index, (field, column)) in fields.iter().zip(columns).enumerate() {
        let read = || {
            let mut values = empty(field, column)?;
            for group in 0..reader.num_row_groups() {
                let group = reader.get_row_group(group)?;
                let rows = usize::try_from(group.metadata().num_rows())?;
                add_chunk(group.get_column_reader(index)?, rows, &mut values)?;
            }
            anyhow::Ok(values)
        };
        let values = read().with_context(|| format!("column {}", field.name()))?;
        let unit = units.get(field.name()).cloned().map(Cow::from);
        table.add_values(field.name(), unit, values);
    }
    Ok(table)
}

/// No values yet, of the type of a column.
fn empty(field: &Type, column: &ColumnDescriptor) -> Result<Values> {
    let logical = column.logical_type_ref();
    let is_signed = !matches!(logical, Some(LogicalType::Integer(integer)) if !integer.is_signed);
    let is_single = field.is_primitive() && column.max_rep_level() == 0;
    let is_list = !field.is_primitive() && column.max_rep_level() == 1;
    let is_list = is_list && column.max_def_level() == ELEMENT;
    Ok(match (column.physical_type(), is_single) {
        (Physical::BOOLEAN, true) => Known::<Vec<bool>>::default().into(),
        (Physical::FLOAT, true) => Known::<Vec<f32>>::default().into(),
        (Physical::DOUBLE, true) => Known::<Vec<f64>>::default().into(),
        (Physical::INT32, true) if is_signed => Known::<Vec<i32>>::default().into(),
        (Physical::INT32, true) => Known::<Vec<u32>>::default().into(),
        (Physical::INT64, true) if is_signed => Known::<Vec<i64>>::default().into(),
        (Physical::INT64, true) => Known::<Vec<u64>>::default().into(),
        (Physical::BYTE_ARRAY, true) => Known::<Texts>::default().into(),
        (Physical::DOUBLE, false) if is_list => Lists::<Vec<f64>>::default().into(),
        (Physical::BYTE_ARRAY, false) if is_list => Lists::<Texts>::default().into(),
        (other, _) => {
            bail!("expected numbers, texts or lists of them, found {other} in another form")
        }
    })
}

/// Adds the rows of a row group.
fn add_chunk(reader: ColumnReader, rows: usize, values: &mut Values) -> Result<()> {
    use ColumnReader::{
        BoolColumnReader, ByteArrayColumnReader, DoubleColumnReader, FloatColumnReader,
        Int32ColumnReader, Int64ColumnReader,
    };
    match (values, reader) {
        (Values::Boolean(to), BoolColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |&value| Ok(value))
        }
        (Values::Single(to), FloatColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |&value| Ok(value))
        }
        (Values::Double(to), DoubleColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |&value| Ok(value))
        }
        (Values::Int32(to), Int32ColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |&value| Ok(value))
        }
        (Values::Int64(to), Int64ColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |&value| Ok(value))
        }
        (Values::UInt32(to), Int32ColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |value| Ok(value.cast_unsigned()))
        }
        (Values::UInt64(to), Int64ColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, |value| Ok(value.cast_unsigned()))
        }
        (Values::Text(to), ByteArrayColumnReader(from)) => {
            Records::of(from, rows)?.add_to(to, text)
        }
        (Values::Numbers(to), DoubleColumnReader(from)) => {
            Records::of(from, rows)?.add_to_lists(to, |&value| Ok(value))
        }
        (Values::Texts(to), ByteArrayColumnReader(from)) => {
            Records::of(from, rows)?.add_to_lists(to, text)
        }
        (values, _) => bail!("expected {} in all row groups", values.type_name()),
    }
}

fn text(bytes: &ByteArray) -> Result<&str> {
    Ok(str::from_utf8(bytes.data())?)
}

/// The rows of a column in a row group, as the format has them: known values, and levels.
struct Records<T> {
    rows: usize,
    known: Vec<T>,
    /// Empty where no value may be missing.
    definition: Vec<i16>,
    /// Empty for a column without lists.
    repetition: Vec<i16>,
}

impl<T> Records<T> {
    fn of<C: DataType<T = T>>(mut column: ColumnReaderImpl<C>, rows: usize) -> Result<Self> {
        let (mut known, mut definition, mut repetition) = (Vec::new(), Vec::new(), Vec::new());
        let levels = (Some(&mut definition), Some(&mut repetition));
        let (found, _, _) = column.read_records(rows, levels.0, levels.1, &mut known)?;
        if found != rows {
            bail!("expected {rows} rows, found {found}");
        }
        Ok(Self {
            rows,
            known,
            definition,
            repetition,
        })
    }

    /// Adds one value a row.
    fn add_to<S: Series>(
        &self,
        values: &mut Known<S>,
        item: impl for<'a> Fn(&'a T) -> Result<S::Item<'a>>,
    ) -> Result<()> {
        let mut known = self.known.iter();
        for row in 0..self.rows {
            let is_known = self.definition.get(row).is_none_or(|&level| level == VALUE);
            let value = is_known.then(|| known.next()).flatten();
            values.push(value.map(&item).transpose()?);
        }
        Ok(())
    }

    /// Adds one list a row.
    fn add_to_lists<S: Series>(
        &self,
        lists: &mut Lists<S>,
        item: impl for<'a> Fn(&'a T) -> Result<S::Item<'a>>,
    ) -> Result<()> {
        let mut known = self.known.iter();
        let mut levels = self.definition.iter().zip(&self.repetition).peekable();
        while let Some((&definition, _)) = levels.next() {
            if definition == 0 {
                lists.push_missing();
                continue;
            }
            let mut elements = Vec::new();
            if definition > EMPTY_LIST {
                elements.push(definition);
            }
            while let Some((&definition, _)) = levels.next_if(|&(_, &repetition)| repetition > 0) {
                elements.push(definition);
            }
            let elements = elements.into_iter().map(|definition| {
                let element = (definition == ELEMENT).then(|| known.next()).flatten();
                element.map(&item).transpose()
            });
            let elements: Vec<Option<S::Item<'_>>> = elements.collect::<Result<_>>()?;
            lists.push(|list| elements.into_iter().for_each(|element| list.push(element)));
        }
        Ok(())
    }
}
