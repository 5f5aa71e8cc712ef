//! A DBC file as a whole.

use can_dbc::{AttributeValue, Dbc, Message as DbcMessage, MessageId, decode_cp1252};

use super::{names, signals};
use crate::{
    frame::CanId,
    j1939::Identifier,
    message::{Addressing, Message, Protocol},
};

/// The messages of a DBC file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Database {
    /// Its messages, in file order.
    pub messages: Vec<Message>,
    /// Parts of the file that are not used, as sentences.
    pub notes: Vec<String>,
}

/// Error: a text is not a DBC file.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    /// The text does not follow the grammar.
    #[error("not a valid DBC file: {problem}")]
    Invalid {
        /// Place in the text, and what was expected there.
        problem: String,
    },
    /// The file is too large.
    #[error("expected a DBC file of at most {most} bytes, found {found}")]
    TooLarge {
        /// The most bytes.
        most: usize,
        /// Its bytes.
        found: usize,
    },
}

/// Large networks take some megabytes.
const MOST_BYTES: usize = 32 << 20;
/// The sender that DBC files state where any may be meant.
const NULL_ADDRESS: u8 = 0xfe;
/// Attribute of a message whose name is too long for its statement.
const LONG_NAME: &str = "SystemMessageLongSymbol";
/// The message that editors put signals into which belong to none.
const NO_MESSAGE: &str = "VECTOR__INDEPENDENT_SIG_MSG";

impl Database {
    /// Parses a DBC file, in UTF-8 or in code page 1252 as most editors write it, also line by line.
    ///
    /// # Errors
    /// The text is not a DBC file.
    pub fn parse(bytes: &[u8]) -> Result<Self, DatabaseError> {
        if bytes.len() > MOST_BYTES {
            return Err(DatabaseError::TooLarge {
                most: MOST_BYTES,
                found: bytes.len(),
            });
        }
        let text = text(bytes);
        let dbc = Dbc::try_from(text.trim_start_matches('\u{feff}'));
        let dbc = dbc.map_err(|error| DatabaseError::Invalid {
            problem: error.to_string(),
        })?;
        let mut database = Self::default();
        for message in dbc
            .messages
            .iter()
            .filter(|message| message.name != NO_MESSAGE)
        {
            let long = dbc.message_attribute(message.id, LONG_NAME);
            let long = names::long_name(long, &message.name);
            let is_taken = |name: &str| database.messages.iter().any(|known| known.name == name);
            let name = match long {
                Some(long) if is_taken(long) => {
                    database.notes.push(format!(
                        "{}: the name {long} is that of another message and is not used",
                        message.name
                    ));
                    &message.name
                }
                Some(long) => long,
                None => &message.name,
            };
            if is_taken(name) {
                database
                    .notes
                    .push(format!("{name}: stated twice, the first is used"));
                continue;
            }
            let prepared = prepare(&dbc, message, name, &mut database.notes);
            database.messages.push(prepared);
        }
        Ok(database)
    }

    /// A message by its name or by its short name.
    #[must_use]
    pub fn message(&self, name: &str) -> Option<&Message> {
        let find = |is: &dyn Fn(&&Message) -> bool| self.messages.iter().find(is);
        find(&|message| message.name == name)
            .or_else(|| find(&|message| message.symbol.as_deref() == Some(name)))
    }
}

/// Returns the text of a file. Editors write code page 1252; additions by other programs may be in UTF-8.
fn text(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len());
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        match std::str::from_utf8(line) {
            Ok(line) => text.push_str(line),
            Err(_) => {
                text.push_str(
                    &decode_cp1252(line).unwrap_or_else(|| String::from_utf8_lossy(line)),
                );
            }
        }
    }
    text
}

fn prepare(dbc: &Dbc, message: &DbcMessage, name: &str, notes: &mut Vec<String>) -> Message {
    let id = match message.id {
        MessageId::Standard(id) => CanId::standard(u32::from(id)),
        MessageId::Extended(id) => CanId::extended(id),
    };
    let group = is_j1939(dbc, message).then(|| Identifier::of(id)).flatten();
    let addressing = match group {
        Some(identifier) => Addressing::ParameterGroup {
            pgn: identifier.pgn,
            source: (identifier.source < NULL_ADDRESS).then_some(identifier.source),
        },
        None => Addressing::Id(id),
    };
    Message {
        name: name.to_owned(),
        symbol: (name != message.name).then(|| message.name.clone()),
        addressing,
        len: usize::try_from(message.size).unwrap_or(usize::MAX),
        protocol: if group.is_some() {
            Protocol::J1939
        } else {
            Protocol::Plain
        },
        signals: signals::prepare(dbc, message, name, notes),
    }
}

/// Whether the file declares a message as one of J1939: by the attribute `VFrameFormat` of the message, or by `ProtocolType` of
/// the whole file.
fn is_j1939(dbc: &Dbc, message: &DbcMessage) -> bool {
    /// Index of `J1939PG` in the usual list of formats.
    const PARAMETER_GROUP: u64 = 3;
    let says = |value: &AttributeValue| match value {
        AttributeValue::String(text) => text.contains("J1939"),
        AttributeValue::Uint(number) => *number == PARAMETER_GROUP,
        AttributeValue::Int(number) => *number == PARAMETER_GROUP as i64,
        AttributeValue::Double(number) => *number == PARAMETER_GROUP as f64,
    };
    let default = |name: &str| {
        let defaults = dbc.attribute_defaults.iter();
        defaults
            .filter(|default| default.name == name)
            .map(|default| &default.value)
            .next()
    };
    let of_message = dbc.attribute_values_message.iter();
    let format = of_message
        .filter(|of| of.message_id == message.id && of.name == "VFrameFormat")
        .map(|of| &of.value)
        .next();
    if let Some(format) = format.or_else(|| default("VFrameFormat")) {
        return says(format);
    }
    let protocol = dbc.attribute_values_database.iter();
    let protocol = protocol
        .filter(|of| of.name == "ProtocolType")
        .map(|of| &of.value)
        .next();
    let protocol = protocol.or_else(|| default("ProtocolType"));
    matches!(protocol, Some(AttributeValue::String(text)) if text.contains("J1939"))
}
