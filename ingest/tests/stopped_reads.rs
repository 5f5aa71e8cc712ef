use std::{collections::BTreeMap, io::Cursor, ops::ControlFlow};

use mcap::{Compression, WriteOptions, records::MessageHeader};
use tipwatch_ingest::Log;

use crate::support::TempLog;

const MESSAGES: u32 = 200;

/// Ten messages a chunk.
fn mcap_file() -> Vec<u8> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .chunk_size(Some(10_000))
        .create(Cursor::new(Vec::new()))
        .unwrap();
    let channel_id = writer
        .add_channel(0, "/arm", "cdr", &BTreeMap::new())
        .unwrap();
    for index in 0..MESSAGES {
        let header = MessageHeader {
            channel_id,
            sequence: index,
            log_time: u64::from(index),
            publish_time: u64::from(index),
        };
        let noise = |at: u32| (index * 1000 + at).wrapping_mul(0x9e37_79b9) as u8;
        let data: Vec<u8> = (0..1000).map(noise).collect();
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Everything that a read says, stopped after so many messages.
fn said(log: &Log, messages: u32) -> String {
    let mut said = Vec::new();
    let losses = log.read(&[log.topics()[0].id], &mut |message| {
        said.push((message.log_time_ns, message.data.to_vec()));
        match (said.len() as u32) < messages {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    });
    format!("{said:?} {losses:?}")
}

#[test]
fn a_read_after_a_stopped_one_is_that_of_a_new_log() {
    let intact = mcap_file();
    let mut damaged = intact.clone();
    damaged[intact.len() / 4] ^= 1;
    for bytes in [intact, damaged] {
        let file = TempLog::new("stopped.mcap", &bytes);
        let log = Log::open(&file.path).unwrap();
        for messages in [
            5,
            5,
            45,
            1,
            120,
            MESSAGES + 1,
            12,
            1,
            MESSAGES,
            1,
            MESSAGES + 1,
        ] {
            let fresh = Log::open(&file.path).unwrap();
            assert!(said(&log, messages) == said(&fresh, messages), "{messages}");
        }
    }
}
