//! Annotated CSV of InfluxDB: tables below each other, each a series with columns of its own. They are read through a private copy
//! with one signal in each row, in the order of the times.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
    fs::File,
    io::{self, BufRead, BufReader, BufWriter, Read, Seek, Write},
};

use csv::StringRecord;
use jiff::Timestamp;

use super::lines::without_mark;

/// Columns that are no tags and no values.
const OWN: [&str; 6] = ["", "table", "_start", "_stop", "_time", "error"];
/// Tags that are no group: the field, and the name of the query's result.
const FIELD: &str = "_field";
const RESULT: &str = "result";
/// Samples in memory (about 60 MB); more go to temporary files.
const MOST_HELD: usize = 1 << 20;
const ANNOTATIONS: [&str; 3] = ["#datatype", "#group", "#default"];

/// Whether a text begins with an annotation.
pub(super) fn is_beginning(beginning: &[u8]) -> bool {
    let text = without_mark(beginning).trim_ascii_start();
    ANNOTATIONS.iter().any(|annotation| {
        let rest = text.strip_prefix(annotation.as_bytes());
        rest.is_some_and(|rest| rest.first() == Some(&b','))
    })
}

/// One table: its annotations and the names of its columns.
#[derive(Default)]
struct Block {
    types: Vec<String>,
    groups: Vec<String>,
    /// Values of empty cells, by column.
    defaults: Vec<String>,
    names: Vec<String>,
}

impl Block {
    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|column| column == name)
    }

    fn is_own(&self, at: usize) -> bool {
        self.names
            .get(at)
            .is_none_or(|name| OWN.contains(&name.as_str()))
    }

    fn cell<'b>(&'b self, row: &'b StringRecord, at: usize) -> &'b str {
        let default = || self.defaults.get(at).map_or("", String::as_str);
        let cell = row.get(at).map(str::trim).filter(|cell| !cell.is_empty());
        cell.unwrap_or_else(default)
    }

    /// Returns the names and values of the tags that identify the series of a row: the result, the tags, measurement and field.
    /// An empty tag does not count.
    fn tags<'b>(&'b self, row: &'b StringRecord) -> impl Iterator<Item = (&'b str, &'b str)> {
        let is_group = |at: usize| self.groups.get(at).is_some_and(|group| group == "true");
        let is_tag =
            move |at: usize| is_group(at) || matches!(self.names[at].as_str(), FIELD | RESULT);
        let tags = (0..self.names.len()).filter(move |&at| !self.is_own(at) && is_tag(at));
        tags.map(|at| (self.names[at].as_str(), self.cell(row, at)))
            .filter(|(_, value)| !value.is_empty())
    }

    /// The columns of values, with their names; that of `_value` is the field.
    fn values(&self) -> Vec<(usize, Option<&str>)> {
        if let Some(at) = self.place("_value") {
            return vec![(at, None)];
        }
        let is_number = |at: usize| {
            let kind = self.types.get(at).map(String::as_str);
            matches!(kind, Some("double" | "long" | "unsignedLong" | "boolean"))
        };
        let columns = (0..self.names.len()).filter(|&at| !self.is_own(at) && is_number(at));
        columns
            .map(|at| (at, Some(self.names[at].as_str())))
            .collect()
    }
}

/// Identity of a series: its tags with their values, and the column of its values if that is not the field's.
type Key = (Vec<(String, String)>, String);

/// Returns the names of series: the values of the tags that differ. Where two would have one name, the tags stand before their
/// values.
fn names_of(series: &BTreeMap<Key, usize>) -> Vec<String> {
    let value_of = |key: &Key, tag: &str| {
        let found = key.0.iter().find(|(of, _)| of == tag);
        found.map(|(_, value)| value.clone())
    };
    let differs = |tag: &str| {
        let values: BTreeSet<Option<String>> =
            series.keys().map(|key| value_of(key, tag)).collect();
        values.len() > 1
    };
    let tags: BTreeSet<&str> = (series.keys().flat_map(|(tags, _)| tags))
        .map(|(tag, _)| tag.as_str())
        .filter(|tag| *tag != FIELD && differs(tag))
        .collect();
    let name = |(key, column): &Key, with_tags: bool| {
        let parts = key.iter().filter(|(tag, _)| tags.contains(tag.as_str()));
        let mut parts: Vec<String> = parts
            .map(|(tag, value)| match with_tags {
                true => format!("{tag}={value}"),
                false => value.clone(),
            })
            .collect();
        let field = key.iter().find(|(tag, _)| tag == FIELD);
        parts.extend(field.map(|(_, field)| field.clone()));
        parts.extend(Some(column.clone()).filter(|column| !column.is_empty()));
        match parts.is_empty() {
            true => "value".to_owned(),
            false => parts.join("."),
        }
    };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for key in series.keys() {
        *counts.entry(name(key, false)).or_default() += 1;
    }
    let mut names = vec![String::new(); series.len()];
    let mut taken: BTreeSet<String> = BTreeSet::new();
    for (key, &at) in series {
        let short = name(key, false);
        let mut found = match counts.get(&short) {
            Some(1) => short,
            _ => name(key, true),
        };
        // a tag may contain what separates tags
        while !taken.insert(found.clone()) {
            found.push('\'');
        }
        names[at] = found;
    }
    names
}

