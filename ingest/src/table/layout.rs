//! The layout of a table in text: its separator, what stands before its rows, the names and units of its columns, and
//! which of them is the time. All of it is found in the first bytes of the file.

use std::collections::{BTreeMap, BTreeSet};

use tipwatch_language::say;

use super::{
    date,
    number::number,
    options::TableOptions,
    time::{self, TableHead, TimeSource},
};

/// Separators of cells; blanks separate only what nothing else does.
const SEPARATORS: [u8; 5] = [b',', b';', b'\t', b'|', b' '];
/// Lines before the names, at most.
const MOST_PREAMBLE: usize = 200;
/// Lines between the names and the first row, at most: units, types, descriptions.
const MOST_BELOW: usize = 3;
/// Rows that are looked at.
const MOST_ROWS: usize = 200;
const MARK: &str = "\u{feff}";

/// The layout of a table in text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TextTable {
    pub(crate) separator: u8,
    /// Whether commas in numbers are decimal points.
    pub(crate) has_decimal_comma: bool,
    /// Offset of the first row.
    pub(crate) rows_at: u64,
    /// Number of lines before the first row.
    pub(crate) lines_before: u64,
    /// Names of all columns; those of a nameless last one are left out.
    pub(crate) names: Vec<String>,
    /// Cells of a whole row, at least: some programs end a row with its last cell that is not empty.
    pub(crate) least_cells: usize,
    /// Units by a line below the names; empty without one.
    pub(crate) units: Vec<String>,
    pub(crate) time: TimeSource,
    /// Columns of a table in which each row has one signal; `None` where each column has one.
    pub(crate) by_signal: Option<BySignal>,
    /// Assumptions about the layout, for the notes of the log.
    pub(crate) notes: Vec<String>,
}

/// The columns of a table with one signal in each row, such as databases of time series export: `time,signal,value`; or with one
/// sensor or axis in each row: `time,sensor,axis,value`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BySignal {
    /// Columns that together name the signal.
    pub(crate) names: Vec<usize>,
    /// Columns with the values of the signal: of several, each is a signal of its own.
    pub(crate) values: Vec<usize>,
    pub(crate) unit: Option<usize>,
}

/// Names of the columns of a table with one signal in each row, in lower case, only letters and digits.
const SIGNAL_NAMES: [&str; 12] = [
    "signal",
    "signalname",
    "channel",
    "channelname",
    "variable",
    "variablename",
    "parameter",
    "field",
    "tag",
    "tagname",
    "name",
    "metric",
];
const VALUES: [&str; 4] = ["value", "val", "reading", "wert"];
const UNITS: [&str; 4] = ["unit", "units", "uom", "einheit"];

