//! The column of time: its name, its unit or form, and its values.

use tipwatch_language::{say, word};

use super::{
    date::{self, Stamp},
    number::{number, with_point},
    options::{DateOrder, TableOptions, TimeUnit},
};

/// Names of columns of time: without a unit, in lower case, only letters and digits.
const NAMES: [&str; 41] = [
    "t",
    "time",
    "timestamp",
    "stamp",
    "epoch",
    "epochtime",
    "unix",
    "unixtime",
    "unixtimestamp",
    "posixtime",
    "datetime",
    "dateandtime",
    "datetimeutc",
    "date",
    "timeofday",
    "elapsed",
    "elapsedtime",
    "utc",
    "utctime",
    "timeutc",
    "timestamputc",
    "gpstime",
    "localtime",
    "systemtime",
    "systime",
    "servertime",
    "logtime",
    "recordtime",
    "rectime",
    "receivetime",
    "recvtime",
    "publishtime",
    "pubtime",
    "sampletime",
    "headerstamp",
    "rosbagtimestamp",
    "rostime",
    "zeit",
    "zeitstempel",
    "datum",
    "uhrzeit",
];
/// Names that can also be those of another time, such as when a row was received, or of a temperature: the time only where no
/// column of another name is.
const OTHER_NAMES: [&str; 27] = [
    "datumuhrzeit",
    "datumzeit",
    "zeitpunkt",
    "messzeit",
    "relzeit",
    "abszeit",
    "ts",
    "devicetime",
    "timestampepoch",
    "createdat",
    "recordedat",
    "receivedat",
    "eventtime",
    "measurementtime",
    "relativetime",
    "reltime",
    "absolutetime",
    "abstime",
    "timesincestart",
    "uptime",
    "horodatage",
    "temps",
    "heure",
    "dateheure",
    "tiempo",
    "hora",
    "fechahora",
];
/// Names of which the program that writes them fixes the unit.
const FIXED: [(&str, TimeUnit); 3] = [
    // PlotJuggler
    ("__time", TimeUnit::Seconds),
    // rostopic echo -p
    ("%time", TimeUnit::Nanoseconds),
    // LabVIEW
    ("x_value", TimeUnit::Seconds),
];
/// Names with a fixed unit that can also be those of another time.
const OTHER_FIXED: [(&str, TimeUnit); 3] = [
    // asammdf
    ("timestamps", TimeUnit::Seconds),
    // sketches for Arduino, after the functions
    ("millis", TimeUnit::Milliseconds),
    ("micros", TimeUnit::Microseconds),
];
/// The last words of the names of two columns that are one stamp.
const SECONDS: [&str; 4] = ["sec", "secs", "seconds", "s"];
const NANOSECONDS: &str = "nanosec";
const NS_PER_S: i64 = 1_000_000_000;
const SECONDS_A_DAY: f64 = 86_400.0;
/// Days from 30 December 1899, the origin of spreadsheets, to 1970.
const DAYS_UNTIL_1970: f64 = 25_569.0;
const DAY_NS: i64 = 86_400 * NS_PER_S;

/// Notation of the times of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Numbers, each a multiple of this many nanoseconds.
    Multiples(i64),
    /// Days since 30 December 1899.
    SpreadsheetDays,
    /// Dates and times of day, in this order where they do not show their order.
    Text(Option<DateOrder>),
    /// Times of day without a date, or times since a beginning, beyond 24 hours.
    TimeOfDay,
}

impl Kind {
    fn of(unit: TimeUnit) -> Self {
        match unit {
            TimeUnit::Hours => Self::Multiples(3600 * NS_PER_S),
            TimeUnit::Minutes => Self::Multiples(60 * NS_PER_S),
            TimeUnit::Seconds => Self::Multiples(NS_PER_S),
            TimeUnit::Milliseconds => Self::Multiples(1_000_000),
            TimeUnit::Microseconds => Self::Multiples(1000),
            TimeUnit::Nanoseconds => Self::Multiples(1),
            TimeUnit::Days => Self::SpreadsheetDays,
        }
    }
}

/// The column of time, or those whose cells are one time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TimeSource {
    pub(crate) columns: Vec<usize>,
    pub(crate) kind: Kind,
    /// The unit (ns) of the last column, if it has the part of a second that the others leave out.
    pub(crate) part_ns: Option<i64>,
    /// Evidence for the unit or the notation, where the name of the column does not state it.
    pub(crate) told: Option<String>,
}

/// A table as far as the search for the time needs it.
pub(crate) struct TableHead<'s> {
    pub(crate) names: &'s [String],
    /// The cells of a line of units below the names.
    pub(crate) units: &'s [String],
    pub(crate) rows: &'s [Vec<String>],
    pub(crate) has_decimal_comma: bool,
}

