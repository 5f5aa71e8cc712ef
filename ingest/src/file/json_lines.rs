//! Lines of which each is a JSON object: they are read through a private copy as a table with a column for each number.

use std::{
    collections::BTreeMap,
    fmt,
    io::{self, BufRead, Write},
};

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use tipwatch_language::say;

use super::lines::{each_line, without_mark};

/// Columns, at most; others are left out.
const MOST_COLUMNS: usize = 4096;
/// Elements of an array that are columns.
const MOST_ELEMENTS: usize = 64;
/// Longest name of a column that is the path of a value, but for the brackets of arrays.
const MOST_PATH_BYTES: usize = 512;

/// Whether a text begins with a line that is a JSON object. A single object describes something else: it is no row of a log.
pub(super) fn is_beginning(beginning: &[u8], is_whole: bool) -> bool {
    let lines = beginning.split_inclusive(|&byte| byte == b'\n');
    let mut lines = lines.filter(|line| !line.trim_ascii().is_empty());
    let first = lines.next().filter(|line| line.ends_with(b"\n"));
    first.is_some_and(|line| {
        (!is_whole || lines.next().is_some())
            && Object::of(line).is_some_and(|object| object.cells.len() > 1)
    })
}

/// Copies the objects as rows of a table. A line that is no object becomes a row that is none. Describes the values left out.
pub(super) fn recode(
    source: &mut (impl BufRead + io::Seek),
    target: &mut dyn Write,
) -> io::Result<Vec<String>> {
    let begins_at = source.stream_position()?;
    let mut columns: BTreeMap<String, usize> = BTreeMap::new();
    let mut names: Vec<String> = Vec::new();
    each_line(source, &mut |line| {
        for (name, _) in Object::of(line).unwrap_or_default().cells {
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
    let mut left_out = LeftOut::default();
    let mut row: Vec<Option<String>> = Vec::new();
    each_line(source, &mut |line| {
        if line.trim_ascii().is_empty() {
            return Ok(());
        }
        let object = Object::of(line).filter(|object| !object.cells.is_empty());
        let Some(object) = object else {
            let shown = line.get(..line.len().min(40)).unwrap_or_default();
            return Ok(table.write_record([String::from_utf8_lossy(shown.trim_ascii()).as_ref()])?);
        };
        left_out.add(&object.left_out);
        row.clear();
        row.resize(names.len(), None);
        for (name, cell) in object.cells {
            let place = columns.get(&name).and_then(|&at| row.get_mut(at));
            match place {
                Some(place @ None) => *place = Some(cell),
                Some(Some(_)) => left_out.repeated += 1,
                None => left_out.beyond += 1,
            }
        }
        let cells = row.iter().map(|cell| cell.as_deref().unwrap_or_default());
        Ok(table.write_record(cells)?)
    })?;
    table.flush()?;
    Ok(left_out.told())
}

/// Counts of the values of objects that are in no column, by reason.
#[derive(Debug, Default)]
struct LeftOut {
    beyond: u64,
    elements: u64,
    long: u64,
    repeated: u64,
}

impl LeftOut {
    fn add(&mut self, other: &Self) {
        self.beyond += other.beyond;
        self.elements += other.elements;
        self.long += other.long;
        self.repeated += other.repeated;
    }

    fn told(&self) -> Vec<String> {
        let Self {
            beyond,
            elements,
            long,
            repeated,
        } = self;
        let told = [
            (*beyond > 0).then(|| {
                say!(
                    "{beyond} values are left out: at most {} are columns",
                    MOST_COLUMNS
                )
            }),
            (*elements > 0).then(|| {
                say!(
                    "{elements} elements of arrays are left out: of each array, the first {} are columns",
                    MOST_ELEMENTS
                )
            }),
            (*long > 0).then(|| {
                say!(
                    "{long} values are left out: their names have more than {} bytes",
                    MOST_PATH_BYTES
                )
            }),
            (*repeated > 0).then(|| {
                say!(
                    "{repeated} values are left out: another one in their line has the same name"
                )
            }),
        ];
        told.into_iter().flatten().collect()
    }
}

/// The numbers and texts of an object, by their paths.
#[derive(Debug, Default)]
struct Object {
    cells: Vec<(String, String)>,
    left_out: LeftOut,
}

impl Object {
    /// `None` if the line is no object.
    fn of(line: &[u8]) -> Option<Self> {
        let line = without_mark(line).trim_ascii();
        if !line.starts_with(b"{") {
            return None;
        }
        let mut object = Self::default();
        let mut deserializer = serde_json::Deserializer::from_slice(line);
        let flat = Flat {
            path: String::new(),
            object: &mut object,
        };
        flat.deserialize(&mut deserializer).ok()?;
        deserializer.end().ok()?;
        Some(object)
    }
}

/// Takes a value apart, in the order of the file.
struct Flat<'f> {
    path: String,
    object: &'f mut Object,
}

impl Flat<'_> {
    fn push<E>(self, cell: String) -> Result<(), E> {
        if self.object.cells.len() < MOST_COLUMNS {
            self.object.cells.push((self.path, cell));
        } else {
            self.object.left_out.beyond += 1;
        }
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
                object: &mut *self.object,
            };
            if elements.next_element_seed(element)?.is_none() {
                return Ok(());
            }
        }
        while elements.next_element::<IgnoredAny>()?.is_some() {
            self.object.left_out.elements += 1;
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        while let Some(key) = entries.next_key::<String>()? {
            if self.path.len() + key.len() > MOST_PATH_BYTES {
                entries.next_value::<IgnoredAny>()?;
                self.object.left_out.long += 1;
                continue;
            }
            let path = match self.path.as_str() {
                "" => key,
                parent => format!("{parent}.{key}"),
            };
            entries.next_value_seed(Flat {
                path,
                object: &mut *self.object,
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

    fn recoded(text: &str) -> (String, Vec<String>) {
        let mut table = Vec::new();
        let told = recode(&mut Cursor::new(text), &mut table).unwrap();
        (String::from_utf8(table).unwrap(), told)
    }

    #[test]
    fn what_is_in_no_column_is_told() {
        let (table, told) = recoded("{\"a.b\":1,\"a\":{\"b\":2}}\n{\"a.b\":3}\n");
        assert_eq!((table.as_str(), told.len()), ("a.b\n1\n3\n", 1));
        let elements = vec!["1"; MOST_ELEMENTS + 3].join(",");
        let (table, told) = recoded(&format!("{{\"t\":1,\"k\":[{elements}]}}\n"));
        assert_eq!(table.lines().next().unwrap().split(',').count(), 65);
        assert!(told.len() == 1 && told[0].starts_with("3 "), "{told:?}");
        let keys = |from: usize| {
            let keys = from..from + MOST_COLUMNS;
            let pairs: Vec<String> = keys.map(|key| format!("\"{key}\":1")).collect();
            format!("{{{}}}\n", pairs.join(","))
        };
        let (_, told) = recoded(&(keys(0) + &keys(5)));
        assert!(told.len() == 1 && told[0].starts_with("5 "), "{told:?}");
        assert!(recoded(&keys(0)).1.is_empty());
    }

    #[test]
    fn the_memory_of_a_line_is_bounded_by_its_length() {
        let keys: Vec<String> = (0..4000).map(|key| format!("\"{key}\":1")).collect();
        let long = format!("{{\"{}\":{{{}}}}}", "k".repeat(1 << 20), keys.join(","));
        let object = Object::of(long.as_bytes()).unwrap();
        assert_eq!((object.cells.len(), object.left_out.long), (0, 1));
        let list = |of: &str| format!("[{}]", vec![of; MOST_ELEMENTS].join(","));
        let cube = format!("{{\"k\":{}}}", list(&list(&list("1"))));
        let object = Object::of(cube.as_bytes()).unwrap();
        let beyond = (MOST_ELEMENTS.pow(3) - MOST_COLUMNS) as u64;
        assert_eq!(
            (object.cells.len(), object.left_out.beyond),
            (MOST_COLUMNS, beyond)
        );
        // an object without values is no row: it would be one of commas
        let (table, _) = recoded("{\"a\":1,\"b\":2}\n{}\n");
        assert_eq!(table, "a,b\n1,2\n{}\n");
    }
}
