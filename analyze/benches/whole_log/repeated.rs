//! A long log: a short one again and again, each time later.

use std::fs::{File, read};
use std::io::BufWriter;
use std::path::Path;

use mcap::{Compression, MessageStream, WriteOptions};

/// Topics that are published once, at the start.
const ONCE: [&str; 2] = ["/robot_description", "/tf_static"];
/// Pause between the end of one pass and the start of the next (ns): long enough for the arm to go back, or the log contradicts
/// itself.
const PAUSE_NS: u64 = 1_000_000_000;
/// Bytes of the stamp in `std_msgs/Header`, with which every other type of the log begins: seconds, then nanoseconds.
const STAMP: std::ops::Range<usize> = 4..12;

/// Writes a log of at least `seconds` with the messages of `source`, a log with LZ4 chunks.
pub(crate) fn write(source: &Path, seconds: f64, out: &Path) {
    let bytes = read(source).expect("the log");
    let messages: Vec<_> = MessageStream::new(&bytes)
        .expect("a log")
        .collect::<Result<_, _>>()
        .expect("intact messages");
    let times = messages.iter().map(|message| message.log_time);
    let (first, last) = (times.clone().min(), times.max());
    let (Some(first), Some(last)) = (first, last) else {
        panic!("a log with messages");
    };
    let period_ns = last - first + PAUSE_NS;
    let passes = (seconds * 1e9 / period_ns as f64).ceil() as u64;
    let file = BufWriter::new(File::create(out).expect("a file"));
    let options = WriteOptions::new()
        .profile("ros2")
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(1 << 22));
    let mut writer = options.create(file).expect("a log");
    for pass in 0..passes {
        let later_ns = pass * period_ns;
        for message in &messages {
            let is_told = ONCE.contains(&message.channel.topic.as_str());
            if is_told && pass > 0 {
                continue;
            }
            let mut data = message.data.to_vec();
            if !is_told {
                delay(&mut data[STAMP], later_ns);
            }
            let mut at = (*message).clone();
            at.log_time += later_ns;
            at.publish_time += later_ns;
            at.data = data.into();
            writer.write(&at).expect("a message");
        }
    }
    writer.finish().expect("a log");
}

fn delay(stamp: &mut [u8], later_ns: u64) {
    let number = |bytes: &[u8]| u64::from(u32::from_le_bytes(bytes.try_into().expect("4 bytes")));
    let ns = number(&stamp[..4]) * 1_000_000_000 + number(&stamp[4..]) + later_ns;
    stamp[..4].copy_from_slice(&((ns / 1_000_000_000) as u32).to_le_bytes());
    stamp[4..].copy_from_slice(&((ns % 1_000_000_000) as u32).to_le_bytes());
}

/// Visits every message, without decoding it.
pub(crate) fn stream(path: &Path) {
    let bytes = read(path).expect("the log");
    let mut count = 0;
    for message in MessageStream::new(&bytes).expect("a log") {
        std::hint::black_box(message.expect("an intact message"));
        count += 1;
    }
    assert!(count > 0, "{} has no messages", path.display());
}
