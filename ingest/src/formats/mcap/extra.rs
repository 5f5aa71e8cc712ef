//! Attachments and metadata records.

use std::{borrow::Cow, ops::Range};

use mcap::records::{Record, op};

use crate::message::Extra;

/// Parses an attachment or metadata record; `None` if it is damaged or of another kind.
pub(super) fn of_mcap_record(record: &[u8]) -> Option<Extra<'_>> {
    const HEADER_BYTES: usize = 9;
    const CRC_BYTES: usize = 4;
    let (&opcode, _) = record.split_first()?;
    let body = record.get(HEADER_BYTES..)?;
    if !matches!(opcode, op::ATTACHMENT | op::METADATA) {
        return None;
    }
    match mcap::parse_record(opcode, body).ok()? {
        Record::Metadata(metadata) => Some(Extra::Metadata(metadata)),
        Record::Attachment { header, data, crc } => {
            let checked: Range<usize> = 0..body.len().checked_sub(CRC_BYTES)?;
            let is_intact = crc == 0 || crc32fast::hash(body.get(checked)?) == crc;
            is_intact.then_some(Extra::Attachment(mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data: Cow::Owned(data.into_owned()),
            }))
        }
        _ => None,
    }
}