/// The columns with the name and the value of a signal, among those of texts and those of numbers.
pub(crate) fn signal_and_value<'n>(
    texts: &[&'n str],
    numbers: &[&'n str],
) -> Option<(&'n str, &'n str)> {
    let called = |names: &[&'n str], known: &[&str]| {
        let is_known = |name: &&&str| known.contains(&time::plain(name).as_str());
        names.iter().find(is_known).copied()
    };
    called(texts, &SIGNAL_NAMES).zip(called(numbers, &VALUES))
}

/// The columns if each row has the name of a signal and its value: by the names of the columns, or because the rows of one time
/// differ by texts.
fn by_signal(sample: &TableHead<'_>, time: &TimeSource) -> Option<BySignal> {
    let columns = || (0..sample.names.len()).filter(|at| !time.columns.contains(at));
    let called = |known: &[&str]| {
        columns().find(|&at| known.contains(&time::plain(&sample.names[at]).as_str()))
    };
    let cell = |row: usize, at: usize| sample.rows[row].get(at).map_or("", String::as_str);
    let has_number =
        |row: usize, at: usize| number(cell(row, at), sample.has_decimal_comma).is_some();
    let rows = || 0..sample.rows.len();
    let named = SIGNAL_NAMES.iter().find_map(|&name| called(&[name]));
    let named = named.zip(called(&VALUES)).filter(|&(name, value)| {
        rows().any(|row| has_number(row, value)) && rows().all(|row| !cell(row, name).is_empty())
    });
    // rows that share their time and their texts in some columns with an earlier row
    let alike = |of: &[usize]| {
        let mut seen = BTreeSet::new();
        let key = |row: usize| -> Vec<&str> {
            time.columns
                .iter()
                .chain(of)
                .map(|&at| cell(row, at))
                .collect()
        };
        rows().filter(|&row| !seen.insert(key(row))).count()
    };
    let at_one_time = alike(&[]);
    let has_texts = |at: usize| rows().all(|row| !cell(row, at).is_empty() && !has_number(row, at));
    let named = named.filter(|&(name, _)| has_texts(name) || alike(&[name]) < at_one_time);
    let mut names: Vec<usize> = named.iter().map(|(name, _)| *name).collect();
    let texts: Vec<usize> = columns().filter(|&at| has_texts(at)).collect();
    let mut left = alike(&names);
    while left > 0 {
        let with = |at: usize| alike(&[names.as_slice(), &[at]].concat());
        let best = texts.iter().map(|&at| (with(at), at)).min();
        let Some((fewer, at)) = best.filter(|(fewer, _)| *fewer < left) else {
            break;
        };
        left = fewer;
        names.push(at);
    }
    let different = |of: &[usize]| {
        let key = |row: usize| -> Vec<&str> { of.iter().map(|&at| cell(row, at)).collect() };
        rows().map(key).collect::<BTreeSet<_>>().len()
    };
    // texts that hardly ever come again are no names
    let are_names = left == 0 && at_one_time > 0 && 2 * different(&names) <= sample.rows.len();
    if !are_names {
        names.truncate(usize::from(named.is_some()));
    }
    names.sort_unstable();
    let unit = called(&UNITS).filter(|unit| !names.contains(unit));
    let values: Vec<usize> = match named {
        Some((_, value)) => vec![value],
        None => columns()
            .filter(|&at| !names.contains(&at) && rows().any(|row| has_number(row, at)))
            .collect(),
    };
    (!names.is_empty() && !values.is_empty()).then_some(BySignal {
        names,
        values,
        unit,
    })
}

/// Reason why the beginning of a file is not that of a readable table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Refusal {
    NotATable,
    /// A table, but not one whose times are known: what to do.
    Unclear(String),
}

/// One line: where it begins and ends, and its text without the line break.
struct Line {
    at: usize,
    end: usize,
    text: String,
}

impl TextTable {
    /// Finds the layout in the first bytes of a file. `is_whole` states whether they are all of it.
    pub(crate) fn find(
        beginning: &[u8],
        is_whole: bool,
        options: &TableOptions,
    ) -> Result<Self, Refusal> {
        let lines = lines_of(beginning, is_whole).ok_or(Refusal::NotATable)?;
        if options.no_header {
            return without_names(&lines, options);
        }
        let mut refusal = Refusal::NotATable;
        for (index, line) in lines.iter().enumerate().take(MOST_PREAMBLE) {
            for separator in SEPARATORS {
                match below_names(&lines, index, line, separator, options) {
                    Ok(table) => return Ok(table),
                    Err(Refusal::NotATable) => {}
                    Err(unclear) if refusal == Refusal::NotATable => refusal = unclear,
                    Err(_) => {}
                }
            }
        }
        Err(refusal)
    }
}

