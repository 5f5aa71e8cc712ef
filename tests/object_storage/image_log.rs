//! A log that is nine tenths images, made from a small one.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{Compression, MessageStream, WriteOptions, Writer};

/// Bytes of images, and of other large messages.
const IMAGE_BYTES: usize = 144 << 17;
const CLOUD_BYTES: usize = 13 << 17;
const PER_IMAGE: usize = 300_000;

/// The messages of a log with images between them, each kind in chunks of its own, as a recorder that buffers by
/// topic writes them.
pub(crate) fn image_log(from: &Path, compression: Option<Compression>) -> Vec<u8> {
    let bytes = std::fs::read(from).unwrap();
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new()
        .compression(compression)
        .chunk_size(Some(4 << 20));
    let mut writer = Writer::with_options(&mut out, options).unwrap();
    let mut ids = BTreeMap::new();
    let messages: Vec<_> = MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let image = writer
        .add_channel(0, "/camera/image", "raw", &BTreeMap::new())
        .unwrap();
    let cloud = writer
        .add_channel(0, "/lidar/points", "raw", &BTreeMap::new())
        .unwrap();
    let bursts = IMAGE_BYTES / PER_IMAGE;
    let mut noise = Noise(7);
    for (burst, part) in messages.chunks(messages.len().div_ceil(bursts)).enumerate() {
        for message in part {
            let channel = &message.channel;
            let id = *ids.entry(channel.id).or_insert_with(|| {
                let schema = channel.schema.as_ref().map_or(0, |schema| {
                    writer
                        .add_schema(&schema.name, &schema.encoding, &schema.data)
                        .unwrap()
                });
                let (topic, encoding) = (&channel.topic, &channel.message_encoding);
                writer
                    .add_channel(schema, topic, encoding, &channel.metadata)
                    .unwrap()
            });
            let header = MessageHeader {
                channel_id: id,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer
                .write_to_known_channel(&header, &message.data)
                .unwrap();
        }
        // the next chunk
        writer.flush().unwrap();
        for (channel_id, length) in [(image, PER_IMAGE), (cloud, CLOUD_BYTES / bursts)] {
            let header = MessageHeader {
                channel_id,
                sequence: burst as u32,
                log_time: part[0].log_time,
                publish_time: part[0].log_time,
            };
            writer
                .write_to_known_channel(&header, &noise.bytes(length))
                .unwrap();
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

/// Bytes that do not compress.
struct Noise(u64);

impl Noise {
    fn bytes(&mut self, length: usize) -> Vec<u8> {
        let mut next = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (self.0 >> 33) as u8
        };
        (0..length).map(|_| next()).collect()
    }
}