impl TimeSource {
    /// The time in nanoseconds of the row with these cells.
    pub(crate) fn read(&self, cells: &[&str], has_decimal_comma: bool) -> Option<i64> {
        if let Some(part_ns) = self.part_ns {
            let (part, whole) = cells.split_last()?;
            let whole_ns = self.whole().read(whole, has_decimal_comma)?;
            let part = decimal_ns(part.trim(), 1).or_else(|| whole_float(part.trim()))?;
            let part_ns = part.checked_mul(part_ns)?;
            let is_part = (0..NS_PER_S).contains(&part_ns);
            return is_part.then(|| whole_ns.checked_add(part_ns)).flatten();
        }
        let (first, second) = (cells.first()?.trim(), cells.get(1));
        match self.kind {
            Kind::Multiples(unit_ns) => {
                let (first, unit) = without_unit(first);
                if unit.is_some_and(|unit| Kind::of(unit) != self.kind) {
                    return None;
                }
                let text = with_point(first, has_decimal_comma);
                decimal_ns(&text, unit_ns).or_else(|| from_float(text.parse().ok()?, unit_ns))
            }
            Kind::SpreadsheetDays => {
                let days = number(first, has_decimal_comma)? - DAYS_UNTIL_1970;
                from_float(days * SECONDS_A_DAY, NS_PER_S)
            }
            Kind::Text(order) => Some(stamp(first, second, order)?.ns),
            Kind::TimeOfDay => Some(stamp(first, second, None)?.ns),
        }
    }

    /// The columns without the last one, of the parts of a second.
    fn whole(&self) -> Self {
        Self {
            columns: self.columns[..self.columns.len() - 1].to_vec(),
            kind: self.kind,
            part_ns: None,
            told: None,
        }
    }

    /// Adds the column with the milliseconds, microseconds or nanoseconds of a time in whole seconds, if there is one: where rows
    /// have one second, that column puts them in order.
    fn with_part(mut self, sample: &TableHead<'_>) -> Self {
        let texts = sample.column_texts(&self.columns);
        let read = |cells: &Vec<&str>| self.read(cells, sample.has_decimal_comma);
        let times: Vec<i64> = texts.iter().filter_map(read).collect();
        let is_whole = |ns: &i64| ns % NS_PER_S == 0;
        let repeats = times.windows(2).any(|pair| pair[0] == pair[1]);
        if self.part_ns.is_some() || !repeats || !times.iter().all(is_whole) {
            return self;
        }
        let part_of = |at: usize| {
            let unit = unit_of(&sample.names[at].trim().to_lowercase())?;
            let Kind::Multiples(part_ns) = Kind::of(unit) else {
                return None;
            };
            let mut columns = self.columns.clone();
            columns.push(at);
            let source = Self {
                columns,
                part_ns: Some(part_ns),
                ..self.clone()
            };
            let texts = sample.column_texts(&source.columns);
            let times = texts
                .iter()
                .map(|cells| source.read(cells, sample.has_decimal_comma));
            let times: Vec<i64> = times.collect::<Option<_>>()?;
            let has_parts = times.is_sorted() && !times.iter().all(is_whole);
            has_parts.then_some((source, unit))
        };
        let Some((found, unit)) = (0..sample.names.len()).find_map(part_of) else {
            return self;
        };
        let told = say!(
            "the seconds of the time are whole; its {unit} are those of the column \"{}\"",
            sample.names[found.columns[found.columns.len() - 1]].escape_debug()
        );
        self.told = Some(
            self.told
                .map_or(told.clone(), |before| format!("{before}; {told}")),
        );
        Self {
            told: self.told,
            ..found
        }
    }

    /// Whether the row states a date without a time zone.
    pub(crate) fn lacks_zone(&self, cells: &[&str]) -> bool {
        let order = match self.kind {
            Kind::Text(order) => order,
            Kind::TimeOfDay => None,
            Kind::SpreadsheetDays => return true,
            Kind::Multiples(_) => return false,
        };
        let cells = &cells[..cells.len() - usize::from(self.part_ns.is_some())];
        let first = cells.first().map_or("", |cell| cell.trim());
        stamp(first, cells.get(1), order).is_some_and(|stamp| !stamp.has_zone)
    }
}

/// Date and time of day in one cell or two.
fn stamp(first: &str, second: Option<&&str>, order: Option<DateOrder>) -> Option<Stamp> {
    match second {
        None => date::parse(first, order),
        Some(second) => {
            let stamp = date::parse(&format!("{first} {}", second.trim()), order)?;
            (stamp.has_date && stamp.has_time).then_some(stamp)
        }
    }
}

/// Whether a column is the one that a person named.
pub(crate) fn is_same_column(column: &str, named: &str) -> bool {
    column.trim().eq_ignore_ascii_case(named.trim()) || plain(column) == plain(named)
}

/// Whether the first column has the name that programs give to an index of rows: none, or that of a column without one. Its cells
/// are the times where they are dates, or numbers since 1970.
pub(super) fn is_index_named(names: &[String]) -> bool {
    let first = names.first().map(|name| name.trim().to_lowercase());
    first.is_some_and(|name| matches!(name.as_str(), "" | "index" | "unnamed: 0"))
}

/// Whether the first column is an index whose cells are times.
pub(super) fn has_index_of_times(sample: &TableHead<'_>) -> bool {
    let texts = sample.column_texts(&[0]);
    let date = |text: &str| {
        date::is_ambiguous(text) || date::parse(text, None).is_some_and(|stamp| stamp.has_date)
    };
    let is_date = |cells: &Vec<&str>| cells.first().is_some_and(|text| date(text));
    let as_number = |cells: &Vec<&str>| number(cells.first()?, sample.has_decimal_comma);
    let numbers: Vec<f64> = texts.iter().filter_map(as_number).collect();
    is_index_named(sample.names)
        && !texts.is_empty()
        && (texts.iter().all(is_date) || epoch_unit_of(&numbers).is_some())
}

