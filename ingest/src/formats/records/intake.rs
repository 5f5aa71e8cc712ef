//! Decodes the messages of whole chunks into batches, on any thread.

use super::{
    channel_counts::ChannelCounts,
    grammar::Grammar,
    parsed::{DefinitionRecord, MessageRecord},
    routes::Routes,
    row::Tally,
    visitor::{Next, Visitor},
};
use crate::formats::reader::Batch;

/// Smallest message of any format, with its own header (bytes).
const SMALLEST_MESSAGE_BYTES: usize = 16;

/// Decodes chunks into batches.
pub(super) struct Intake<'d> {
    routes: &'d Routes<'d>,
    empty: &'d (dyn Fn() -> Box<dyn Batch> + Sync),
}

/// The decoded messages of one chunk; reused for other chunks.
pub(crate) struct TakenIn {
    batch: Box<dyn Batch>,
    messages: ChannelCounts,
    /// Counts of messages and of damage in the chunk.
    pub(super) tally: Tally,
}

impl TakenIn {
    /// Hands the messages to the visitor and returns what is wrong with the chunk.
    pub(super) fn deliver<V: Visitor>(&mut self, visitor: &mut V) -> Tally {
        visitor.accept(&mut *self.batch, &mut self.messages);
        std::mem::take(&mut self.tally)
    }
}

impl<'d> Intake<'d> {
    pub(super) fn new(
        routes: &'d Routes<'d>,
        empty: &'d (dyn Fn() -> Box<dyn Batch> + Sync),
    ) -> Self {
        Self { routes, empty }
    }

    /// Decodes verified content. `share` is that of the chunk in the bytes of the file.
    pub(super) fn take_in<G: Grammar>(
        &self,
        content: &[u8],
        share: f64,
        used: Option<TakenIn>,
    ) -> TakenIn {
        let mut taken = used.unwrap_or_else(|| TakenIn {
            batch: (self.empty)(),
            messages: ChannelCounts::new(self.routes.table_size()),
            tally: Tally::default(),
        });
        let most = content.len() / SMALLEST_MESSAGE_BYTES;
        taken.batch.expect(share, most);
        taken.tally = Tally::default();
        let mut visitor = BatchVisitor {
            routes: self.routes,
            batch: &mut *taken.batch,
            messages: &mut taken.messages,
        };
        // A batch never stops the walk.
        let _ = taken.tally.walk_intact::<G, _>(content, &mut visitor);
        taken
    }
}

struct BatchVisitor<'b> {
    routes: &'b Routes<'b>,
    batch: &'b mut dyn Batch,
    messages: &'b mut ChannelCounts,
}

impl Visitor for BatchVisitor<'_> {
    fn definition(&mut self, definition: &DefinitionRecord<'_>) -> bool {
        self.routes.agrees(definition)
    }

    #[inline]
    fn message(&mut self, record: &MessageRecord<'_>) -> Next {
        let (topic, writer) = match self.routes.wanted_topic(record.channel_id) {
            Ok(topic) => topic,
            Err(next) => return next,
        };
        self.messages.add(record.channel_id, 1);
        self.batch.take(&record.message(topic, writer));
        Next::Continue
    }

    fn topic_name(&self, channel_id: u32) -> Option<&str> {
        self.routes.topic_name(channel_id)
    }
}
