//! Parquet files.

use std::{
    fs::File,
    ops::{ControlFlow, Range},
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::Arc,
};

use jiff::{Span, civil::date};
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
    coarse_times::{CoarseTimes, HeldRows},
    columns::{Columns, TOPIC},
    rows::RowTopic,
};
use crate::{
    file::LogFile,
    formats::reader::{FileReader, Request},
    message::{Error, Losses, LostPart, LostRange, TopicTable},
    table::{self, DaysPassed, Kind, TableHead, TableOptions, TimeSource},
};

/// Far above the row groups of any writer.
const MOST_GROUP_BYTES: i64 = 2 << 30;
/// Most rows of a row group: damaged counts can stand for any number of them.
const MOST_GROUP_ROWS: i64 = 1 << 26;
/// Rows that are read at a time: a damaged count does not reserve memory for all of them.
const ROWS_PER_READ: usize = 4096;

/// The times (ns) of the rows of a group, those that cannot be read, and the columns of numbers.
type Rows = (Vec<Option<i64>>, Unread, Vec<Vec<f64>>);

/// The rows whose texts are no times, in order.
#[derive(Default)]
struct Unread {
    rows: Vec<usize>,
    /// The text of the first of them.
    example: String,
}

/// Rows in which the unit of the times is looked for.
const SAMPLED_ROWS: usize = 200;

/// The time of the rows.
enum Time {
    /// The column of time, or those of its seconds and their parts, and the unit of each (ns).
    Numbers {
        columns: Vec<usize>,
        units_ns: Vec<i64>,
    },
    /// Texts, dates and times of day, read as those of a table in text.
    Texts {
        source: TimeSource,
        lacks_zone: bool,
    },
}

impl Time {
    fn columns(&self) -> &[usize] {
        match self {
            Self::Numbers { columns, .. } => columns,
            Self::Texts { source, .. } => &source.columns,
        }
    }