/// A value of a series.
struct SeriesValue {
    time_ns: i64,
    series: usize,
    cell: Box<str>,
}

impl SeriesValue {
    fn write(&self, target: &mut impl Write) -> io::Result<()> {
        target.write_all(&self.time_ns.to_le_bytes())?;
        target.write_all(&(self.series as u64).to_le_bytes())?;
        target.write_all(&(self.cell.len() as u64).to_le_bytes())?;
        target.write_all(self.cell.as_bytes())
    }

    /// The next sample of a file; `None` at its end.
    fn read(source: &mut impl BufRead) -> io::Result<Option<Self>> {
        if source.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let mut number = || {
            let mut bytes = [0; 8];
            source
                .read_exact(&mut bytes)
                .map(|()| u64::from_le_bytes(bytes))
        };
        let (time, series, bytes) = (number()?, number()?, number()?);
        let mut cell = String::new();
        source.by_ref().take(bytes).read_to_string(&mut cell)?;
        Ok(Some(Self {
            time_ns: time.cast_signed(),
            series: series as usize,
            cell: cell.into(),
        }))
    }
}

/// Puts samples in the order of their times, in bounded memory.
struct ByTime {
    most: usize,
    held: Vec<SeriesValue>,
    /// Each has samples in the order of their times, which the file has behind those of the one before.
    files: Vec<BufReader<File>>,
}

impl ByTime {
    fn push(&mut self, sample: SeriesValue) -> io::Result<()> {
        if self.held.len() >= self.most {
            self.held.sort_by_key(|sample| sample.time_ns);
            let mut file = BufWriter::new(tempfile::tempfile()?);
            for sample in self.held.drain(..) {
                sample.write(&mut file)?;
            }
            let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.rewind()?;
            self.files.push(BufReader::new(file));
        }
        self.held.push(sample);
        Ok(())
    }

    /// Calls `take` with every sample. Those of one time come in the order of the file.
    fn each(self, take: &mut dyn FnMut(&SeriesValue) -> io::Result<()>) -> io::Result<()> {
        let Self {
            mut held,
            mut files,
            ..
        } = self;
        held.sort_by_key(|sample| sample.time_ns);
        let (mut held, in_memory) = (held.into_iter(), files.len());
        let mut next = |from: usize| match files.get_mut(from) {
            Some(file) => SeriesValue::read(file),
            None => Ok(held.next()),
        };
        let heads: io::Result<Vec<Option<SeriesValue>>> = (0..=in_memory).map(&mut next).collect();
        let mut heads = heads?;
        let place = |(from, head): (usize, &Option<SeriesValue>)| {
            let sample = head.as_ref()?;
            Some(Reverse((sample.time_ns, from)))
        };
        let mut order: BinaryHeap<_> = heads.iter().enumerate().filter_map(place).collect();
        while let Some(Reverse((_, from))) = order.pop() {
            let head = std::mem::replace(&mut heads[from], next(from)?);
            order.extend(place((from, &heads[from])));
            if let Some(sample) = head {
                take(&sample)?;
            }
        }
        Ok(())
    }
}

/// Copies the values as rows of a table. A row without a time becomes one that has none.
pub(super) fn recode(source: &mut dyn Read, target: &mut dyn Write) -> io::Result<()> {
    recode_holding(MOST_HELD, source, target)
}

fn recode_holding(most: usize, source: &mut dyn Read, target: &mut dyn Write) -> io::Result<()> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(source);
    let mut block = Block::default();
    let mut series: BTreeMap<Key, usize> = BTreeMap::new();
    let mut samples = ByTime {
        most,
        held: Vec::new(),
        files: Vec::new(),
    };
    let mut wrong: Vec<String> = Vec::new();
    let mut row = StringRecord::new();
    loop {
        match reader.read_record(&mut row) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) if error.is_io_error() => return Err(error.into()),
            Err(error) => {
                wrong.push(error.to_string());
                continue;
            }
        }
        let cells = || {
            row.iter()
                .map(|cell| cell.trim().to_owned())
                .collect::<Vec<_>>()
        };
        let first = row
            .get(0)
            .unwrap_or_default()
            .trim_start_matches('\u{feff}')
            .trim();
        if first.starts_with('#') {
            if !block.names.is_empty() {
                block = Block::default();
            }
            match first {
                "#datatype" => block.types = cells(),
                "#group" => block.groups = cells(),
                "#default" => block.defaults = cells(),
                _ => {}
            }
            continue;
        }
        if block.names.is_empty()
            || block
                .place("_time")
                .is_some_and(|at| row.get(at) == Some("_time"))
        {
            block.names = cells();
            continue;
        }
        let time_ns = block.place("_time").and_then(|at| time_ns(row.get(at)?));
        let Some(time_ns) = time_ns.filter(|_| row.len() == block.names.len()) else {
            wrong.push(row.iter().collect::<Vec<_>>().join(","));
            continue;
        };
        let key: Vec<(String, String)> = block
            .tags(&row)
            .map(|(tag, value)| (tag.to_owned(), value.to_owned()))
            .collect();
        for (at, name) in block.values() {
            let cell = block.cell(&row, at);
            if !cell.is_empty() {
                let count = series.len();
                let series = *series
                    .entry((key.clone(), name.unwrap_or_default().to_owned()))
                    .or_insert(count);
                samples.push(SeriesValue {
                    time_ns,
                    series,
                    cell: cell.into(),
                })?;
            }
        }
    }
    let names = names_of(&series);
    let mut table = csv::WriterBuilder::new().flexible(true).from_writer(target);
    table.write_record(["time_ns", "signal", "value"])?;
    samples.each(&mut |sample| {
        let time = sample.time_ns.to_string();
        Ok(table.write_record([time.as_str(), names[sample.series].as_str(), &sample.cell])?)
    })?;
    for row in wrong {
        table.write_record([row.as_str(), "", ""])?;
    }
    table.flush()
}

