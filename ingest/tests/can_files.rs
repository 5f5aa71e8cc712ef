//! Files of CAN loggers as logs: each channel a topic of frames.

use std::{io::Write as _, ops::ControlFlow, path::PathBuf};

use tipwatch_can::{Database, j1939};
use tipwatch_ingest::{CanTopic, FieldRequest, Log, Losses, record_fields, recover};

use crate::support::TempLog;

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("can/tests/data")
        .join(name)
}

/// Messages by topic, and what was lost.
fn read(log: &Log) -> (Vec<u64>, Losses) {
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let mut counts = vec![0; ids.len()];
    let losses = log.read(&ids, &mut |message| {
        counts[message.topic.index()] += 1;
        ControlFlow::Continue(())
    });
    (counts, losses.unwrap())
}

#[test]
fn every_format_is_recognised_by_its_content() {
    let cases = [
        ("mixed.log", "candump", ["can0", "can1"]),
        ("mixed.asc", "Vector ASC", ["can1", "can2"]),
        ("mixed.blf", "Vector BLF", ["can1", "can2"]),
        ("mixed.mf4", "ASAM MF4", ["can0", "can1"]),
    ];
    for (name, format, channels) in cases {
        // under a name that says nothing
        let file = TempLog::new("trace", &std::fs::read(fixture(name)).unwrap());
        let log = Log::open(&file.path).unwrap();
        assert_eq!(log.format().to_string(), format);
        let topics = log.topics();
        let names: Vec<&str> = topics.iter().map(|topic| topic.name.as_str()).collect();
        assert_eq!(names, channels, "{name}");
        assert_eq!(topics[0].type_name, "ros2_socketcan_msgs/msg/FdFrame");
        assert_eq!(topics[1].type_name, "can_msgs/msg/Frame");
        // 120 frames, of which 20 on the second channel and 20 remote frames
        let (counts, losses) = read(&log);
        assert_eq!(counts, [80, 20], "{name}");
        assert_eq!(topics[0].message_count, Some(80));
        assert!(losses.is_empty(), "{name}: {losses:?}");
        assert!(
            losses
                .notes
                .iter()
                .any(|note| note.contains("20 remote frames")),
            "{losses:?}"
        );
        let (first, last) = log.span_ns().unwrap();
        assert!((last - first - 119 * 15_625_000).abs() < 10_000, "{name}");
    }
}

/// A PCAN trace has classical data frames only, and MF4 files may have a bus for each group.
#[test]
fn every_bus_of_a_trace_is_a_topic() {
    let cases: [(&str, &str, &[&str], u64); 3] = [
        ("classical.trc", "PEAK TRC", &["can1", "can2"], 60),
        ("classical_1_0.trc", "PEAK TRC", &["can1"], 60),
        (
            "layout_virtual_bus.mf4",
            "ASAM MF4",
            &["can1", "can2", "can3", "can4"],
            48,
        ),
    ];
    for (name, format, channels, frames) in cases {
        let log = Log::open(&fixture(name)).unwrap();
        assert_eq!(log.format().to_string(), format);
        let names: Vec<&str> = log
            .topics()
            .iter()
            .map(|topic| topic.name.as_str())
            .collect();
        assert_eq!(names, channels, "{name}");
        let (counts, losses) = read(&log);
        assert_eq!(counts.iter().sum::<u64>(), frames, "{name}");
        assert!(losses.is_empty(), "{name}: {losses:?}");
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("clean.mcap");
        recover(&log, &target).unwrap();
        assert_eq!(read(&Log::open(&target).unwrap()).0, counts, "{name}");
    }
}

/// A file packed as a whole, by each of the programs that users have.
fn packed(bytes: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(bytes).unwrap();
    let mut bzip2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    bzip2.write_all(bytes).unwrap();
    let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
    lz4.write_all(bytes).unwrap();
    vec![
        ("gzip", gzip.finish().unwrap()),
        ("bzip2", bzip2.finish().unwrap()),
        ("lz4", lz4.finish().unwrap()),
        ("zstd", zstd::stream::encode_all(bytes, 1).unwrap()),
    ]
}

