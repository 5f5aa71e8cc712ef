//! Bags of ROS 1, made in memory.

use std::{io::Write as _, ops::ControlFlow};

use tipwatch_ingest::{Format, Log, LostPart, joint_names_in};

use crate::support::{FIRST_NS, PERIOD_NS, Style, TempLog, joint_log, joint_samples, topic_named};

pub(crate) const PACKINGS: [&str; 3] = ["none", "lz4", "bz2"];
const JOINT_STATE: &str = "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
    float64[] effort\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
const MESSAGES_IN_A_CHUNK: usize = 20;

fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in fields {
        let bytes = (name.len() + 1 + value.len()) as u32;
        header.extend(bytes.to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    let mut record = (header.len() as u32).to_le_bytes().to_vec();
    record.extend(header);
    record.extend((data.len() as u32).to_le_bytes());
    record.extend(data);
    record
}

fn time(time_ns: i64) -> [u8; 8] {
    let (seconds, nanoseconds) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
    let halves = [
        (seconds as u32).to_le_bytes(),
        (nanoseconds as u32).to_le_bytes(),
    ];
    halves.concat().try_into().unwrap()
}

fn connection(id: u32, topic: &str, type_name: &str, definition: &str) -> Vec<u8> {
    let data = record(
        &[
            ("topic", topic.as_bytes()),
            ("type", type_name.as_bytes()),
            ("md5sum", b"*"),
            ("message_definition", definition.as_bytes()),
        ],
        b"",
    );
    // The data of a connection is itself a header, without data.
    let data = &data[4..data.len() - 4];
    record(
        &[
            ("conn", &id.to_le_bytes()),
            ("op", &[7]),
            ("topic", topic.as_bytes()),
        ],
        data,
    )
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
}

fn joint_state(index: usize) -> Vec<u8> {
    let value = index as f64;
    let mut bytes = (index as u32).to_le_bytes().to_vec();
    bytes.extend(time(FIRST_NS + index as i64 * PERIOD_NS));
    text(&mut bytes, "/base");
    bytes.extend(2_u32.to_le_bytes());
    text(&mut bytes, "a");
    text(&mut bytes, "bb");
    for pair in [[value, -value], [0.5, value * 0.25]] {
        bytes.extend(2_u32.to_le_bytes());
        bytes.extend(pair.map(f64::to_le_bytes).concat());
    }
    bytes.extend(0_u32.to_le_bytes());
    bytes
}

fn pack(packing: &str, content: &[u8]) -> Vec<u8> {
    match packing {
        "lz4" => {
            let info = lz4_flex::frame::FrameInfo::new().content_checksum(true);
            let mut encoder = lz4_flex::frame::FrameEncoder::with_frame_info(info, Vec::new());
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        }
        "bz2" => {
            let level = bzip2::Compression::fast();
            let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), level);
            encoder.write_all(content).unwrap();
            encoder.finish().unwrap()
        }
        _ => content.to_vec(),
    }
}

/// Returns a bag with the same joint states and strings as in [`joint_log`].
pub(crate) fn bag(packing: &str, is_indexed: bool, message_count: usize) -> Vec<u8> {
    let connections = [
        connection(0, "/joint_states", "sensor_msgs/JointState", JOINT_STATE),
        connection(1, "/chatter", "std_msgs/String", "string data\n"),
    ];
    let mut bytes = bag_header(0, 0);
    let mut infos = Vec::new();
    for first in (0..message_count).step_by(MESSAGES_IN_A_CHUNK) {
        let last = (first + MESSAGES_IN_A_CHUNK).min(message_count) - 1;
        let mut content = if first == 0 {
            connections.concat()
        } else {
            Vec::new()
        };
        for index in first..=last {
            let stamp = time(FIRST_NS + index as i64 * PERIOD_NS + 5);
            let message = |id: u32, data: &[u8]| {
                record(
                    &[("conn", &id.to_le_bytes()), ("op", &[2]), ("time", &stamp)],
                    data,
                )
            };
            content.extend(message(0, &joint_state(index)));
            let mut chatter = Vec::new();
            text(&mut chatter, &format!("message {index}"));
            content.extend(message(1, &chatter));
        }
        let size = (content.len() as u32).to_le_bytes();
        let place = bytes.len() as u64;
        let fields: &[(&str, &[u8])] = &[
            ("compression", packing.as_bytes()),
            ("op", &[5]),
            ("size", &size),
        ];
        bytes.extend(record(fields, &pack(packing, &content)));
        let count = (last - first + 1) as u32;
        for id in [0_u32, 1] {
            bytes.extend(record(
                &[
                    ("conn", &id.to_le_bytes()),
                    ("count", &count.to_le_bytes()),
                    ("op", &[4]),
                    ("ver", &1_u32.to_le_bytes()),
                ],
                &vec![0; 12 * count as usize],
            ));
        }
        let times = [first, last].map(|i| time(FIRST_NS + i as i64 * PERIOD_NS + 5));
        let counts = [0, count, 1, count].map(u32::to_le_bytes).concat();
        infos.extend(record(
            &[
                ("chunk_pos", &place.to_le_bytes()),
                ("count", &2_u32.to_le_bytes()),
                ("end_time", &times[1]),
                ("op", &[6]),
                ("start_time", &times[0]),
                ("ver", &1_u32.to_le_bytes()),
            ],
            &counts,
        ));
    }
    if is_indexed {
        let header = bag_header(
            bytes.len() as u64,
            message_count.div_ceil(MESSAGES_IN_A_CHUNK),
        );
        bytes[..header.len()].copy_from_slice(&header);
        bytes.extend(connections.concat());
        bytes.extend(infos);
    }
    bytes
}

