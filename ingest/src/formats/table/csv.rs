//! Comma-separated values, or values separated by semicolons, tabs, bars or blanks.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    ops::ControlFlow,
    path::PathBuf,
};

use csv::{ByteRecord, Reader, ReaderBuilder};
use tipwatch_language::{say, word};

use super::{
    coarse_times::{CoarseTimes, HeldRows},
    columns::Columns,
    lost_rows::{LostRows, Place, Problem},
    rows::RowTopic,
};
use crate::{
    file::LogFile,
    formats::reader::{FileReader, Request},
    message::{Error, Losses, TopicTable},
    table::{
        BySignal, CounterTurns, DaysPassed, Kind, Mark, Refusal, TableOptions, TextTable,
        decimal_mark, grouped_once, is_ambiguous, join_blanks, number, with_unit,
    },
};

/// Enough for some hundred rows, by which the form of the times is found out.
const BEGINNING_BYTES: u64 = 64 << 10;
/// Cells that are empty by intent.
const MISSING: [&str; 7] = ["", "nan", "na", "n/a", "null", "none", "-"];

/// More lines are no text of a cell, but what an open quotation mark has swallowed.
const MOST_LINES_OF_A_CELL: usize = 16;
/// Most signals of a table with one in each row.
const MOST_SIGNALS: usize = 4096;