#[test]
fn packed_traces_give_the_messages_of_the_trace() {
    for name in [
        "mixed.log",
        "mixed.asc",
        "mixed.blf",
        "mixed_plain.mf4",
        "classical.trc",
    ] {
        let bytes = std::fs::read(fixture(name)).unwrap();
        let plain = read(&Log::open(&fixture(name)).unwrap()).0;
        for (packing, packed) in packed(&bytes) {
            let file = TempLog::new("trace", &packed);
            let log = Log::open(&file.path).unwrap();
            let (counts, losses) = read(&log);
            assert_eq!(counts, plain, "{name} in {packing}");
            assert!(losses.is_empty(), "{name} in {packing}: {losses:?}");
        }
    }
}

/// Packed files that were joined are one file, whatever zeros fill up their blocks; of a file that is cut the beginning is read.
#[test]
fn joined_and_cut_packed_traces_are_read() {
    let bytes = std::fs::read(fixture("mixed.log")).unwrap();
    let long = bytes.repeat(20);
    let halves = 10 * bytes.len();
    for ((packing, first), (_, second)) in packed(&long[..halves])
        .into_iter()
        .zip(packed(&long[halves..]))
    {
        for [between, behind] in
            [[0, 0], [0, 1], [0, 70_000], [512, 3]].map(|pad| pad.map(|n| vec![0; n]))
        {
            let file = TempLog::new(
                "joined",
                &[&first, &between, &second, &behind]
                    .map(Vec::as_slice)
                    .concat(),
            );
            let (counts, losses) = read(&Log::open(&file.path).unwrap());
            assert_eq!(counts, [80 * 20, 20 * 20], "{packing}");
            assert!(losses.is_empty(), "{packing}: {losses:?}");
        }
        let file = TempLog::new("cut", &[&first[..], &second[..second.len() / 2]].concat());
        let log = Log::open(&file.path).unwrap();
        let (counts, losses) = read(&log);
        assert!(
            (80 * 10..80 * 20).contains(&counts[0]),
            "{packing}: {counts:?}"
        );
        assert!(!losses.is_empty(), "{packing}");
        let flipped = first.len() / 2;
        let mut damaged = [&first[..], &second[..]].concat();
        damaged[flipped] ^= 0x40;
        let file = TempLog::new("flipped", &damaged);
        let Ok(log) = Log::open(&file.path) else {
            continue;
        };
        let (counts, losses) = read(&log);
        assert!(counts[0] <= 80 * 20, "{packing}");
        // these have a checksum
        if ["gzip", "bzip2"].contains(&packing) {
            assert!(!losses.is_empty(), "{packing}");
        }
    }
}

#[test]
fn messages_become_topics_with_a_number_per_signal() {
    let mut log = Log::open(&fixture("machine.log")).unwrap();
    let database = Database::parse(&std::fs::read(fixture("machine.dbc")).unwrap()).unwrap();
    let topic = |name: &str| CanTopic {
        name: format!("can/{name}"),
        bus: None,
        message: database.message(name).unwrap().clone(),
        source: None,
        notes: vec!["a remark".to_owned()],
    };
    log.decode_can(&[topic("BoomState"), topic("AxleLoads")])
        .unwrap();
    let requests = [
        FieldRequest::raw("can/BoomState", "BoomLength"),
        FieldRequest::raw("can/AxleLoads", "AxleLoad1"),
    ];
    let (columns, losses) = record_fields(&log, &requests, None).unwrap();
    assert_eq!(columns[0].values.len(), 45);
    // 16716 mm
    assert!((columns[0].values[0] - 16.716).abs() < 1e-12);
    assert!(
        columns[1]
            .values
            .iter()
            .all(|mass| (0.0..32127.5).contains(mass))
    );
    assert_eq!(
        losses
            .notes
            .iter()
            .filter(|note| *note == "a remark")
            .count(),
        1
    );
    // on a bus that is not there
    let elsewhere = CanTopic {
        name: "other/Slope".into(),
        bus: Some("can7".into()),
        message: j1939::public_group(61481).unwrap(),
        source: None,
        notes: Vec::new(),
    };
    let error = log.decode_can(&[elsewhere]).unwrap_err().to_string();
    assert!(error.contains("can7") && error.contains("can0"), "{error}");
}

