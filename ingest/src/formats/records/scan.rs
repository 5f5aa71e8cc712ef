//! Builds the contents of a file without an intact index by one walk over it.

use std::collections::BTreeMap;

use super::{
    contents::{ChunkDirectory, ChunkEntry, Contents, Schema, widest},
    grammar::Grammar,
    parsed::{DefinitionRecord, MessageRecord},
    read_ahead::KeptChunk,
    visitor::{Next, Visitor},
    walk,
};
use crate::{
    file::FileBytes,
    message::{Error, Losses},
};

/// The contents of the whole file; damage is added to `losses`.
pub(super) fn read<G: Grammar>(file: &FileBytes, losses: &mut Losses) -> Result<Contents, Error> {
    let mut scan = Scan::default();
    // No chunk is known yet.
    let no_chunks = ChunkDirectory::new();
    // A scan never stops the walk.
    let _ = walk::walk::<G, _>(
        file,
        &no_chunks,
        false,
        None,
        &KeptChunk::default(),
        &mut scan,
        losses,
    )?;
    scan.end_chunk();
    let mut contents = scan.contents;
    contents.message_counts = Some(scan.counts);
    Ok(contents)
}

#[derive(Default)]
struct Scan {
    contents: Contents,
    counts: BTreeMap<u32, u64>,
    chunk: Option<(u64, Vec<u32>)>,
}

impl Scan {
    fn end_chunk(&mut self) {
        if let Some((offset, channels)) = self.chunk.take() {
            // A chunk without messages was damaged; reading must report it again.
            let entry = ChunkEntry {
                channels: (!channels.is_empty()).then_some(channels),
                ..Default::default()
            };
            self.contents.chunks.insert(offset, entry);
        }
    }
}

impl Visitor for Scan {
    fn wants_repetitions(&self) -> bool {
        true
    }

    fn begin_chunk(&mut self, offset: u64, _end: u64) {
        self.end_chunk();
        self.chunk = Some((offset, Vec::new()));
    }

    fn definition(&mut self, definition: &DefinitionRecord<'_>) -> bool {
        // The first definition is kept: a repeated one is either equal or damaged.
        match definition {
            DefinitionRecord::Schema { id, schema } => {
                self.contents
                    .schemas
                    .entry(*id)
                    .or_insert_with(|| Schema::from_record(schema));
                true
            }
            DefinitionRecord::Channel { id, channel } => {
                let channels = &mut self.contents.channels;
                let known = channels.entry(*id).or_insert_with(|| channel.clone());
                known.is_same(channel)
            }
        }
    }

    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let time_ns = (record.log_time_ns, record.log_time_ns);
        let span_ns = self.contents.span_ns.unwrap_or(time_ns);
        self.contents.span_ns = Some(widest(span_ns, time_ns));
        let id = record.channel_id;
        if let Some((_, channels)) = &mut self.chunk
            && !channels.contains(&id)
        {
            channels.push(id);
        }
        *self.counts.entry(id).or_default() += 1;
        // The channel may be defined later. Reading, which knows all channels, reports undefined
        // ones.
        Next::Continue
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        let channel = self.contents.channels.get(&channel_id);
        channel.map(|channel| channel.topic.as_str())
    }
}
