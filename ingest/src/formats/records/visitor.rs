//! Interface that the walk over a file calls for each record.

use super::{
    channel_counts::ChannelCounts,
    parsed::{DefinitionRecord, MessageRecord},
};
use crate::formats::reader::Batch;

/// Instruction of a visitor to the walk after a message.
#[derive(PartialEq, Eq)]
pub(crate) enum Next {
    Continue,
    /// Continue, but the channel of the message is not defined.
    UndefinedChannel,
    Stop,
}

/// Receives what the walk finds.
pub(crate) trait Visitor {
    /// Whether the chunk at this offset is wanted.
    fn wants_chunk(&self, _offset: u64) -> bool {
        true
    }
    /// A wanted chunk begins.
    fn begin_chunk(&mut self, _offset: u64, _end: u64) {}
    /// Takes a definition; `false` if it contradicts an earlier one.
    fn definition(&mut self, _definition: &DefinitionRecord<'_>) -> bool {
        true
    }
    fn message(&mut self, record: &MessageRecord<'_>) -> Next;
    /// Accepts the decoded messages of a chunk.
    fn accept(&mut self, _batch: &mut dyn Batch, _counts: &mut ChannelCounts) {}
    /// Whether a message after damage is plausible: its channel is known, and its time is near that
    /// of another message.
    fn is_likely(&self, record: &MessageRecord<'_>, near_ns: Option<i64>) -> bool {
        const NEAR_NS: u64 = 3_600_000_000_000;
        let is_near = |time_ns: i64| time_ns.abs_diff(record.log_time_ns) < NEAR_NS;
        near_ns.is_some_and(is_near) && self.topic_name(record.channel_id).is_some()
    }
    /// The topic of a channel, for the loss report.
    fn topic_name(&self, channel_id: u32) -> Option<&str>;
    /// Whether the walk continues after the last message, where definitions are repeated.
    fn wants_repetitions(&self) -> bool {
        false
    }
    /// A record outside chunks that concerns no message.
    fn other(&mut self, _bytes: &std::ops::Range<u64>) {}
    fn progress(&mut self, _offset: u64) {}
}
