//! One message, still encoded.

use super::topic::TopicId;

/// One message, borrowed from the reader's buffer during a callback.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// The topic on which the message was recorded.
    pub topic: TopicId,
    /// Index of the message's sender among the topic's [`writers`](super::Topic::writers); 0 where the format does not tell them
    /// apart.
    pub writer: u32,
    /// Time at which the recorder received the message, in nanoseconds.
    pub log_time_ns: i64,
    /// Time at which the sender sent the message, in nanoseconds; equal to the log time where the format has none.
    pub publish_time_ns: i64,
    /// The sender's counter; zero where the format has none.
    pub sequence: u32,
    /// The encoded message.
    pub data: &'a [u8],
}
