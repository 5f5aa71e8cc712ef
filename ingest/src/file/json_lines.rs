//! Lines of which each is a JSON object: they are read through a private copy as a table with a column for each number.

use std::{
    collections::BTreeMap,
    fmt,
    io::{self, BufRead, Write},
};

use serde::de::{
    DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor,
};

/// Columns, at most; others are left out.
const MOST_COLUMNS: usize = 4096;
/// Elements of an array that are columns.
const MOST_ELEMENTS: usize = 64;

/// Whether a text begins with a line that is an object. An object alone describes something: it is no row of a log.
pub(super) fn is_beginning(beginning: &[u8], is_whole: bool) -> bool {
    let lines = beginning.split_inclusive(|&byte| byte == b'\n');
    let mut lines = lines.filter(|line| !line.trim_ascii().is_empty());
    let first = lines.next().filter(|line| line.ends_with(b"\n"));
    first.is_some_and(|line| {
        (!is_whole || lines.next().is_some()) && cells_of(line).is_some_and(|cells| cells.len() > 1)
    })
}

/// Copies the objects as rows of a table. A line that is no object becomes a row that is none.
pub(super) fn recode(
    source: &mut (impl BufRead + io::Seek),
    target: &mut dyn Write,
) -> io::Result<()> {
    let begins_at = source.stream_position()?;
    let mut columns: BTreeMap<String, usize> = BTreeMap::new();
    let mut names: Vec<String> = Vec::new();
    each_line(source, &mut |line| {
        for (name, _) in cells_of(line).unwrap_or_default() {
            if names.len() < MOST_COLUMNS && !columns.contains_key(&name) {
                columns.insert(name.clone(), names.len());
                names.push(name);
            }
        }
        Ok(())
    })?;
    source.seek(io::SeekFrom::Start(begins_at))?;
    let mut table = csv::WriterBuilder::new().flexible(true).from_writer(target);
    table.write_record(&names)?;
    let mut row: Vec<String> = Vec::new();
    each_line(source, &mut |line| {
        let Some(cells) = cells_of(line) else {
            let shown = line.get(..line.len().min(40)).unwrap_or_default();
            return Ok(table.write_record([String::from_utf8_lossy(shown.trim_ascii()).as_ref()])?);
        };
        row.clear();
        row.resize(names.len(), String::new());
        for (name, cell) in cells {
            let place = columns.get(&name).and_then(|&at| row.get_mut(at));
            place.into_iter().for_each(|place| place.clone_from(&cell));
        }
        Ok(table.write_record(&row)?)
    })?;
    table.flush()
}

fn each_line(
    source: &mut impl BufRead,
    take: &mut dyn FnMut(&[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let mut line = Vec::new();
    loop {
        line.clear();
        if source.read_until(b'\n', &mut line)? == 0 {
            return Ok(());
        }
        if !line.trim_ascii().is_empty() {
            take(&line)?;
        }
    }
}

/// The numbers and texts of an object, by their paths; `None` if the line is no object.
fn cells_of(line: &[u8]) -> Option<Vec<(String, String)>> {
    let line = line
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(line)
        .trim_ascii();
    if !line.starts_with(b"{") {
        return None;
    }
    let mut cells = Vec::new();
    let mut deserializer = serde_json::Deserializer::from_slice(line);
    let flat = Flat {
        path: String::new(),
        cells: &mut cells,
    };
    flat.deserialize(&mut deserializer).ok()?;
    deserializer.end().ok()?;
    Some(cells)
}

/// Takes a value apart, in the order of the file.
struct Flat<'f> {
    path: String,
    cells: &'f mut Vec<(String, String)>,
}

impl Flat<'_> {
    fn push<E>(self, cell: String) -> Result<(), E> {
        self.cells.push((self.path, cell));
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for Flat<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Flat<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a JSON value")
    }

    fn visit_bool<E>(self, value: bool) -> Result<(), E> {
        self.push(value.to_string())
    }

    fn visit_i64<E>(self, value: i64) -> Result<(), E> {
        self.push(value.to_string())
    }

    fn visit_u64<E>(self, value: u64) -> Result<(), E> {
        self.push(value.to_string())
    }

    fn visit_f64<E>(self, value: f64) -> Result<(), E> {
        self.push(value.to_string())
    }

    fn visit_str<E>(self, value: &str) -> Result<(), E> {
        self.push(value.to_owned())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        self.push(String::new())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<(), A::Error> {
        for index in 0..MOST_ELEMENTS {
            let path = format!("{}[{index}]", self.path);
            let element = Flat {
                path,
                cells: &mut *self.cells,
            };
            if elements.next_element_seed(element)?.is_none() {
                return Ok(());
            }
        }
        while elements.next_element::<IgnoredAny>()?.is_some() {}
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        while let Some(key) = entries.next_key::<String>()? {
            let path = match self.path.as_str() {
                "" => key,
                parent => format!("{parent}.{key}"),
            };
            if self.cells.len() > MOST_COLUMNS {
                return Err(A::Error::custom("too many values"));
            }
            entries.next_value_seed(Flat {
                path,
                cells: &mut *self.cells,
            })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn objects_become_rows_in_the_order_of_their_keys() {
        let text = b"{\"ts\":1700000000000000001,\"imu\":{\"az\":9.81,\"q\":[1,0.5]},\"on\":true}\n\nbad, line\n\
                     {\"ts\":1.5e9,\"boom\":null,\"text\":\"a, b\"}";
        assert!(is_beginning(text, true));
        let mut table = Vec::new();
        recode(&mut Cursor::new(text), &mut table).unwrap();
        assert_eq!(
            String::from_utf8(table).unwrap(),
            "ts,imu.az,imu.q[0],imu.q[1],on,boom,text\n1700000000000000001,9.81,1,0.5,true,,\n\
             \"bad, line\"\n1500000000,,,,,,\"a, b\"\n"
        );
        assert!(!is_beginning(b"[{\"ts\":1}]\n", true));
        assert!(!is_beginning(b"{\n\"ts\":1}\n", true));
        assert!(!is_beginning(b"{\"ts\":1,\"x\"", false));
        assert!(!is_beginning(b"{\"ts\":1,\"x\":2}\n", true));
        assert!(is_beginning(b"{\"ts\":1,\"x\":2}\n{\"ts", true));
    }
}
