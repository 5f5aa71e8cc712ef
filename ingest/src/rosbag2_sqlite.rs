//! The SQLite database of rosbag2: a table of topics and one row for each message.

use std::{
    collections::HashMap,
    fmt::Write as _,
    ops::ControlFlow,
    os::unix::ffi::OsStrExt,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, OpenFlags, Row, types::ValueRef};

use crate::{
    error::Error,
    file_bytes::FileBytes,
    losses::{Losses, LostPart},
    message::Message,
    reader::{Reader, Request},
    topic::{TopicDescription, TopicId, TopicTable},
};

/// Rows between two calls for progress.
const ROWS_PER_PROGRESS: u64 = 1024;

/// One database.
pub(crate) struct SqliteReader {
    path: PathBuf,
    bytes: u64,
    cut: Option<Cut>,
    /// By the number that the database gives a topic.
    topics: HashMap<i64, TopicId>,
}

impl SqliteReader {
    pub(crate) fn open(
        path: &Path,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let file = FileBytes::open(path)?;
        let cut = Cut::find(&file, losses)?;
        report_unmerged_journal(path, losses);
        let connection = connect(path)?;
        let definitions = definitions(&connection);
        let counts = message_counts(&connection);
        let mut ids = HashMap::new();
        for row in topic_rows(&connection, path)? {
            let definition = definitions.get(&row.type_name);
            let id = topics.register(&TopicDescription {
                name: &row.name,
                type_name: &row.type_name,
                encoding: &row.encoding,
                schema_encoding: definition.map_or("", |definition| &definition.encoding),
                definition: definition.map(|definition| definition.text.as_bytes()),
            });
            let count = counts
                .as_ref()
                .map(|counts| counts.get(&row.id).copied().unwrap_or(0));
            topics.add_messages(id, count);
            ids.insert(row.id, id);
        }
        if counts.is_none() {
            losses.note(format!(
                "{}: the messages cannot be counted",
                path.display()
            ));
        }
        Ok(Self {
            path: path.to_path_buf(),
            bytes: file.len(),
            cut,
            topics: ids,
        })
    }
}

/// Opens without any right to write, and without the files that SQLite makes beside a database.
fn connect(path: &Path) -> Result<Connection, Error> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
        | OpenFlags::SQLITE_OPEN_URI
        | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection =
        Connection::open_with_flags(uri(path), flags).map_err(Error::sqlite(path, "opening"))?;
    // A database cut short is refused as a whole unless its schema counts as writable. Nothing
    // can be written: the file is open for reading only.
    connection
        .execute_batch("PRAGMA writable_schema=ON; PRAGMA trusted_schema=OFF;")
        .map_err(Error::sqlite(path, "opening"))?;
    Ok(connection)
}

/// SQLite takes options in an address only, in which every unusual byte has to be escaped.
fn uri(path: &Path) -> String {
    let mut uri = String::from("file:");
    for &byte in path.as_os_str().as_bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri.push_str("?mode=ro&immutable=1");
    uri
}

/// The end of a database that is shorter than it claims to be.
///
/// SQLite reads zeros behind the end of the file. The last message of a page that is cut in two
/// then comes out whole, with zeros at its end, and only these bytes give it away.
struct Cut {
    last_bytes: Vec<u8>,
}

impl Cut {
    /// Compares the size that the database claims with that of the file.
    fn find(file: &FileBytes, losses: &mut Losses) -> Result<Option<Self>, Error> {
        const PAGE_SIZE_OFFSET: usize = 16;
        const PAGE_COUNT_OFFSET: usize = 28;
        const COMPARED_BYTES: u64 = 16;
        let mut header = [0; 32];
        if file.len() < header.len() as u64 {
            return Ok(None);
        }
        file.read_at(0, &mut header)?;
        let page_bytes = header[PAGE_SIZE_OFFSET..]
            .first_chunk()
            .map(|b| u16::from_be_bytes(*b));
        let page_bytes = match page_bytes {
            Some(1) => 65536,
            Some(bytes) => u64::from(bytes),
            None => 0,
        };
        let pages = header[PAGE_COUNT_OFFSET..]
            .first_chunk()
            .map_or(0, |b| u32::from_be_bytes(*b));
        let expected = page_bytes * u64::from(pages);
        if expected <= file.len() {
            return Ok(None);
        }
        let reason = format!(
            "expected a database of {expected} bytes, found {}",
            file.len()
        );
        losses.lose(LostPart::Tail, file.path(), file.len()..expected, reason);
        let last_bytes = file.read_vec(file.len() - COMPARED_BYTES, COMPARED_BYTES)?;
        Ok(Some(Self { last_bytes }))
    }

    /// Whether a message may reach over the end of the file: somewhere it goes on as the file
    /// ends, and nothing but zeros follows.
    fn may_run_through(&self, data: &[u8]) -> bool {
        let zeros = data.iter().rev().take_while(|byte| **byte == 0).count();
        (data.len() - zeros..data.len()).any(|end| {
            let compared = end.min(self.last_bytes.len());
            let file_end = &self.last_bytes[self.last_bytes.len() - compared..];
            data[..end].ends_with(file_end)
        })
    }
}

/// A recorder that was killed leaves its last messages in a journal, which only a writer may merge.
fn report_unmerged_journal(path: &Path, losses: &mut Losses) {
    let mut journal = path.as_os_str().to_owned();
    journal.push("-wal");
    let journal = PathBuf::from(journal);
    let bytes = std::fs::metadata(&journal).map_or(0, |metadata| metadata.len());
    if bytes > 0 {
        let reason = "a write-ahead journal that was never merged is not read".to_owned();
        losses.lose(LostPart::File, &journal, 0..bytes, reason);
    }
}

