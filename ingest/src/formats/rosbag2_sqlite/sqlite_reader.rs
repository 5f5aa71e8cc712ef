//! Opens a database and registers its topics.
//!
//! Where SQLite cannot read the table of topics, it is salvaged from single pages.

use std::{collections::HashMap, path::PathBuf};

use rusqlite::Connection;
use tipwatch_language::say;

use super::{
    connection::connect,
    cut::Cut,
    private_copy::{self, PrivateCopy},
    salvage::{self, Salvage},
    tables::{self, Counts},
};
use crate::{
    file::{FileBytes, LogFile},
    message::{Error, Losses, TopicDescription, TopicId, TopicTable},
};

/// One database.
pub(crate) struct SqliteReader {
    /// The path as given; `data` may be a copy.
    pub(super) path: PathBuf,
    pub(super) file: FileBytes,
    data: PathBuf,
    _copy: Option<PrivateCopy>,
    pub(super) cut: Option<Cut>,
    /// Topic and writer, by the topic's id in the database.
    pub(super) topics: HashMap<i64, (TopicId, u32)>,
}

impl SqliteReader {
    pub(crate) fn open(
        named: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = named.path();
        let copy = private_copy::with_journal(named, losses);
        let data = copy.as_ref().map_or(named.data(), |copy| &copy.path);
        let (file, cut) = Cut::find(FileBytes::open(data, path)?, path, losses)?;
        let mut reader = Self {
            path: path.to_path_buf(),
            data: data.to_path_buf(),
            cut,
            file,
            _copy: copy,
            topics: HashMap::new(),
        };
        reader.register(topics, losses)?;
        Ok(reader)
    }

    pub(super) fn connect(&self) -> Result<Connection, Error> {
        connect(&self.data, &self.path)
    }

    fn register(&mut self, topics: &mut TopicTable, losses: &mut Losses) -> Result<(), Error> {
        let connection = self.connect()?;
        let definitions = tables::definitions(&connection);
        let counts = Counts::read(&connection);
        let rows = match tables::topic_rows(&connection, &self.path) {
            Ok(rows) => rows,
            Err(error) => self.salvaged_topics(error, losses)?,
        };
        for row in rows {
            let definition = definitions.get(&row.type_name);
            let description = TopicDescription {
                name: &row.name,
                type_name: &row.type_name,
                encoding: &row.encoding,
                schema_encoding: definition.map_or("", |definition| &definition.encoding),
                definition: definition.map(|definition| definition.text.as_bytes()),
            };
            let qos = row.offered_qos.filter(|qos| !qos.is_empty());
            let qos = qos.map(|qos| ("offered_qos_profiles".to_owned(), qos));
            let (id, writer) = topics.register_writer(&description, &qos.into_iter().collect());
            topics.add_messages(id, counts.as_ref().map(|counts| counts.of_topic(row.id)));
            self.topics.insert(row.id, (id, writer));
        }
        let path = self.path.display();
        match counts.map(|counts| counts.missing()) {
            None => losses.note(say!("{path}: the messages cannot be counted")),
            Some(0) => {}
            Some(missing) => losses.note(say!(
                "{path}: {missing} message ids are missing from the recorder's numbering"
            )),
        }
        Ok(())
    }

    /// The topics found in single pages; the error if there are none.
    fn salvaged_topics(
        &self,
        error: Error,
        losses: &mut Losses,
    ) -> Result<Vec<salvage::TopicRow>, Error> {
        let topics = match Salvage::open(&self.file)? {
            Some(mut salvage) => salvage.topics()?,
            None => Vec::new(),
        };
        if topics.is_empty() {
            return Err(error);
        }
        losses.note(say!(
            "{error}; {} topics were found in single pages",
            topics.len()
        ));
        Ok(topics)
    }
}
