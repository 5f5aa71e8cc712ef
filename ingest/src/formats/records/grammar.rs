//! The record syntax that a format defines for the walk.

use super::{
    contents::Contents,
    packed_chunk::PackedChunk,
    parsed::{DefinitionRecord, MessageRecord},
};
use crate::{
    file::FileBytes,
    message::{Error, Extra},
};

/// The role of a record in the walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Chunk,
    Message,
    /// A message type, a channel, a connection.
    Definition,
    /// The number of messages of one channel in the preceding chunk.
    Index,
    /// The messages end here; later records repeat earlier ones.
    End,
    Other,
    /// Not defined by the format.
    Unknown,
}

/// A record, judged by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    pub(crate) kind: Kind,
    /// Including the record header.
    pub(crate) length_bytes: u64,
    /// Whether a second length inside confirms the first.
    pub(crate) is_certain: bool,
    /// Whether the bytes cannot resemble a record by chance.
    pub(crate) is_unmistakable: bool,
}

/// The record syntax of a format. Records include their header.
pub(crate) trait Grammar: Send + Sync + Sized + 'static {
    /// Offset of the first record.
    const FIRST_RECORD: u64;
    /// Number of bytes that [`frame`](Self::frame) needs; fewer at the end of a file.
    const HEAD_BYTES: usize;

    /// The record at the front of `head`; `None` if it is invalid.
    fn frame(head: &[u8]) -> Option<Frame>;

    /// Describes why the bytes are not a record.
    fn complaint(head: &[u8]) -> String;

    /// Whether these bytes properly end a file.
    fn is_closing(rest: &[u8]) -> bool;

    /// Splits off one record from verified bytes.
    fn split(bytes: &[u8]) -> Option<(Kind, &[u8], &[u8])>;

    fn message(record: &[u8]) -> Option<MessageRecord<'_>>;

    /// Passes what a record defines to `take`; `false` if it is unreadable.
    fn definition(record: &[u8], take: &mut dyn FnMut(DefinitionRecord<'_>)) -> bool;

    /// Parses a chunk, whose data may be truncated. Ignores the kind and the length in the record
    /// header.
    fn chunk(record: &[u8]) -> Option<PackedChunk<'_>>;

    /// A channel and the number of its messages in the preceding chunk.
    fn index(record: &[u8]) -> Option<(u32, u64)>;

    /// The attachment or metadata in a record.
    fn extra(_record: &[u8]) -> Option<Extra<'_>> {
        None
    }

    /// The contents by the index at the end of a file; `None` if it is absent, incomplete or
    /// damaged.
    fn contents(file: &FileBytes) -> Result<Option<Contents>, Error>;
}
