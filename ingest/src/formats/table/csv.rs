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
    lost_rows::{LostRows, Place, Problem},
    rows::{Counted, RowTopic},
};
use crate::{
    file::LogFile,
    formats::reader::{FileReader, Request},
    message::{Error, Losses, TopicTable},
    table::{Refusal, TableOptions, TextTable, number},
};

/// Enough for some hundred rows, by which the form of the times is found out.
const BEGINNING_BYTES: u64 = 64 << 10;
/// Cells that are empty by intent.
const MISSING: [&str; 7] = ["", "nan", "na", "n/a", "null", "none", "-"];

/// A table in text.
pub(crate) struct CsvReader {
    path: PathBuf,
    data: PathBuf,
    table: TextTable,
    rows: RowTopic,
    columns: Columns,
    /// Where the last row begins, if no line break ends it.
    cut_at: Option<u64>,
}

impl CsvReader {
    pub(crate) fn open(
        file: &LogFile,
        options: &TableOptions,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = file.path();
        let source = File::open(file.data()).map_err(Error::io(path))?;
        let bytes = source.metadata().map_err(Error::io(path))?.len();
        let mut beginning = Vec::new();
        let read = source.take(BEGINNING_BYTES).read_to_end(&mut beginning);
        read.map_err(Error::io(path))?;
        let is_whole = beginning.len() as u64 == bytes;
        let found = TextTable::find(&beginning, is_whole, options);
        let table = found.map_err(|refusal| Error::Table {
            path: path.to_path_buf(),
            problem: match refusal {
                Refusal::Unclear(problem) => problem,
                Refusal::NotATable => "no line has the names of columns with a time among them; \
                    state it: --time-column NAME, or --no-header if there are no names"
                    .to_owned(),
            },
        })?;
        let is_value = |(at, _): &(usize, &String)| !table.time.columns.contains(at);
        let values = || table.names.iter().enumerate().filter(is_value);
        let unit = |at: usize| table.units.get(at).map_or("", String::as_str).to_owned();
        let columns = Columns::new(
            values().map(|(_, name)| name.clone()).collect(),
            &values().map(|(at, _)| unit(at)).collect::<Vec<_>>(),
        );
        for note in &table.notes {
            losses.note(format!("{}: {note}", path.display()));
        }
        let mut csv = Self {
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            table,
            rows: RowTopic::register(&columns, bytes, topics),
            columns,
            cut_at: None,
        };
        csv.scan(losses)?;
        topics.add_messages(csv.rows.topic, Some(csv.rows.counted.rows));
        Ok(csv)
    }

    /// Counts the rows and reports what is wrong with them.
    fn scan(&mut self, losses: &mut Losses) -> Result<(), Error> {
        losses.integrity.checksums_absent = true;
        let ends = self.ends_with_line_break()?;
        let mut odd = vec![OddCells::default(); self.columns.names.len()];
        let mut lacks_zone = false;
        let mut last_start = None;
        let mut counted = Counted::default();
        let mut lost = LostRows::default();
        // of the last row, which may be cut off
        let mut pending = None;
        self.each_row(&mut |row, place| {
            match row {
                Ok(row) => {
                    lacks_zone |= row.lacks_zone;
                    for (odd, cell) in odd.iter_mut().zip(row.cells) {
                        odd.count(cell);
                    }
                    if let Some((_, time_ns)) = pending.replace((place.bytes.start, row.time_ns)) {
                        counted.count(time_ns);
                    }
                }
                Err(problem) => lost.count(problem, &place),
            }
            last_start = Some(place.bytes.start);
            ControlFlow::Continue(())
        })?;
        lost.report(&self.path, losses);
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
        note_odd_cells(&name, &self.columns.names, &odd, losses);
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

    /// Calls `take` with every row, or what is wrong with it, and its place.
    fn each_row(&self, take: &mut TakeRow<'_>) -> Result<(), Error> {
        let table = &self.table;
        let mut file = File::open(&self.data).map_err(Error::io(&self.path))?;
        file.seek(SeekFrom::Start(table.rows_at))
            .map_err(Error::io(&self.path))?;
        let mut reader = reader(file, table.separator);
        let mut row = ByteRecord::new();
        let mut cells = Vec::new();
        loop {
            let before = reader.position().clone();
            match reader.read_byte_record(&mut row) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => match error.into_kind() {
                    csv::ErrorKind::Io(source) => return Err(Error::io(&self.path)(source)),
                    _ => continue,
                },
            }
            let start = row.position().unwrap_or(&before);
            let place = Place {
                bytes: table.rows_at + start.byte()..table.rows_at + reader.position().byte(),
                line: table.lines_before + start.line(),
            };
            cells.clear();
            if take(self.row(&row, &mut cells), place).is_break() {
                return Ok(());
            }
        }
    }