#[test]
fn damage_is_told_and_the_rest_is_read() {
    for name in ["mixed.log", "mixed.asc", "mixed.blf", "mixed_plain.mf4"] {
        let mut bytes = std::fs::read(fixture(name)).unwrap();
        let cut = bytes.len() * 9 / 10 + 1;
        bytes.truncate(cut);
        let file = TempLog::new("cut", &bytes);
        let log = Log::open(&file.path).unwrap();
        let (counts, losses) = read(&log);
        let frames: u64 = counts.iter().sum();
        assert!((1..=100).contains(&frames), "{name}: {frames}");
        assert!(!losses.is_empty(), "{name}");
    }
}

#[test]
fn frames_are_recovered_as_a_clean_file() {
    let log = Log::open(&fixture("mixed.blf")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("clean.mcap");
    recover(&log, &target).unwrap();
    let clean = Log::open(&target).unwrap();
    assert_eq!(read(&clean).0, read(&log).0);
    let mut frames = [0, 0];
    for (log, count) in [&log, &clean].into_iter().zip(&mut frames) {
        let bus = log.can_buses().next().unwrap().id;
        log.read_can_frames(bus, &mut |frame| *count += frame.data().len())
            .unwrap();
    }
    assert!(frames[0] > 400 && frames[0] == frames[1], "{frames:?}");
}

#[test]
fn a_measurement_without_frames_is_refused() {
    let mut bytes = std::fs::read(fixture("mixed_plain.mf4")).unwrap();
    // no channel is called like a frame any more
    for at in 0..bytes.len() - 4 {
        if &bytes[at..at + 4] == b"CAN_" {
            bytes[at] = b'X';
        }
    }
    let file = TempLog::new("decoded.mf4", &bytes);
    let error = Log::open(&file.path).unwrap_err().to_string();
    assert!(
        error.contains("expected bus frames (CAN_DataFrame)"),
        "{error}"
    );
}

#[test]
fn requests_to_send_are_no_frames_and_frames_without_identifier_are_lost() {
    let text = "date Mon Jan 1 10:00:00.000 am 2024\nbase dec  timestamps absolute\ninternal events logged\n   \
        0.010000 1  256             Rx   d 1 200\n   0.020000 1  257             TxRq d 1 1\n   \
        0.021000 1  257             Tx   d 1 1\n   0.022000 CANFD 1 TxRq 258 1 0 1 1 9\n   \
        0.023000 1  Statistic: D 10 R 0 XD 0 XR 0 E 0 O 0 B 3.5%\n   0.030000 1  256             Rx   r\n";
    let file = TempLog::new("log.asc", text.as_bytes());
    let (counts, losses) = read(&Log::open(&file.path).unwrap());
    assert_eq!(counts, [3]);
    assert!(losses.is_empty(), "{losses:?}");
    let named = format!(
        "{text}   0.040000 1  EngineData      Rx   d 1 1\n   0.050000 1  256             Rx   d 1 2\n"
    );
    let file = TempLog::new("log.asc", named.as_bytes());
    let (counts, losses) = read(&Log::open(&file.path).unwrap());
    assert_eq!(counts, [4]);
    assert!(
        losses.lines().any(|line| line.contains("EngineData")),
        "{losses:?}"
    );
}

/// As SavvyCAN writes it; its bytes are hexadecimal without a mark.
#[test]
fn a_table_of_frames_is_a_bus() {
    let row = |k: u32| {
        format!(
            "{},0000021A,false,Rx,1,3,00,10,{k:02X},00,00,00,00,00,\n",
            166_064_000 + 10_000 * k
        )
    };
    let rows: String = (0..40).map(row).collect();
    let text =
        format!("Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n{rows}not a frame\n");
    let file = TempLog::new("trace", text.as_bytes());
    let log = Log::open(&file.path).unwrap();
    assert_eq!(log.format().to_string(), "candump");
    assert_eq!(log.topics()[0].name, "can1");
    let mut last = None;
    let losses = log
        .read_can_frames(log.topics()[0].id, &mut |frame| last = Some(frame.clone()))
        .unwrap();
    let last = last.unwrap();
    assert_eq!(last.data(), [0, 0x10, 39]);
    assert_eq!(last.time_ns, 166_454_000_000);
    assert_eq!(losses.ranges.len(), 1, "{losses:?}");
    assert!(
        losses.notes.iter().any(|note| note.contains("CAN frames")),
        "{losses:?}"
    );
}
