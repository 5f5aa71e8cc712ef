//! One message, still encoded.

use super::topic::TopicId;

/// One message, borrowed from the reader's buffer during a callback.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// The topic it was recorded on.
    pub topic: TopicId,
    /// Which of the topic's [`writers`](super::Topic::writers) sent it; 0 where the format does not tell them apart.
    pub writer: u32,
    /// When the recorder received it, in nanoseconds.
    pub log_time_ns: i64,
    /// When the sender sent it, in nanoseconds; equal to the log time where the format has none.
    pub publish_time_ns: i64,
    /// The sender's counter; zero where the format has none.
    pub sequence: u32,
    /// The encoded message.
    pub data: &'a [u8],
}