    fn is_of_day(&self) -> bool {
        matches!(self, Self::Texts { source, .. } if source.kind == Kind::TimeOfDay)
    }
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
        let of_stamp = |&(at, unit_ns): &(usize, i64)| Time::Numbers {
            columns: vec![at],
            units_ns: vec![unit_ns],
        };
        // a name says more than a type: tables also have times at which something else happened
        let by_name = stamps
            .iter()
            .find(|(at, _)| table::is_name_of_time(columns[*at].name()));
        let texts = singles()
            .filter(|&at| is_text(&columns[at]) && may_be_time(columns[at].name(), options));
        let mut candidates: Vec<usize> = texts.chain(numbers.iter().copied()).collect();
        candidates.sort_unstable();
        let (time, mut told) = match by_name {
            Some(stamp) => (of_stamp(stamp), None),
            None => match (
                time_by_values(file.data(), &metadata, &candidates, options),
                stamps.first(),
            ) {
                (Err(_), Some(stamp)) => (of_stamp(stamp), None),
                (found, _) => found.map_err(invalid)?,
            },
        };
        let used = time.columns();
        let not_used = stamps.iter().map(|(at, _)| at);
        let not_used = not_used.filter(|at| !used.contains(at));
        let not_used: Vec<&str> = not_used.map(|at| columns[*at].name()).collect();
        if !not_used.is_empty() {
            let used = used.iter().map(|at| columns[*at].name());
            told = Some(say!(
                "time: {}; not the other columns of times: {} (--time-column NAME states one)",
                used.collect::<Vec<_>>().join(word!(" and ")),
                not_used.join(", ")
            ));
        }
        numbers.retain(|at| !used.contains(at));
        refuse_packing(&metadata, numbers.iter().chain(used)).map_err(invalid)?;
        if let Some(told) = told {
            losses.note(format!("{}: {told}", path.display()));
        }
        if let Time::Texts {
            lacks_zone: true, ..
        } = time
        {
            let name = path.display();
            losses.note(say!(
                "{name}: times are stated without a time zone: UTC is assumed"
            ));
        }
        let read = || {
            numbers
                .iter()
                .chain(used)
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
        let mut times = CoarseTimes::default();
        let _ = reader.each_row(losses, &mut |time_ns, values| {
            times.count(time_ns, values.iter().copied());
            ControlFlow::Continue(())
        })?;
        reader.rows.counted = times.finish(path, losses);
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
        let (is_of_day, mut days) = (self.time.is_of_day(), DaysPassed::default());
        let mut values = Vec::new();
        let mut lost: Vec<LostGroups> = Vec::new();
        let mut lost_rows: Option<LostRange> = None;
        let mut last_ns = None;
        for group in 0..self.metadata.num_row_groups() {
            let (times, unread, columns) = match self.group(group)? {
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
                            before_ns: last_ns,
                            behind_ns: None,
                        }),
                    }
                    continue;
                }
            };
            for (row, time_ns) in times.into_iter().enumerate() {
                let Some(time_ns) = time_ns else {
                    match unread.rows.binary_search(&row) {
                        Ok(_) => self.lose_row(group, &unread.example, last_ns, &mut lost_rows),
                        Err(_) => without_time += 1,
                    }
                    continue;
                };
                let time_ns = match is_of_day {
                    true => days.after(time_ns),
                    false => time_ns,
                };
                last_ns = Some(time_ns);
                for lost in &mut lost {
                    lost.behind_ns.get_or_insert(time_ns);
                }
                if let Some(lost) = &mut lost_rows {
                    lost.last_time_ns.get_or_insert(time_ns);
                }
                values.clear();
                values.extend(columns.iter().map(|column| column[row]));
                if take(time_ns, &values).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        for lost in lost {
            let reason = lost.reason();
            losses.push(LostRange {
                first_time_ns: lost.before_ns,
                last_time_ns: lost.behind_ns,
                ..LostRange::of(LostPart::Chunk, &self.path, lost.bytes, reason)
            });
        }
        if let Some(mut lost) = lost_rows {
            let count = lost.message_count.unwrap_or(0);
            if count > 1 {
                lost.reason = say!("{count} rows: {}", lost.reason);
            }
            losses.push(lost);
        }
        if without_time > 0 {
            losses.note(say!(
                "{}: {without_time} rows have no time and are not read",
                self.path.display()
            ));
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Adds a row of a group to those whose texts are no times.
    fn lose_row(
        &self,
        group: usize,
        example: &str,
        before_ns: Option<i64>,
        lost: &mut Option<LostRange>,
    ) {
        let bytes = self.bytes_of(group);
        let lost = lost.get_or_insert_with(|| {
            let advice = "";
            let reason = say!(
                "expected a time, found \"{}\"{advice}",
                example.escape_debug()
            );
            LostRange {
                first_time_ns: before_ns,
                ..LostRange::of(LostPart::Records, &self.path, bytes.clone(), reason)
            }
        });
        let count = lost.message_count.unwrap_or(0) + 1;
        lost.message_count = Some(count);
        lost.messages.insert(TOPIC.to_owned(), count);
        lost.start_byte = lost.start_byte.min(bytes.start);
        lost.end_byte = lost.end_byte.max(bytes.end);
        lost.last_time_ns = None;
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
            let mut unread = Unread::default();
            let times = match &self.time {
                Time::Numbers { columns, units_ns } => {
                    let first = columns.first().zip(units_ns.first());
                    let (&first, &unit_ns) = first.unwrap_or((&0, &1));
                    let (first, described) = column(first);
                    let mut times = times_ns(first?, described, unit_ns, rows)?;
                    if let Some((&second, &part_ns)) = columns.get(1).zip(units_ns.get(1)) {
                        let (parts, described) = column(second);
                        add_parts(&mut times, part_ns, &numbers(parts?, described, rows)?);
                    }
                    times
                }
                Time::Texts { source, .. } => {
                    let cells = source.columns.iter().map(|&at| {
                        let (cells_of, described) = column(at);
                        texts(cells_of?, described, rows)
                    });
                    let cells: Vec<Vec<String>> = cells.collect::<ParquetResult<_>>()?;
                    let time_ns = |row: usize| {
                        let found = row_of(&cells, row);
                        let time_ns = source.read(&found, false);
                        let is_empty = || found.iter().all(|cell| cell.trim().is_empty());
                        if time_ns.is_none() && !is_empty() {
                            unread.add(row, &found);
                        }
                        time_ns
                    };
                    (0..rows).map(time_ns).collect()
                }
            };
            let columns = self.numbers.iter().map(|&at| {
                let (numbers_of, described) = column(at);
                numbers(numbers_of?, described, rows)
            });
            Ok((times, unread, columns.collect::<ParquetResult<_>>()?))
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

impl Unread {
    fn add(&mut self, row: usize, cells: &[&str]) {
        const MOST_SHOWN: usize = 40;
        if self.rows.is_empty() {
            self.example = cells.join(" ").chars().take(MOST_SHOWN).collect();
        }
        self.rows.push(row);
    }
}

/// Row groups that cannot be read for one reason.
struct LostGroups {
    problem: String,
    first: usize,
    last: usize,
    count: usize,
    /// Bytes from the first of these groups to the last.
    bytes: Range<u64>,
    /// The times of the rows before the first of them, and behind the last.
    before_ns: Option<i64>,
    behind_ns: Option<i64>,
}

impl LostGroups {
    fn add(&mut self, group: usize, bytes: &Range<u64>) {
        self.count += 1;
        self.last = group;
        self.behind_ns = None;
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

/// The columns that are the time, with what was assumed, by their names and first values.
fn time_by_values(
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
        .map(|row| row_of(&texts, row).into_iter().map(str::to_owned).collect())
        .collect();
    let sample = TableHead {
        names: &names,
        units: &[],
        rows: &rows,
        has_decimal_comma: false,
    };
    let found = table::find(&sample, options).map_err(|problem| {
        let others = (0..schema.num_columns()).filter(|at| !columns.contains(at));
        let others: Vec<String> = others.map(name).collect();
        match others.is_empty() {
            true => problem,
            false => format!(
                "{problem}; columns that are neither numbers nor times: {}",
                others.join(", ")
            ),
        }
    })?;
    let in_file: Vec<usize> = found.columns.iter().map(|&at| columns[at]).collect();
    if in_file.iter().any(|&at| is_text(&schema.column(at))) {
        let lacks_zone = rows.iter().any(|row| {
            let cells = found.columns.iter();
            let cells: Vec<&str> = cells
                .filter_map(|&at| Some(row.get(at)?.as_str()))
                .collect();
            found.lacks_zone(&cells)
        });
        let told = found.told.clone();
        let source = TimeSource {
            columns: in_file,
            ..found
        };
        return Ok((Time::Texts { source, lacks_zone }, told));
    }
    let TimeSource {
        kind,
        part_ns,
        told,
        ..
    } = found;
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
    let units_ns = std::iter::once(unit_ns).chain(part_ns).collect();
    let columns = in_file;
    Ok((Time::Numbers { columns, units_ns }, told))
}

/// The cells of a row.
fn row_of(columns: &[Vec<String>], row: usize) -> Vec<&str> {
    let columns = columns.iter();
    columns
        .map(|column| column.get(row).map_or("", String::as_str))
        .collect()
}

/// The first values of columns, as text.
fn first_texts(
    data: &Path,
    metadata: &ParquetMetaData,
    columns: &[usize],
) -> Result<Vec<Vec<String>>, String> {
    let source = Arc::new(File::open(data).map_err(|error| error.to_string())?);
    let mut found_all: Vec<Vec<String>> = vec![Vec::new(); columns.len()];
    let groups = metadata.row_groups().iter().enumerate();
    let Some((index, group)) = groups.into_iter().find(|(_, group)| group.num_rows() > 0) else {
        return Ok(found_all);
    };
    let text = |error: ParquetError| error.to_string();
    let pages = metadata.page_index_for_row_group(index);
    let properties = Arc::new(ReaderProperties::builder().build());
    let reader = SerializedRowGroupReader::new(source, group, pages, properties).map_err(text)?;
    let rows = SAMPLED_ROWS.min(usize::try_from(group.num_rows()).unwrap_or(0));
    for (found, &at) in found_all.iter_mut().zip(columns) {
        let described = group.column(at).column_descr();
        let reader = reader.get_column_reader(at).map_err(text)?;
        *found = texts(reader, described, rows).map_err(text)?;
    }
    Ok(found_all)
}

/// The cells of a column as text: whole numbers with all their digits, dates and times of day as in ISO 8601. Empty where it has no
/// value.
fn texts(
    reader: ColumnReader,
    column: &ColumnDescriptor,
    rows: usize,
) -> ParquetResult<Vec<String>> {
    let of_calendar = |value: i64| calendar_text(column, value).unwrap_or_default();
    let none = String::new();
    match reader {
        ColumnReader::ByteArrayColumnReader(reader) if is_text(column) => {
            each(reader, column, rows, none, |text| {
                String::from_utf8_lossy(text.data()).into_owned()
            })
        }
        ColumnReader::Int32ColumnReader(reader) if is_text(column) => {
            each(reader, column, rows, none, |&value| {
                of_calendar(value.into())
            })
        }
        ColumnReader::Int64ColumnReader(reader) if is_text(column) => {
            each(reader, column, rows, none, |&value| of_calendar(value))
        }
        ColumnReader::Int64ColumnReader(reader) if !is_unsigned(column) && !is_decimal(column) => {
            each(reader, column, rows, none, ToString::to_string)
        }
        other => {
            let shown = |value: f64| match value.is_finite() {
                true => value.to_string(),
                false => String::new(),
            };
            Ok(numbers(other, column, rows)?
                .into_iter()
                .map(shown)
                .collect())
        }
    }
}

/// The text of a date or a time of day.
fn calendar_text(column: &ColumnDescriptor, value: i64) -> Option<String> {
    const S_PER_HOUR: i64 = 3600;
    const NS_PER_S: i64 = 1_000_000_000;
    let unit_ns = match (column.logical_type_ref(), column.converted_type()) {
        (Some(LogicalType::Time(time)), _) => unit_ns(&time.unit),
        (None, ConvertedType::TIME_MILLIS) => unit_ns(&TimeUnit::MILLIS),
        (None, ConvertedType::TIME_MICROS) => unit_ns(&TimeUnit::MICROS),
        _ => {
            let days = Span::new().try_days(value).ok()?;
            return Some(date(1970, 1, 1).checked_add(days).ok()?.to_string());
        }
    };
    let time_ns = value.checked_mul(unit_ns).filter(|time| *time >= 0)?;
    let (time_s, part_ns) = (time_ns / NS_PER_S, time_ns % NS_PER_S);
    let (hour, of_hour) = (time_s / S_PER_HOUR, time_s % S_PER_HOUR);
    let (minute, second) = (of_hour / 60, of_hour % 60);
    Some(format!("{hour:02}:{minute:02}:{second:02}.{part_ns:09}"))
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

/// A unit of time (ns).
fn unit_ns(unit: &TimeUnit) -> i64 {
    match unit {
        TimeUnit::MILLIS => 1_000_000,
        TimeUnit::MICROS => 1000,
        TimeUnit::NANOS => 1,
    }
}

/// Whether the cells are texts, dates or times of day.
fn is_text(column: &ColumnDescriptor) -> bool {
    use ConvertedType::{DATE, TIME_MICROS, TIME_MILLIS, UTF8};
    match column.logical_type_ref() {
        Some(logical) => matches!(
            logical,
            LogicalType::String | LogicalType::Date | LogicalType::Time(_)
        ),
        None => matches!(
            column.converted_type(),
            UTF8 | DATE | TIME_MILLIS | TIME_MICROS
        ),
    }
}

/// Whether the name is that of a time or of a part of it.
fn may_be_time(name: &str, options: &TableOptions) -> bool {
    match &options.time_column {
        None => table::is_name_of_time(name),
        Some(named) => (named.split(',').chain([named.as_str()]))
            .any(|named| table::is_same_column(name, named)),
    }
}

/// The unit of a timestamp (ns).
fn time_unit_ns(column: &ColumnDescriptor) -> Option<i64> {
    let unit = match column.logical_type_ref() {
        Some(LogicalType::Timestamp(timestamp)) => Some(&timestamp.unit),
        _ => None,
    };
    match (unit, column.converted_type(), column.physical_type()) {
        (Some(unit), ..) => Some(unit_ns(unit)),
        (None, ConvertedType::TIMESTAMP_MILLIS, _) => Some(unit_ns(&TimeUnit::MILLIS)),
        (None, ConvertedType::TIMESTAMP_MICROS, _) => Some(unit_ns(&TimeUnit::MICROS)),
        // the type of timestamps in nanoseconds before there was a name for it
        (None, _, Physical::INT96) => Some(unit_ns(&TimeUnit::NANOS)),
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
fn each<C: DataType, V: Clone>(
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
            true => known.next().unwrap_or_else(|| missing.clone()),
            false => missing.clone(),
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
        let mut held = HeldRows::new(self.rows.counted.spread);
        let mut visit = |time_ns: i64, values: &[f64]| {
            let flow = self
                .rows
                .visit(count, time_ns, values, &mut message, request);
            count += 1;
            flow
        };
        let mut flow = self.each_row(&mut losses, &mut |time_ns, values| {
            held.push(time_ns, values, &mut visit)
        })?;
        if flow.is_continue() {
            flow = held.end(&mut visit);
        }
        request.losses.merge(&losses);
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.rows.counted.span_ns
    }
}
