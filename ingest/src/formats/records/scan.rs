//! Topics of a file without an intact index: one walk over everything.

use std::collections::BTreeMap;

use super::{
    contents::{Channel, ChunkDirectory, Contents, Schema},
    grammar::Grammar,
    parsed::{Definition, MessageRecord},
    visitor::{Next, Visitor},
    walk,
};
use crate::{
    file::FileBytes,
    message::{Error, Losses},
};

/// What a whole file holds, with its damage.
pub(super) fn read<G: Grammar>(file: &FileBytes, losses: &mut Losses) -> Result<Contents, Error> {
    let mut scan = Scan::default();
    // Nothing is known yet about the chunks.
    let no_chunks = ChunkDirectory::new();
    // A scan never stops by itself, so whether it broke off says nothing.
    let _ = walk::walk::<G, _>(file, &no_chunks, None, &mut scan, losses)?;
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
            // A chunk without messages was damaged: reading has to report it again.
            let entry = super::ChunkEntry {
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

    fn definition(&mut self, definition: &Definition<'_>) -> bool {
        // The first definition stays: a repeated one can only be equal or damaged.
        match definition {
            Definition::Schema { id, schema } => {
                self.contents
                    .schemas
                    .entry(*id)
                    .or_insert_with(|| Schema::from_record(schema));
                true
            }
            Definition::Channel { id, channel } => {
                let new = Channel::from_record(channel);
                *self
                    .contents
                    .channels
                    .entry(*id)
                    .or_insert_with(|| Channel::from_record(channel))
                    == new
            }
        }
    }

    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let id = record.channel_id;
        if let Some((_, channels)) = &mut self.chunk
            && !channels.contains(&id)
        {
            channels.push(id);
        }
        *self.counts.entry(id).or_default() += 1;
        // Its channel may be defined later. Reading, which knows them all, reports those that are
        // not.
        Next::Continue
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        let channel = self.contents.channels.get(&channel_id);
        channel.map(|channel| channel.topic.as_str())
    }
}
