//! Locates attachments and metadata records.

use std::ops::Range;

use super::{
    parsed::MessageRecord,
    visitor::{Next, Visitor},
};

/// Larger attachments are skipped.
pub(super) const RECORD_LIMIT_BYTES: u64 = 64 << 20;

#[derive(Default)]
pub(super) struct ExtraRanges(pub(super) Vec<Range<u64>>);

impl Visitor for ExtraRanges {
    fn wants_chunk(&self, _offset: u64) -> bool {
        false
    }

    fn message(&mut self, _record: &MessageRecord<'_>) -> Next {
        Next::Continue
    }

    fn topic_name(&self, _channel_id: u32) -> Option<&str> {
        None
    }

    fn other(&mut self, bytes: &Range<u64>) {
        if bytes.end - bytes.start <= RECORD_LIMIT_BYTES {
            self.0.push(bytes.clone());
        }
    }
}
