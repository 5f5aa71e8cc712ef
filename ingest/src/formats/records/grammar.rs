//! Files that are a row of records, some of them chunks of compressed records: what MCAP files and
//! bags of ROS 1 have in common.
//!
//! A format tells its [`Grammar`]; the walk, the search for the next record after damage, the
//! decompression and the report of what was lost are the same for both. Parsers get bytes and do
//! no input or output themselves.

use super::{
    contents::Contents,
    packed_chunk::PackedChunk,
    parsed::{Definition, MessageRecord},
};
use crate::{
    file::FileBytes,
    message::{Error, Extra},
};

/// What a record is to the walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Chunk,
    Message,
    /// A message type, a channel, a connection.
    Definition,
    /// How many messages of one channel the chunk before it has.
    Index,
    /// The messages end here; what follows repeats what was told before.
    End,
    Other,
    /// A kind that the format does not define.
    Unknown,
}

/// A record by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Frame {
    pub(crate) kind: Kind,
    /// With everything that comes before its content.
    pub(crate) length_bytes: u64,
    /// Whether the length was confirmed by a second one within.
    pub(crate) is_certain: bool,
    /// Whether what stands there cannot look like a record by chance.
    pub(crate) is_unmistakable: bool,
}

/// How a format writes its records. A record is given with the bytes that tell its length.
pub(crate) trait Grammar: Send + Sync + Sized + 'static {
    /// Where the first record stands.
    const FIRST_RECORD: u64;
    /// How many bytes [`frame`](Self::frame) wants to see; fewer at the end of a file.
    const HEAD_BYTES: usize;

    /// What stands at the front of `head`; `None` if it is no record.
    fn frame(head: &[u8]) -> Option<Frame>;

    /// Why it is none.
    fn complaint(head: &[u8]) -> String;

    /// Whether these bytes at the end of a file close it.
    fn is_closing(rest: &[u8]) -> bool;

    /// Splits off one record of bytes that are known to be intact.
    fn split(bytes: &[u8]) -> Option<(Kind, &[u8], &[u8])>;

    fn message(record: &[u8]) -> Option<MessageRecord<'_>>;

    /// Hands over what a record defines; `false` when it cannot be read.
    fn definition(record: &[u8], take: &mut dyn FnMut(Definition<'_>)) -> bool;

    /// A chunk, whose data may be cut short. The kind and the length that the record claims to have
    /// are not looked at.
    fn chunk(record: &[u8]) -> Option<PackedChunk<'_>>;

    /// A channel and how many messages of it the chunk before has.
    fn index(record: &[u8]) -> Option<(u32, u64)>;

    /// What a record holds that is neither a message nor about messages.
    fn extra(_record: &[u8]) -> Option<Extra<'_>> {
        None
    }

    /// What the index at the end of a file tells; `None` if it is absent, incomplete or damaged.
    fn contents(file: &FileBytes) -> Result<Option<Contents>, Error>;
}
