use std::{collections::BTreeMap, io::Cursor, ops::ControlFlow};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::{Log, TopicId};

use crate::support::TempLog;

#[test]
fn chunks_without_a_wanted_topic_are_skipped_and_counted() {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .chunk_size(Some(10_000))
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let channels = ["/arm", "/camera"].map(|topic| {
        writer
            .add_channel(0, topic, "cdr", &BTreeMap::new())
            .unwrap()
    });
    for index in 0..400_u32 {
        let header = MessageHeader {
            channel_id: channels[(index / 200) as usize],
            sequence: index,
            log_time: u64::from(index),
            publish_time: u64::from(index),
        };
        writer
            .write_to_known_channel(&header, &[index as u8; 1000])
            .unwrap();
    }
    writer.finish().unwrap();
    let file = TempLog::new("mixed.mcap", &writer.into_inner().into_inner());
    let log = Log::open(&file.path).unwrap();
    let passed_over = |topics: &[TopicId]| {
        let losses = log.read(topics, &mut |_| ControlFlow::Continue(()));
        losses.unwrap().integrity.chunks_passed_over
    };
    let all: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
    assert_eq!(passed_over(&all), 0);
    let halves = [passed_over(&all[..1]), passed_over(&all[1..])];
    assert!(
        halves.iter().all(|&half| (18..=21).contains(&half)),
        "{halves:?}"
    );
}
