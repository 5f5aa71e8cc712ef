//! Messages that rosbag2 compressed one by one: `compression_mode: MESSAGE`.

use std::{collections::BTreeMap, io::Read, ops::ControlFlow};

use zstd::stream::read::Decoder;

use crate::{
    formats::{FileReader, Request},
    message::{Losses, RawMessage, Topic, TopicId},
};

/// The first bytes of a zstd frame. No message in CDR begins with them.
const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// Far above any message.
const MOST_BYTES: u64 = 1 << 30;

/// Unpacks messages one after the other.
#[derive(Default)]
pub(super) struct Unpacker {
    message: Vec<u8>,
    /// Messages that could not be unpacked, by topic.
    failures: BTreeMap<TopicId, u64>,
}

impl Unpacker {
    /// Passes on a message, unpacked if it is packed.
    pub(super) fn visit(
        &mut self,
        message: &RawMessage<'_>,
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if !message.data.starts_with(ZSTD_MAGIC) {
            return visit(message);
        }
        self.message.clear();
        let unpacked = Decoder::new(message.data).and_then(|decoder| {
            let bounded = &mut decoder.take(MOST_BYTES + 1);
            bounded.read_to_end(&mut self.message)
        });
        if unpacked.is_err() || self.message.len() as u64 > MOST_BYTES {
            *self.failures.entry(message.topic).or_default() += 1;
            return ControlFlow::Continue(());
        }
        visit(&RawMessage {
            data: &self.message,
            ..*message
        })
    }

    pub(super) fn report(&self, topics: &[Topic], losses: &mut Losses) {
        for (topic, count) in &self.failures {
            for topic in topics.iter().filter(|known| known.id == *topic) {
                for _ in 0..*count {
                    losses.count_undecodable(&topic.name);
                }
            }
        }
    }
}

/// Whether the first ROS 2 message in a file is compressed: a file without its `metadata.yaml` does not state it.
pub(super) fn has_packed_messages(reader: &dyn FileReader, topics: &[Topic]) -> bool {
    let wanted: Vec<bool> = topics.iter().map(|topic| topic.encoding == "cdr").collect();
    let mut is_packed = false;
    if wanted.contains(&true) {
        let mut losses = Losses::default();
        // what cannot be read is reported when the log is read
        let _ = reader.read(&mut Request {
            wanted: &wanted,
            visit: &mut |message| {
                is_packed = message.data.starts_with(ZSTD_MAGIC);
                ControlFlow::Break(())
            },
            progress: &mut |_| {},
            bytes_before: 0,
            losses: &mut losses,
            batches: None,
        });
    }
    is_packed
}