/// The lines of a text, the last one only if it is whole; `None` if this is no text.
fn lines_of(beginning: &[u8], is_whole: bool) -> Option<Vec<Line>> {
    let end = match is_whole {
        true => beginning.len(),
        false => (beginning.iter())
            .rposition(is_break)
            .map_or(beginning.len(), |at| at + 1),
    };
    let mut lines = Vec::new();
    let mut rest = beginning.get(..end)?;
    while !rest.is_empty() {
        let piece = first_line(rest);
        rest = &rest[piece.len()..];
        let at = lines.last().map_or(0, |line: &Line| line.end);
        // what is not UTF-8 is Latin-1, where each byte is a character
        let text = match std::str::from_utf8(piece) {
            Ok(text) => text.to_owned(),
            Err(_) => piece.iter().copied().map(char::from).collect(),
        };
        let text = text.trim_end_matches(['\n', '\r']);
        let text = text.strip_prefix(MARK).filter(|_| at == 0).unwrap_or(text);
        let is_text = |c: char| !c.is_control() || c == '\t';
        if !text.chars().all(is_text) {
            // the end of the text, if it is one
            break;
        }
        let end = at + piece.len();
        lines.push(Line {
            at,
            end,
            text: text.to_owned(),
        });
    }
    (!lines.is_empty()).then_some(lines)
}