    fn row<'c>(&self, row: &ByteRecord, cells: &'c mut Vec<Cell>) -> Result<Row<'c>, Problem> {
        let width = self.table.names.len();
        // a separator at the end of a row begins no cell
        let is_longer = row
            .iter()
            .skip(width)
            .any(|cell| !cell.trim_ascii().is_empty());
        if row.len() < width || is_longer {
            return Err(Problem {
                kind: "cells",
                text: format!("expected a row of {width} cells, found {}", row.len()),
            });
        }
        let time = &self.table.time;
        let texts = time
            .columns
            .iter()
            .map(|&at| row.get(at).unwrap_or_default());
        let texts: Vec<_> = texts.map(String::from_utf8_lossy).collect();
        let texts: Vec<&str> = texts.iter().map(|text| &**text).collect();
        let Some(time_ns) = time.read(&texts, self.table.has_decimal_comma) else {
            return Err(Problem {
                kind: "time",
                text: format!(
                    "expected a time, found \"{}\"",
                    texts.join(" ").escape_debug()
                ),
            });
        };
        let values = row.iter().take(width).enumerate();
        let values = values.filter(|(at, _)| !time.columns.contains(at));
        cells.extend(values.map(|(_, cell)| self.cell(cell)));
        Ok(Row {
            time_ns,
            cells,
            lacks_zone: time.lacks_zone(&texts),
        })
    }

    fn cell(&self, bytes: &[u8]) -> Cell {
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim();
        match number(text, self.table.has_decimal_comma) {
            Some(number) => Cell::Number(number),
            None => match text.to_ascii_lowercase().as_str() {
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

struct Row<'c> {
    time_ns: i64,
    cells: &'c [Cell],
    /// Whether its date has no time zone.
    lacks_zone: bool,
}

type TakeRow<'t> = dyn FnMut(Result<Row<'_>, Problem>, Place) -> ControlFlow<()> + 't;

/// The cells of a column that are neither numbers nor empty by intent.
#[derive(Debug, Clone, Default)]
struct OddCells {
    count: u64,
    example: String,
    has_number: bool,
}

impl OddCells {
    fn count(&mut self, cell: &Cell) {
        match cell {
            Cell::Other(text) => {
                if self.count == 0 {
                    self.example = text.chars().take(20).collect();
                }
                self.count += 1;
            }
            Cell::Number(_) => self.has_number = true,
            Cell::Missing => {}
        }
    }
}

/// Names the columns with cells that are not numbers: those of texts in one line.
fn note_odd_cells(name: &str, columns: &[String], odd: &[OddCells], losses: &mut Losses) {
    let odd = || columns.iter().zip(odd).filter(|(_, odd)| odd.count > 0);
    let texts = odd().filter(|(_, odd)| !odd.has_number);
    let texts: Vec<String> = texts
        .map(|(column, odd)| {
            let (column, example) = (column.escape_debug(), odd.example.escape_debug());
            format!("\"{column}\" (\"{example}\")")
        })
        .collect();
    if !texts.is_empty() {
        losses.note(format!(
            "{name}: columns of texts are not read: {}",
            texts.join(", ")
        ));
    }
    for (column, odd) in odd().filter(|(_, odd)| odd.has_number) {
        losses.note(format!(
            "{name}: column \"{}\": {} cells are not numbers, for example \"{}\"",
            column.escape_debug(),
            odd.count,
            odd.example.escape_debug()
        ));
    }
}

fn reader(file: File, separator: u8) -> Reader<BufReader<File>> {
    ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
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
        self.each_row(&mut |row, place| {
            if let (Ok(row), true) = (row, self.cut_at != Some(place.bytes.start)) {
                values.clear();
                values.extend(row.cells.iter().map(|cell| match cell {
                    Cell::Number(number) => *number,
                    Cell::Missing | Cell::Other(_) => f64::NAN,
                }));
                let time_ns = row.time_ns;
                flow = self
                    .rows
                    .visit(count, time_ns, &values, &mut message, request);
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
