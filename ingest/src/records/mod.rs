//! Files that are a row of records, some of them chunks of compressed records: what MCAP files and
//! bags of ROS 1 have in common.
//!
//! A format tells its [`Grammar`]; the walk, the search for the next record after damage, the
//! decompression and the report of what was lost are the same for both. Parsers get bytes and do
//! no input or output themselves.

mod contents;
mod decompress;
mod delivery;
mod extras;
mod head;
mod loss_log;
mod lz4;
mod read_ahead;
mod row;
mod scan;
mod walk;

use std::ops::ControlFlow;

pub(crate) use self::{
    contents::{Channel, ChunkDirectory, ChunkEntry, Contents, Schema},
    decompress::{Compression, PackedChunk},
    head::HeadWindow,
};
use crate::{
    error::Error,
    extra::Extra,
    file_bytes::FileBytes,
    log_file::LogFile,
    losses::Losses,
    reader::{Reader, Request},
    topic::TopicTable,
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

/// A message.
pub(crate) struct MessageRecord<'a> {
    pub(crate) channel_id: u32,
    pub(crate) sequence: u32,
    pub(crate) log_time_ns: i64,
    pub(crate) publish_time_ns: i64,
    pub(crate) data: &'a [u8],
}

/// What a record defines.
pub(crate) enum Definition<'a> {
    Schema { id: u32, schema: SchemaRecord<'a> },
    Channel { id: u32, channel: ChannelRecord<'a> },
}

/// A message type.
pub(crate) struct SchemaRecord<'a> {
    pub(crate) name: &'a str,
    pub(crate) encoding: &'a str,
    pub(crate) data: &'a [u8],
}

/// A topic as one writer sees it.
pub(crate) struct ChannelRecord<'a> {
    /// `None` for messages without a type.
    pub(crate) schema_id: Option<u32>,
    pub(crate) topic: &'a str,
    pub(crate) encoding: &'a str,
}

/// What to do after a message.
#[derive(PartialEq, Eq)]
pub(crate) enum Next {
    Continue,
    /// Go on, but the message belongs to no channel that was defined.
    UndefinedChannel,
    Stop,
}

/// Sees what the walk meets.
pub(crate) trait Visitor {
    /// Whether the chunk at this offset is worth decompressing.
    fn wants_chunk(&self, _offset: u64) -> bool {
        true
    }
    /// A wanted chunk begins.
    fn begin_chunk(&mut self, _offset: u64, _end: u64) {}
    /// `false` when it contradicts what was defined before.
    fn definition(&mut self, _definition: &Definition<'_>) -> bool {
        true
    }
    fn message(&mut self, record: &MessageRecord<'_>) -> Next;
    /// The messages of a chunk that another thread has taken in.
    fn accept(&mut self, _taken: &mut delivery::TakenIn) {}
    /// Whether a message that stands behind damage is one of this log: its channel is known, and its
    /// time is near that of another.
    fn is_likely(&self, record: &MessageRecord<'_>, near_ns: Option<i64>) -> bool {
        const NEAR_NS: u64 = 3_600_000_000_000;
        let is_near = |time_ns: i64| time_ns.abs_diff(record.log_time_ns) < NEAR_NS;
        near_ns.is_some_and(is_near) && self.topic_name(record.channel_id).is_some()
    }
    /// The topic of a channel, for the report of losses.
    fn topic_name(&self, channel_id: u32) -> Option<&str>;
    /// Whether to go on where the messages end, because definitions are repeated there.
    fn wants_repetitions(&self) -> bool {
        false
    }
    /// A record outside chunks that bears on no message.
    fn other(&mut self, _bytes: &std::ops::Range<u64>) {}
    fn progress(&mut self, _offset: u64) {}
}

/// One file of records.
pub(crate) struct RecordReader<G> {
    file: FileBytes,
    chunks: ChunkDirectory,
    channels: delivery::ChannelTable,
    grammar: std::marker::PhantomData<G>,
}

impl<G: Grammar> RecordReader<G> {
    pub(crate) fn open(
        named: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let file = FileBytes::open(named.data(), named.path())?;
        let mut contents = match G::contents(&file)? {
            Some(contents) => contents,
            None => {
                losses.note(format!(
                    "{}: no intact index at its end: the whole file was read to find its topics",
                    named.path().display()
                ));
                scan::read::<G>(&file, losses)?
            }
        };
        contents.drop_wrong_places::<G>(&file, losses)?;
        let channels = delivery::ChannelTable::register(&contents, topics);
        Ok(Self {
            file,
            chunks: contents.chunks,
            channels,
            grammar: std::marker::PhantomData,
        })
    }
}

impl<G: Grammar> Reader for RecordReader<G> {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        // The walk and the visitor both need to report; the walk's losses are taken over after.
        let mut losses = Losses::default();
        let routes = delivery::Routes::new(&self.channels, request.wanted);
        let intake = request.batches;
        let intake = intake.map(|batches| delivery::Intake::new(&routes, batches.empty));
        let mut delivery = delivery::Delivery::new(&routes, &self.chunks, request);
        let flow = walk::walk::<G, _>(
            &self.file,
            &self.chunks,
            intake.as_ref(),
            &mut delivery,
            &mut losses,
        )?;
        if flow.is_continue() {
            delivery.report_missing(&mut losses);
        }
        request.losses.merge(&losses);
        // of all files of the log
        request.losses.integrity.chunks_passed_over += losses.integrity.chunks_passed_over;
        Ok(flow)
    }

    fn extras(&self, take: &mut dyn FnMut(Extra<'_>)) -> Result<(), Error> {
        let mut places = extras::Places::default();
        // What is damaged, reading has told.
        let _ = walk::walk::<G, _>(
            &self.file,
            &self.chunks,
            None,
            &mut places,
            &mut Losses::default(),
        )?;
        for bytes in places.0 {
            let record = self.file.read_vec(bytes.start, bytes.end - bytes.start)?;
            if let Some(extra) = G::extra(&record) {
                take(extra);
            }
        }
        Ok(())
    }
}