/// A table in text.
pub(crate) struct CsvReader {
    lines: Lines,
    rows: RowTopic,
    columns: Columns,
    /// Signals of a table in which each line has one signal.
    signals: Option<Signals>,
    /// Whether a mark in the numbers of a column stands between groups of digits, by column.
    grouped: Vec<bool>,
    /// Whether numbers of a column are read that have a unit behind them, by column.
    with_unit: Vec<bool>,
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
        let refused = |problem| Error::Table {
            path: path.to_path_buf(),
            problem,
        };
        let table = found.map_err(|refusal| {
            refused(match refusal {
                Refusal::Unclear(problem) => problem,
                Refusal::NotATable => "no line has the names of columns with a time among them; \
                    state it: --time-column NAME, or --no-header if there are no names"
                    .to_owned(),
            })
        })?;
        let mut lines = Lines {
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            table,
            cut_at: None,
        };
        lines.cut_at = lines.find_cut()?;
        let mut signals = None;
        let columns = match lines.table.by_signal.clone() {
            None => lines.columns(),
            Some(by) => {
                let found = Signals::find(&lines, by)?.map_err(refused)?;
                let columns = Columns::new(found.names(&lines.table.names), &found.units);
                signals = Some(found);
                columns
            }
        };
        for note in lines.table.notes.iter().chain(&columns.notes) {
            losses.note(format!("{}: {note}", path.display()));
        }
        let mut csv = Self {
            rows: RowTopic::register(&columns, bytes, topics),
            lines,
            columns,
            signals,
            grouped: Vec::new(),
            with_unit: Vec::new(),
        };
        csv.scan(losses)?;
        topics.add_messages(csv.rows.topic, Some(csv.rows.counted.rows));
        Ok(csv)
    }

    /// Counts the rows and reports what is wrong with them.
    fn scan(&mut self, losses: &mut Losses) -> Result<(), Error> {
        losses.integrity.checksums_absent = true;
        let mut odd = vec![OddCells::default(); self.columns.names.len()];
        let mut lacks_zone = false;
        let mut turns = 0_u64;
        let mut time_decimals = Decimals::default();
        let mut remarks = 0_u64;
        let mut times = CoarseTimes::default();
        let mut lost = LostRows::default();
        self.each_row(&mut |row, place| {
            match row {
                Ok(row) => {
                    lacks_zone |= row.lacks_zone;
                    turns += u64::from(row.begins_again);
                    (row.time_decimal.into_iter()).for_each(|mark| time_decimals.see(mark));
                    for (odd, cell) in odd.iter_mut().zip(row.cells) {
                        odd.count(cell);
                    }
                    times.count(row.time_ns, row.cells.iter().map(Cell::as_number));
                    lost.intact(row.time_ns);
                }
                Err(problem) if problem.is_remark() => remarks += 1,
                Err(problem) => lost.count(problem, &place),
            }
            ControlFlow::Continue(())
        })?;
        let path = &self.lines.path;
        lost.report(path, losses);
        let name = path.display().to_string();
        if self.lines.cut_at.is_some() {
            losses.note(say!(
                "{name}: the last row has no line break and may be cut off: it is not read"
            ));
        }
        if remarks > 0 {
            losses.note(say!(
                "{name}: {remarks} lines are no rows: they begin with # or repeat the names of the columns"
            ));
        }
        self.rows.counted = times.finish(path, losses);
        if turns > 0 {
            losses.note(say!(
                "{name}: the time falls back as a counter that begins again at 0, or by an hour as at the end of summer time ({turns} times): its times \
                 go on"
            ));
        }
        if lacks_zone {
            losses.note(say!(
                "{name}: times are stated without a time zone: UTC is assumed"
            ));
        }
        let decimals = odd.iter().map(|odd| odd.decimals);
        let decimals = decimals.fold(time_decimals, Decimals::and);
        self.grouped = odd.iter().map(|odd| odd.is_grouped(decimals)).collect();
        let grouped = &self.grouped;
        note_grouped(&name, &self.columns.names, (&odd, grouped), losses);
        for (odd, _) in odd.iter_mut().zip(grouped).filter(|(_, is)| !**is) {
            odd.count += odd.only_grouped;
        }
        self.with_unit = odd.iter_mut().map(OddCells::has_one_unit).collect();
        note_units(&name, (&self.columns.names, &odd), losses);
        note_odd_cells(&name, &self.columns.names, &odd, losses);
        Ok(())
    }

    /// Calls `take` with every row, or what is wrong with it, and its place. Where each line has one signal, the lines of one
    /// time are a row.
    fn each_row(&self, take: &mut TakeRow<'_>) -> Result<(), Error> {
        let Some(signals) = &self.signals else {
            return self
                .lines
                .each(&mut |line, place| take(line.map(|line| line.row), place));
        };
        let width = self.columns.names.len();
        let mut open: Option<JoinedRow> = None;
        let mut flow = ControlFlow::Continue(());
        self.lines.each(&mut |line, place| {
            flow = match line.and_then(|line| signals.read(&line, &self.lines)) {
                Err(problem) => match open.take().map(|before| before.show(take)) {
                    Some(ControlFlow::Break(())) => ControlFlow::Break(()),
                    _ => take(Err(problem), place),
                },
                Ok(read) => match &mut open {
                    Some(joined) if joined.takes(&read) => {
                        joined.add(read, place);
                        ControlFlow::Continue(())
                    }
                    _ => match open.replace(JoinedRow::new(read, place, width)) {
                        Some(done) => done.show(take),
                        None => ControlFlow::Continue(()),
                    },
                },
            };
            flow
        })?;
        if let (ControlFlow::Continue(()), Some(done)) = (flow, open) {
            let _ = done.show(take);
        }
        Ok(())
    }
}

/// The lines of a table.
struct Lines {
    path: PathBuf,
    data: PathBuf,
    table: TextTable,
    /// Position of the last line, if no line break ends it.
    cut_at: Option<u64>,
}

impl Lines {
    /// Every column but the time.
    fn columns(&self) -> Columns {
        let table = &self.table;
        let is_value = |(at, _): &(usize, &String)| !table.time.columns.contains(at);
        let values = || table.names.iter().enumerate().filter(is_value);
        let unit = |at: usize| table.units.get(at).map_or("", String::as_str).to_owned();
        Columns::new(
            values().map(|(_, name)| name.clone()).collect(),
            &values().map(|(at, _)| unit(at)).collect::<Vec<_>>(),
        )
    }

