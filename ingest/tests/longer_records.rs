//! MCAP records with more bytes than their fields, as later versions of the format may write them.

use std::ops::ControlFlow;

use tipwatch_ingest::{Log, metadata_records, recover};

use crate::support::TempLog;

/// Content of the summary of a file.
#[derive(Clone, Copy, PartialEq)]
enum Summary {
    None,
    /// Without statistics: messages are counted by their index.
    Indexes,
    Whole,
}

/// Writes records byte by byte, each with some bytes behind its fields.
struct Writer {
    bytes: Vec<u8>,
    padding: &'static [u8],
}

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn numbers<const N: usize>(numbers: [u64; N]) -> Vec<u8> {
    numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect()
}

impl Writer {
    /// Writes a record, and returns its offset and length.
    fn record(&mut self, opcode: u8, fields: &[&[u8]]) -> (u64, u64) {
        let start = self.bytes.len() as u64;
        let body = [fields.concat().as_slice(), self.padding].concat();
        self.bytes.push(opcode);
        self.bytes.extend((body.len() as u64).to_le_bytes());
        self.bytes.extend(body);
        (start, self.bytes.len() as u64 - start)
    }

    fn definitions(&mut self) {
        let id = 1_u16.to_le_bytes();
        self.record(
            3,
            &[
                &id,
                &sized(b"own/msg/Number"),
                &sized(b"ros2msg"),
                &sized(b"float64 x\n"),
            ],
        );
        let says = [sized(b"offered_qos_profiles"), sized(b"- depth: 5")].concat();
        self.record(4, &[&id, &id, &sized(b"/x"), &sized(b"cdr"), &sized(&says)]);
    }
}

const MESSAGES: u64 = 4;

/// A file of two chunks, or of messages without chunks.
fn file(padding: &'static [u8], is_chunked: bool, summary: Summary) -> Vec<u8> {
    let mut file = Writer {
        bytes: mcap::MAGIC.to_vec(),
        padding,
    };
    file.record(1, &[&sized(b"ros2"), &sized(b"a test")]);
    if !is_chunked {
        file.definitions();
    }
    let mut chunks = Vec::new();
    for first in (0..MESSAGES).step_by(2) {
        let mut content = Writer {
            bytes: Vec::new(),
            padding,
        };
        content.definitions();
        for number in first..first + 2 {
            let header = [&1_u16.to_le_bytes()[..], &(number as u32).to_le_bytes()].concat();
            let times = numbers([number + 1, number + 1]);
            let data = [&[0, 1, 0, 0][..], &(number as f64).to_le_bytes()].concat();
            // the data are all that is left of a message: bytes behind them belong to them
            let plain = std::mem::take(&mut content.padding);
            content.record(5, &[&header, &times, &data]);
            content.padding = plain;
        }
        if !is_chunked {
            let definitions = {
                let mut writer = Writer {
                    bytes: Vec::new(),
                    padding,
                };
                writer.definitions();
                writer.bytes.len()
            };
            file.bytes.extend(&content.bytes[definitions..]);
            continue;
        }
        let bytes = content.bytes;
        let size = bytes.len() as u64;
        let crc = crc32fast::hash(&bytes).to_le_bytes();
        let span = numbers([first + 1, first + 2]);
        let place = file.record(
            6,
            &[
                &span,
                &numbers([size]),
                &crc,
                &sized(b""),
                &numbers([size]),
                &bytes,
            ],
        );
        let entries = numbers([first + 1, 0, first + 2, 0]);
        let index = file.record(7, &[&1_u16.to_le_bytes(), &sized(&entries)]);
        chunks.push((place, index, span, size));
    }
    let name = [
        &numbers([1, 2])[..],
        &sized(b"robot.urdf"),
        &sized(b"text/xml"),
    ]
    .concat();
    let attachment = [&name[..], &numbers([8]), b"<robot/>"].concat();
    let crc = crc32fast::hash(&attachment).to_le_bytes();
    let (attached, attached_bytes) = file.record(9, &[&attachment, &crc]);
    let values = [sized(b"serial"), sized(b"7")].concat();
    let (stated, stated_bytes) = file.record(12, &[&sized(b"machine"), &sized(&values)]);
    file.record(15, &[&[0; 4]]);
    let summary_start = file.bytes.len() as u64;
    if summary != Summary::None {
        file.definitions();
        for ((start, length), (index, index_bytes), span, size) in &chunks {
            let offsets = [&1_u16.to_le_bytes()[..], &numbers([*index])].concat();
            file.record(
                8,
                &[
                    span,
                    &numbers([*start, *length]),
                    &sized(&offsets),
                    &numbers([*index_bytes]),
                    &sized(b""),
                    &numbers([*size, *size]),
                ],
            );
        }
        let of_attachment = numbers([attached, attached_bytes, 1, 2, 8]);
        file.record(
            10,
            &[&of_attachment, &sized(b"robot.urdf"), &sized(b"text/xml")],
        );
        file.record(13, &[&numbers([stated, stated_bytes]), &sized(b"machine")]);
    }
    if summary == Summary::Whole {
        let counts = [&1_u16.to_le_bytes()[..], &numbers([MESSAGES])].concat();
        let small = [1_u32, 1, 1, chunks.len() as u32]
            .map(u32::to_le_bytes)
            .concat();
        file.record(
            11,
            &[
                &numbers([MESSAGES]),
                &1_u16.to_le_bytes(),
                &small,
                &numbers([1, MESSAGES]),
                &sized(&counts),
            ],
        );
        file.record(14, &[&[3], &numbers([summary_start, 10])]);
    }
    let start = if summary == Summary::None {
        0
    } else {
        summary_start
    };
    // readers find the footer by its length
    file.padding = b"";
    file.record(2, &[&numbers([start, 0]), &[0; 4]]);
    file.bytes.extend(mcap::MAGIC);
    file.bytes
}

