//! Counts of the frames and values of a message that did not become numbers, by reason.

use std::collections::BTreeMap;

/// Counts of one message.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// Frames, or reassembled messages, of the message.
    pub frames: u64,
    /// Among them those of another length than the message has, and one of these lengths. They give no numbers.
    pub wrong_length: Option<(u64, usize)>,
    /// Frames whose multiplexer selects nothing that the description knows, and one such value.
    pub unknown_multiplexer: Option<(u64, u64)>,
    /// Frames whose counter stood still since the last frame, so that they are repetitions. They give no numbers.
    pub standing_counter: u64,
    /// Frames with other data whose counter has never moved up to them: the sender does not count.
    pub idle_counter: u64,
    /// Frames whose checksum stood still although other data changed.
    pub standing_checksum: u64,
    /// Number of values that mean "not available", by index of the signal.
    pub not_available: BTreeMap<usize, u64>,
    /// Number of values that mean "error", or are reserved, by index of the signal.
    pub errors: BTreeMap<usize, u64>,
    /// Number of values outside the range that the description states, by index of the signal.
    pub out_of_range: BTreeMap<usize, u64>,
    /// Frames by source address (J1939).
    pub sources: BTreeMap<u8, u64>,
    /// Messages of several packets that were not complete (J1939).
    pub incomplete: u64,
    /// Remote frames with its identifier, which carry no data.
    pub remote: u64,
}
