//! FileReader of record-based files: MCAP, and bags of ROS 1.
//!
//! Both are sequences of records, some of which are chunks of compressed records. A format
//! implements [`Grammar`]; the walk, the search for the next record after damage, decompression
//! and the loss report are shared. Parsers take bytes and do no I/O.

mod channel_counts;
mod contents;
mod damage;
mod decompress;
mod delivery;
mod extras;
mod grammar;
mod head_window;
mod intake;
mod loss_log;
mod lz4;
mod packed_chunk;
mod parsed;
mod read_ahead;
mod record_reader;
mod routes;
mod row;
mod scan;
mod unpacked;
mod visitor;
mod walk;

pub(crate) use self::{
    contents::{ChunkEntry, Contents, ExtraPlace},
    grammar::{Frame, Grammar, Kind},
    packed_chunk::{Compression, PackedChunk},
    parsed::{Channel, DefinitionRecord, MessageRecord, SchemaRecord},
    record_reader::RecordReader,
};