    /// Finds the position of the last line, if no line break ends it.
    fn find_cut(&self) -> Result<Option<u64>, Error> {
        let mut file = File::open(&self.data).map_err(Error::io(&self.path))?;
        let bytes = file.metadata().map_err(Error::io(&self.path))?.len();
        let mut last = [b'\n'];
        if bytes > 0 {
            file.seek(SeekFrom::End(-1))
                .map_err(Error::io(&self.path))?;
            file.read_exact(&mut last).map_err(Error::io(&self.path))?;
        }
        let mut start = None;
        if !matches!(last, [b'\n' | b'\r']) {
            self.each(&mut |_, place| {
                start = Some(place.bytes.start);
                ControlFlow::Continue(())
            })?;
        }
        Ok(start)
    }

    /// Calls `take` with every line that is whole, or what is wrong with it, and its place.
    fn each(&self, take: &mut TakeLine<'_>) -> Result<(), Error> {
        let table = &self.table;
        let mut file = File::open(&self.data).map_err(Error::io(&self.path))?;
        file.seek(SeekFrom::Start(table.rows_at))
            .map_err(Error::io(&self.path))?;
        let mut reader = reader(file, table.separator);
        let mut row = ByteRecord::new();
        let mut cells = Vec::new();
        let mut passed = (DaysPassed::default(), CounterTurns::default());
        let mut has_other_columns = false;
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
            row = join_blanks(row, table.separator);
            let start = row.position().unwrap_or(&before);
            let place = Place {
                bytes: table.rows_at + start.byte()..table.rows_at + reader.position().byte(),
                line: table.lines_before + start.line(),
            };
            if self.cut_at == Some(place.bytes.start) {
                return Ok(());
            }
            let is_remark = self.is_remark(&row);
            if let Some(next) = self.behind_open_quote(&row, &place)? {
                let mut position = reader.position().clone();
                position
                    .set_byte(next - table.rows_at)
                    .set_line(start.line() + 1);
                let problem = match is_remark {
                    true => Problem::remark(),
                    false => Problem {
                        kind: "quote",
                        text: word!(
                            "expected a quotation mark at the end of a cell, found the end of the line"
                        )
                        .to_owned(),
                    },
                };
                let of_line = Place {
                    bytes: place.bytes.start..next,
                    line: place.line,
                };
                reader
                    .seek_raw(SeekFrom::Start(next), position)
                    .map_err(|error| Error::io(&self.path)(error.into()))?;
                if take(Err(problem), of_line).is_break() {
                    return Ok(());
                }
                continue;
            }
            if is_remark {
                if take(Err(Problem::remark()), place).is_break() {
                    return Ok(());
                }
                continue;
            }
            cells.clear();
            let mut line = self.read(&row, &mut cells, &mut passed);
            if has_other_columns || line.is_err() {
                let names = self.names_columns(&row);
                has_other_columns = names.unwrap_or(has_other_columns);
                // a recorder that starts again
                if names == Some(false) || !has_other_columns && self.is_units(&row) {
                    line = Err(Problem::remark());
                }
            }
            if has_other_columns {
                line = Err(Problem {
                    kind: "columns",
                    text: word!(
                        "expected the columns that the table begins with, found a line that names others or puts them in another \
                         order"
                    )
                    .to_owned(),
                });
            }
            if take(line, place).is_break() {
                return Ok(());
            }
        }
    }

    /// Whether a line is a remark: it begins with `#` and lacks the cells of a row, whose first cell may be "#N/A" or "#1", or it
    /// names the columns again.
    fn is_remark(&self, record: &ByteRecord) -> bool {
        let Some(first) = record
            .get(0)
            .and_then(|cell| cell.trim_ascii_start().strip_prefix(b"#"))
        else {
            return false;
        };
        let names = &self.table.names;
        let is_name = |name: &String| !name.is_empty() && name.as_bytes() == first.trim_ascii();
        record.len() != names.len() || names.first().is_some_and(is_name)
    }

    /// Returns whether a line that names the columns names others than the first such line, or in another order; `None` for a
    /// row.
    fn names_columns(&self, record: &ByteRecord) -> Option<bool> {
        let names = &self.table.names;
        let time = names.get(*self.table.time.columns.first()?)?.as_bytes();
        // the columns of a table without a line of names are called c1, c2, ..
        let is_name = |cell: &[u8]| !time.is_empty() && cell.trim_ascii() == time;
        record.iter().any(is_name).then(|| {
            let cells = record.iter().take(names.len()).map(<[u8]>::trim_ascii);
            !cells.eq(names.iter().map(String::as_bytes))
        })
    }

    /// Whether a line repeats the line of units below the names of the columns.
    fn is_units(&self, record: &ByteRecord) -> bool {
        let units = &self.table.units;
        let of_line = record.iter().map(<[u8]>::trim_ascii);
        !units.is_empty() && of_line.eq(units.iter().map(|unit| unit.trim().as_bytes()))
    }

    /// Finds the position of the next line, if a quotation mark in this one has swallowed others: a record of several lines that
    /// has not as many cells as there are columns, or far too many lines.
    fn behind_open_quote(&self, record: &ByteRecord, place: &Place) -> Result<Option<u64>, Error> {
        let breaks = record
            .iter()
            .flatten()
            .filter(|byte| **byte == b'\n')
            .count();
        let is_remark = record.len() == self.table.names.len() && breaks <= MOST_LINES_OF_A_CELL;
        if breaks == 0 || is_remark {
            return Ok(None);
        }
        let mut file = File::open(&self.data).map_err(Error::io(&self.path))?;
        file.seek(SeekFrom::Start(place.bytes.start))
            .map_err(Error::io(&self.path))?;
        let mut line = Vec::new();
        let read = BufReader::new(file).read_until(b'\n', &mut line);
        read.map_err(Error::io(&self.path))?;
        let next = place.bytes.start + line.len() as u64;
        Ok((next < place.bytes.end).then_some(next))
    }

    fn read<'c>(
        &self,
        record: &'c ByteRecord,
        cells: &'c mut Vec<Cell>,
        (days, turns): &mut (DaysPassed, CounterTurns),
    ) -> Result<Line<'c>, Problem> {
        let width = self.table.names.len();
        // a separator at the end of a row begins no cell
        let is_longer = record
            .iter()
            .skip(width)
            .any(|cell| !cell.trim_ascii().is_empty());
        if record.len() < self.table.least_cells || is_longer {
            return Err(Problem {
                kind: "cells",
                text: say!("expected a row of {width} cells, found {}", record.len()),
            });
        }
        let time = &self.table.time;
        let texts = time
            .columns
            .iter()
            .map(|&at| record.get(at).unwrap_or_default());
        let texts: Vec<_> = texts.map(String::from_utf8_lossy).collect();
        let texts: Vec<&str> = texts.iter().map(|text| &**text).collect();
        let Some(time_ns) = time.read(&texts, self.table.has_decimal_comma) else {
            // a block of zeros before a row is a part of its first cell
            const MOST_SHOWN: usize = 40;
            let found: String = texts.join(" ").chars().take(MOST_SHOWN).collect();
            let advice = match is_ambiguous(&found) {
                true => {
                    word!(", which can be day or month first: --date-order dmy or mdy states it")
                }
                false => "",
            };
            return Err(Problem {
                kind: "time",
                text: say!(
                    "expected a time, found \"{}\"{advice}",
                    found.escape_debug()
                ),
            });
        };
        let lacks_zone = time.lacks_zone(&texts);
        let (time_ns, begins_again) = match time.kind {
            Kind::TimeOfDay => (days.after(time_ns), false),
            Kind::Multiples(_) => turns.after(time_ns, time.kind),
            Kind::Text(_) if lacks_zone => turns.after(time_ns, time.kind),
            Kind::Text(_) | Kind::SpreadsheetDays => (time_ns, false),
        };
        let is_number = matches!(time.kind, Kind::Multiples(_) | Kind::SpreadsheetDays);
        let time_decimal = texts.first().filter(|_| is_number);
        let time_decimal = time_decimal.and_then(|text| decimal_mark(text));
        if self.table.by_signal.is_none() {
            let missing = std::iter::repeat(&b""[..]);
            let values = record.iter().chain(missing).take(width).enumerate();
            let values = values.filter(|(at, _)| !time.columns.contains(at));
            cells.extend(values.map(|(_, cell)| self.cell(cell)));
        }
        Ok(Line {
            record,
            row: Row {
                time_ns,
                cells,
                lacks_zone,
                begins_again,
                time_decimal,
            },
        })
    }

    fn cell(&self, bytes: &[u8]) -> Cell {
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim();
        let has_decimal_comma = self.table.has_decimal_comma;
        let plain = number(text, has_decimal_comma);
        // between cells that commas separate a point can only be a decimal mark
        let may_be = |mark| has_decimal_comma || mark == Mark::Comma;
        if let Some((whole, mark)) = grouped_once(text).filter(|(_, mark)| may_be(*mark)) {
            return Cell::Grouped { whole, plain, mark };
        }
        match plain {
            Some(number) => Cell::Number {
                number,
                decimal: decimal_mark(text),
                digits: text.bytes().filter(u8::is_ascii_digit).count(),
            },
            None => match text.to_ascii_lowercase().as_str() {
                "true" => Cell::whole(1.0),
                "false" => Cell::whole(0.0),
                lower if MISSING.contains(&lower) => Cell::Missing,
                _ => match with_unit(text, has_decimal_comma) {
                    Some((number, unit)) => Cell::WithUnit(number, unit.to_owned()),
                    None => Cell::Other(text.to_owned()),
                },
            },
        }
    }
}