/// Lines may end with CR, with LF or with both.
fn is_break(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

/// The first line with its line break, if it has one.
fn first_line(text: &[u8]) -> &[u8] {
    let end = match text.iter().position(is_break) {
        Some(at) if text[at..].starts_with(b"\r\n") => at + 2,
        Some(at) => at + 1,
        None => text.len(),
    };
    &text[..end]
}

impl Line {
    fn is_comment(&self) -> bool {
        self.text.starts_with('#')
    }

    fn is_row(&self) -> bool {
        !self.text.trim().is_empty() && !self.is_comment()
    }
}

/// The table if this line has the names of its columns.
fn below_names(
    lines: &[Line],
    index: usize,
    line: &Line,
    separator: u8,
    options: &TableOptions,
) -> Result<TextTable, Refusal> {
    let is_comment = line.is_comment();
    let text = line.text.trim_start_matches('#').trim();
    let mut names = cells(text, separator);
    let has_end = names.last().is_some_and(String::is_empty);
    let named = names.iter().filter(|name| !name.is_empty()).count();
    if let Some(problem) = frames_in(&names) {
        return Err(Refusal::Unclear(problem));
    }
    let names_a_time = time::names_a_time(&names, options);
    let may_be_time = names_a_time || time::is_index_named(&names);
    if named == 0 || names.len() < 2 || !may_be_time {
        return Err(Refusal::NotATable);
    }
    let below: Vec<(usize, Vec<String>)> = lines
        .iter()
        .enumerate()
        .skip(index + 1)
        .filter(|(_, line)| !line.text.trim().is_empty())
        .map(|(at, line)| (at, line.is_comment(), cells(&line.text, separator)))
        // the first cell of a row may be "#N/A" or "#1"
        .filter(|(_, begins_with_mark, row)| !begins_with_mark || row.len() == names.len())
        .map(|(at, _, row)| (at, row))
        .take(MOST_ROWS + MOST_BELOW)
        .collect();
    let has_decimal_comma = has_decimal_comma(&below, separator);
    let is_number = |cell: &String| number(cell, has_decimal_comma).is_some();
    // a name and a number are a property of the log, such as its time
    if named == 2 && names.iter().any(is_number) {
        return Err(Refusal::NotATable);
    }
    let is_described = |row: &Vec<String>| {
        let has_value = row.iter().any(|cell| is_number(cell) || is_date(cell));
        !has_value || row.iter().any(|cell| time::unit_cell(cell).is_some())
    };
    let described = below
        .iter()
        .take(MOST_BELOW)
        .take_while(|(_, row)| is_described(row))
        .count();
    let (above, rows) = below.split_at(described.min(below.len()));
    let width = |row: &Vec<String>| {
        row.iter()
            .rposition(|cell| !cell.is_empty())
            .map_or(0, |at| at + 1)
    };
    let fits = |row: &&(usize, Vec<String>)| width(&row.1) <= names.len() && row.1.len() > 1;
    let fitting = rows.iter().filter(fits).count();
    // a sentence has blanks, too
    if separator == b' ' && !are_numbers_below(&names, rows, has_decimal_comma) {
        return Err(Refusal::NotATable);
    }
    // a remark and a property of the log can look like names
    if fitting == 0 && (is_comment || !rows.is_empty() && named == 2) {
        return Err(Refusal::NotATable);
    }
    let mut notes = Vec::new();
    // a separator at the end of a line begins no column, unless some row has a value there
    if has_end && rows.iter().all(|(_, row)| width(row) < names.len()) {
        names.pop();
    }
    let units: Vec<String> = above
        .first()
        .map(|(_, row)| row.clone())
        .unwrap_or_default();
    if index > 0 && lines[..index].iter().any(Line::is_row) {
        let count = lines[..index].iter().filter(|line| line.is_row()).count();
        notes.push(say!(
            "{count} lines before the names of the columns are not rows"
        ));
    }
    if !above.is_empty() {
        notes.push(say!(
            "{} lines between the names of the columns and the first row are not rows: \"{}\"",
            above.len(),
            lines[above[0].0].text.trim().escape_debug()
        ));
    }
    let usual = usual_cells(rows).map_or(names.len(), |cells| cells.min(names.len()));
    let is_whole = |row: &&(usize, Vec<String>)| row.1.len() >= usual;
    let sampled: Vec<Vec<String>> = (rows.iter().filter(is_whole))
        .map(|(_, row)| row.clone())
        .collect();
    let sample = TableHead {
        names: &names,
        units: &units,
        rows: &sampled,
        has_decimal_comma,
    };
    if !names_a_time && !time::has_index_of_times(&sample) {
        return Err(Refusal::NotATable);
    }
    let time = time::find(&sample, options).map_err(Refusal::Unclear)?;
    notes.extend(time.told.clone());
    notes.extend(time::other_times(&names, &time));
    let by_signal = by_signal(&sample, &time);
    if let Some(found) = &by_signal {
        let listed = |columns: &[usize]| {
            let quoted = |&at: &usize| format!("\"{}\"", names[at].escape_debug());
            columns.iter().map(quoted).collect::<Vec<_>>().join(", ")
        };
        notes.push(say!(
            "each row has one signal: its name in {}, its value in {}",
            listed(&found.names),
            listed(&found.values)
        ));
    }
    let first_row = rows.first().map_or(lines.len(), |(at, _)| *at);
    let end = lines.last().map_or(0, |line| line.end);
    let rows_at = lines.get(first_row).map_or(end, |line| line.at);
    Ok(TextTable {
        separator,
        has_decimal_comma,
        rows_at: rows_at as u64,
        lines_before: first_row as u64,
        names,
        least_cells: usual,
        units,
        time,
        by_signal,
        notes,
    })
}

/// The table if its first line is a row.
fn without_names(lines: &[Line], options: &TableOptions) -> Result<TextTable, Refusal> {
    let first = lines
        .iter()
        .position(Line::is_row)
        .ok_or(Refusal::NotATable)?;
    let rows_of = |separator: u8| -> Vec<(usize, Vec<String>)> {
        let rows = lines
            .iter()
            .enumerate()
            .skip(first)
            .filter(|(_, line)| line.is_row());
        rows.take(MOST_ROWS)
            .map(|(at, line)| (at, cells(&line.text, separator)))
            .collect()
    };
    let widest = |separator: &u8| rows_of(*separator).first().map_or(0, |(_, row)| row.len());
    let (blank, others) = SEPARATORS.split_last().ok_or(Refusal::NotATable)?;
    let others = others.iter().copied().rev().max_by_key(widest);
    let separator = (others.into_iter().chain([*blank]))
        .find(|separator| widest(separator) > 1)
        .ok_or(Refusal::NotATable)?;
    let rows = rows_of(separator);
    let width = rows.iter().map(|(_, row)| row.len()).min().unwrap_or(0);
    let names: Vec<String> = (1..=width.max(1))
        .map(|column| format!("c{column}"))
        .collect();
    let has_decimal_comma = has_decimal_comma(&rows, separator);
    let sampled: Vec<Vec<String>> = rows.into_iter().map(|(_, row)| row).collect();
    let sample = TableHead {
        names: &names,
        units: &[],
        rows: &sampled,
        has_decimal_comma,
    };
    let time = time::find_unnamed(&sample, options).map_err(Refusal::Unclear)?;
    let notes = time.told.iter().cloned().collect();
    Ok(TextTable {
        separator,
        has_decimal_comma,
        rows_at: lines[first].at as u64,
        lines_before: first as u64,
        least_cells: names.len(),
        names,
        units: Vec::new(),
        time,
        by_signal: None,
        notes,
    })
}

/// Returns the error for a table whose columns are those of CAN frames, whose bytes would be taken for numbers; `None` for
/// others.
fn frames_in(names: &[String]) -> Option<String> {
    const IDS: [&str; 6] = [
        "id",
        "canid",
        "arbitrationid",
        "identifier",
        "messageid",
        "msgid",
    ];
    const LENGTHS: [&str; 4] = ["dlc", "len", "length", "datalength"];
    const BYTES: [&str; 9] = [
        "data",
        "databytes",
        "payload",
        "data0",
        "data1",
        "d0",
        "d1",
        "byte0",
        "b0",
    ];
    let place = |known: &[&str]| {
        names
            .iter()
            .position(|name| known.contains(&time::plain(name).as_str()))
    };
    let columns = [place(&IDS)?, place(&LENGTHS)?, place(&BYTES)?].map(|at| names[at].as_str());
    Some(format!(
        "each row is a frame of a CAN bus (columns {}): expected the columns of SavvyCAN, of the converters for CANedge or of \
         python-can; export the trace as Vector ASC or BLF, PEAK TRC, ASAM MF4 or text of candump",
        columns
            .map(|name| format!("\"{}\"", name.escape_debug()))
            .join(", ")
    ))
}

/// The cells of most rows.
fn usual_cells(rows: &[(usize, Vec<String>)]) -> Option<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    (rows.iter()).for_each(|(_, row)| *counts.entry(row.len()).or_default() += 1);
    let (cells, count) = counts.into_iter().max_by_key(|(_, count)| *count)?;
    (2 * count > rows.len()).then_some(cells)
}

