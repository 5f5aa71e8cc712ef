//! Attachments and metadata records.

use std::borrow::Cow;

use mcap::records::{Record, op};

use super::record;
use crate::message::Extra;

/// Parses an attachment or metadata record; `None` if it is damaged or of another kind.
pub(super) fn of_mcap_record(record: &[u8]) -> Option<Extra<'_>> {
    let (opcode, body, _) = record::split_record(record)?;
    if !matches!(opcode, op::ATTACHMENT | op::METADATA) {
        return None;
    }
    match mcap::parse_record(opcode, body).ok()? {
        Record::Metadata(metadata) => Some(Extra::Metadata(metadata)),
        Record::Attachment { header, data, crc } => {
            let checked = record::attachment_bytes(body)?;
            let is_intact = crc == 0 || crc32fast::hash(checked) == crc;
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
