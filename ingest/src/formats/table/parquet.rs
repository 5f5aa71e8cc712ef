//! Parquet files.

use std::{
    fs::File,
    ops::{ControlFlow, Range},
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
    sync::Arc,
};

use parquet::{
    basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical},
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::DataType,
    errors::{ParquetError, Result as ParquetResult},
    file::{
        metadata::{ParquetMetaData, ParquetMetaDataReader},
        properties::ReaderProperties,
        reader::RowGroupReader,
        serialized_reader::SerializedRowGroupReader,
    },
    schema::types::ColumnDescriptor,
};

use super::{
    columns::Columns,
    rows::{Counted, RowTopic},
};
use crate::{
    file::{
        LogFile,
        table_time::{self as time, Unit},
    },
    formats::reader::{FileReader, Request},
    message::{Error, Losses, LostPart, TopicTable},
};

/// Far above the row groups of any writer.
const MOST_GROUP_BYTES: i64 = 2 << 30;
/// The same, in rows: damaged counts can stand for any number of them.
const MOST_GROUP_ROWS: i64 = 1 << 26;
/// Rows that are read at a time: a damaged count does not reserve memory for all of them.
const ROWS_PER_READ: usize = 4096;

/// The times (ns) of the rows of a group, and the columns of numbers.
type Rows = (Vec<Option<i64>>, Vec<Vec<f64>>);

/// A Parquet file.
pub(crate) struct ParquetReader {
    path: PathBuf,
    data: PathBuf,
    metadata: ParquetMetaData,
    time: usize,
    power: u32,
    /// Indices of the columns with numbers.
    numbers: Vec<usize>,
    rows: RowTopic,
}

impl ParquetReader {
    pub(crate) fn open(
        file: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = file.path();
        let invalid = |problem: String| Error::Unsupported {
            path: path.to_path_buf(),
            format: problem,
        };
        let source = File::open(file.data()).map_err(Error::io(path))?;
        let bytes = source.metadata().map_err(Error::io(path))?.len();
        // the library may panic on damaged bytes
        let metadata = catch_unwind(AssertUnwindSafe(|| {
            ParquetMetaDataReader::new().parse_and_finish(&source)
        }));
        let metadata = match metadata {
            Ok(Ok(metadata)) => metadata,
            Ok(Err(error)) => {
                return Err(invalid(format!(
                    "a Parquet file whose end is damaged: {error}"
                )));
            }
            Err(_) => return Err(invalid("a Parquet file whose end is damaged".to_owned())),
        };
        let schema = metadata.file_metadata().schema_descr();
        let (fields, columns) = (schema.root_schema().get_fields(), schema.columns());
        // a value that is repeated is a list of old writers
        let is_single = |at: usize| {
            schema.get_column_root(at).is_primitive() && columns[at].max_rep_level() == 0
        };
        let singles = || (0..columns.len()).filter(|&at| is_single(at));
        let stated = singles().find_map(|at| Some((at, time_power(&columns[at])?)));
        let named = || {
            singles().find_map(|at| match time::unit_in_name(columns[at].name())? {
                Unit::PowerOfTen(power) if is_number(&columns[at]) => Some((at, power)),
                _ => None,
            })
        };
        let (time, power) = stated.or_else(named).ok_or_else(|| {
            let names: Vec<&str> = fields.iter().map(|field| field.name()).collect();
            invalid(format!(
                "a Parquet file without a column of time: expected one of type timestamp or of a name like time_s, \
                 time_ms or t_ns, found {}",
                names.join(", ")
            ))
        })?;
        let numbers = singles().filter(|&at| at != time && is_number(&columns[at]));
        let numbers: Vec<usize> = numbers.collect();
        let read = || {
            numbers
                .iter()
                .chain([&time])
                .map(|&at| schema.get_column_root_idx(at))
        };
        let others = (fields.iter().enumerate()).filter(|(at, _)| !read().any(|read| read == *at));
        let others: Vec<&str> = others.map(|(_, field)| field.name()).collect();
        if !others.is_empty() {
            losses.note(format!(
                "{}: columns that are not numbers are not read: {}",
                path.display(),
                others.join(", ")
            ));
        }
        let columns = Columns::new(
            numbers
                .iter()
                .map(|&at| columns[at].name().to_owned())
                .collect(),
        );
        let mut reader = Self {
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            metadata,
            time,
            power,
            numbers,
            rows: RowTopic::register(&columns, bytes, topics),
        };
        let mut counted = Counted::default();
        let _ = reader.each_row(losses, &mut |time_ns, _| {
            counted.count(time_ns);
            ControlFlow::Continue(())
        })?;
        reader.rows.counted = counted;
        topics.add_messages(reader.rows.topic, Some(reader.rows.counted.rows));
        Ok(reader)
    }

