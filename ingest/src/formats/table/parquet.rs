//! Parquet files.

use std::{
    fs::File,
    ops::{ControlFlow, Range},
    panic::{AssertUnwindSafe, catch_unwind},
    path::PathBuf,
};

use arrow_array::{
    Array, ArrowPrimitiveType, BooleanArray, RecordBatch,
    cast::AsArray,
    types::{
        Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type,
        TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType,
        TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
    },
};
use arrow_schema::{DataType, TimeUnit};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ParquetRecordBatchReaderBuilder};

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

const ROWS_PER_BATCH: usize = 4096;
/// Far above the row groups of any writer.
const MOST_GROUP_BYTES: i64 = 2 << 30;

/// A Parquet file.
pub(crate) struct ParquetReader {
    path: PathBuf,
    data: PathBuf,
    metadata: ArrowReaderMetadata,
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
            ArrowReaderMetadata::load(&source, Default::default())
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
        let fields = metadata.schema().fields().clone();
        let stated = fields
            .iter()
            .position(|field| time_power(field.data_type()).is_some());
        let named = || {
            fields.iter().enumerate().find_map(|(at, field)| {
                match time::unit_in_name(field.name())? {
                    Unit::PowerOfTen(power) if is_number(field.data_type()) => Some((at, power)),
                    _ => None,
                }
            })
        };
        let stated = stated.and_then(|at| Some((at, time_power(fields[at].data_type())?)));
        let (time, power) = stated.or_else(named).ok_or_else(|| {
            let names: Vec<&str> = fields.iter().map(|field| field.name().as_str()).collect();
            invalid(format!(
                "a Parquet file without a column of time: expected one of type timestamp or of a name like time_s, \
                 time_ms or t_ns, found {}",
                names.join(", ")
            ))
        })?;
        let is_value = |at: &usize| *at != time && is_number(fields[*at].data_type());
        let numbers: Vec<usize> = (0..fields.len()).filter(is_value).collect();
        let others = fields
            .iter()
            .enumerate()
            .filter(|(at, _)| *at != time && !numbers.contains(at));
        let others: Vec<&str> = others.map(|(_, field)| field.name().as_str()).collect();
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
                .map(|&at| fields[at].name().clone())
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
        for group in 0..self.metadata.metadata().num_row_groups() {
            let batches = match self.group(group)? {
                Ok(batches) => batches,
                Err(problem) => {
                    let reason = format!("row group {group}: {problem}");
                    losses.lose(LostPart::Chunk, &self.path, self.bytes_of(group), reason);
                    continue;
                }
            };
            for batch in &batches {
                let columns: Vec<Vec<f64>> = self
                    .numbers
                    .iter()
                    .map(|&at| numbers(batch.column(at)))
                    .collect();
                let times = times_ns(batch.column(self.time), self.power);
                for (row, time_ns) in times.into_iter().enumerate() {
                    let Some(time_ns) = time_ns else {
                        without_time += 1;
                        continue;
                    };
                    values.clear();
                    values.extend(
                        columns
                            .iter()
                            .map(|column| column.get(row).copied().unwrap_or(f64::NAN)),
                    );
                    if take(time_ns, &values).is_break() {
                        return Ok(ControlFlow::Break(()));
                    }
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
    fn group(&self, group: usize) -> Result<Result<Vec<RecordBatch>, String>, Error> {
        let source = File::open(&self.data).map_err(Error::io(&self.path))?;
        let size = self.metadata.metadata().row_group(group).total_byte_size();
        if !(0..=MOST_GROUP_BYTES).contains(&size) {
            return Ok(Err(format!("{size} bytes")));
        }
        let metadata = self.metadata.clone();
        // the library may panic on damaged bytes
        let read = catch_unwind(AssertUnwindSafe(|| {
            let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(source, metadata);
            let builder = builder
                .with_row_groups(vec![group])
                .with_batch_size(ROWS_PER_BATCH);
            let batches = builder.build().map_err(|error| error.to_string())?;
            batches
                .collect::<Result<Vec<_>, _>>()
                .map_err(|error| error.to_string())
        }));
        Ok(read.unwrap_or_else(|_| Err("cannot be decoded".to_owned())))
    }

    fn bytes_of(&self, group: usize) -> Range<u64> {
        let of_file = |number: i64| u64::try_from(number).unwrap_or(0).min(self.rows.bytes);
        let group = self.metadata.metadata().row_group(group);
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
fn time_power(data_type: &DataType) -> Option<u32> {
    match data_type {
        DataType::Timestamp(TimeUnit::Second, _) => Some(9),
        DataType::Timestamp(TimeUnit::Millisecond, _) => Some(6),
        DataType::Timestamp(TimeUnit::Microsecond, _) => Some(3),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => Some(0),
        _ => None,
    }
}

fn is_number(data_type: &DataType) -> bool {
    let is_other = matches!(data_type, DataType::Float16);
    *data_type == DataType::Boolean
        || !is_other && (data_type.is_integer() || data_type.is_floating())
}

fn times_ns(column: &dyn Array, power: u32) -> Vec<Option<i64>> {
    let whole = |values: Vec<Option<i64>>| -> Vec<Option<i64>> {
        let scale = 10_i64.pow(power);
        values
            .into_iter()
            .map(|value| value?.checked_mul(scale))
            .collect()
    };
    match column.data_type() {
        DataType::Timestamp(TimeUnit::Second, _) => whole(integers::<TimestampSecondType>(column)),
        DataType::Timestamp(TimeUnit::Millisecond, _) => {
            whole(integers::<TimestampMillisecondType>(column))
        }
        DataType::Timestamp(TimeUnit::Microsecond, _) => {
            whole(integers::<TimestampMicrosecondType>(column))
        }
        DataType::Timestamp(TimeUnit::Nanosecond, _) => {
            whole(integers::<TimestampNanosecondType>(column))
        }
        DataType::Int64 => whole(integers::<Int64Type>(column)),
        _ => (numbers(column).into_iter())
            .map(|number| time::from_float(number, power))
            .collect(),
    }
}

fn integers<T: ArrowPrimitiveType<Native = i64>>(column: &dyn Array) -> Vec<Option<i64>> {
    column
        .as_primitive_opt::<T>()
        .map_or(Vec::new(), |values| values.iter().collect())
}

/// NaN for what is missing.
fn numbers(column: &dyn Array) -> Vec<f64> {
    fn of<T: ArrowPrimitiveType>(column: &dyn Array, to: impl Fn(T::Native) -> f64) -> Vec<f64> {
        let values = column.as_primitive_opt::<T>();
        let number = |value: Option<T::Native>| value.map_or(f64::NAN, &to);
        values.map_or(Vec::new(), |values| values.iter().map(number).collect())
    }
    match column.data_type() {
        DataType::Float64 => of::<Float64Type>(column, |value| value),
        DataType::Float32 => of::<Float32Type>(column, f64::from),
        DataType::Int8 => of::<Int8Type>(column, f64::from),
        DataType::Int16 => of::<Int16Type>(column, f64::from),
        DataType::Int32 => of::<Int32Type>(column, f64::from),
        DataType::Int64 => of::<Int64Type>(column, |value| value as f64),
        DataType::UInt8 => of::<UInt8Type>(column, f64::from),
        DataType::UInt16 => of::<UInt16Type>(column, f64::from),
        DataType::UInt32 => of::<UInt32Type>(column, f64::from),
        DataType::UInt64 => of::<UInt64Type>(column, |value| value as f64),
        DataType::Boolean => {
            let values = column.as_any().downcast_ref::<BooleanArray>();
            let number = |value: Option<bool>| value.map_or(f64::NAN, f64::from);
            values.map_or(Vec::new(), |values| values.iter().map(number).collect())
        }
        _ => Vec::new(),
    }
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