/// Whether most of the rows have a cell for each name, and most of those cells are numbers.
fn are_numbers_below(
    names: &[String],
    rows: &[(usize, Vec<String>)],
    has_decimal_comma: bool,
) -> bool {
    let numbers = |row: &Vec<String>| {
        let is_number = |cell: &&String| number(cell, has_decimal_comma).is_some();
        row.iter().filter(is_number).count()
    };
    let is_row =
        |(_, row): &&(usize, Vec<String>)| row.len() == names.len() && 2 * numbers(row) > row.len();
    2 * rows.iter().filter(is_row).count() > rows.len()
}

/// The cells of a line, without blanks around them.
fn cells(line: &str, separator: u8) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .from_reader(line.as_bytes());
    let mut record = csv::ByteRecord::new();
    match reader.read_byte_record(&mut record) {
        Ok(true) => join_blanks(record, separator)
            .iter()
            .map(|cell| String::from_utf8_lossy(cell).trim().to_owned())
            .collect(),
        _ => Vec::new(),
    }
}

/// The record with several blanks for one, where blanks separate cells.
pub(crate) fn join_blanks(record: csv::ByteRecord, separator: u8) -> csv::ByteRecord {
    if separator != b' ' {
        return record;
    }
    let mut joined: csv::ByteRecord = record.iter().filter(|cell| !cell.is_empty()).collect();
    joined.set_position(record.position().cloned());
    joined
}

fn is_date(cell: &str) -> bool {
    date::parse(cell, None).is_some() || date::is_ambiguous(cell)
}

