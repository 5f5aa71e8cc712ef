//! CAN signals of a machine file: reads the DBC files that it names and makes their messages topics of the log.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use tipwatch_can::{Database, Message, Protocol, Signal, j1939};
use tipwatch_ingest::{CanTopic, Log};
use tipwatch_language::say;
use tipwatch_mechanics::machine::{CanMessageSpec, CanSpec, can_signals};

use crate::error::CanError;
use crate::machine_file::{MachineFile, MachineFileError};

/// Far above any DBC file.
const LIMIT_BYTES: u64 = 32 << 20;

/// Reads a DBC file.
///
/// # Errors
/// The file cannot be read, or is not a DBC file.
pub fn read_dbc(path: &Path) -> Result<Database, CanError> {
    let failed = |source| CanError::Read {
        path: path.into(),
        source,
    };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(LIMIT_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Database::parse(&bytes).map_err(|source| CanError::Dbc {
        path: path.into(),
        source,
    })
}

impl MachineFile {
    /// Opens a log whose CAN messages, as far as the machine file names signals of them, are topics of their own.
    ///
    /// # Errors
    /// The log or a DBC file cannot be read, or a message or signal is not described.
    pub fn open_log(&self, path: &Path) -> Result<Log, MachineFileError> {
        self.decode_can(Log::open(path)?)
    }

    /// A log whose CAN messages, as far as the machine file names signals of them, are topics of their own.
    ///
    /// # Errors
    /// A DBC file cannot be read, or a message or signal is not described.
    pub fn decode_can(&self, mut log: Log) -> Result<Log, MachineFileError> {
        let topics = self.can_topics()?;
        if !topics.is_empty() {
            log.decode_can(&topics)?;
        }
        Ok(log)
    }

    /// The DBC files that the machine file names.
    #[must_use]
    pub fn dbc_files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = Vec::new();
        for can in can_signals(&self.text) {
            if let CanMessageSpec::Dbc { file, .. } = can.message {
                let path = self.beside(&file);
                if !files.contains(&path) {
                    files.push(path);
                }
            }
        }
        files
    }

    fn can_topics(&self) -> Result<Vec<CanTopic>, CanError> {
        let mut databases: BTreeMap<PathBuf, Database> = BTreeMap::new();
        let mut topics: Vec<CanTopic> = Vec::new();
        for can in can_signals(&self.text) {
            let (mut message, mut notes) = match &can.message {
                CanMessageSpec::ParameterGroup(pgn) => (public_group(*pgn)?, Vec::new()),
                CanMessageSpec::Dbc { file, message } => {
                    let path = self.beside(file);
                    if !databases.contains_key(&path) {
                        databases.insert(path.clone(), read_dbc(&path)?);
                    }
                    described(&databases[&path], &path, message)?
                }
            };
            let Some(index) = message.signal(&can.signal) else {
                let names = message.signals.iter().map(|signal| signal.name.clone());
                return Err(CanError::NoSignal {
                    message: message.name.clone(),
                    signal: can.signal,
                    available: names.collect(),
                });
            };
            notes.extend(unit_note(&can, &message.signals[index]));
            // the field of the topic is called as the machine file calls it, also by the short name
            let mut named = message.signals[index].clone();
            named.name = can.signal.clone();
            let add = |message: &mut Message| {
                if message
                    .signals
                    .iter()
                    .all(|signal| signal.name != named.name)
                {
                    message.signals.push(named);
                }
            };
            match topics.iter_mut().find(|topic| topic.name == can.topic()) {
                Some(topic) => {
                    add(&mut topic.message);
                    topic.notes.extend(notes);
                }
                None => {
                    add(&mut message);
                    topics.push(CanTopic {
                        name: can.topic(),
                        bus: can.bus,
                        message,
                        source: can.source,
                        notes,
                    });
                }
            }
        }
        Ok(topics)
    }
}

fn public_group(pgn: u32) -> Result<Message, CanError> {
    j1939::public_group(pgn).ok_or_else(|| CanError::NoGroup {
        pgn,
        known: j1939::public_groups()
            .filter_map(|group| group.pgn())
            .collect(),
    })
}

/// A message of a DBC file, and remarks about it.
fn described(
    database: &Database,
    path: &Path,
    name: &str,
) -> Result<(Message, Vec<String>), CanError> {
    let message = database.message(name).ok_or_else(|| CanError::NoMessage {
        path: path.into(),
        message: name.into(),
        available: database
            .messages
            .iter()
            .map(|message| message.name.clone())
            .collect(),
    })?;
    let of_message = format!("{}.", message.name);
    let notes = database
        .notes
        .iter()
        .filter(|note| note.starts_with(&of_message));
    let mut notes: Vec<String> = notes
        .map(|note| format!("{}: {note}", path.display()))
        .collect();
    if message.protocol == Protocol::Plain && message.is_extended() {
        notes.push(say!(
            "{}: message {name} has a 29-bit identifier and the file does not say J1939: its identifier must match \
             exactly, and the highest values count as numbers",
            path.display()
        ));
    }
    Ok((message.clone(), notes))
}

/// Returns the note on the unit of a signal: converted, taken as SI, or left to scale and offset of the machine file; `None` for
/// an SI unit.
fn unit_note(can: &CanSpec, signal: &Signal) -> Option<String> {
    let name = format!("{}.{}", can.topic(), can.signal);
    match (signal.is_converted, signal.unit.as_str()) {
        (true, "") => Some(say!(
            "{name}: no unit is stated; its values are taken as SI units"
        )),
        (true, unit) if unit != signal.si.symbol && signal.si.factor != 1.0 => {
            Some(say!("{name}: {unit} is converted to {}", signal.si.symbol))
        }
        (true, _) => None,
        (false, unit) => Some(say!(
            "{name}: the unit \"{}\" is not converted: scale and offset of the machine file must do it",
            unit.escape_debug()
        )),
    }
}
