use std::ops::ControlFlow;

use proptest::prelude::*;
use tipwatch_ingest::{Log, Losses, LostPart, LostRange, SensorDecoder, SensorKind, SensorSample};

use crate::support::{
    COMPRESSIONS, FIRST_NS, Mcap, PERIOD_NS, Style, TempLog, joint_log, joint_samples,
};

/// Messages named by lost ranges do not count among the missing ones of the index.
#[test]
fn missing_messages_beside_lost_ranges_are_told_as_more() {
    let told = |named: u64| {
        let range = LostRange {
            file: "log.mcap".into(),
            start_byte: 0,
            end_byte: 1,
            part: LostPart::Chunk,
            reason: "damaged".into(),
            first_time_ns: None,
            last_time_ns: None,
            messages: [("/imu".to_owned(), named)].into(),
            message_count: Some(named),
        };
        let losses = Losses {
            ranges: vec![range.clone(), range],
            missing_messages: [("/imu".to_owned(), 8)].into(),
            ..Losses::default()
        };
        losses.lines().skip(2).collect::<Vec<_>>()
    };
    assert!(told(2)[0].starts_with("4 more messages of /imu are missing, 8 in all"));
    assert!(told(0)[0].starts_with("8 messages of /imu are missing"));
    assert!(told(4).is_empty() && told(u64::MAX).is_empty());
}

