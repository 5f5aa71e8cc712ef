//! Topics of a file without an intact summary: one walk over everything.

use std::collections::BTreeMap;

use super::{
    Channel, ChunkDirectory, Contents, Schema,
    record::{ChannelRecord, MessageRecord, SchemaRecord},
    walk::{self, Next, Visitor},
};
use crate::{error::Error, file_bytes::FileBytes, losses::Losses};

/// What a whole file holds, with its damage.
pub(super) fn read(file: &FileBytes, losses: &mut Losses) -> Result<Contents, Error> {
    let mut scan = Scan::default();
    // Nothing is known yet about the chunks.
    let no_chunks = ChunkDirectory::new();
    // A scan never stops by itself, so whether it broke off says nothing.
    let _ = walk::walk(file, &no_chunks, &mut scan, losses)?;
    scan.end_chunk();
    let mut contents = scan.contents;
    contents.message_counts = Some(scan.counts);
    Ok(contents)
}

#[derive(Default)]
struct Scan {
    contents: Contents,
    counts: BTreeMap<u16, u64>,
    chunk: Option<(u64, Vec<u16>)>,
}

impl Scan {
    fn end_chunk(&mut self) {
        if let Some((offset, channels)) = self.chunk.take() {
            // A chunk without messages was damaged: reading has to report it again.
            let known = (!channels.is_empty()).then_some(channels);
            self.contents.chunks.insert(offset, known);
        }
    }
}

impl Visitor for Scan {
    fn wants_chunk(&mut self, offset: u64) -> bool {
        self.end_chunk();
        self.chunk = Some((offset, Vec::new()));
        true
    }

    fn schema(&mut self, record: &SchemaRecord<'_>) {
        // The first definition stays: a repeated one can only be equal or damaged.
        self.contents
            .schemas
            .entry(record.id)
            .or_insert_with(|| Schema::from_record(record));
    }

    fn channel(&mut self, record: &ChannelRecord<'_>) -> bool {
        let new = Channel::from_record(record);
        *self
            .contents
            .channels
            .entry(record.id)
            .or_insert_with(|| Channel::from_record(record))
            == new
    }

    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let id = record.channel_id;
        if let Some((_, channels)) = &mut self.chunk
            && !channels.contains(&id)
        {
            channels.push(id);
        }
        if !self.contents.channels.contains_key(&id) {
            return Next::UndefinedChannel;
        }
        *self.counts.entry(id).or_default() += 1;
        Next::Continue
    }
}