/// Whether a line of names has a column that can be the time.
pub(super) fn names_a_time(names: &[String], options: &TableOptions) -> bool {
    match &options.time_column {
        Some(named) => columns_named(names, named).is_some(),
        None => !candidates(names).is_empty(),
    }
}

/// Finds the column of time and how it is written.
///
/// # Errors
/// There is none, or its unit or form does not follow from the table: what to do.
pub(crate) fn find(sample: &TableHead<'_>, options: &TableOptions) -> Result<TimeSource, String> {
    if let Some(named) = &options.time_column {
        let columns = columns_named(sample.names, named).ok_or_else(|| {
            format!(
                "no column \"{named}\" (--time-column): the columns are {}",
                shown(sample.names)
            )
        })?;
        let source = choose(&sample.column_texts(&columns), &columns, sample, options)?;
        return Ok(source.with_part(sample));
    }
    let mut refusal = None;
    let index = has_index_of_times(sample).then(|| vec![0]);
    for columns in candidates(sample.names).into_iter().chain(index) {
        match choose(&sample.column_texts(&columns), &columns, sample, options) {
            Ok(source) => return Ok(source.with_part(sample)),
            Err(problem) => refusal = refusal.or(Some(problem)),
        }
    }
    Err(refusal.unwrap_or_else(|| {
        format!(
            "no column of time: expected a name like time, t [s] or timestamp_ms, or --time-column NAME, found {}",
            shown(sample.names)
        )
    }))
}

impl<'s> TableHead<'s> {
    /// The cells of one or two columns, row by row, those without a time left out.
    fn column_texts(&self, columns: &[usize]) -> Vec<Vec<&'s str>> {
        let texts = |row: &'s Vec<String>| -> Option<Vec<&'s str>> {
            let cells = columns
                .iter()
                .map(|&at| row.get(at).map(|cell| cell.trim()));
            let cells = cells.map(|cell| cell.filter(|cell| !cell.is_empty()));
            cells.collect()
        };
        self.rows.iter().filter_map(texts).collect()
    }
}

/// Finds the time in a table without names: the first column, or the first two.
pub(super) fn find_unnamed(
    sample: &TableHead<'_>,
    options: &TableOptions,
) -> Result<TimeSource, String> {
    if options.time_column.is_some() {
        return find(sample, options);
    }
    let choose =
        |columns: &[usize]| choose(&sample.column_texts(columns), columns, sample, options);
    if options.time_unit.is_none() && has_stamps(&sample.column_texts(&[0, 1])) {
        return choose(&[0, 1]);
    }
    choose(&[0])
        .or_else(|problem| choose(&[0, 1]).map_err(|_| problem))
        .map_err(|problem| format!("{problem}; another column: --time-column c2"))
}

/// Whether two columns are seconds since 1970 and nanoseconds: those of a stamp in a message of ROS 2.
fn has_stamps(texts: &[Vec<&str>]) -> bool {
    /// No state or counter beside a time is as large.
    const LARGE_NS: i64 = 1_000_000;
    let whole = |text: &&str| text.parse::<i64>().ok();
    let pairs: Option<Vec<(i64, i64)>> = texts
        .iter()
        .map(|cells| Some((whole(cells.first()?)?, whole(cells.get(1)?)?)))
        .collect();
    let pairs = pairs.unwrap_or_default();
    let is_stamp = |&(seconds, nanoseconds): &(i64, i64)| {
        epoch_unit(seconds as f64) == Some(TimeUnit::Seconds)
            && (0..NS_PER_S).contains(&nanoseconds)
    };
    pairs.iter().all(is_stamp) && pairs.iter().any(|(_, ns)| *ns >= LARGE_NS)
}

fn shown(names: &[String]) -> String {
    const MOST: usize = 12;
    if names.is_empty() {
        return "none".to_owned();
    }
    let mut text: Vec<String> = names
        .iter()
        .take(MOST)
        .map(|name| format!("\"{}\"", name.escape_debug()))
        .collect();
    if names.len() > MOST {
        text.push(format!("{} more", names.len() - MOST));
    }
    text.join(", ")
}

/// The columns that a person named: one, or two joined by a comma.
fn columns_named(names: &[String], named: &str) -> Option<Vec<usize>> {
    let exact = |wanted: &str| names.iter().position(|name| name.trim() == wanted.trim());
    let place = |wanted: &str| {
        exact(wanted).or_else(|| names.iter().position(|name| is_same_column(name, wanted)))
    };
    if let Some(at) = place(named) {
        return Some(vec![at]);
    }
    let (first, second) = named.split_once(',')?;
    Some(vec![place(first)?, place(second)?])
}