/// The signals of a table with one in each line.
struct Signals {
    by: BySignal,
    /// The place of each by its name.
    places: BTreeMap<String, usize>,
    /// The first unit that is stated of each.
    units: Vec<String>,
}

impl Signals {
    /// Finds the signals of all lines, in the order of their first lines.
    ///
    /// # Errors
    /// Outside: the file cannot be read. Inside: the table cannot be read in the order of its times, or has too many signals.
    fn find(lines: &Lines, by: BySignal) -> Result<Result<Self, String>, Error> {
        let mut found = Self {
            by,
            places: BTreeMap::new(),
            units: Vec::new(),
        };
        let (mut last, mut runs, mut falls) = (None, 0, 0);
        lines.each(&mut |line, _| {
            let Ok(line) = line else {
                return ControlFlow::Continue(());
            };
            let name = found.name(&line);
            let place = match found.places.get(&name) {
                Some(&place) => place,
                None => {
                    let place = found.places.len();
                    found.places.insert(name, place);
                    let unit = found.by.unit.and_then(|unit| line.record.get(unit));
                    let unit = String::from_utf8_lossy(unit.unwrap_or_default());
                    let units = found.by.values.iter().map(|_| unit.trim().to_owned());
                    found.units.extend(units);
                    place
                }
            };
            let time_ns = line.row.time_ns;
            if let Some((of, before_ns)) = last.replace((place, time_ns)) {
                runs += usize::from(of != place);
                falls += usize::from(time_ns < before_ns);
            }
            match found.units.len() > MOST_SIGNALS {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })?;
        let count = found.places.len();
        Ok(match count {
            _ if found.units.len() > MOST_SIGNALS => Err(format!(
                "each row has one signal: expected at most {MOST_SIGNALS} of them, found more"
            )),
            _ if falls > 0 && runs + 1 == count => Err(format!(
                "each row has one signal, and one follows the other: expected rows in the order of their times, found the {count} \
                 signals one after the other; sort the rows by their times"
            )),
            _ => Ok(found),
        })
    }

    /// The name of the signal of a line; that of its sensor, if each line has several values.
    fn name(&self, line: &Line<'_>) -> String {
        let part = |&at: &usize| {
            let text = line.record.get(at).unwrap_or_default().trim_ascii();
            String::from_utf8_lossy(text)
        };
        self.by.names.iter().map(part).collect::<Vec<_>>().join(".")
    }

    /// Returns the names of the columns by place: the values of the first name, then those of the second one, and so on.
    fn names(&self, columns: &[String]) -> Vec<String> {
        let mut names = vec![String::new(); self.units.len()];
        let values = self.by.values.as_slice();
        for (name, &place) in &self.places {
            for (value, &at) in values.iter().enumerate() {
                names[place * values.len() + value] = match values {
                    [_] => name.clone(),
                    _ => format!("{name}.{}", columns[at]),
                };
            }
        }
        names
    }

    fn read(&self, line: &Line<'_>, lines: &Lines) -> Result<OneSignal, Problem> {
        let name = self.name(line);
        let Some(&place) = self.places.get(&name) else {
            return Err(Problem {
                kind: "signal",
                text: say!(
                    "expected the name of a signal, found \"{}\"",
                    name.escape_debug()
                ),
            });
        };
        Ok(OneSignal {
            time_ns: line.row.time_ns,
            lacks_zone: line.row.lacks_zone,
            begins_again: line.row.begins_again,
            first_column: place * self.by.values.len(),
            cells: (self.by.values.iter())
                .map(|&at| lines.cell(line.record.get(at).unwrap_or_default()))
                .collect(),
        })
    }
}

/// A line with one signal, or with the values of one sensor.
struct OneSignal {
    time_ns: i64,
    lacks_zone: bool,
    begins_again: bool,
    first_column: usize,
    cells: Vec<Cell>,
}

/// The signals of lines of one time.
struct JoinedRow {
    time_ns: i64,
    cells: Vec<Cell>,
    lacks_zone: bool,
    begins_again: bool,
    place: Place,
}

impl JoinedRow {
    fn new(first: OneSignal, place: Place, width: usize) -> Self {
        let mut cells = Vec::with_capacity(width);
        cells.resize_with(width, || Cell::Missing);
        let mut joined = Self {
            time_ns: first.time_ns,
            cells,
            lacks_zone: first.lacks_zone,
            begins_again: first.begins_again,
            place: place.clone(),
        };
        joined.add(first, place);
        joined
    }

