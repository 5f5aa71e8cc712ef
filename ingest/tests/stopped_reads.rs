use std::ops::ControlFlow;

use mcap::{Compression, WriteOptions};
use tipwatch_ingest::Log;

use crate::support::{Mcap, TempLog};

const MESSAGES: u32 = 200;

/// Ten messages a chunk.
fn mcap_file() -> Vec<u8> {
    let options = WriteOptions::new().compression(Some(Compression::Zstd));
    let mut writer = Mcap::new(options.chunk_size(Some(10_000)));
    let channel = writer.joints("/arm");
    for index in 0..MESSAGES {
        let noise = |at: u32| (index * 1000 + at).wrapping_mul(0x9e37_79b9) as u8;
        let data: Vec<u8> = (0..1000).map(noise).collect();
        writer.message(channel, index, [index.into(); 2], &data);
    }
    writer.finish()
}

/// Everything that a read returns, stopped after so many messages.
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