/// The columns that can be the time, the most likely first.
fn candidates(names: &[String]) -> Vec<Vec<usize>> {
    let mut found: Vec<Vec<usize>> = Vec::new();
    let says = |at: usize| name_of_time(&names[at]);
    let is_date = |name: &str| matches!(plain(name).as_str(), "date" | "datum");
    for (at, name) in names.iter().enumerate() {
        if is_date(name) {
            let others = (0..names.len()).filter(|&other| other != at && !is_date(&names[other]));
            found.extend(
                others
                    .filter(|&other| says(other).is_some())
                    .map(|other| vec![at, other]),
            );
        }
    }
    // seconds beside nanoseconds are one stamp: alone, they would lose what is below a second
    let last_word = |name: &str| {
        let name = name.to_lowercase();
        let is_sign = |c: char| !c.is_ascii_alphanumeric();
        let (before, word) = name.rsplit_once(is_sign).unwrap_or(("", &name));
        (before.to_owned(), word.to_owned())
    };
    for (at, name) in names.iter().enumerate() {
        let (before, word) = last_word(name);
        if SECONDS.contains(&word.as_str())
            && let Some(other) = names.iter().position(|other| {
                let (of, word) = last_word(other);
                let is_part = unit_of(&word) == Some(TimeUnit::Nanoseconds);
                of == before && (is_part || word == NANOSECONDS)
            })
        {
            found.push(vec![at, other]);
        }
    }
    found.extend(
        (0..names.len())
            .filter(|&at| says(at).is_some())
            .map(|at| vec![at]),
    );
    // the sort keeps the order of the columns
    let is_other = |&at: &usize| says(at).is_some_and(|name| name.is_other);
    found.sort_by_key(|columns| columns.iter().any(is_other));
    found
}

/// Finds the notation of the times in one or two columns, by their names and values.
///
/// # Errors
/// Names and values do not determine the notation: the remedy.
fn choose(
    texts: &[Vec<&str>],
    columns: &[usize],
    sample: &TableHead<'_>,
    options: &TableOptions,
) -> Result<TimeSource, String> {
    let name = |at: usize| sample.names.get(at).map_or("", String::as_str);
    let called = columns
        .iter()
        .map(|&at| format!("\"{}\"", name(at).escape_debug()))
        .collect::<Vec<_>>()
        .join(word!(" and "));
    let source = |kind, told| TimeSource {
        columns: columns.to_vec(),
        kind,
        part_ns: None,
        told,
    };
    let as_number = |text: &str| number(without_unit(text).0, sample.has_decimal_comma);
    let first = columns.first().copied().unwrap_or_default();
    let in_name = unit_in_name(name(first)).flatten();
    let Some(example) = texts.first() else {
        // no rows: the names must do
        return match options.time_unit.or(in_name) {
            Some(unit) => Ok(source(Kind::of(unit), None)),
            None => Ok(source(Kind::Text(options.date_order), None)),
        };
    };
    let are_numbers = texts
        .iter()
        .filter(|cells| cells.iter().all(|cell| as_number(cell).is_some()))
        .count()
        * 2
        > texts.len();
    let is_date = |name: &str| name.to_lowercase().contains("dat");
    // a count beside a date is no time of day: 1000 ms would be ten o'clock
    let is_counted =
        |cells: &&Vec<&str>| cells.get(1).is_some_and(|cell| as_number(cell).is_some());
    let are_counted = texts.iter().filter(is_counted).count() * 2 > texts.len();
    if columns.len() == 2 && are_counted && is_date(name(first)) {
        return Err(format!(
            "the columns {called}: expected a date and a time of day with their marks (2026-11-28 and 14:59:58), or seconds and \
             nanoseconds, found {}; another column: --time-column NAME",
            example.join(" and ")
        ));
    }
    if columns.len() == 2 && are_numbers {
        let told = say!("time: {called}, as seconds and nanoseconds");
        let pair = TimeSource {
            part_ns: Some(1),
            ..source(Kind::of(TimeUnit::Seconds), Some(told))
        };
        return match texts.iter().any(|cells| pair.read(cells, false).is_some()) {
            true => Ok(pair),
            false => Err(format!(
                "the columns {called}: expected seconds and nanoseconds, or a date and a time of day, found {}",
                example.join(" and ")
            )),
        };
    }
    if !are_numbers {
        return text_kind(texts, &called, options).map(|(kind, told)| source(kind, told));
    }
    let numbers = texts.iter().filter_map(|cells| as_number(cells.first()?));
    let of_epoch = epoch_unit_of(&numbers.collect::<Vec<_>>());
    let below = sample.units.get(first).and_then(|cell| unit_cell(cell));
    let of_cell = |cells: &Vec<&str>| without_unit(cells.first()?).1;
    let in_cells = of_cell(example);
    let in_cells = in_cells.filter(|unit| texts.iter().all(|cells| of_cell(cells) == Some(*unit)));
    let stated = options.time_unit.or(in_name).or(below);
    if let (Some(stated), Some(unit)) = (stated, in_cells)
        && stated != unit
    {
        let by = match (options.time_unit, in_name) {
            (Some(_), _) => "--time-unit",
            (None, Some(_)) => "its name",
            (None, None) => "the line of units",
        };
        return Err(format!(
            "the column {called}: expected cells in {stated} by {by}, found \"{}\"; another column: --time-column NAME",
            example.join(" ").escape_debug()
        ));
    }
    if let Some(unit) = options.time_unit {
        let other = in_name.or(below).filter(|other| *other != unit);
        let told = other.map(|other| {
            say!("time: {called}, in {unit} by --time-unit, although the table says {other}")
        });
        return Ok(source(Kind::of(unit), told));
    }
    if let Some(unit) = in_name.or(below).or(in_cells) {
        let told = match (in_name, below) {
            (Some(_), _) => None,
            (None, Some(unit)) => Some(say!("time: {called}, in {unit} by the line of units")),
            (None, None) => Some(say!("time: {called}, in {unit} by its cells")),
        };
        let stated = source(Kind::of(unit), told);
        let is_read = |cells: &Vec<&str>| stated.read(cells, sample.has_decimal_comma).is_some();
        return match (texts.iter().any(is_read), of_epoch) {
            (false, Some(unit)) => Err(format!(
                "the column {called}: {} is after the year 2262 in the unit of its name; as numbers since 1970 they \
                 are {unit}: --time-unit {unit}",
                example.join(" ")
            )),
            _ => Ok(stated),
        };
    }
    match of_epoch {
        Some(unit) if plain(name(first)).contains("gps") => Ok(source(
            Kind::of(unit),
            Some(say!(
                "time: {called}, in {unit} since 1970 by the size of its numbers; if they count from 6 January 1980, as GPS does, dates \
                 are ten years too early"
            )),
        )),
        Some(unit) => Ok(source(
            Kind::of(unit),
            Some(say!(
                "time: {called}, in {unit} since 1970 by the size of its numbers"
            )),
        )),
        None => Err(format!(
            "the column of time {called} states no unit: expected a name like time_s, time_ms, time_us or time_ns, \
             numbers since 1970 of 10, 13, 16 or 19 digits, or dates; found \"{}\"; state the unit: --time-unit s, ms, \
             us, ns, min, h or days (since 30 December 1899, as spreadsheets keep dates)",
            example.join(" ").escape_debug()
        )),
    }
}