/// The time of a cell: RFC 3339 or nanoseconds since 1970.
fn time_ns(cell: &str) -> Option<i64> {
    let cell = cell.trim();
    let stamp = || i64::try_from(cell.parse::<Timestamp>().ok()?.as_nanosecond()).ok();
    cell.parse().ok().or_else(stamp)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recoded(text: &str) -> String {
        assert!(is_beginning(text.as_bytes()));
        let held = |most: usize| {
            let mut table = Vec::new();
            recode_holding(most, &mut text.as_bytes(), &mut table).unwrap();
            String::from_utf8(table).unwrap()
        };
        // what memory holds and what files hold is the same
        assert!([1, 2, 3].iter().all(|&most| held(most) == held(MOST_HELD)));
        held(MOST_HELD)
    }

    #[test]
    fn series_below_each_other_are_merged_by_time() {
        let text = "#group,false,false,true,false,false,true,true\r\n#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,\
                    double,string,string\r\n#default,_result,,,,,,\r\n,result,table,_start,_time,_value,_field,machine\r\n\
                    ,,0,1970-01-01T00:00:00Z,1970-01-01T00:00:01Z,1.5,boom,a\r\n\
                    ,,0,1970-01-01T00:00:00Z,1970-01-01T00:00:03Z,2.5,boom,a\r\n\r\n\
                    #group,false,false,true,false,false,true,true\r\n#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,\
                    long,string,string\r\n#default,_result,,,,,,\r\n,result,table,_start,_time,_value,_field,machine\r\n\
                    ,,1,1970-01-01T00:00:00Z,1970-01-01T00:00:02.5Z,7,gear,a\r\n,,1,1970-01-01T00:00:00Z,soon,7,gear,a\r\n";
        assert_eq!(
            recoded(text),
            "time_ns,signal,value\n1000000000,boom,1.5\n2500000000,gear,7\n3000000000,boom,2.5\n\
             \",,1,1970-01-01T00:00:00Z,soon,7,gear,a\",,\n"
        );
    }

    #[test]
    fn fields_in_columns_are_signals_and_tags_that_differ_are_in_their_names() {
        let text = "#datatype,string,long,dateTime:RFC3339,string,double,double,string\n#group,false,false,false,true,false,\
                    false,false\n#default,_result,,,,,,\n,result,table,_time,machine,boom,az,note\n\
                    ,,0,1970-01-01T00:00:01Z,a,1,9,x\n,,1,1970-01-01T00:00:01Z,b,2,,x\n";
        assert_eq!(
            recoded(text),
            "time_ns,signal,value\n1000000000,a.boom,1\n1000000000,a.az,9\n1000000000,b.boom,2\n"
        );
    }

    #[test]
    fn series_that_differ_have_names_that_differ() {
        let block = |result: &str, tags: &str, rows: &str| {
            let groups = "true,".repeat(tags.split(',').count());
            format!(
                "#group,false,false,false,false,{groups}true\n#default,{result},,,,,,\n,result,table,_time,_value,{tags},_field\n{rows}"
            )
        };
        let row = |time: u32, tags: &str| format!(",,0,{time},{time},{tags},boom\n");
        let names = |text: &str| -> Vec<String> {
            let table = recoded(text);
            let rows = table.lines().skip(1);
            rows.map(|row| row.split(',').nth(1).unwrap().to_owned())
                .collect()
        };
        let mean = block("mean", "x", &row(1, "a"));
        let max = block("max", "x", &row(2, "a"));
        assert_eq!(names(&(mean.clone() + &max)), ["mean.boom", "max.boom"]);
        assert_eq!(names(&mean), ["boom"]);
        let tags = block("", "x,y", &(row(1, ",1") + &row(2, "1,")));
        assert_eq!(names(&tags), ["y=1.boom", "x=1.boom"]);
        // a tag that one of them has not
        let other = block("", "x,y", &row(1, "a,")) + &block("", "z", &row(2, ""));
        assert_eq!(names(&other), ["a.boom", "boom"]);
        let dots = block("", "x,y", &(row(1, "a.y=b,") + &row(2, "a,b")));
        let dots = names(&dots);
        assert_ne!(dots[0], dots[1]);
    }
}