/// Whether numbers have a comma as decimal point: always where a comma separates no cells; else if cells in quotes cannot be read
/// otherwise (`1,234` can be one thousand).
fn has_decimal_comma(rows: &[(usize, Vec<String>)], separator: u8) -> bool {
    let is_decimal = |cell: &String| {
        let Some((whole, fraction)) = cell.split_once(',') else {
            return false;
        };
        let whole = whole.trim_start_matches('-');
        let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
        are_digits(whole) && are_digits(fraction) && (fraction.len() != 3 || whole == "0")
    };
    separator != b',' || rows.iter().flat_map(|(_, row)| row).any(is_decimal)
}

#[cfg(test)]
mod tests {
    use super::{super::time::Kind, *};

    fn found(text: &str) -> Result<TextTable, Refusal> {
        TextTable::find(text.as_bytes(), true, &TableOptions::default())
    }

    fn with(text: &str, change: impl FnOnce(&mut TableOptions)) -> Result<TextTable, Refusal> {
        let mut options = TableOptions::default();
        change(&mut options);
        TextTable::find(text.as_bytes(), true, &options)
    }

    #[test]
    fn what_stands_before_the_rows_is_passed_over() {
        let cases = [
            ("time_s,x\n1,2\n", 2, 9),
            ("\u{feff}# by hand\n\"Time [s]\";x\n1;2\n", 2, 26),
            ("Logger 7\nSerial,0815\n\nTime [s],x,y\n1,2,3\n", 3, 35),
            ("Date,14.11.2023\nTime,12:00:00\nt [s],x\n0,1\n", 2, 38),
            ("Time;angle\n[s];[deg]\n0,5;1,25\n", 2, 21),
            ("time_s,x,\n1,2,\n", 2, 10),
            ("# t [s],x\n0,1\n", 2, 10),
            ("time_s x\n1 2\n", 2, 9),
            ("# t_s   x   y\n  0.0  1.0  2.0\n", 3, 14),
            (
                " t_s | x \n-----+---\n 1.0 | 2.0\n 2.0 | 2.0\n(2 rows)\n",
                2,
                20,
            ),
        ];
        for (text, width, rows_at) in cases {
            let table = found(text).unwrap();
            assert_eq!(
                (table.names.len(), table.rows_at),
                (width, rows_at),
                "{text:?}: {table:?}"
            );
        }
        let table = found("Time;angle\n[s];[deg]\n0,5;1,25\n").unwrap();
        assert_eq!(
            (table.time.kind, table.has_decimal_comma),
            (Kind::Multiples(1_000_000_000), true)
        );
        assert_eq!(table.units, ["[s]", "[deg]"]);
    }

    #[test]
    fn other_texts_are_no_tables() {
        for text in [
            "time flies\n",
            "time flies like\nan arrow it\nflies on 3\n",
            "t a b\n1 2\n3 4\n",
            "angle,load\n1,2\n",
            "\u{1}time_s,x\n",
            "",
            "\n\n",
            ",,\n",
        ] {
            assert_eq!(found(text), Err(Refusal::NotATable), "{text:?}");
        }
        assert_eq!(
            TextTable::find(b"\xff,\n", true, &TableOptions::default()),
            Err(Refusal::NotATable)
        );
    }

