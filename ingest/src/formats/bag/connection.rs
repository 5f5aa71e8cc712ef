//! Connection records: a topic and its type under one number.

use std::collections::BTreeMap;

use super::header;
use crate::formats::records::{Channel, DefinitionRecord, SchemaRecord};

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
    let channel = Channel {
        schema_id: Some(id),
        topic: topic.to_owned(),
        encoding: "ros1".to_owned(),
        says,
    };
    take(DefinitionRecord::Channel { id, channel });
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (name, value) in fields {
            bytes.extend(((name.len() + 1 + value.len()) as u32).to_le_bytes());
            bytes.extend(name.as_bytes());
            bytes.push(b'=');
            bytes.extend(*value);
        }
        bytes
    }

    #[test]
    fn what_a_connection_says_of_its_writer_is_kept() {
        let header = fields(&[("conn", &[3, 0, 0, 0]), ("op", &[7]), ("topic", b"/map")]);
        let data = fields(&[
            ("type", b"nav_msgs/OccupancyGrid"),
            ("message_definition", b"int8[] data"),
            ("callerid", b"/map_server"),
            ("latching", b"1"),
        ]);
        let mut record = (header.len() as u32).to_le_bytes().to_vec();
        record.extend(header);
        record.extend((data.len() as u32).to_le_bytes());
        record.extend(data);
        let mut says = BTreeMap::new();
        connection(&record, &mut |definition| {
            if let DefinitionRecord::Channel { channel, .. } = definition {
                says = channel.says;
            }
        })
        .unwrap();
        let text = |text: &str| text.to_owned();
        let expected = [("callerid", "/map_server"), ("latching", "1")];
        assert_eq!(says, expected.map(|(k, v)| (text(k), text(v))).into());
    }
}
