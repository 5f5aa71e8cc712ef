//! Comma-separated values, or values separated by semicolons or tabs.

use std::{
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    ops::ControlFlow,
    path::PathBuf,
};

use csv::{ByteRecord, Reader, ReaderBuilder};

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

const BEGINNING_BYTES: u64 = 4096;
/// Cells that are empty by intent.
const MISSING: [&str; 7] = ["", "nan", "na", "n/a", "null", "none", "-"];

/// A table in text.
pub(crate) struct CsvReader {
    path: PathBuf,
    data: PathBuf,
    separator: u8,
    time: usize,
    unit: Unit,
    rows: RowTopic,
    columns: Columns,
    /// Where the last row begins, if no line break ends it.
    cut_at: Option<u64>,
}

impl CsvReader {
    pub(crate) fn open(
        file: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = file.path();
        let io = |data: &LogFile| File::open(data.data()).map_err(Error::io(path));
        let mut beginning = Vec::new();
        let read = io(file)?.take(BEGINNING_BYTES).read_to_end(&mut beginning);
        read.map_err(Error::io(path))?;
        let invalid = |problem: String| Error::Unsupported {
            path: path.to_path_buf(),
            format: problem,
        };
        let separator = time::separator(&beginning)
            .ok_or_else(|| invalid("a table without a column of time".to_owned()))?;
        let mut reader = reader(io(file)?, separator);
        let header = reader
            .byte_headers()
            .map_err(|error| invalid(error.to_string()))?
            .clone();
        let name = |cell: &[u8]| {
            let text = String::from_utf8_lossy(cell);
            text.trim_start_matches('\u{feff}').trim().to_owned()
        };
        let mut names: Vec<String> = header.iter().map(name).collect();
        let found = names
            .iter()
            .enumerate()
            .find_map(|(at, name)| Some((at, time::unit_in_name(name)?)));
        let (time, unit) =
            found.ok_or_else(|| invalid("a table without a column of time".to_owned()))?;
        let time_name = names.remove(time);
        let columns = Columns::new(names);
        let bytes = std::fs::metadata(file.data())
            .map_err(Error::io(path))?
            .len();
        let mut csv = Self {
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            separator,
            time,
            unit,
            rows: RowTopic::register(&columns, bytes, topics),
            columns,
            cut_at: None,
        };
        csv.check_time(&mut reader, &time_name).map_err(invalid)?;
        csv.scan(losses)?;
        topics.add_messages(csv.rows.topic, Some(csv.rows.counted.rows));
        Ok(csv)
    }

    /// The first row must have a time.
    fn check_time(&self, reader: &mut Reader<BufReader<File>>, name: &str) -> Result<(), String> {
        let mut row = ByteRecord::new();
        if !reader.read_byte_record(&mut row).unwrap_or(false) {
            return Ok(());
        }
        let cell = String::from_utf8_lossy(row.get(self.time).unwrap_or_default()).into_owned();
        if self.unit == Unit::Text && time::parse(&cell, self.unit).is_none() {
            return Err(format!(
                "the column of time \"{name}\" states no unit: expected a name like {name}_s, {name}_ms, {name}_us or \
                 {name}_ns, or dates by ISO 8601, found \"{}\"",
                cell.escape_default()
            ));
        }
        Ok(())
    }

    /// Counts the rows and reports what is wrong with them.
    fn scan(&mut self, losses: &mut Losses) -> Result<(), Error> {
        losses.integrity.checksums_absent = true;
        let ends = self.ends_with_line_break()?;
        let mut odd: Vec<(u64, Option<String>)> = vec![(0, None); self.columns.names.len()];
        let mut lacks_zone = false;
        let mut last_start = None;
        let mut counted = Counted::default();
        // of the last row, which may be cut off
        let mut pending = None;
        self.each_row(&mut |row, start, end| {
            match row {
                Ok((time_ns, cells, time_text)) => {
                    lacks_zone |= self.unit == Unit::Text && time::lacks_zone(time_text);
                    for ((count, example), cell) in odd.iter_mut().zip(cells.iter()) {
                        if let Cell::Other(text) = cell {
                            *count += 1;
                            example.get_or_insert_with(|| text.chars().take(20).collect());
                        }
                    }
                    if let Some((_, time_ns)) = pending.replace((start, *time_ns)) {
                        counted.count(time_ns);
                    }
                }
                Err(problem) => {
                    losses.lose(LostPart::Records, &self.path, start..end, problem.clone());
                }
            }
            last_start = Some(start);
            ControlFlow::Continue(())
        })?;
        let name = self.path.display().to_string();
        if !ends && let Some(start) = last_start {
            losses.note(format!(
                "{name}: the last row has no line break and may be cut off: it is not read"
            ));
            self.cut_at = Some(start);
            pending = pending.filter(|(at, _)| *at != start);
        }
        if let Some((_, time_ns)) = pending {
            counted.count(time_ns);
        }
        self.rows.counted = counted;
        if lacks_zone {
            losses.note(format!(
                "{name}: times are stated without a time zone: UTC is assumed"
            ));
        }
        for (column, (count, example)) in self.columns.names.iter().zip(odd) {
            if let Some(example) = example {
                losses.note(format!(
                    "{name}: column \"{}\": {count} cells are not numbers, for example \"{}\"",
                    column.escape_default(),
                    example.escape_default()
                ));
            }
        }
        Ok(())
    }