    #[test]
    fn what_the_table_does_not_state_is_asked_for() {
        let unclear = |text: &str| match found(text) {
            Err(Refusal::Unclear(problem)) => problem,
            other => panic!("{text:?}: {other:?}"),
        };
        assert!(unclear("time,x\n0.01,1\n").contains("--time-unit"));
        assert!(unclear("time,x\n03/04/2026 10:00:00,1\n").contains("--date-order"));
        assert!(unclear("time_s,x\n1700000000000,1\n").contains("--time-unit ms"));
        assert!(unclear("date,x\n14.11.2023,1\n").contains("--time-column"));
        let frames = unclear("Time,Channel,ID,Flags,DLC,Data0,Data1\n0.5,0,257,0,2,10,20\n");
        assert!(
            frames.contains("\"ID\", \"DLC\", \"Data0\"") && frames.contains("candump"),
            "{frames}"
        );
        // as MATLAB writes durations
        let seconds = found("Time,x\n0.02 sec,1\n0.04 sec,2\n").unwrap().time;
        assert_eq!(seconds.read(&["0.04 sec"], false), Some(40_000_000));
        let kind =
            |text: &str, change: fn(&mut TableOptions)| with(text, change).unwrap().time.kind;
        assert_eq!(
            kind("time,x\n0.01,1\n", |of| of.time_unit =
                Some(super::super::TimeUnit::Milliseconds)),
            Kind::Multiples(1_000_000)
        );
        assert_eq!(
            kind("time,x\n03/04/2026 10:00:00,1\n", |of| {
                of.date_order = Some(super::super::DateOrder::Dmy);
            }),
            Kind::Text(Some(super::super::DateOrder::Dmy))
        );
        assert_eq!(
            kind("clock,x\n1700000000,1\n", |of| of.time_column =
                Some("clock".into())),
            Kind::Multiples(1_000_000_000)
        );
    }

    #[test]
    fn a_unit_in_a_cell_is_that_of_the_column_or_the_row_has_no_time() {
        let time = found("time_s,x\n0.5,1\n900 ms,2\n1 s,3\n").unwrap().time;
        let read = |cell: &str| time.read(&[cell], false);
        assert_eq!(
            (read("0.5"), read("900 ms"), read("1 s")),
            (Some(500_000_000), None, Some(1_000_000_000))
        );
        for text in [
            "time_s,x\n900 ms,1\n910 ms,2\n",
            "time,x\n[s],m\n900 ms,1\n910 ms,2\n",
        ] {
            let refused = matches!(found(text), Err(Refusal::Unclear(_)));
            assert!(refused, "{text}");
        }
        let seconds = |of: &mut TableOptions| {
            of.time_unit = Some(super::super::TimeUnit::Seconds);
        };
        assert!(with("time,x\n900 ms,1\n910 ms,2\n", seconds).is_err());
    }

    #[test]
    fn a_name_that_can_be_of_another_time_is_the_time_only_where_no_other_is() {
        let seconds = |of: &mut TableOptions| {
            of.time_unit = Some(super::super::TimeUnit::Seconds);
        };
        for text in [
            "uptime_ms,timestamp,x\n5,1700000000,1\n15,1700000001,2\n",
            "created_at,time,x\n1700000009,1700000000,1\n1700000009,1700000001,2\n",
            "millis,timestamp,x\n5,1700000000,1\n15,1700000001,2\n",
        ] {
            assert_eq!(found(text).unwrap().time.columns, [1], "{text}");
        }
        let temperature = with("temps,time,x\n80,0.5,1\n81,0.6,2\n", seconds);
        assert_eq!(temperature.unwrap().time.columns, [1]);
        let table = found("date,uptime_ms,time,x\n2023-11-14,5,22:13:20,1\n");
        assert_eq!(table.unwrap().time.columns, [0, 2]);
        // no number of a time without a unit can be read
        let table = found("time,uptime_ms,x\n0.5,5,1\n0.6,15,2\n");
        assert_eq!(table.unwrap().time.columns, [1]);
    }

    #[test]
    fn two_columns_can_be_one_time() {
        let table = found("Date;Time;x\n14.11.2023;22:13:20,5;1\n").unwrap();
        assert_eq!(table.time.columns, [0, 1]);
        let cells = ["14.11.2023", "22:13:20,5"];
        assert_eq!(
            table.time.read(&cells, true),
            Some(1_700_000_000_500_000_000)
        );
        let table = found("header.stamp.sec,header.stamp.nanosec,x\n1700000000,5,1\n").unwrap();
        let stamp = (Kind::Multiples(1_000_000_000), Some(1));
        assert_eq!((table.time.kind, table.time.part_ns), stamp);
        let table = with(
            "1700000000,5000000,base,1.5\n1700000000,9000000,base,1.5\n",
            |of| of.no_header = true,
        );
        let table = table.unwrap();
        assert_eq!(table.names.len(), 4);
        assert_eq!((table.time.kind, table.time.part_ns), stamp);
    }