#[test]
fn bytes_behind_the_fields_of_a_record_are_passed_over() {
    for summary in [Summary::None, Summary::Indexes, Summary::Whole] {
        for (is_chunked, padding) in [
            (true, &b""[..]),
            (true, b"\x01\xff\xff"),
            (false, b"\x01\xff\xff"),
            (
                true,
                b"\x05\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00",
            ),
        ] {
            let named = format!("{is_chunked} {padding:?}");
            let log = TempLog::new("log.mcap", &file(padding, is_chunked, summary));
            let log = Log::open(&log.path).unwrap();
            let topic = &log.topics()[0];
            assert_eq!(log.topics().len(), 1, "{named}");
            let is_counted = is_chunked || summary != Summary::Indexes;
            assert_eq!(
                topic.message_count,
                is_counted.then_some(MESSAGES),
                "{named}"
            );
            let mut numbers = Vec::new();
            let losses = log
                .read(&[topic.id], &mut |message| {
                    numbers.push(message.data.len());
                    ControlFlow::Continue(())
                })
                .unwrap();
            assert_eq!(numbers, [12; MESSAGES as usize], "{named}");
            assert!(losses.is_empty(), "{named}: {losses:?}");
            let says = &topic.writers[0].says;
            assert_eq!(says["offered_qos_profiles"], "- depth: 5", "{named}");
            assert_eq!(
                metadata_records(&log).unwrap()[0].values["serial"],
                "7",
                "{named}"
            );
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("out.mcap");
            let report = recover(&log, &out).unwrap();
            assert_eq!(
                (report.extras, report.message_count()),
                (2, MESSAGES),
                "{named}"
            );
        }
    }
}

#[test]
fn a_chunk_whose_inner_length_is_damaged_is_mended() {
    let mut bytes = file(b"", true, Summary::Whole);
    let mut chunk = mcap::MAGIC.len();
    while bytes[chunk] != 6 {
        let length = u64::from_le_bytes(bytes[chunk + 1..chunk + 9].try_into().unwrap());
        chunk += 9 + length as usize;
    }
    // the lengths of the content, before and after compression
    let [plain, packed] = [chunk + 9 + 16, chunk + 9 + 32];
    assert_eq!(bytes[plain..plain + 8], bytes[packed..packed + 8]);
    bytes[packed] -= 1;
    let file = TempLog::new("log.mcap", &bytes);
    let log = Log::open(&file.path).unwrap();
    let mut count = 0;
    let losses = log
        .read(&[log.topics()[0].id], &mut |_| {
            count += 1;
            ControlFlow::Continue(())
        })
        .unwrap();
    assert_eq!((count, losses.ranges.len()), (MESSAGES, 1), "{losses:?}");
}
