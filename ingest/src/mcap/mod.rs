//! MCAP files: topics from the summary, or from a scan where there is no intact one; messages by
//! a checked walk of the records.

mod chunk;
mod record;
mod scan;
mod summary;
mod walk;

use std::{
    collections::{BTreeMap, HashMap},
    ops::ControlFlow,
    path::Path,
};

use self::{
    record::{ChannelRecord, MessageRecord, SchemaRecord},
    walk::{Next, Visitor},
};
use crate::{
    error::Error,
    file_bytes::FileBytes,
    losses::Losses,
    message::Message,
    reader::{Reader, Request},
    topic::{TopicDescription, TopicId, TopicTable},
};

/// Which channels each chunk holds, by the chunk's offset; `None` when it is not known.
type ChunkDirectory = BTreeMap<u64, Option<Vec<u16>>>;

/// What has to be known about a file before its messages can be read.
#[derive(Default)]
struct Contents {
    schemas: HashMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// `None` when the file does not tell.
    message_counts: Option<BTreeMap<u16, u64>>,
    chunks: ChunkDirectory,
}

struct Schema {
    name: String,
    encoding: String,
    text: String,
}

#[derive(PartialEq)]
struct Channel {
    schema_id: u16,
    topic: String,
    encoding: String,
}

impl Schema {
    fn from_record(record: &SchemaRecord<'_>) -> Self {
        Self {
            name: record.name.to_owned(),
            encoding: record.encoding.to_owned(),
            text: String::from_utf8_lossy(record.data).into_owned(),
        }
    }
}

impl Channel {
    fn from_record(record: &ChannelRecord<'_>) -> Self {
        Self {
            schema_id: record.schema_id,
            topic: record.topic.to_owned(),
            encoding: record.message_encoding.to_owned(),
        }
    }
}

/// One MCAP file.
pub(crate) struct McapReader {
    file: FileBytes,
    chunks: ChunkDirectory,
    topics: HashMap<u16, TopicId>,
}

impl McapReader {
    pub(crate) fn open(
        path: &Path,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let file = FileBytes::open(path)?;
        let contents = match summary::read(&file)? {
            Some(contents) => {
                note_checksum_of_first_chunk(&file, &contents, losses)?;
                contents
            }
            None => scan::read(&file, losses)?,
        };
        let topics = register_topics(&contents, topics);
        Ok(Self {
            file,
            chunks: contents.chunks,
            topics,
        })
    }
}

/// The summary does not tell whether chunks carry checksums; one chunk does.
fn note_checksum_of_first_chunk(
    file: &FileBytes,
    contents: &Contents,
    losses: &mut Losses,
) -> Result<(), Error> {
    let Some((&offset, _)) = contents.chunks.first_key_value() else {
        return Ok(());
    };
    let mut window = crate::file_bytes::Window::new(file);
    if let Some(crc) = walk::chunk_crc_at(&mut window, offset)? {
        losses.saw_checksum(crc != 0);
    }
    Ok(())
}

fn register_topics(contents: &Contents, topics: &mut TopicTable) -> HashMap<u16, TopicId> {
    let mut ids = HashMap::new();
    for (&channel_id, channel) in &contents.channels {
        let schema = contents.schemas.get(&channel.schema_id);
        let id = topics.register(&TopicDescription {
            name: &channel.topic,
            type_name: schema.map_or("", |schema| &schema.name),
            encoding: &channel.encoding,
            schema_encoding: schema.map_or("", |schema| &schema.encoding),
            definition: schema.map(|schema| schema.text.as_str()),
        });
        let counts = contents.message_counts.as_ref();
        let count = counts.map(|counts| counts.get(&channel_id).copied().unwrap_or(0));
        topics.add_messages(id, count);
        ids.insert(channel_id, id);
    }
    ids
}

impl Reader for McapReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        let channels = self.channel_table(request);
        // The walk and the visitor both need to report; the walk's losses are taken over after.
        let mut losses = Losses::default();
        let mut delivery = Delivery {
            channels,
            chunks: &self.chunks,
            request,
        };
        let flow = walk::walk(&self.file, &self.chunks, &mut delivery, &mut losses);
        request.losses.merge(&losses);
        flow
    }
}

impl McapReader {
    fn channel_table(&self, request: &Request<'_>) -> Vec<ChannelUse> {
        let channel_count = self
            .topics
            .keys()
            .max()
            .map_or(0, |&id| usize::from(id) + 1);
        let mut table = vec![ChannelUse::Undefined; channel_count];
        for (&channel, &topic) in &self.topics {
            table[usize::from(channel)] = if request.wants(topic) {
                ChannelUse::Wanted(topic)
            } else {
                ChannelUse::Unwanted
            };
        }
        table
    }
}

#[derive(Clone, Copy)]
enum ChannelUse {
    Undefined,
    Unwanted,
    Wanted(TopicId),
}

/// Hands the wanted messages of a walk to the caller of [`Log::read`](crate::Log::read).
struct Delivery<'d, 'r> {
    channels: Vec<ChannelUse>,
    chunks: &'d ChunkDirectory,
    request: &'d mut Request<'r>,
}

impl Delivery<'_, '_> {
    fn channel_use(&self, channel_id: u16) -> ChannelUse {
        self.channels
            .get(usize::from(channel_id))
            .copied()
            .unwrap_or(ChannelUse::Undefined)
    }
}

impl Visitor for Delivery<'_, '_> {
    fn wants_chunk(&mut self, offset: u64) -> bool {
        match self.chunks.get(&offset) {
            Some(Some(channels)) => channels
                .iter()
                .any(|&channel| matches!(self.channel_use(channel), ChannelUse::Wanted(_))),
            _ => true,
        }
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let topic = match self.channel_use(record.channel_id) {
            ChannelUse::Wanted(topic) => topic,
            ChannelUse::Unwanted => return Next::Continue,
            ChannelUse::Undefined => return Next::UndefinedChannel,
        };
        let message = Message {
            topic,
            log_time_ns: record.log_time_ns,
            publish_time_ns: record.publish_time_ns,
            sequence: record.sequence,
            data: record.data,
        };
        match (self.request.visit)(&message) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Stop,
        }
    }

    fn progress(&mut self, offset: u64) {
        self.request.advance(offset);
    }
}