    fn ends_with_line_break(&self) -> Result<bool, Error> {
        let mut file = File::open(&self.data).map_err(Error::io(&self.path))?;
        let mut last = [b'\n'];
        if self.rows.bytes > 0 {
            file.seek(SeekFrom::End(-1))
                .map_err(Error::io(&self.path))?;
            file.read_exact(&mut last).map_err(Error::io(&self.path))?;
        }
        Ok(matches!(last, [b'\n' | b'\r']))
    }

    /// Calls `take` with every row, or what is wrong with it, and its bytes.
    fn each_row(&self, take: &mut TakeRow<'_>) -> Result<(), Error> {
        let file = File::open(&self.data).map_err(Error::io(&self.path))?;
        let mut reader = reader(file, self.separator);
        let width = self.columns.names.len() + 1;
        let mut row = ByteRecord::new();
        let mut cells = Vec::new();
        loop {
            let start = reader.position().byte();
            match reader.read_byte_record(&mut row) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => match error.into_kind() {
                    csv::ErrorKind::Io(source) => return Err(Error::io(&self.path)(source)),
                    _ => continue,
                },
            }
            let start = row.position().map_or(start, csv::Position::byte);
            let end = reader.position().byte();
            let time_text = String::from_utf8_lossy(row.get(self.time).unwrap_or_default());
            let parsed = if row.len() != width {
                Err(format!(
                    "expected a row of {width} cells, found {}",
                    row.len()
                ))
            } else if let Some(time_ns) = self.parse_time(&time_text) {
                cells.clear();
                let others = row.iter().enumerate().filter(|(at, _)| *at != self.time);
                cells.extend(others.map(|(_, cell)| self.cell(cell)));
                Ok((time_ns, cells.as_slice(), &*time_text))
            } else {
                Err(format!(
                    "expected a time, found \"{}\"",
                    time_text.escape_default()
                ))
            };
            if take(&parsed, start, end).is_break() {
                return Ok(());
            }
        }
    }

    fn parse_time(&self, text: &str) -> Option<i64> {
        let decimal_comma = self.separator != b',' && self.unit != Unit::Text;
        match decimal_comma {
            true => time::parse(&text.replace(',', "."), self.unit),
            false => time::parse(text, self.unit),
        }
    }

    fn cell(&self, bytes: &[u8]) -> Cell {
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim();
        let has_decimal_comma = self.separator != b',' && text.contains(',');
        let number = match has_decimal_comma {
            true => text.replace(',', ".").parse(),
            false => text.parse::<f64>(),
        };
        match number {
            Ok(number) if number.is_finite() => Cell::Number(number),
            _ => match text.to_ascii_lowercase().as_str() {
                "true" => Cell::Number(1.0),
                "false" => Cell::Number(0.0),
                text if MISSING.contains(&text) => Cell::Missing,
                _ => Cell::Other(text.to_owned()),
            },
        }
    }
}

/// A cell other than the time.
enum Cell {
    Number(f64),
    Missing,
    Other(String),
}

/// Time, cells and the time as written.
type Row<'r> = (i64, &'r [Cell], &'r str);
type TakeRow<'t> = dyn FnMut(&Result<Row<'_>, String>, u64, u64) -> ControlFlow<()> + 't;

fn reader(file: File, separator: u8) -> Reader<BufReader<File>> {
    ReaderBuilder::new()
        .delimiter(separator)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(BufReader::with_capacity(1 << 16, file))
}

impl FileReader for CsvReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        request.losses.integrity.checksums_absent = true;
        let mut flow = ControlFlow::Continue(());
        if !request.wants(self.rows.topic) {
            return Ok(flow);
        }
        let (mut message, mut values, mut count) = (Vec::new(), Vec::new(), 0);
        self.each_row(&mut |row, start, _| {
            if let (Ok((time_ns, cells, _)), true) = (row, self.cut_at != Some(start)) {
                values.clear();
                values.extend(cells.iter().map(|cell| match cell {
                    Cell::Number(number) => *number,
                    Cell::Missing | Cell::Other(_) => f64::NAN,
                }));
                flow = self
                    .rows
                    .visit(count, *time_ns, &values, &mut message, request);
                count += 1;
            }
            flow
        })?;
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.rows.counted.span_ns
    }
}