    /// Whether a signal has the time of this row, and its cells are still empty.
    fn takes(&self, next: &OneSignal) -> bool {
        let mut cells = self
            .cells
            .iter()
            .skip(next.first_column)
            .take(next.cells.len());
        next.time_ns == self.time_ns && cells.all(|cell| matches!(cell, Cell::Missing))
    }

    fn add(&mut self, next: OneSignal, place: Place) {
        let cells = self.cells.iter_mut().skip(next.first_column);
        cells.zip(next.cells).for_each(|(cell, next)| *cell = next);
        self.place.bytes.end = place.bytes.end;
    }

    fn show(self, take: &mut TakeRow<'_>) -> ControlFlow<()> {
        let row = Row {
            time_ns: self.time_ns,
            cells: &self.cells,
            lacks_zone: self.lacks_zone,
            begins_again: self.begins_again,
            time_decimal: None,
        };
        take(Ok(row), self.place)
    }
}

/// A cell other than the time.
enum Cell {
    Number {
        number: f64,
        /// The mark before its decimals.
        decimal: Option<Mark>,
        digits: usize,
    },
    /// A number that is `whole` if its mark stands between groups of digits, else `plain`.
    Grouped {
        whole: f64,
        plain: Option<f64>,
        mark: Mark,
    },
    /// A number and the unit behind it.
    WithUnit(f64, String),
    Missing,
    Other(String),
}

impl Cell {
    fn whole(number: f64) -> Self {
        Self::Number {
            number,
            decimal: None,
            digits: 0,
        }
    }