/// The form of dates and times of day.
fn text_kind(
    texts: &[Vec<&str>],
    called: &str,
    options: &TableOptions,
) -> Result<(Kind, Option<String>), String> {
    let read = |cells: &[&str], order| stamp(cells.first()?, cells.get(1), order);
    let joined = |cells: &[&str]| cells.join(" ");
    let is_unclear = |cells: &&Vec<&str>| date::is_ambiguous(&joined(cells));
    let shows = |order: DateOrder| {
        let other = match order {
            DateOrder::Dmy => DateOrder::Mdy,
            _ => DateOrder::Dmy,
        };
        texts.iter().any(|cells| {
            let text = joined(cells);
            !is_unclear(&cells)
                && text.contains(['/', '-'])
                && read(cells, Some(order)).is_some()
                && read(cells, Some(other)).is_none()
        })
    };
    let order = match (options.date_order, texts.iter().find(is_unclear)) {
        (Some(order), _) => Some(order),
        (None, None) => match (shows(DateOrder::Dmy), shows(DateOrder::Mdy)) {
            (true, false) => Some(DateOrder::Dmy),
            (false, true) => Some(DateOrder::Mdy),
            _ => None,
        },
        (None, Some(unclear)) => match (shows(DateOrder::Dmy), shows(DateOrder::Mdy)) {
            (true, false) => Some(DateOrder::Dmy),
            (false, true) => Some(DateOrder::Mdy),
            _ => {
                return Err(format!(
                    "the column of time {called}: \"{}\" can be day or month first; state the order: --date-order dmy, \
                     mdy or ymd",
                    joined(unclear).escape_debug()
                ));
            }
        },
    };
    let mut all = texts.iter().filter_map(|cells| read(cells, order));
    let found = all.next();
    // two columns are one time by most of their rows: others may stand beside a date
    let are_few = |cells: &Vec<&str>| cells.len() == 2 && 2 * (1 + all.count()) <= texts.len();
    let found = found.filter(|_| !texts.first().is_some_and(are_few));
    let Some(found) = found else {
        let example = texts.first().map(|cells| joined(cells)).unwrap_or_default();
        let zone = date::unknown_zone(&example).map_or(String::new(), |zone| {
            format!(
                "; the time zone \"{}\" is not known or that of several places: write UTC, CET, EST or +05:30",
                zone.escape_debug()
            )
        });
        return Err(format!(
            "the column of time {called}: expected numbers or dates (ISO 8601, 14.11.2023 22:13:20, 14-Nov-2023), \
             found \"{}\"{zone}; another column: --time-column NAME",
            example.escape_debug()
        ));
    };
    if options.time_unit.is_some() {
        return Err(format!(
            "the column of time {called} has dates, which --time-unit does not apply to"
        ));
    }
    if found.has_date && !found.has_time {
        return Err(format!(
            "the column of time {called} has dates without a time of day; name both columns: --time-column DATE,TIME"
        ));
    }
    let order_text = match order {
        Some(DateOrder::Dmy) if options.date_order.is_none() => Some(word!("day first")),
        Some(DateOrder::Mdy) if options.date_order.is_none() => Some(word!("month first")),
        _ => None,
    };
    let told = match (found.has_date, order_text) {
        (false, _) => Some(say!(
            "time: {called}, times of day without a date: they count from midnight of the first day"
        )),
        (true, Some(order)) => Some(say!("time: {called}, dates with the {order}")),
        (true, None) => None,
    };
    let kind = match found.has_date {
        true => Kind::Text(order),
        false => Kind::TimeOfDay,
    };
    Ok((kind, told))
}

