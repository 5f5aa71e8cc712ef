//! Tables of numbers (CSV, or CAN traces that were decoded to CSV) as one MCAP log.
//!
//! ```sh
//! cargo run --release -p tipwatch-analyze --example csv_to_mcap -- \
//!     -o drive.mcap --time time_ms --time-unit ms /boom=boom.csv /imu=imu.csv
//! ```
//!
//! Every file becomes a topic, every column but the time a `float64` field of its messages, every line a
//! message. The time goes into `header.stamp`. A cell without a number (empty, `NaN`) is NaN, which means that
//! the message does not have that number: tables in which each line has only what changed are welcome.
//! `[signals]` of the machine file then tells which field is what, and in which unit it is.

#![allow(
    dead_code,
    reason = "a test takes this file as a module and needs no main"
)]

use std::{
    collections::BTreeMap,
    error::Error,
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
    process::ExitCode,
};

use csv::{ReaderBuilder, StringRecord, Trim};
use mcap::{WriteOptions, records::MessageHeader};

/// The definition that goes with the header of every message.
const HEADER: &str = "====\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ====\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const USAGE: &str = "usage: csv_to_mcap -o OUT.mcap TOPIC=FILE.csv ... [--time COLUMN] [--time-unit s|ms|us|ns] \
    [--start UNIX_SECONDS] [--delimiter C] [--skip COLUMN ...]";

/// Format of the tables.
#[derive(Debug, Clone)]
pub(crate) struct TableFormat {
    /// The column of the time; the first where none is named.
    pub(crate) time_column: Option<String>,
    /// Nanoseconds in one unit of time.
    pub(crate) time_unit_ns: f64,
    /// Time of the log at time zero of the tables (s). Not zero: a stamp of zero means that there is none.
    pub(crate) start_s: f64,
    /// Separator of the cells; with `;` a comma is a decimal point.
    pub(crate) delimiter: u8,
    /// Columns that are no numbers.
    pub(crate) skipped: Vec<String>,
}

impl Default for TableFormat {
    fn default() -> Self {
        Self {
            time_column: None,
            time_unit_ns: 1e9,
            start_s: 1.0,
            delimiter: b',',
            skipped: Vec::new(),
        }
    }
}

/// A table: its fields, and a line of numbers for each time.
#[derive(Debug)]
struct Table {
    fields: Vec<String>,
    lines: Vec<(i64, Vec<f64>)>,
}