    /// The number, to compare it with others of its column: a mark that may stand between groups of digits does. NaN for none.
    fn as_number(&self) -> f64 {
        match self {
            Self::Number { number, .. } | Self::WithUnit(number, _) => *number,
            Self::Grouped { whole, .. } => *whole,
            Self::Missing | Self::Other(_) => f64::NAN,
        }
    }
}

struct Row<'c> {
    time_ns: i64,
    cells: &'c [Cell],
    /// Whether the date of the row has no time zone.
    lacks_zone: bool,
    /// Whether its time falls back as a counter that begins again at 0, or as at the end of summer time.
    begins_again: bool,
    /// The mark before the decimals of its time, if that is a number.
    time_decimal: Option<Mark>,
}

/// A line of the file; its row has no cells where each line has one signal.
struct Line<'c> {
    record: &'c ByteRecord,
    row: Row<'c>,
}

type TakeLine<'t> = dyn FnMut(Result<Line<'_>, Problem>, Place) -> ControlFlow<()> + 't;
type TakeRow<'t> = dyn FnMut(Result<Row<'_>, Problem>, Place) -> ControlFlow<()> + 't;

/// Decimal marks of numbers that can be read in one way only.
#[derive(Debug, Clone, Copy, Default)]
struct Decimals {
    point: bool,
    comma: bool,
}