    #[test]
    fn a_time_in_whole_seconds_has_its_parts_in_a_column_of_their_own() {
        let table = found("Date,Time,ms,x\n2023-11-14,22:13:20,0,1\n2023-11-14,22:13:20,250,2\n");
        let time = table.unwrap().time;
        assert_eq!(
            (&time.columns[..], time.part_ns),
            (&[0, 1, 2][..], Some(1_000_000))
        );
        let cells = ["2023-11-14", "22:13:20", "250"];
        assert_eq!(time.read(&cells, false), Some(1_700_000_000_250_000_000));
        assert!(time.lacks_zone(&cells));
        let table =
            found("x,time,usec\n1,1700000000,9\n2,1700000000,999000\n3,1700000001,1000\n").unwrap();
        assert_eq!(
            table.time.read(&["1700000001", "1000"], false),
            Some(1_700_000_001_001_000_000)
        );
        // a time that has its parts, and a column that is none: of a delay, say
        for text in [
            "time,ms,x\n1700000000.25,3,1\n1700000000.5,4,2\n",
            "time,ms,x\n1700000000,30,1\n1700000000,20,2\n1700000001,40,2\n",
            "time,ms,x\n1700000000,1200,1\n1700000000,1300,2\n",
            "time,ms,x\n1700000000,20,1\n1700000001,30,2\n",
        ] {
            assert_eq!(found(text).unwrap().time.columns, [0], "{text}");
        }
    }

    #[test]
    fn further_columns_of_times_are_told() {
        let is_told = |text: &str| {
            let notes = found(text).unwrap().notes;
            notes.iter().any(|note| note.contains("--time-column"))
        };
        assert!(is_told("t [s],ax,t [s],angle\n0,1,0.5,2\n1,1,1.5,2\n"));
        assert!(!is_told("t [s],ax,angle\n0,1,2\n1,1,2\n"));
        assert!(!is_told(
            "Date,Time,ms,x\n2023-11-14,22:13:20,0,1\n2023-11-14,22:13:20,250,2\n"
        ));
    }

    #[test]
    fn tables_of_measuring_programs_are_found_below_their_headers() {
        let catman = "HBM-catman-AP\t5.4\n10. Messung\n\nZeit  1 - Standard-Messrate\tboom\ns\tgrad\n\
                      0,0000\t10,5\n0,0100\t10,6\n";
        let table = found(catman).unwrap();
        assert_eq!(
            (table.time.kind, table.has_decimal_comma),
            (Kind::Multiples(1_000_000_000), true)
        );
        let labview = "LabVIEW Measurement\t\nDate\t2026/03/04\n***End_of_Header***\t\n\t\nChannels\t1\t\n\
                       Date\t2026/03/04\t\nX_Dimension\tTime\t\nDelta_X\t0.01\t\n***End_of_Header***\t\t\n\
                       X_Value\tboom\tComment\n0.000000\t10.5\t\n0.010000\t10.6\t\n";
        let table = found(labview).unwrap();
        assert_eq!(table.names, ["X_Value", "boom", "Comment"]);
        // rows that end with their last cell that is not empty
        let table = found("X_Value\tboom\tComment\n0.0\t10.5\tbegin\n0.1\t10.6\n0.2\t10.7\n");
        assert_eq!(table.unwrap().least_cells, 2);
        let table = found("time_s,a,b\n0.0,1,2\n0.1,1\n0.2,1,3\n");
        assert_eq!(table.unwrap().least_cells, 3);
    }
}
