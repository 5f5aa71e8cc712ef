//! Annotated CSV of InfluxDB: tables below each other, each a series with columns of its own. They are read through a private copy
//! with one signal in each row, in the order of the times.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, Read, Write},
};

use csv::StringRecord;
use jiff::Timestamp;

/// Columns that are no tags and no values.
const OWN: [&str; 7] = ["", "result", "table", "_start", "_stop", "_time", "error"];
const ANNOTATIONS: [&str; 3] = ["#datatype", "#group", "#default"];

/// Whether a text begins with an annotation.
pub(super) fn is_beginning(beginning: &[u8]) -> bool {
    let text = beginning
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(beginning)
        .trim_ascii_start();
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

    /// What tells its series from others: the tags, measurement and field.
    fn tags<'b>(&'b self, row: &'b StringRecord) -> impl Iterator<Item = (&'b str, &'b str)> {
        let is_tag = |at: usize| {
            self.groups.get(at).is_some_and(|group| group == "true") || self.names[at] == "_field"
        };
        let tags = (0..self.names.len()).filter(move |&at| !self.is_own(at) && is_tag(at));
        tags.map(|at| {
            (
                self.names[at].as_str(),
                row.get(at).unwrap_or_default().trim(),
            )
        })
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

/// A value of a series.
struct Sample {
    time_ns: i64,
    series: usize,
    cell: Box<str>,
}

/// Copies the values as rows of a table. A row without a time becomes one that has none.
pub(super) fn recode(source: &mut dyn Read, target: &mut dyn Write) -> io::Result<()> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .from_reader(source);
    let mut block = Block::default();
    // the values of each tag: only what differs is a part of the names
    let mut tags: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut series: BTreeMap<(Vec<(String, String)>, String), usize> = BTreeMap::new();
    let mut samples: Vec<Sample> = Vec::new();
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
        for (tag, value) in &key {
            tags.entry(tag.clone()).or_default().insert(value.clone());
        }
        for (at, name) in block.values() {
            let cell = row.get(at).unwrap_or_default().trim();
            if !cell.is_empty() {
                let count = series.len();
                let series = *series
                    .entry((key.clone(), name.unwrap_or_default().to_owned()))
                    .or_insert(count);
                samples.push(Sample {
                    time_ns,
                    series,
                    cell: cell.into(),
                });
            }
        }
    }
    let mut names = vec![String::new(); series.len()];
    for ((key, column), at) in &series {
        let differs =
            |tag: &str| tag == "_field" || tags.get(tag).is_some_and(|values| values.len() > 1);
        let parts = key
            .iter()
            .filter(|(tag, value)| tag != "_field" && differs(tag) && !value.is_empty());
        let field = key.iter().filter(|(tag, _)| tag == "_field");
        let mut parts: Vec<&str> = parts
            .chain(field)
            .map(|(_, value)| value.as_str())
            .collect();
        parts.extend(Some(column.as_str()).filter(|column| !column.is_empty()));
        names[*at] = match parts.is_empty() {
            true => "value".to_owned(),
            false => parts.join("."),
        };
    }
    samples.sort_by_key(|sample| sample.time_ns);
    let mut table = csv::WriterBuilder::new().flexible(true).from_writer(target);
    table.write_record(["time_ns", "signal", "value"])?;
    for sample in samples {
        let time = sample.time_ns.to_string();
        table.write_record([time.as_str(), names[sample.series].as_str(), &sample.cell])?;
    }
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
        let mut table = Vec::new();
        recode(&mut text.as_bytes(), &mut table).unwrap();
        String::from_utf8(table).unwrap()
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
}
