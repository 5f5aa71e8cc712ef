//! Fixtures and helpers of all tests.

use std::{fs, io::Cursor, path::PathBuf};

use tipwatch_can::{CanId, Container, Frame, FrameKind, FrameSource};

pub(crate) fn data_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

pub(crate) fn data(name: &str) -> Vec<u8> {
    fs::read(data_folder().join(name)).expect(name)
}

pub(crate) fn text(name: &str) -> String {
    String::from_utf8(data(name)).unwrap()
}

/// Returns all frames of a file, and the sentences about its losses.
pub(crate) fn frames(bytes: &[u8]) -> (Vec<(String, Frame)>, Vec<String>) {
    let mut source = Container::open(Cursor::new(bytes)).unwrap();
    let mut frames = Vec::new();
    let mut frame = Frame::default();
    while source.next_frame(&mut frame).unwrap() {
        let channel = source.channels()[frame.channel].clone();
        frames.push((channel, frame.clone()));
    }
    let lost = source.lost().iter().map(|lost| lost.reason.clone());
    (frames, lost.collect())
}

/// The frames that `frames.txt` lists, on channels 0 and 1.
pub(crate) fn listed() -> Vec<Frame> {
    let listed = text("frames.txt");
    let frame = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        let raw = u32::from_str_radix(words[3], 16).unwrap();
        let mut frame = Frame::default();
        frame.time_ns = words[0].parse().unwrap();
        frame.channel = words[1].parse().unwrap();
        frame.id = if words[4] == "1" {
            CanId::extended(raw)
        } else {
            CanId::standard(raw)
        };
        frame.kind = match words[2] {
            "data" => FrameKind::Data,
            "remote" => FrameKind::Remote,
            _ => FrameKind::Error,
        };
        frame.is_fd = words[5] == "1";
        let byte = |at: usize| u8::from_str_radix(&words[6][at..at + 2], 16).unwrap();
        let bytes: Vec<u8> = (0..words[6].len()).step_by(2).map(byte).collect();
        assert!(frame.set_data(&bytes));
        frame
    };
    listed.lines().map(frame).collect()
}