/// Times of day over midnight: they count from midnight of the first day.
#[derive(Debug, Default)]
pub(crate) struct DaysPassed {
    /// The last time of day (ns).
    last: Option<i64>,
    days: i64,
}

impl DaysPassed {
    /// The next time of day (ns), and the days before it. One that falls by more than half a day is of the next day.
    pub(crate) fn after(&mut self, time_of_day_ns: i64) -> i64 {
        let fell = |last: i64| last < DAY_NS && last.saturating_sub(time_of_day_ns) > DAY_NS / 2;
        self.days += i64::from(self.last.is_some_and(fell));
        self.last = Some(time_of_day_ns);
        time_of_day_ns.saturating_add(self.days.saturating_mul(DAY_NS))
    }
}

/// Times that fall back and go on: counters that begin again at 0 (of 16 or 32 bits, the seconds of a day or of a GPS week), and
/// local times at the end of summer time.
#[derive(Debug, Default)]
pub(crate) struct CounterTurns {
    last: Option<i64>,
    /// The last two steps of the time forwards (ns): one alone may be that of a wrong time.
    steps: [i64; 2],
    passed_ns: i64,
}

impl CounterTurns {
    /// The next time (ns), with what it fell back before, and whether it falls back now: by what its counter holds or by an hour,
    /// but for some steps. A recorder that starts again falls by another time.
    pub(crate) fn after(&mut self, time_ns: i64, kind: Kind) -> (i64, bool) {
        const MOST_STEPS: i64 = 4;
        const HOUR_NS: i64 = 3600 * NS_PER_S;
        let last = self.last.replace(time_ns).unwrap_or(time_ns);
        let step = time_ns.saturating_sub(last);
        let mut turn = None;
        if step > 0 {
            self.steps = [self.steps[1], step];
        } else if step < 0 {
            let usual = self.steps[0].min(self.steps[1]);
            let steps = 1..=usual.saturating_mul(MOST_STEPS);
            let is_turn = |turn: &i64| steps.contains(&step.saturating_add(*turn));
            turn = match kind {
                Kind::Multiples(unit_ns) => {
                    let [of_16, of_32] = [16, 32].map(|bits: u32| 1_i64 << bits);
                    let holds = [
                        unit_ns.saturating_mul(of_16),
                        unit_ns.saturating_mul(of_32),
                        1_000_000 * of_16,
                        1_000_000 * of_32,
                        1000 * of_32,
                        DAY_NS,
                        7 * DAY_NS,
                    ];
                    let is_counted = |turn: &i64| time_ns >= 0 && last < *turn && is_turn(turn);
                    holds.into_iter().find(is_counted)
                }
                _ => Some(HOUR_NS).filter(is_turn),
            };
        }
        self.passed_ns = self.passed_ns.saturating_add(turn.unwrap_or(0));
        (time_ns.saturating_add(self.passed_ns), turn.is_some())
    }
}

/// The unit of numbers that count from 1970, by most of them. What would be minutes apart in that unit are no rows of a log: they
/// count from the start of a computer, in a smaller unit.
fn epoch_unit_of(numbers: &[f64]) -> Option<TimeUnit> {
    const LONGEST_STEP_NS: f64 = 600e9;
    let units: Vec<TimeUnit> = numbers.iter().copied().filter_map(epoch_unit).collect();
    let unit = *units.first()?;
    let (same, count) = (units.iter().filter(|other| **other == unit), numbers.len());
    let mut steps: Vec<f64> = numbers
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let is_log = match Kind::of(unit) {
        Kind::Multiples(unit_ns) => step * unit_ns as f64 <= LONGEST_STEP_NS,
        _ => false,
    };
    (2 * same.count() > count && is_log).then_some(unit)
}

/// The unit of a number that counts from 1970: 10 digits are seconds, 13 milliseconds, and so on. Not after 2052: LabVIEW counts
/// from 1904.
fn epoch_unit(number: f64) -> Option<TimeUnit> {
    let is_date = |least: f64| (least..2.6 * least).contains(&number);
    let units = [
        (TimeUnit::Seconds, 1e9),
        (TimeUnit::Milliseconds, 1e12),
        (TimeUnit::Microseconds, 1e15),
        (TimeUnit::Nanoseconds, 1e18),
    ];
    let found = units.into_iter().find(|(_, least)| is_date(*least));
    found.map(|(unit, _)| unit)
}

/// Names the columns of times beside the time: what stands in their rows may have been measured at those times.
pub(super) fn other_times(names: &[String], time: &TimeSource) -> Option<String> {
    let listed = |of: &dyn Fn(usize) -> bool, between: &str| {
        let columns = (0..names.len()).filter(|&at| of(at));
        let quoted = columns.map(|at| format!("\"{}\"", names[at].escape_debug()));
        quoted.collect::<Vec<_>>().join(between)
    };
    let is_time = |name: &str| name_of_time(name).is_some_and(|name| !name.is_other);
    let others = listed(
        &|at| !time.columns.contains(&at) && is_time(&names[at]),
        ", ",
    );
    let used = listed(&|at| time.columns.contains(&at), word!(" and "));
    (!others.is_empty()).then(|| {
        say!(
            "time: {}; not the other columns of times: {} (--time-column NAME states one)",
            used,
            others
        )
    })
}