impl Decimals {
    fn see(&mut self, mark: Mark) {
        match mark {
            Mark::Point => self.point = true,
            Mark::Comma => self.comma = true,
        }
    }

    fn have(self, mark: Mark) -> bool {
        match mark {
            Mark::Point => self.point,
            Mark::Comma => self.comma,
        }
    }

    fn and(self, other: Self) -> Self {
        Self {
            point: self.point || other.point,
            comma: self.comma || other.comma,
        }
    }
}

/// The cells of a column that are neither numbers nor empty by intent, and what its marks can be.
#[derive(Debug, Clone, Default)]
struct OddCells {
    count: u64,
    example: String,
    has_number: bool,
    decimals: Decimals,
    /// Numbers whose mark may stand between groups of digits, that mark, and how many of them are no numbers otherwise.
    grouped: u64,
    mark: Option<Mark>,
    only_grouped: u64,
    /// Whether the column has whole numbers of three digits without a mark, and of more.
    has_hundreds: bool,
    has_thousands: bool,
    /// Cells with a unit behind their number: how many, the first one's unit, and whether others have another.
    with_unit: u64,
    unit: Option<String>,
    has_other_unit: bool,
}

impl OddCells {
    fn count(&mut self, cell: &Cell) {
        match cell {
            Cell::Other(text) => {
                if self.count == 0 {
                    self.example = text.chars().take(20).collect();
                }
                self.count += 1;
                if text.contains(',') {
                    self.decimals.see(Mark::Comma);
                }
            }
            Cell::Number {
                number,
                decimal,
                digits,
            } => {
                self.has_number = true;
                if let Some(mark) = decimal {
                    self.decimals.see(*mark);
                } else if number.fract() == 0.0 {
                    self.has_hundreds |= *digits == 3;
                    self.has_thousands |= *digits > 3;
                }
            }
            Cell::Grouped { whole, plain, mark } => {
                if plain.is_none() && self.example.is_empty() {
                    let whole = whole.abs() as u64;
                    self.example = format!("{},{:03}", whole / 1000, whole % 1000);
                }
                // with both marks one of them stands before decimals
                if self.mark.is_some_and(|other| other != *mark) {
                    self.decimals.see(*mark);
                    self.decimals.see(mark.other());
                }
                self.mark = Some(*mark);
                self.grouped += 1;
                self.only_grouped += u64::from(plain.is_none());
                self.has_number |= plain.is_some();
            }
            Cell::WithUnit(number, unit) => {
                if self.count == 0 && self.example.is_empty() {
                    self.example = format!("{number} {unit}");
                }
                self.with_unit += 1;
                let first = self.unit.get_or_insert_with(|| unit.clone());
                self.has_other_unit |= first != unit;
            }
            Cell::Missing => {}
        }
    }