/// Reads all that is left of a possibly damaged file.
fn read_all(bytes: &[u8]) -> Vec<SensorSample> {
    let file = TempLog::new("log.mcap", bytes);
    let Ok(log) = Log::open(&file.path) else {
        return Vec::new();
    };
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let joints = ["bb".to_owned(), "a".to_owned()];
    let mut decoders: Vec<_> = log
        .topics()
        .iter()
        .map(|topic| SensorDecoder::new(topic, SensorKind::JointStates, &joints).ok())
        .collect();
    let mut samples = Vec::new();
    let mut sample = SensorSample::default();
    log.read(&ids, &mut |message| {
        if let Some(decoder) = &mut decoders[message.topic.index()]
            && decoder.decode(message, &mut sample).is_ok()
        {
            samples.push(sample.clone());
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    samples
}

#[test]
fn file_cut_anywhere_yields_what_came_before() {
    for compression in COMPRESSIONS {
        for chunked in [true, false] {
            let style = Style {
                chunked,
                ..Style::chunked(compression)
            };
            let bytes = joint_log(&style, 200);
            let whole = read_all(&bytes);
            assert_eq!(whole.len(), 200);
            let mut counts = Vec::new();
            for end in (8..bytes.len()).step_by(97) {
                let found = read_all(&bytes[..end]);
                assert_eq!(found, whole[..found.len()]);
                counts.push(found.len());
            }
            assert!(counts.is_sorted(), "more bytes must not yield less");
            assert_eq!(*counts.last().unwrap(), 200);
        }
    }
}

/// A last message may end with zeros of its own, as the covariances of an odometry: the record ends where the file does.
#[test]
fn zeros_that_end_the_last_message_are_content() {
    let style = Style {
        chunked: false,
        ..Style::chunked(None)
    };
    let mut writer = Mcap::new(style.options());
    let topic = writer.topic("/odom", "std_msgs/msg/String", "string data\n");
    let data = |number: u8| [&[number; 100][..], &[0; 624]].concat();
    for number in 1..4_u8 {
        writer.message(topic, number.into(), [u64::from(number); 2], &data(number));
    }
    let bytes = writer.finish();
    let last = data(3);
    let at = bytes.windows(last.len()).rposition(|part| part == last);
    let file = TempLog::new("log.mcap", &bytes[..at.unwrap() + last.len()]);
    let log = Log::open(&file.path).unwrap();
    let mut found = Vec::new();
    let losses = log.read(&[log.topics()[0].id], &mut |message| {
        found.push(message.data.to_vec());
        ControlFlow::Continue(())
    });
    assert_eq!(found, [1, 2, 3].map(data));
    assert_eq!(losses.unwrap().bytes_lost(), 0);
}

/// After a loss of power, zeros or erased bytes stand behind what was written: they complete no message.
#[test]
fn bytes_that_were_never_written_are_no_content() {
    let filled = |bytes: &[u8], fill: u8| [bytes, &[fill; 5000]].concat();
    for compression in COMPRESSIONS {
        for chunked in [true, false] {
            let style = Style {
                chunked,
                ..Style::chunked(compression)
            };
            let bytes = joint_log(&style, 200);
            let ends = (1000..bytes.len()).step_by(331);
            for (end, fill) in ends.zip([0, 0xff].into_iter().cycle()) {
                let cut = &bytes[..end];
                if !cut.ends_with(&[fill]) {
                    assert_eq!(read_all(&filled(cut, fill)), read_all(cut), "cut at {end}");
                }
            }
            let file = TempLog::new("log.mcap", &filled(&bytes, 0));
            let (samples, losses) = joint_samples(&file.path);
            assert_eq!(
                (samples.len(), losses.is_empty()),
                (200, true),
                "{losses:?}"
            );
            assert!(
                losses
                    .notes
                    .iter()
                    .any(|note| note.contains("5000 bytes at the end"))
            );
        }
    }
}

#[test]
fn truncation_is_reported_with_its_position() {
    let bytes = joint_log(&Style::chunked(None), 200);
    let file = TempLog::new("log.mcap", &bytes[..bytes.len() / 2]);
    let (samples, losses) = joint_samples(&file.path);
    assert!(samples.len() > 50 && samples.len() < 150);
    let [range] = losses.ranges.as_slice() else {
        panic!("{losses:?}")
    };
    assert_eq!(range.part, LostPart::Tail);
    assert_eq!(range.end_byte, bytes.len() as u64 / 2);
    assert!(
        range.reason.contains("bytes are left in the file"),
        "{range}"
    );
    let json = serde_json::to_string(&losses).unwrap();
    assert!(
        json.contains("start_byte") && json.contains("undecodable_messages"),
        "{json}"
    );
}

/// The offsets and lengths of the chunks of an undamaged file.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let chunk = |index: &mcap::records::ChunkIndex| {
        (
            index.chunk_start_offset as usize,
            index.chunk_length as usize,
        )
    };
    summary.chunk_indexes.iter().map(chunk).collect()
}

#[test]
fn wrong_checksum_loses_one_chunk_only() {
    for compression in COMPRESSIONS {
        for summary in [true, false] {
            let indexed = joint_log(&Style::chunked(compression), 200);
            let (offset, length) = chunks(&indexed)[1];
            let mut bytes = joint_log(
                &Style {
                    summary,
                    ..Style::chunked(compression)
                },
                200,
            );
            bytes[offset + length - 20] ^= 0x10;
            let file = TempLog::new("log.mcap", &bytes);
            let (samples, losses) = joint_samples(&file.path);
            assert_eq!(losses.ranges.len(), 1, "{losses:?}");
            let range = &losses.ranges[0];
            assert_eq!(range.part, LostPart::Chunk);
            let expected = (offset as u64, (offset + length) as u64);
            assert_eq!((range.start_byte, range.end_byte), expected);
            if compression.is_none() {
                assert!(range.reason.starts_with("CRC: expected"), "{range}");
            }
            assert!(
                samples.len() > 100 && samples.len() < 200,
                "{}",
                samples.len()
            );
            assert_eq!(samples.last().unwrap().values[1], 199.0);
        }
    }
}

#[test]
fn chunk_of_wrong_length_is_read_if_its_checksum_fits() {
    for compression in COMPRESSIONS {
        for summary in [true, false] {
            let style = Style {
                summary,
                ..Style::chunked(compression)
            };
            let indexed = joint_log(&Style::chunked(compression), 200);
            let mut bytes = joint_log(&style, 200);
            let (offset, _) = chunks(&indexed)[1];
            bytes[offset + 1..offset + 9].fill(0x7f);
            let file = TempLog::new("log.mcap", &bytes);
            let (samples, losses) = joint_samples(&file.path);
            assert_eq!(samples.len(), 200, "{losses:?}");
            let [range] = losses.ranges.as_slice() else {
                panic!("{losses:?}")
            };
            assert_eq!(range.start_byte, offset as u64);
            assert!(range.reason.contains("content is intact"), "{range}");
        }
    }
}

#[test]
fn next_record_after_damage_is_found_without_index() {
    let style = Style {
        summary: false,
        ..Style::chunked(Some(mcap::Compression::Lz4))
    };
    let mut bytes = joint_log(&style, 200);
    let (offset, length) = chunks(&joint_log(&Style::chunked(style.compression), 200))[1];
    bytes[offset..offset + 60].fill(0);
    let file = TempLog::new("log.mcap", &bytes);
    let (samples, losses) = joint_samples(&file.path);
    let [range] = losses.ranges.as_slice() else {
        panic!("{losses:?}")
    };
    let expected = (offset as u64, (offset + length) as u64);
    assert_eq!((range.start_byte, range.end_byte), expected);
    let lost = range.messages["/joint_states"];
    assert_eq!(
        samples.len() as u64 + lost,
        200,
        "the index beside it counts"
    );
    let (first, last) = (range.first_time_ns.unwrap(), range.last_time_ns.unwrap());
    for index in 0..200 {
        let log_time_ns = FIRST_NS + index * PERIOD_NS + 5;
        let is_there = samples.iter().any(|s| s.log_time_ns == log_time_ns);
        assert!(is_there || (first..=last).contains(&log_time_ns), "{index}");
    }
}

#[test]
fn wrong_index_loses_no_message() {
    let good = joint_log(&Style::chunked(None), 200);
    let summary_at = chunks(&good)
        .iter()
        .map(|(offset, length)| offset + length)
        .max()
        .unwrap();
    let mut bytes = good.clone();
    let first = chunks(&good)[1].0 as u64;
    // The chunk's index has the same offset; without its checksum the damage would go unnoticed.
    let place = (summary_at..bytes.len() - 8)
        .find(|&at| bytes[at..at + 8] == first.to_le_bytes())
        .unwrap();
    bytes[place..place + 8].copy_from_slice(&(first + 300).to_le_bytes());
    let crc_at = bytes.len() - 8 - 4;
    bytes[crc_at..crc_at + 4].fill(0);
    let file = TempLog::new("log.mcap", &bytes);
    let (samples, losses) = joint_samples(&file.path);
    assert_eq!(samples.len(), 200);
    assert!(losses.is_empty(), "{losses:?}");
    assert!(
        losses.notes[0].contains("are not at their offsets"),
        "{losses:?}"
    );
}

#[test]
fn absurd_content_size_is_refused_before_allocation() {
    for compression in COMPRESSIONS {
        let mut bytes = joint_log(&Style::chunked(compression), 200);
        let (offset, _) = chunks(&bytes)[1];
        let size_at = offset + 9 + 16;
        for size in [u64::MAX, 1 << 40, 1 << 29] {
            bytes[size_at..size_at + 8].copy_from_slice(&size.to_le_bytes());
            let file = TempLog::new("log.mcap", &bytes);
            let (samples, losses) = joint_samples(&file.path);
            let lost = losses.ranges.iter().map(|range| range.part);
            let chunks = lost.filter(|part| *part == LostPart::Chunk);
            assert_eq!(chunks.count(), 1, "{losses:?}");
            assert!(samples.len() > 100);
        }
    }
}

#[test]
fn damaged_beginning_loses_nothing_else() {
    let mut bytes = joint_log(&Style::chunked(Some(mcap::Compression::Zstd)), 200);
    bytes[..30].fill(0);
    let file = TempLog::new("log.mcap", &bytes);
    let (samples, losses) = joint_samples(&file.path);
    assert_eq!(samples.len(), 200);
    assert_eq!(losses.ranges[0].start_byte, 0, "{losses:?}");
    let nameless = TempLog::new("log.dat", &bytes);
    assert!(Log::open(&nameless.path).is_err());
}

#[test]
fn absent_checksums_are_a_finding_not_a_loss() {
    let style = Style {
        crc: false,
        ..Style::chunked(None)
    };
    let file = TempLog::new("log.mcap", &joint_log(&style, 50));
    let log = Log::open(&file.path).unwrap();
    assert!(log.losses().is_empty());
    assert!(
        log.losses()
            .integrity
            .note()
            .unwrap()
            .contains("integrity cannot be verified")
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

    #[test]
    fn changed_bytes_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        summary in any::<bool>(),
        crc in any::<bool>(),
    ) {
        for compression in COMPRESSIONS {
            let style = Style { summary, crc, ..Style::chunked(compression) };
            let mut bytes = joint_log(&style, 60);
            for (place, value) in &changes {
                let at = place.index(bytes.len());
                bytes[at] = *value;
            }
            read_all(&bytes);
        }
    }

    #[test]
    fn changed_bytes_of_single_records_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let style = Style { chunked: false, ..Style::chunked(None) };
        let mut bytes = joint_log(&style, 30);
        for (place, value) in &changes {
            let at = place.index(bytes.len());
            bytes[at] = *value;
        }
        read_all(&bytes);
    }

    #[test]
    fn arbitrary_bytes_after_the_magic_never_panic(
        rest in proptest::collection::vec(any::<u8>(), 0..400),
        database in any::<bool>(),
    ) {
        let magic: &[u8] = if database { b"SQLite format 3\0" } else { mcap::MAGIC };
        read_all(&[magic, &rest].concat());
    }
}