/// Whether a name denotes a time.
pub(crate) fn is_name_of_time(name: &str) -> bool {
    unit_in_name(name).is_some()
}

/// Returns the unit in the name of a column, if the name is that of a time; the inner value is `None` if the name states no unit.
fn unit_in_name(name: &str) -> Option<Option<TimeUnit>> {
    name_of_time(name).map(|name| name.unit)
}

/// The name of a column of time.
struct NameOfTime {
    unit: Option<TimeUnit>,
    /// Whether the name can also denote another quantity.
    is_other: bool,
}

fn name_of_time(name: &str) -> Option<NameOfTime> {
    let name = name.trim().to_lowercase();
    let fixed = FIXED.iter().map(|fixed| (fixed, false));
    let mut fixed = fixed.chain(OTHER_FIXED.iter().map(|fixed| (fixed, true)));
    if let Some(((_, unit), is_other)) = fixed.find(|((fixed, _), _)| *fixed == name) {
        return Some(NameOfTime {
            unit: Some(*unit),
            is_other,
        });
    }
    let known = |name: &str, unit| {
        let is_other = OTHER_NAMES.contains(&name);
        (is_other || NAMES.contains(&name)).then_some(NameOfTime { unit, is_other })
    };
    let is_end = |c: char| matches!(c, ']' | ')' | '_' | ' ' | '}');
    let open = |c: char| matches!(c, '[' | '(' | '_' | ' ' | '/' | '{' | '.' | '-' | ',');
    let bare = name.trim_end_matches(is_end);
    if let Some((base, unit)) = bare.rsplit_once(open)
        && let Some(unit) = unit_of(unit.trim())
        // "time in ms"
        && let base = base.trim_end().strip_suffix(" in").unwrap_or(base)
        && let Some(found) = known(&plain(base), Some(unit))
    {
        return Some(found);
    }
    // channels of time of one measurement are counted: "Time 1 - default rate"
    let counted = bare.split_once(" - ").map_or(bare, |(name, _)| name);
    let bare = plain(
        match counted.trim_end_matches(|c: char| c.is_ascii_digit()) {
            name if name.ends_with(' ') => name,
            _ => bare,
        },
    );
    let glued = ["ms", "us", "µs", "ns", "sec"]
        .into_iter()
        .find_map(|unit| known(bare.strip_suffix(unit)?, unit_of(unit)));
    glued.or_else(|| known(&bare, None))
}

/// A name in lower case without anything but letters and digits.
pub(super) fn plain(name: &str) -> String {
    let name = name.to_lowercase();
    name.chars().filter(|c| c.is_alphanumeric()).collect()
}

/// A unit in a cell of a line of units.
pub(super) fn unit_cell(cell: &str) -> Option<TimeUnit> {
    let bare = |c: char| matches!(c, '[' | ']' | '(' | ')' | ' ');
    unit_of(&cell.trim_matches(bare).to_lowercase())
}

/// A number and the unit behind it, as MATLAB writes durations: `0.02 sec`.
fn without_unit(cell: &str) -> (&str, Option<TimeUnit>) {
    let parts = cell.trim().rsplit_once(' ');
    let unit = parts.and_then(|(_, unit)| unit_of(&unit.to_lowercase()));
    match (parts, unit) {
        (Some((number, _)), Some(unit)) => (number.trim_end(), Some(unit)),
        _ => (cell, None),
    }
}

fn unit_of(text: &str) -> Option<TimeUnit> {
    Some(match text {
        "s" | "sec" | "secs" | "second" | "seconds" => TimeUnit::Seconds,
        "ms" | "msec" | "msecs" | "millis" | "millisecond" | "milliseconds" => {
            TimeUnit::Milliseconds
        }
        "us" | "µs" | "μs" | "usec" | "usecs" | "micros" | "microsecond" | "microseconds" => {
            TimeUnit::Microseconds
        }
        "ns" | "nsec" | "nsecs" | "nanos" | "nanosecond" | "nanoseconds" => TimeUnit::Nanoseconds,
        "min" | "mins" | "minute" | "minutes" => TimeUnit::Minutes,
        "h" | "hr" | "hrs" | "hour" | "hours" => TimeUnit::Hours,
        _ => return None,
    })
}

