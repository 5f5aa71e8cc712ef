//! Connection records: a topic and its type under one number.

use std::collections::BTreeMap;

use super::header;
use crate::formats::records::{ChannelRecord, DefinitionRecord, SchemaRecord};

/// Parses a connection, which defines a topic and its type.
pub(super) fn connection(record: &[u8], take: &mut dyn FnMut(DefinitionRecord<'_>)) -> Option<()> {
    let (header, data) = header::split(record)?;
    let id = header.connection?;
    let topic = std::str::from_utf8(header.topic?).ok()?;
    let mut type_name = None;
    let mut definition = &b""[..];
    let mut says = BTreeMap::new();
    header::fields(data, |name, value| match name {
        b"type" => type_name = std::str::from_utf8(value).ok(),
        b"message_definition" => definition = value,
        // what it says of the writer: its name, and whether it is latched
        _ => {
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            says.insert(text(name), text(value));
        }
    })?;
    let schema = SchemaRecord {
        name: type_name?,
        encoding: "ros1msg",
        data: definition,
    };
    take(DefinitionRecord::Schema { id, schema });
    let channel = ChannelRecord {
        schema_id: Some(id),
        topic,
        encoding: "ros1",
        says,
    };
    take(DefinitionRecord::Channel { id, channel });
    Some(())
}