    /// Whether the numbers with units have one unit. Of several none is read: they are counted as cells that are not numbers.
    fn has_one_unit(&mut self) -> bool {
        if self.has_other_unit {
            self.count += self.with_unit;
            return false;
        }
        self.has_number |= self.with_unit > 0;
        self.with_unit > 0
    }

    /// Whether the marks in the column's numbers stand between groups of digits. The column itself decides, else the decimals of
    /// the whole table, else whole numbers below a thousand without a mark.
    fn is_grouped(&self, table: Decimals) -> bool {
        let Some(mark) = self.mark else {
            return false;
        };
        let other = mark.other();
        if self.decimals.have(mark) || self.decimals.have(other) {
            !self.decimals.have(mark)
        } else if self.only_grouped == self.grouped {
            true
        } else if table.have(mark) != table.have(other) {
            table.have(other)
        } else {
            self.has_hundreds && !self.has_thousands
        }
    }
}

/// Names the columns whose numbers have marks between groups of digits.
fn note_grouped(
    name: &str,
    columns: &[String],
    (odd, grouped): (&[OddCells], &[bool]),
    losses: &mut Losses,
) {
    let columns = columns.iter().zip(odd).zip(grouped);
    for ((column, odd), _) in columns.filter(|(_, is_grouped)| **is_grouped) {
        losses.note(say!(
            "{name}: column \"{}\": the mark in {} numbers is taken for one between thousands and hundreds",
            column.escape_debug(),
            odd.grouped
        ));
    }
}

/// Names the units that are left out behind the numbers of columns, and the columns that have several.
fn note_units(name: &str, (columns, odd): (&[String], &[OddCells]), losses: &mut Losses) {
    for (column, odd) in columns.iter().zip(odd) {
        let (Some(unit), column) = (&odd.unit, column.escape_debug()) else {
            continue;
        };
        let unit = unit.escape_debug();
        losses.note(match odd.has_other_unit {
            false => say!(
                "{name}: column \"{column}\": the unit \"{unit}\" behind its numbers is left out: scale of the machine file converts them"
            ),
            true => say!(
                "{name}: column \"{column}\": expected one unit behind its numbers, found \"{unit}\" and others: no number with a unit is read"
            ),
        });
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
        losses.note(say!(
            "{name}: columns of texts are not read: {}",
            texts.join(", ")
        ));
    }
    for (column, odd) in odd().filter(|(_, odd)| odd.has_number) {
        losses.note(say!(
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
        let mut held = HeldRows::new(self.rows.counted.spread);
        let mut visit = |time_ns: i64, values: &[f64]| {
            let flow = self
                .rows
                .visit(count, time_ns, values, &mut message, request);
            count += 1;
            flow
        };
        self.each_row(&mut |row, _| {
            if let Ok(row) = row {
                values.clear();
                let cells = row.cells.iter().zip(&self.grouped).zip(&self.with_unit);
                values.extend(cells.map(|((cell, &is_grouped), &with_unit)| match cell {
                    Cell::Number { number, .. } => *number,
                    Cell::WithUnit(number, _) if with_unit => *number,
                    Cell::Grouped { whole, .. } if is_grouped => *whole,
                    Cell::Grouped { plain, .. } => plain.unwrap_or(f64::NAN),
                    Cell::WithUnit(..) | Cell::Missing | Cell::Other(_) => f64::NAN,
                }));
                flow = held.push(row.time_ns, &values, &mut visit);
            }
            flow
        })?;
        if flow.is_continue() {
            flow = held.end(&mut visit);
        }
        Ok(flow)
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.rows.counted.span_ns
    }
}