/// Converts a decimal number of units of `unit_ns` nanoseconds, exactly.
fn decimal_ns(text: &str, unit_ns: i64) -> Option<i64> {
    let (is_negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !are_digits(whole) || !are_digits(fraction) {
        return None;
    }
    let mut number = whole.parse::<i64>().ok()?.checked_mul(unit_ns)?;
    let mut unit = unit_ns;
    for digit in fraction.bytes() {
        unit /= 10;
        number = number.checked_add(i64::from(digit - b'0') * unit)?;
    }
    Some(if is_negative { -number } else { number })
}

fn whole_float(text: &str) -> Option<i64> {
    let number: f64 = text.parse().ok()?;
    (number.fract() == 0.0)
        .then(|| from_float(number, 1))
        .flatten()
}

/// A number of so many nanoseconds.
pub(crate) fn from_float(number: f64, unit_ns: i64) -> Option<i64> {
    let nanos = number * unit_ns as f64;
    (nanos.is_finite() && nanos.abs() < 9.2e18).then_some(nanos.round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_state_the_unit() {
        let cases = [
            ("time_s", Some(Some(TimeUnit::Seconds))),
            ("Time [ms]", Some(Some(TimeUnit::Milliseconds))),
            ("timestamp(us)", Some(Some(TimeUnit::Microseconds))),
            ("t_ns", Some(Some(TimeUnit::Nanoseconds))),
            ("t/s", Some(Some(TimeUnit::Seconds))),
            ("t [s]", Some(Some(TimeUnit::Seconds))),
            ("Time (min)", Some(Some(TimeUnit::Minutes))),
            ("Elapsed time [h]", Some(Some(TimeUnit::Hours))),
            ("timestampMs", Some(Some(TimeUnit::Milliseconds))),
            ("__time", Some(Some(TimeUnit::Seconds))),
            ("%time", Some(Some(TimeUnit::Nanoseconds))),
            ("timestamp", Some(None)),
            ("Epoch", Some(None)),
            ("Date Time", Some(None)),
            ("Timestamp (UTC)", Some(None)),
            ("Zeit  1 - Standard-Messrate", Some(None)),
            ("Time 2", Some(None)),
            ("X_Value", Some(Some(TimeUnit::Seconds))),
            ("time2", None),
            ("lap - 1", None),
            ("__timestamp", Some(None)),
            ("Zeit in ms", Some(Some(TimeUnit::Milliseconds))),
            ("Rel. time [s]", Some(Some(TimeUnit::Seconds))),
            ("uptime_ms", Some(Some(TimeUnit::Milliseconds))),
            ("Temps (s)", Some(Some(TimeUnit::Seconds))),
            ("millis", Some(Some(TimeUnit::Milliseconds))),
            ("Datum/Uhrzeit", Some(None)),
            ("timestamps", Some(Some(TimeUnit::Seconds))),
            ("created_at", Some(None)),
            ("ts", Some(None)),
            ("boom_angle", None),
            ("lift_time_s", None),
            ("times", None),
        ];
        for (name, expected) in cases {
            assert_eq!(unit_in_name(name), expected, "{name}");
        }
    }

    #[test]
    fn counters_of_a_computer_are_no_dates() {
        let steps = |first: f64, step: f64| {
            let numbers: Vec<f64> = (0..5).map(|k| first + f64::from(k) * step).collect();
            epoch_unit_of(&numbers)
        };
        assert_eq!(steps(1.7e9, 0.01), Some(TimeUnit::Seconds));
        assert_eq!(steps(1.7e15, 1e4), Some(TimeUnit::Microseconds));
        // nanoseconds from 0, microseconds and nanoseconds since a computer was started, LabVIEW's seconds since 1904
        assert_eq!(steps(0.0, 5e8), None);
        assert_eq!(steps(1.200_004e9, 1e4), None);
        assert_eq!(steps(1.8e12, 1e7), None);
        assert_eq!(steps(3.86e9, 0.01), None);
    }

    fn source(kind: Kind) -> TimeSource {
        TimeSource {
            columns: vec![0],
            kind,
            part_ns: None,
            told: None,
        }
    }

    #[test]
    fn val_times_are_exact() {
        let read = |text: &str, unit_ns| source(Kind::Multiples(unit_ns)).read(&[text], false);
        assert_eq!(
            read("1700000000.123456789", NS_PER_S),
            Some(1_700_000_000_123_456_789)
        );
        assert_eq!(read("-1.5", 1_000_000), Some(-1_500_000));
        assert_eq!(read("1e3", 1), Some(1000));
        assert_eq!(read("0.05", 60 * NS_PER_S), Some(3 * NS_PER_S));
        for wrong in ["", "nan", "yesterday", "99999999999999999999"] {
            assert_eq!(read(wrong, NS_PER_S), None, "{wrong}");
        }
        let pair = TimeSource {
            columns: vec![0, 1],
            part_ns: Some(1),
            ..source(Kind::Multiples(NS_PER_S))
        };
        assert_eq!(
            pair.read(&["1700000000", "5"], false),
            Some(1_700_000_000_000_000_005)
        );
        assert_eq!(pair.read(&["1700000000", "1000000000"], false), None);
    }

    #[test]
    fn the_number_of_digits_tells_the_unit() {
        let cases = [
            (1_700_000_000.0, Some(TimeUnit::Seconds)),
            (1_700_000_000_123.0, Some(TimeUnit::Milliseconds)),
            (1.7e15, Some(TimeUnit::Microseconds)),
            (1.7e18, Some(TimeUnit::Nanoseconds)),
            (0.01, None),
            (123_456.0, None),
            (1.7e10, None),
            (-1.7e9, None),
        ];
        for (number, expected) in cases {
            assert_eq!(epoch_unit(number), expected, "{number}");
        }
    }
}
