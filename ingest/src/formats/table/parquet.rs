//! Parquet files.

use std::{
    fs::File,
    ops::{ControlFlow, Range},
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::Arc,
};

use parquet::{
    basic::{Compression, ConvertedType, LogicalType, TimeUnit, Type as Physical},
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
use tipwatch_language::{say, word};

use super::{
    columns::Columns,
    rows::{Counted, RowTopic},
};
use crate::{
    file::LogFile,
    formats::reader::{FileReader, Request},
    message::{Error, Losses, LostPart, TopicTable},
    table::{self, Kind, Sample, TableOptions, TimeSource},
};

/// Far above the row groups of any writer.
const MOST_GROUP_BYTES: i64 = 2 << 30;
/// The same, in rows: damaged counts can stand for any number of them.
const MOST_GROUP_ROWS: i64 = 1 << 26;
/// Rows that are read at a time: a damaged count does not reserve memory for all of them.
const ROWS_PER_READ: usize = 4096;

/// The times (ns) of the rows of a group, and the columns of numbers.
type Rows = (Vec<Option<i64>>, Vec<Vec<f64>>);

/// Rows in which the unit of the times is looked for.
const SAMPLED_ROWS: usize = 200;

/// The column of time, or those of its seconds and their parts.
struct Time {
    columns: Vec<usize>,
    /// The unit of each (ns).
    units_ns: Vec<i64>,
}

/// A Parquet file.
pub(crate) struct ParquetReader {
    path: PathBuf,
    data: PathBuf,
    metadata: ParquetMetaData,
    time: Time,
    /// Indices of the columns with numbers.
    numbers: Vec<usize>,
    rows: RowTopic,
}

impl ParquetReader {
    pub(crate) fn open(
        file: &LogFile,
        options: &TableOptions,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = file.path();
        let invalid = |problem: String| Error::Table {
            path: path.to_path_buf(),
            problem,
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
                    "the end of the Parquet file is damaged: {error}"
                )));
            }
            Err(_) => return Err(invalid("the end of the Parquet file is damaged".to_owned())),
        };
        let schema = metadata.file_metadata().schema_descr();
        let (fields, columns) = (schema.root_schema().get_fields(), schema.columns());
        // a value that is repeated is a list of old writers
        let is_single = |at: usize| {
            schema.get_column_root(at).is_primitive() && columns[at].max_rep_level() == 0
        };
        let singles = || (0..columns.len()).filter(|&at| is_single(at));
        let mut numbers: Vec<usize> = singles().filter(|&at| is_number(&columns[at])).collect();
        let is_meant = |at: usize| {
            let named = options.time_column.as_ref();
            named.is_none_or(|named| table::is_same_column(columns[at].name(), named))
        };
        let stamps = singles().filter(|&at| is_meant(at));
        let stamps = stamps.filter_map(|at| Some((at, time_unit_ns(&columns[at])?)));
        let stamps: Vec<(usize, i64)> = stamps.collect();
        let of_stamp = |&(at, unit_ns): &(usize, i64)| Time {
            columns: vec![at],
            units_ns: vec![unit_ns],
        };
        // a name says more than a type: tables also have times at which something else happened
        let by_name = stamps
            .iter()
            .find(|(at, _)| table::is_name_of_time(columns[*at].name()));
        let (time, mut told) = match by_name {
            Some(stamp) => (of_stamp(stamp), None),
            None => match (
                number_time(file.data(), &metadata, &numbers, options),
                stamps.first(),
            ) {
                (Err(_), Some(stamp)) => (of_stamp(stamp), None),
                (found, _) => found.map_err(invalid)?,
            },
        };
        let not_used = stamps.iter().map(|(at, _)| at);
        let not_used = not_used.filter(|at| !time.columns.contains(at));
        let not_used: Vec<&str> = not_used.map(|at| columns[*at].name()).collect();
        if !not_used.is_empty() {
            let used = time.columns.iter().map(|at| columns[*at].name());
            told = Some(say!(
                "time: {}; not the other columns of times: {} (--time-column NAME states one)",
                used.collect::<Vec<_>>().join(word!(" and ")),
                not_used.join(", ")
            ));
        }
        numbers.retain(|at| !time.columns.contains(at));
        refuse_packing(&metadata, numbers.iter().chain(&time.columns)).map_err(invalid)?;
        if let Some(told) = told {
            losses.note(format!("{}: {told}", path.display()));
        }
        let read = || {
            numbers
                .iter()
                .chain(&time.columns)
                .map(|&at| schema.get_column_root_idx(at))
        };
        let others = (fields.iter().enumerate()).filter(|(at, _)| !read().any(|read| read == *at));
        let others: Vec<&str> = others.map(|(_, field)| field.name()).collect();
        let values: Vec<&str> = numbers.iter().map(|&at| columns[at].name()).collect();
        if let Some((signal, value)) = table::signal_and_value(&others, &values) {
            return Err(invalid(format!(
                "each row has one signal (its name in \"{signal}\", its value in \"{value}\"): expected a column for each signal; \
                 write the table as CSV, or anew (with pandas: table.pivot_table(index=TIME, columns=\"{signal}\", \
                 values=\"{value}\"))"
            )));
        }
        if !others.is_empty() {
            losses.note(say!(
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
            &[],
        );
        for note in &columns.notes {
            losses.note(format!("{}: {note}", path.display()));
        }
        let mut reader = Self {
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            metadata,
            time,
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
        let mut lost: Vec<LostGroups> = Vec::new();
        for group in 0..self.metadata.num_row_groups() {
            let (times, columns) = match self.group(group)? {
                Ok(rows) => rows,
                Err(problem) => {
                    let bytes = self.bytes_of(group);
                    match lost.iter_mut().find(|lost| lost.problem == problem) {
                        Some(lost) => lost.add(group, &bytes),
                        None => lost.push(LostGroups {
                            problem,
                            first: group,
                            last: group,
                            count: 1,
                            bytes,
                        }),
                    }
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
        for lost in lost {
            let reason = lost.reason();
            losses.lose(LostPart::Chunk, &self.path, lost.bytes, reason);
        }
        if without_time > 0 {
            losses.note(say!(
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
            return Ok(Err(say!("{size} bytes, {count} rows")));
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
            let Time { columns, units_ns } = &self.time;
            let first = columns.first().zip(units_ns.first());
            let (&first, &unit_ns) = first.unwrap_or((&0, &1));
            let (first, described) = column(first);
            let mut times = times_ns(first?, described, unit_ns, rows)?;
            if let Some((&second, &part_ns)) = columns.get(1).zip(units_ns.get(1)) {
                let (parts, described) = column(second);
                add_parts(&mut times, part_ns, &numbers(parts?, described, rows)?);
            }
            let columns = self.numbers.iter().map(|&at| {
                let (numbers_of, described) = column(at);
                numbers(numbers_of?, described, rows)
            });
            Ok((times, columns.collect::<ParquetResult<_>>()?))
        }));
        let read = read.map(|rows| rows.map_err(|error| error.to_string()));
        Ok(read.unwrap_or_else(|_| Err(word!("cannot be decoded").to_owned())))
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

/// Row groups that cannot be read for one reason.
struct LostGroups {
    problem: String,
    first: usize,
    last: usize,
    count: usize,
    /// From the first of them to the last.
    bytes: Range<u64>,
}

impl LostGroups {
    fn add(&mut self, group: usize, bytes: &Range<u64>) {
        self.count += 1;
        self.last = group;
        self.bytes = self.bytes.start.min(bytes.start)..self.bytes.end.max(bytes.end);
    }

    fn reason(&self) -> String {
        let Self {
            problem,
            first,
            last,
            count,
            ..
        } = self;
        match count {
            1 => say!("row group {first}: {problem}"),
            _ => say!("{count} row groups, the first {first}, the last {last}: {problem}"),
        }
    }
}

/// Refuses columns in a packing that this build cannot open: no value of them can be read.
fn refuse_packing<'c>(
    metadata: &ParquetMetaData,
    mut columns: impl Iterator<Item = &'c usize>,
) -> Result<(), String> {
    let packing = |at: usize| {
        let mut groups = metadata.row_groups().iter();
        groups.find_map(|group| match group.columns().get(at)?.compression() {
            Compression::BROTLI(_) => Some("brotli"),
            Compression::LZO => Some("lzo"),
            _ => None,
        })
    };
    let schema = metadata.file_metadata().schema_descr();
    match columns.find_map(|&at| Some((at, packing(at)?))) {
        None => Ok(()),
        Some((at, packing)) => Err(format!(
            "the column \"{}\" is packed with {packing}: expected snappy, gzip, lz4, zstd or no packing; write it anew \
             (with pyarrow: pq.write_table(pq.read_table(old), new, compression=\"zstd\"))",
            schema.column(at).name().escape_debug()
        )),
    }
}

/// The column of numbers that is the time, with what was assumed, by its name and first values.
fn number_time(
    data: &Path,
    metadata: &ParquetMetaData,
    columns: &[usize],
    options: &TableOptions,
) -> Result<(Time, Option<String>), String> {
    let schema = metadata.file_metadata().schema_descr();
    let name = |at: usize| schema.column(at).name().to_owned();
    let names: Vec<String> = columns.iter().map(|&at| name(at)).collect();
    refuse_packing(metadata, columns.iter())?;
    // the library may panic on damaged bytes
    let texts = catch_unwind(AssertUnwindSafe(|| first_texts(data, metadata, columns)));
    let texts = texts.unwrap_or_else(|_| Err("cannot be decoded".to_owned()))?;
    let rows: Vec<Vec<String>> = (0..texts.iter().map(Vec::len).max().unwrap_or(0))
        .map(|row| {
            let cell = |column: &Vec<String>| column.get(row).cloned().unwrap_or_default();
            texts.iter().map(cell).collect()
        })
        .collect();
    let sample = Sample {
        names: &names,
        units: &[],
        rows: &rows,
        has_decimal_comma: false,
    };
    let TimeSource {
        columns: found,
        kind,
        part_ns,
        told,
    } = table::find(&sample, options).map_err(|problem| {
        let others = (0..schema.num_columns()).filter(|at| !columns.contains(at));
        let others: Vec<String> = others.map(name).collect();
        match others.is_empty() {
            true => problem,
            false => {
                let has_texts = others.iter().any(|name| table::is_name_of_time(name));
                let way_out = match has_texts {
                    true => "; write times as timestamps (with pandas: pd.to_datetime)",
                    false => "",
                };
                format!(
                    "{problem}; columns that are neither numbers nor timestamps: {}{way_out}",
                    others.join(", ")
                )
            }
        }
    })?;
    let unit_ns = match kind {
        Kind::Multiples(unit_ns) => unit_ns,
        Kind::SpreadsheetDays => {
            return Err(
                "--time-unit days is for tables in text: expected s, ms, us, ns, min or h"
                    .to_owned(),
            );
        }
        Kind::Text(_) | Kind::TimeOfDay => return Err("no row has a time".to_owned()),
    };
    let columns = found.iter().map(|&at| columns[at]).collect();
    let units_ns = std::iter::once(unit_ns).chain(part_ns).collect();
    Ok((Time { columns, units_ns }, told))
}

/// The first values of columns of numbers, as text: whole numbers with all their digits.
fn first_texts(
    data: &Path,
    metadata: &ParquetMetaData,
    columns: &[usize],
) -> Result<Vec<Vec<String>>, String> {
    let source = Arc::new(File::open(data).map_err(|error| error.to_string())?);
    let mut found: Vec<Vec<String>> = vec![Vec::new(); columns.len()];
    let groups = metadata.row_groups().iter().enumerate();
    let Some((index, group)) = groups.into_iter().find(|(_, group)| group.num_rows() > 0) else {
        return Ok(found);
    };
    let text = |error: ParquetError| error.to_string();
    let pages = metadata.page_index_for_row_group(index);
    let properties = Arc::new(ReaderProperties::builder().build());
    let reader = SerializedRowGroupReader::new(source, group, pages, properties).map_err(text)?;
    let rows = SAMPLED_ROWS.min(usize::try_from(group.num_rows()).unwrap_or(0));
    for (texts, &at) in found.iter_mut().zip(columns) {
        let described = group.column(at).column_descr();
        *texts = match reader.get_column_reader(at).map_err(text)? {
            ColumnReader::Int64ColumnReader(reader)
                if !is_unsigned(described) && !is_decimal(described) =>
            {
                let values = each(reader, described, rows, None, |&value| Some(value));
                let shown = |value: Option<i64>| value.map_or(String::new(), |v| v.to_string());
                values.map_err(text)?.into_iter().map(shown).collect()
            }
            other => {
                let values = numbers(other, described, rows).map_err(text)?;
                let shown = |value: f64| match value.is_finite() {
                    true => value.to_string(),
                    false => String::new(),
                };
                values.into_iter().map(shown).collect()
            }
        };
    }
    Ok(found)
}

/// Adds parts of a second, in a unit (ns), to times that are whole seconds.
fn add_parts(times: &mut [Option<i64>], part_ns: i64, parts: &[f64]) {
    for (time, &part) in times.iter_mut().zip(parts) {
        let more_ns = part * part_ns as f64;
        let is_part = part.fract() == 0.0 && (0.0..1e9).contains(&more_ns);
        *time = time
            .filter(|_| is_part)
            .and_then(|time| time.checked_add(more_ns as i64));
    }
}

/// The unit of a timestamp (ns).
fn time_unit_ns(column: &ColumnDescriptor) -> Option<i64> {
    let unit = match column.logical_type_ref() {
        Some(LogicalType::Timestamp(timestamp)) => Some(&timestamp.unit),
        _ => None,
    };
    match (unit, column.converted_type(), column.physical_type()) {
        (Some(TimeUnit::MILLIS), ..) | (None, ConvertedType::TIMESTAMP_MILLIS, _) => {
            Some(1_000_000)
        }
        (Some(TimeUnit::MICROS), ..) | (None, ConvertedType::TIMESTAMP_MICROS, _) => Some(1000),
        // the type of timestamps in nanoseconds before there was a name for it
        (Some(TimeUnit::NANOS), ..) | (None, _, Physical::INT96) => Some(1),
        _ => None,
    }
}

/// Whether the numbers are whole multiples of a power of ten.
fn is_decimal(column: &ColumnDescriptor) -> bool {
    matches!(column.logical_type_ref(), Some(LogicalType::Decimal(_)))
        || column.converted_type() == ConvertedType::DECIMAL
}

fn is_number(column: &ColumnDescriptor) -> bool {
    if is_decimal(column) {
        return true;
    }
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

/// The times of a row group, in this unit (ns).
fn times_ns(
    reader: ColumnReader,
    column: &ColumnDescriptor,
    unit_ns: i64,
    rows: usize,
) -> ParquetResult<Vec<Option<i64>>> {
    match reader {
        ColumnReader::Int64ColumnReader(reader) if !is_unsigned(column) && !is_decimal(column) => {
            each(reader, column, rows, None, |time| time.checked_mul(unit_ns))
        }
        ColumnReader::Int96ColumnReader(reader) => {
            each(reader, column, rows, None, |time| Some(time.to_nanos()))
        }
        other => {
            let times = numbers(other, column, rows)?.into_iter();
            Ok(times.map(|time| table::from_float(time, unit_ns)).collect())
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
    let mut found = match reader {
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
        ColumnReader::FixedLenByteArrayColumnReader(reader) if is_decimal(column) => {
            each(reader, column, rows, f64::NAN, |value| {
                whole_number(value.data())
            })
        }
        ColumnReader::ByteArrayColumnReader(reader) if is_decimal(column) => {
            each(reader, column, rows, f64::NAN, |value| {
                whole_number(value.data())
            })
        }
        _ => Err(ParquetError::General("expected numbers".to_owned())),
    }?;
    if is_decimal(column) {
        let unit = 10_f64.powi(column.type_scale());
        // a quotient of two exact numbers is the nearest one to the decimal
        found.iter_mut().for_each(|value| *value /= unit);
    }
    Ok(found)
}

/// A whole number of any length, the highest byte first.
fn whole_number(bytes: &[u8]) -> f64 {
    let Some((&first, rest)) = bytes.split_first() else {
        return f64::NAN;
    };
    match bytes.len() {
        ..=16 => {
            let exact = i128::from(first.cast_signed());
            rest.iter()
                .fold(exact, |sum, &byte| (sum << 8) | i128::from(byte)) as f64
        }
        _ => rest
            .iter()
            .fold(f64::from(first.cast_signed()), |sum, &byte| {
                sum * 256.0 + f64::from(byte)
            }),
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