fn main() -> ExitCode {
    match run(std::env::args().skip(1)) {
        Ok(count) => {
            eprintln!("{count} messages written");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(mut arguments: impl Iterator<Item = String>) -> Result<usize, Box<dyn Error>> {
    let (mut out, mut tables, mut format) = (None, Vec::new(), TableFormat::default());
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(USAGE);
        match argument.as_str() {
            "-o" => out = Some(PathBuf::from(value()?)),
            "--time" => format.time_column = Some(value()?),
            "--time-unit" => {
                format.time_unit_ns = match value()?.as_str() {
                    "s" => 1e9,
                    "ms" => 1e6,
                    "us" => 1e3,
                    "ns" => 1.0,
                    other => return Err(format!("--time-unit {other}: {USAGE}").into()),
                }
            }
            "--start" => format.start_s = value()?.parse()?,
            "--delimiter" => format.delimiter = *value()?.as_bytes().first().ok_or(USAGE)?,
            "--skip" => format.skipped.push(value()?),
            table => {
                let (topic, file) = table.split_once('=').ok_or(USAGE)?;
                tables.push((topic.to_owned(), PathBuf::from(file)));
            }
        }
    }
    convert(&tables, &out.ok_or(USAGE)?, &format)
}

/// Writes tables, each with its topic, as one log; gives the number of messages.
///
/// # Errors
/// A file cannot be read or written or exists, or a cell is no number.
pub(crate) fn convert(
    tables: &[(String, PathBuf)],
    out: &Path,
    format: &TableFormat,
) -> Result<usize, Box<dyn Error>> {
    let read: Result<Vec<Table>, _> = (tables.iter())
        .map(|(_, file)| read_table(file, format))
        .collect();
    let read = read?;
    let file = File::create_new(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let options = WriteOptions::new().profile("ros2");
    let mut writer = options.create(BufWriter::new(file))?;
    let mut channels = Vec::new();
    for ((topic, _), table) in tables.iter().zip(&read) {
        let type_name = format!("tables/msg/{}", type_of(topic));
        let schema = writer.add_schema(&type_name, "ros2msg", definition(table).as_bytes())?;
        channels.push(writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?);
    }
    let mut order: Vec<(i64, usize, usize)> = Vec::new();
    for (table, content) in read.iter().enumerate() {
        let lines = content.lines.iter().enumerate();
        order.extend(lines.map(|(line, (stamp_ns, _))| (*stamp_ns, table, line)));
    }
    order.sort_unstable();
    for (sequence, &(stamp_ns, table, line)) in order.iter().enumerate() {
        let header = MessageHeader {
            channel_id: channels[table],
            sequence: sequence as u32,
            log_time: stamp_ns as u64,
            publish_time: stamp_ns as u64,
        };
        let message = message(stamp_ns, &read[table].lines[line].1);
        writer.write_to_known_channel(&header, &message)?;
    }
    writer.finish()?;
    Ok(order.len())
}

fn read_table(path: &Path, format: &TableFormat) -> Result<Table, Box<dyn Error>> {
    let fault = |message: String| format!("{}: {message}", path.display());
    let mut reader = ReaderBuilder::new()
        .delimiter(format.delimiter)
        .trim(Trim::All)
        .from_path(path)
        .map_err(|error| fault(error.to_string()))?;
    let names = reader.headers().map_err(|error| fault(error.to_string()))?;
    let names: Vec<String> = names.iter().map(str::to_owned).collect();
    let records: Result<Vec<StringRecord>, _> = reader.records().collect();
    let records = records.map_err(|error| fault(error.to_string()))?;
    let mut columns = Vec::new();
    for (column, name) in names.iter().enumerate() {
        if format.skipped.contains(name) {
            continue;
        }
        let mut numbers = Vec::with_capacity(records.len());
        for record in &records {
            let found = record.get(column).unwrap_or_default();
            let number = number(found, format).ok_or_else(|| {
                let line = record.position().map_or(0, csv::Position::line);
                let place = format!("line {line}, column {name:?}");
                fault(format!(
                    "{place}: expected a number, found {found:?}; --skip {name:?} leaves the column out"
                ))
            })?;
            numbers.push(number);
        }
        columns.push((name.clone(), numbers));
    }
    let time = match &format.time_column {
        None => Some(0).filter(|_| !columns.is_empty()),
        Some(wanted) => columns.iter().position(|(name, _)| name == wanted),
    };
    let time = time.ok_or_else(|| {
        let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        let wanted = format.time_column.as_deref().unwrap_or("of the time");
        fault(format!(
            "expected a column {wanted}, found {}",
            names.join(", ")
        ))
    })?;
    let (time_name, times) = columns.remove(time);
    let fields: Vec<String> = columns.iter().map(|(name, _)| field_name(name)).collect();
    for (i, field) in fields.iter().enumerate() {
        if field.is_empty() || fields[..i].contains(field) {
            let expected = "columns of different names, in letters and digits";
            return Err(fault(format!("expected {expected}, found {field:?}")).into());
        }
    }
    let mut lines = Vec::with_capacity(times.len());
    for (line, time) in times.iter().enumerate() {
        let stamp_ns = (format.start_s * 1e9 + time * format.time_unit_ns).round();
        if !(stamp_ns > 0.0 && stamp_ns < f64::from(i32::MAX) * 1e9) {
            let place = format!("line {}, column {time_name:?}", line + 2);
            return Err(fault(format!("{place}: expected a time after zero")).into());
        }
        let numbers = columns.iter().map(|(_, numbers)| numbers[line]);
        lines.push((stamp_ns as i64, numbers.collect()));
    }
    Ok(Table { fields, lines })
}

/// The number in a cell, NaN in an empty one; `None` if it holds anything else.
fn number(cell: &str, format: &TableFormat) -> Option<f64> {
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
        return Some(f64::NAN);
    }
    let number: Result<f64, _> = match format.delimiter {
        b';' => cell.replace(',', ".").parse(),
        _ => cell.parse(),
    };
    number.ok().filter(|number| number.is_finite())
}

/// A column's name as that of a field: its words of letters and digits joined by underscores, a letter
/// first.
fn field_name(column: &str) -> String {
    let words = column.split(|c: char| !c.is_ascii_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let name = words.join("_");
    match name.starts_with(|c: char| c.is_ascii_digit()) {
        true => format!("n{name}"),
        false => name,
    }
}

/// A topic's name as that of a type.
fn type_of(topic: &str) -> String {
    let words = topic.split(|c: char| !c.is_ascii_alphanumeric());
    let capital = |word: &str| {
        let mut letters = word.chars();
        letters
            .next()
            .map(|first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    words.filter_map(capital).collect()
}

fn definition(table: &Table) -> String {
    let fields: String = (table.fields.iter())
        .map(|field| format!("float64 {field}\n"))
        .collect();
    format!("std_msgs/Header header\n{fields}{HEADER}")
}

/// One message in CDR, little-endian: the header with an empty frame, then the numbers.
fn message(stamp_ns: i64, numbers: &[f64]) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(((stamp_ns / 1_000_000_000) as i32).to_le_bytes());
    bytes.extend(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
    bytes.extend(1_u32.to_le_bytes());
    bytes.push(0);
    // numbers stand at multiples of eight, counted from behind the first four bytes
    while (bytes.len() - 4) % 8 != 0 {
        bytes.push(0);
    }
    for number in numbers {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}
