//! What of a message's frames did not become numbers, and why.

use std::collections::BTreeMap;

use crate::message::Message;

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
    /// Frames whose checksum stood still although other data changed.
    pub standing_checksum: u64,
    /// By index of the signal: values that say "not available".
    pub not_available: BTreeMap<usize, u64>,
    /// By index of the signal: values that say "error", or are reserved.
    pub errors: BTreeMap<usize, u64>,
    /// By index of the signal: values outside the range that the description states.
    pub out_of_range: BTreeMap<usize, u64>,
    /// Frames by source address (J1939).
    pub sources: BTreeMap<u8, u64>,
    /// Messages of several packets that were not complete (J1939).
    pub incomplete: u64,
    /// Remote frames with its identifier, which carry no data.
    pub remote: u64,
}

impl Tally {
    /// Sentences about what did not become numbers; none if all did.
    #[must_use]
    pub fn lines(&self, message: &Message) -> Vec<String> {
        let name = &message.name;
        let mut lines = Vec::new();
        let mut tell = |count: u64, what: String| {
            if count > 0 {
                lines.push(format!("{name}: {count} of {} frames {what}", self.frames));
            }
        };
        if let Some((count, found)) = self.wrong_length {
            let expected = message.len;
            tell(
                count,
                format!(
                    "have a wrong length (expected {expected} bytes, found for example {found}): no numbers"
                ),
            );
        }
        if let Some((count, value)) = self.unknown_multiplexer {
            tell(
                count,
                format!(
                    "have an unknown multiplexer (for example {value}): no numbers of multiplexed signals"
                ),
            );
        }
        tell(
            self.standing_counter,
            "repeat the message counter of the frame before: no numbers".to_owned(),
        );
        tell(
            self.standing_checksum,
            "have the checksum of the frame before although other data changed".to_owned(),
        );
        let of_signals = [
            (&self.not_available, "say \"not available\""),
            (&self.errors, "say \"error\" or are reserved"),
            (&self.out_of_range, "lie outside the stated range"),
        ];
        for (counts, what) in of_signals {
            for (&index, count) in counts {
                let signal = message
                    .signals
                    .get(index)
                    .map_or("?", |signal| &signal.name);
                lines.push(format!(
                    "{name}.{signal}: {count} values {what}: no numbers"
                ));
            }
        }
        if self.incomplete > 0 {
            let count = self.incomplete;
            lines.push(format!(
                "{name}: {count} messages of several packets are incomplete: no numbers"
            ));
        }
        if self.remote > 0 {
            lines.push(format!(
                "{name}: {} remote frames carry no data",
                self.remote
            ));
        }
        lines
    }
}