    /// Calls `take` with the time and the numbers of every row. Row groups that cannot be read are lost.
    fn each_row(
        &self,
        losses: &mut Losses,
        take: &mut dyn FnMut(i64, &[f64]) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, Error> {
        let mut without_time = 0_u64;
        let mut values = Vec::new();
        for group in 0..self.metadata.num_row_groups() {
            let (times, columns) = match self.group(group)? {
                Ok(rows) => rows,
                Err(problem) => {
                    let reason = format!("row group {group}: {problem}");
                    losses.lose(LostPart::Chunk, &self.path, self.bytes_of(group), reason);
                    continue;
                }
            };
            for (row, time_ns) in times.into_iter().enumerate() {
                let Some(time_ns) = time_ns else {
                    without_time += 1;
                    continue;
                };
                values.clear();
                values.extend(columns.iter().map(|column| column[row]));
                if take(time_ns, &values).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        if without_time > 0 {
            losses.note(format!(
                "{}: {without_time} rows have no time and are not read",
                self.path.display()
            ));
        }
        Ok(ControlFlow::Continue(()))
    }

    /// The rows of a group, or what is wrong with it.
    fn group(&self, group: usize) -> Result<Result<Rows, String>, Error> {
        let source = File::open(&self.data).map_err(Error::io(&self.path))?;
        let pages = self.metadata.page_index_for_row_group(group);
        let group = self.metadata.row_group(group);
        let (size, count) = (group.total_byte_size(), group.num_rows());
        if !(0..=MOST_GROUP_BYTES).contains(&size) || !(0..=MOST_GROUP_ROWS).contains(&count) {
            return Ok(Err(format!("{size} bytes, {count} rows")));
        }
        let properties = Arc::new(ReaderProperties::builder().build());
        // the library may panic on damaged bytes
        let read = catch_unwind(AssertUnwindSafe(|| -> ParquetResult<Rows> {
            let rows = count as usize;
            let source = Arc::new(source);
            let reader = SerializedRowGroupReader::new(source, group, pages, properties)?;
            let column = |at: usize| {
                (
                    reader.get_column_reader(at),
                    group.column(at).column_descr(),
                )
            };
            let (times, described) = column(self.time);
            let times = times_ns(times?, described, self.power, rows)?;
            let columns = self.numbers.iter().map(|&at| {
                let (numbers_of, described) = column(at);
                numbers(numbers_of?, described, rows)
            });
            Ok((times, columns.collect::<ParquetResult<_>>()?))
        }));
        let read = read.map(|rows| rows.map_err(|error| error.to_string()));
        Ok(read.unwrap_or_else(|_| Err("cannot be decoded".to_owned())))
    }

    fn bytes_of(&self, group: usize) -> Range<u64> {
        let of_file = |number: i64| u64::try_from(number).unwrap_or(0).min(self.rows.bytes);
        let group = self.metadata.row_group(group);
        let columns = group.columns().iter();
        let ranges = columns.map(|column| {
            let start = column
                .dictionary_page_offset()
                .unwrap_or(column.data_page_offset());
            of_file(start)..of_file(start.saturating_add(column.compressed_size()))
        });
        let all = ranges.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        all.unwrap_or(0..0)
    }
}

/// The power of ten of nanoseconds in the unit of a timestamp.
fn time_power(column: &ColumnDescriptor) -> Option<u32> {
    let unit = match column.logical_type_ref() {
        Some(LogicalType::Timestamp(timestamp)) => Some(&timestamp.unit),
        _ => None,
    };
    match (unit, column.converted_type(), column.physical_type()) {
        (Some(TimeUnit::MILLIS), ..) | (None, ConvertedType::TIMESTAMP_MILLIS, _) => Some(6),
        (Some(TimeUnit::MICROS), ..) | (None, ConvertedType::TIMESTAMP_MICROS, _) => Some(3),
        // the type of timestamps in nanoseconds before there was a name for it
        (Some(TimeUnit::NANOS), ..) | (None, _, Physical::INT96) => Some(0),
        _ => None,
    }
}

fn is_number(column: &ColumnDescriptor) -> bool {
    let is_whole = || match column.logical_type_ref() {
        Some(logical) => matches!(logical, LogicalType::Integer(_)),
        None => is_unsigned(column) || is_signed(column),
    };
    match column.physical_type() {
        Physical::BOOLEAN | Physical::FLOAT | Physical::DOUBLE => true,
        Physical::INT32 | Physical::INT64 => is_whole(),
        _ => false,
    }
}

fn is_signed(column: &ColumnDescriptor) -> bool {
    use ConvertedType::{INT_8, INT_16, INT_32, INT_64, NONE};
    matches!(
        column.converted_type(),
        NONE | INT_8 | INT_16 | INT_32 | INT_64
    )
}

fn is_unsigned(column: &ColumnDescriptor) -> bool {
    use ConvertedType::{UINT_8, UINT_16, UINT_32, UINT_64};
    match column.logical_type_ref() {
        Some(LogicalType::Integer(integer)) => !integer.is_signed,
        _ => matches!(
            column.converted_type(),
            UINT_8 | UINT_16 | UINT_32 | UINT_64
        ),
    }
}

/// The times of a row group, in the unit of 10 to this power of nanoseconds.
fn times_ns(
    reader: ColumnReader,
    column: &ColumnDescriptor,
    power: u32,
    rows: usize,
) -> ParquetResult<Vec<Option<i64>>> {
    let scale = 10_i64.pow(power);
    match reader {
        ColumnReader::Int64ColumnReader(reader) if !is_unsigned(column) => {
            each(reader, column, rows, None, |time| time.checked_mul(scale))
        }
        ColumnReader::Int96ColumnReader(reader) => {
            each(reader, column, rows, None, |time| Some(time.to_nanos()))
        }
        other => {
            let times = numbers(other, column, rows)?.into_iter();
            Ok(times.map(|time| time::from_float(time, power)).collect())
        }
    }
}

/// The numbers of a row group, NaN for what is missing.
fn numbers(
    reader: ColumnReader,
    column: &ColumnDescriptor,
    rows: usize,
) -> ParquetResult<Vec<f64>> {
    let unsigned = is_unsigned(column);
    match reader {
        ColumnReader::BoolColumnReader(reader) => {
            each(reader, column, rows, f64::NAN, |&value| value.into())
        }
        ColumnReader::FloatColumnReader(reader) => {
            each(reader, column, rows, f64::NAN, |&value| value.into())
        }
        ColumnReader::DoubleColumnReader(reader) => {
            each(reader, column, rows, f64::NAN, |&value| value)
        }
        ColumnReader::Int32ColumnReader(reader) => each(reader, column, rows, f64::NAN, |&value| {
            if unsigned {
                value.cast_unsigned().into()
            } else {
                value.into()
            }
        }),
        ColumnReader::Int64ColumnReader(reader) => each(reader, column, rows, f64::NAN, |&value| {
            if unsigned {
                value.cast_unsigned() as f64
            } else {
                value as f64
            }
        }),
        _ => Err(ParquetError::General("expected numbers".to_owned())),
    }
}

/// Every row of a column, `missing` where it has no value.
fn each<C: DataType, V: Copy>(
    mut reader: ColumnReaderImpl<C>,
    column: &ColumnDescriptor,
    rows: usize,
    missing: V,
    value: impl Fn(&C::T) -> V,
) -> ParquetResult<Vec<V>> {
    let (mut found, mut levels, mut known) = (Vec::new(), Vec::new(), Vec::new());
    while found.len() < rows {
        levels.clear();
        known.clear();
        let most = ROWS_PER_READ.min(rows - found.len());
        let (count, ..) = reader.read_records(most, Some(&mut levels), None, &mut known)?;
        if count == 0 {
            let problem = format!("expected {rows} rows, found {}", found.len());
            return Err(ParquetError::General(problem));
        }
        if column.max_def_level() == 0 {
            found.extend(known.iter().map(&value));
            continue;
        }
        let mut known = known.iter().map(&value);
        let row = |&level: &i16| match level == column.max_def_level() {
            true => known.next().unwrap_or(missing),
            false => missing,
        };
        found.extend(levels.iter().map(row));
    }
    Ok(found)
}

impl FileReader for ParquetReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        if !request.wants(self.rows.topic) {
            return Ok(ControlFlow::Continue(()));
        }
        let mut message = Vec::new();
        let mut count = 0;
        let mut losses = Losses::default();
        let flow = self.each_row(&mut losses, &mut |time_ns, values| {
            let flow = self
                .rows
                .visit(count, time_ns, values, &mut message, request);
            count += 1;
            flow
        })?;
        request.losses.merge(&losses);
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.rows.counted.span_ns
    }
}
