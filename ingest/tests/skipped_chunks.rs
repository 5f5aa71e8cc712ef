use std::ops::ControlFlow;

use mcap::{Compression, WriteOptions};
use tipwatch_ingest::{Log, TopicId};

use crate::support::{Mcap, TempLog};

#[test]
fn chunks_without_a_wanted_topic_are_skipped_and_counted() {
    let options = WriteOptions::new().compression(Some(Compression::Zstd));
    let mut writer = Mcap::new(options.chunk_size(Some(10_000)));
    let channels = ["/arm", "/camera"].map(|topic| writer.joints(topic));
    for index in 0..400_u32 {
        let channel = channels[(index / 200) as usize];
        writer.message(channel, index, [index.into(); 2], &[index as u8; 1000]);
    }
    let file = TempLog::new("mixed.mcap", &writer.finish());
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
