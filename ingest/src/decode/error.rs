//! Errors of decoding a message.

/// Error: a message cannot be decoded. Offsets count from the start of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The message ends before a wanted field.
    #[error("byte {offset}: expected {needed_bytes} more bytes, found {available_bytes}")]
    TooShort {
        /// Start of the field.
        offset: usize,
        /// Size of the field.
        needed_bytes: usize,
        /// The bytes left.
        available_bytes: usize,
    },
    /// An array or string claims more elements than the rest of the message can hold.
    #[error("byte {offset}: an array of {count} elements, but only {available_bytes} bytes follow")]
    ImpossibleCount {
        /// Position of the count.
        offset: usize,
        /// The count.
        count: usize,
        /// Bytes left in the message.
        available_bytes: usize,
    },
    /// A message of another sensor than the first one of its topic.
    #[error(
        "header.frame_id is another than in the first message: another sensor, which needs a topic of its own"
    )]
    OtherFrame,
    /// An encoding other than plain CDR.
    #[error("expected plain CDR (encapsulation 0x0000 or 0x0001), found 0x{found:04x} ({name})")]
    Encapsulation {
        /// The first two bytes.
        found: u16,
        /// The name of that encoding.
        name: &'static str,
    },
    /// A message that is not a JSON object.
    #[error("line {line}, column {column}: {problem}")]
    Json {
        /// Counted from 1.
        line: usize,
        /// Counted from 1.
        column: usize,
        /// Description of the problem.
        problem: &'static str,
    },
    /// A message that is not valid protobuf of its type.
    #[error("protobuf: {problem}")]
    Protobuf {
        /// Description of the problem.
        problem: &'static str,
    },
}