struct Definition {
    encoding: String,
    text: String,
}

/// The definitions by type name. Older databases have no such table.
fn definitions(connection: &Connection) -> HashMap<String, Definition> {
    const QUERY: &str =
        "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
    let Ok(mut statement) = connection.prepare(QUERY) else {
        return HashMap::new();
    };
    let rows = statement.query_map([], |row| {
        Ok((
            row.get(0)?,
            Definition {
                encoding: row.get(1)?,
                text: row.get(2)?,
            },
        ))
    });
    rows.into_iter().flatten().flatten().collect()
}

struct TopicRow {
    id: i64,
    name: String,
    type_name: String,
    encoding: String,
}

fn topic_rows(connection: &Connection, path: &Path) -> Result<Vec<TopicRow>, Error> {
    const QUERY: &str = "SELECT id, name, type, serialization_format FROM topics ORDER BY id";
    let failed = || Error::sqlite(path, "the table of topics");
    let mut statement = connection.prepare(QUERY).map_err(failed())?;
    let rows = statement
        .query_map([], |row| {
            Ok(TopicRow {
                id: row.get(0)?,
                name: row.get(1)?,
                type_name: row.get(2)?,
                encoding: row.get(3)?,
            })
        })
        .map_err(failed())?;
    rows.collect::<Result<_, _>>().map_err(failed())
}

/// Messages by topic; `None` when damage prevents counting.
fn message_counts(connection: &Connection) -> Option<HashMap<i64, u64>> {
    const QUERY: &str = "SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id";
    let mut statement = connection.prepare(QUERY).ok()?;
    let rows = statement
        .query_map([], |row| Ok((row.get(0)?, row.get::<_, i64>(1)?)))
        .ok()?;
    rows.map(|row| row.map(|(id, count)| (id, count.unsigned_abs())))
        .collect::<Result<_, _>>()
        .ok()
}

impl Reader for SqliteReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        let connection = connect(&self.path)?;
        let mut pass = Pass {
            reader: self,
            request,
            rows: 0,
            last_id: None,
            malformed: 0,
        };
        let flow = match pass.run(&connection) {
            Ok(flow) => flow,
            Err(source) => {
                pass.report_broken_off(&source);
                ControlFlow::Continue(())
            }
        };
        pass.report_malformed();
        Ok(flow)
    }
}

/// One reading of all wanted rows.
struct Pass<'p, 'r> {
    reader: &'p SqliteReader,
    request: &'p mut Request<'r>,
    rows: u64,
    last_id: Option<i64>,
    malformed: u64,
}

impl Pass<'_, '_> {
    fn run(&mut self, connection: &Connection) -> Result<ControlFlow<()>, rusqlite::Error> {
        self.request.losses.integrity.checksums_absent = true;
        let Some(query) = self.query() else {
            return Ok(ControlFlow::Continue(()));
        };
        let mut statement = connection.prepare(&query)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            if self.row(row)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// `None` when no topic of this file is wanted.
    fn query(&self) -> Option<String> {
        let topics = self.reader.topics.iter();
        let wanted = topics.filter(|(_, topic)| self.request.wants(**topic));
        let numbers: Vec<String> = wanted.map(|(id, _)| id.to_string()).collect();
        let list = numbers.join(", ");
        (!numbers.is_empty()).then(|| {
            format!(
                "SELECT id, topic_id, timestamp, data FROM messages \
                 WHERE topic_id IN ({list}) ORDER BY id"
            )
        })
    }

    fn row(&mut self, row: &Row<'_>) -> Result<ControlFlow<()>, rusqlite::Error> {
        self.last_id = row.get_ref(0)?.as_i64().ok();
        self.rows += 1;
        if self.rows.is_multiple_of(ROWS_PER_PROGRESS) {
            self.request.advance(self.estimated_bytes());
        }
        let topic = row
            .get_ref(1)?
            .as_i64()
            .ok()
            .and_then(|id| self.reader.topics.get(&id));
        let time_ns = row.get_ref(2)?.as_i64();
        let (Some(&topic), Ok(time_ns), ValueRef::Blob(data)) = (topic, time_ns, row.get_ref(3)?)
        else {
            self.malformed += 1;
            return Ok(ControlFlow::Continue(()));
        };
        if self
            .reader
            .cut
            .as_ref()
            .is_some_and(|cut| cut.may_run_through(data))
        {
            self.malformed += 1;
            return Ok(ControlFlow::Continue(()));
        }
        Ok((self.request.visit)(&Message {
            topic,
            log_time_ns: time_ns,
            publish_time_ns: time_ns,
            sequence: 0,
            data,
        }))
    }

    /// SQLite does not tell positions. Rows come evenly enough for a progress bar.
    fn estimated_bytes(&self) -> u64 {
        const TYPICAL_ROW_BYTES: u64 = 400;
        (self.rows * TYPICAL_ROW_BYTES).min(self.reader.bytes)
    }

    fn report_broken_off(&mut self, source: &rusqlite::Error) {
        let reason = match self.last_id {
            Some(id) => format!("after message {id}: {source}"),
            None => format!("no message can be read: {source}"),
        };
        let reason = format!("{reason} (a database does not tell which bytes these are)");
        let bytes = self.reader.bytes;
        self.request
            .losses
            .lose(LostPart::Tail, &self.reader.path, bytes..bytes, reason);
    }

    fn report_malformed(&mut self) {
        if self.malformed > 0 {
            let reason = format!("{} rows are no whole messages", self.malformed);
            let bytes = self.reader.bytes;
            self.request
                .losses
                .lose(LostPart::Records, &self.reader.path, bytes..bytes, reason);
        }
    }
}