fn bag_header(index_position: u64, chunks: usize) -> Vec<u8> {
    header_of(index_position, chunks, 2)
}

fn header_of(index_position: u64, chunks: usize, connections: u32) -> Vec<u8> {
    let mut bytes = b"#ROSBAG V2.0\n".to_vec();
    bytes.extend(record(
        &[
            ("chunk_count", &(chunks as u32).to_le_bytes()),
            ("conn_count", &connections.to_le_bytes()),
            ("index_pos", &index_position.to_le_bytes()),
            ("op", &[3]),
        ],
        &[b' '; 100],
    ));
    bytes
}

#[test]
fn bag_gives_the_samples_of_the_mcap_file() {
    let mcap = TempLog::new("log.mcap", &joint_log(&Style::chunked(None), 90));
    let (expected, _) = joint_samples(&mcap.path);
    for packing in PACKINGS {
        for is_indexed in [true, false] {
            let file = TempLog::new("log", &bag(packing, is_indexed, 90));
            let log = Log::open(&file.path).unwrap();
            assert_eq!(log.format(), Format::Ros1Bag);
            assert_eq!(log.topics()[0].message_count, Some(90));
            let joints = topic_named(&log, "/joint_states");
            assert_eq!(joint_names_in(&log, joints).unwrap(), ["a", "bb"]);
            let (samples, losses) = joint_samples(&file.path);
            assert_eq!(samples.len(), 90);
            for (sample, expected) in samples.iter().zip(&expected) {
                assert_eq!(sample.values, expected.values);
                assert_eq!(sample.header_stamp_ns, expected.header_stamp_ns);
                assert_eq!(sample.log_time_ns, expected.log_time_ns);
            }
            assert_eq!(losses.integrity.note().is_some(), packing == "none");
            // A bag without index may continue; its end is unknown.
            assert_eq!(losses.is_empty(), is_indexed, "{losses:?}");
            assert_eq!(losses.bytes_lost(), 0);
        }
    }
}

#[test]
fn a_bag_that_was_closed_without_messages_is_whole() {
    let end = header_of(0, 0, 0).len() as u64;
    for (position, chunks, connections, is_whole) in
        [(end, 0, 0, true), (end, 3, 2, false), (0, 0, 0, false)]
    {
        let file = TempLog::new("log.bag", &header_of(position, chunks, connections));
        let log = Log::open(&file.path).unwrap();
        assert!(log.topics().is_empty());
        let losses = log.read(&[], &mut |_| ControlFlow::Continue(())).unwrap();
        assert_eq!(
            losses.is_empty(),
            is_whole,
            "{position} {chunks}: {losses:?}"
        );
    }
}

#[test]
fn bag_cut_anywhere_yields_what_came_before() {
    for packing in PACKINGS {
        let bytes = bag(packing, true, 90);
        let mut counts = Vec::new();
        for end in (2500..bytes.len()).step_by(211) {
            let file = TempLog::new("cut.bag", &bytes[..end]);
            let log = Log::open(&file.path).unwrap();
            if log.topics().is_empty() {
                continue;
            }
            let (samples, losses) = joint_samples(&file.path);
            for (index, sample) in samples.iter().enumerate() {
                assert_eq!(sample.values[1], index as f64);
            }
            let is_told = !losses.is_empty() || losses.notes[0].contains("no intact index");
            assert!(is_told, "cut at {end} of {}", bytes.len());
            counts.push(samples.len());
        }
        assert!(counts.is_sorted(), "{packing}: {counts:?}");
        assert!(*counts.last().unwrap() >= 80);
    }
}

#[test]
fn index_tells_what_a_damaged_chunk_held() {
    for packing in ["lz4", "bz2"] {
        let mut bytes = bag(packing, true, 90);
        let headers = (0..bytes.len() / 2).filter(|&at| bytes[at..].starts_with(b"compression="));
        let middle = headers.max().unwrap() + 200;
        bytes[middle..middle + 40].fill(0);
        let file = TempLog::new("log.bag", &bytes);
        let (samples, losses) = joint_samples(&file.path);
        let [range] = losses.ranges.as_slice() else {
            panic!("{losses:?}")
        };
        assert_eq!(range.part, LostPart::Chunk);
        assert!((range.start_byte..range.end_byte).contains(&(middle as u64)));
        assert_eq!(range.messages["/joint_states"], 20);
        assert_eq!(losses.missing_messages["/joint_states"], 20);
        assert_eq!(samples.len(), 70);
        let span_ns = range.last_time_ns.unwrap() - range.first_time_ns.unwrap();
        assert_eq!(span_ns, 19 * PERIOD_NS);
    }
}

#[test]
fn missing_bytes_lose_only_the_messages_they_touch() {
    let whole = bag("none", false, 150);
    // in message 79, the last but one of its chunk, to the first messages of the next chunk
    let inside = |index: usize| {
        let text = joint_state(index);
        whole.windows(text.len()).position(|w| w == text).unwrap()
    };
    let (from, to) = (inside(79) + 18, inside(86) - 97);
    let bytes = [&whole[..from], &whole[to..]].concat();
    let file = TempLog::new("log.bag", &bytes);
    let (samples, losses) = joint_samples(&file.path);
    let found: Vec<f64> = samples.iter().map(|sample| sample.values[1]).collect();
    let intact = (0..79).chain(86..150).map(f64::from);
    for index in intact {
        assert!(found.contains(&index), "{index}: {losses:?}");
    }
    assert!(!losses.ranges.is_empty());
}
