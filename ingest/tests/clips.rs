//! Spans of time cut out of logs: the messages are those of the log, to the byte.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use mcap::{Attachment, WriteOptions, records};
use tipwatch_ingest::{
    ClipReport, ClipRequest, Log, MetadataRecord, metadata_records, write_clips,
};

use crate::{
    bags::bag,
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{FIRST_NS, PERIOD_NS, RecordedMessage, Style, TempLog, joint_log, messages},
};

const SECOND_NS: i64 = 1_000_000_000;

fn request(path: PathBuf, start_ns: i64, end_ns: i64) -> ClipRequest {
    let values = BTreeMap::from([("of".to_owned(), "log".to_owned())]);
    let name = "origin".to_owned();
    ClipRequest {
        path,
        start_ns,
        end_ns,
        origin: MetadataRecord { name, values },
    }
}

/// Cuts one span out of a log.
fn clip(log: &Path, start_ns: i64, end_ns: i64) -> (tempfile::TempDir, PathBuf, ClipReport) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mcap");
    let request = request(path.clone(), start_ns, end_ns);
    let (reports, _) = write_clips(&Log::open(log).unwrap(), &[request]).unwrap();
    (folder, path, reports[0].clone())
}

fn within(messages: &[RecordedMessage], start_ns: i64, end_ns: i64) -> Vec<RecordedMessage> {
    let is_within = |message: &&RecordedMessage| (start_ns..=end_ns).contains(&message.1);
    messages.iter().filter(is_within).cloned().collect()
}

#[test]
fn every_format_gives_the_messages_of_the_span() {
    let recorded = joint_messages(0, 200);
    let can = Path::new(env!("CARGO_MANIFEST_DIR")).join("can/tests/data/mixed.log");
    let mut table = String::from("time_s,angle,speed\n");
    for row in 0..200 {
        let time = 1_700_000_000.0 + f64::from(row) * 0.01;
        table.push_str(&format!("{time},{},{}\n", f64::from(row) * 0.5, -row));
    }
    let logs = [
        TempLog::new(
            "a.mcap",
            &joint_log(&Style::chunked(Some(mcap::Compression::Lz4)), 200),
        ),
        TempLog::new("a.bag", &bag("bz2", true, 200)),
        database(&[JOINTS, ("/own", "own/msg/Type")], &rows(&recorded), false),
        TempLog::new("a.log", &std::fs::read(can).unwrap()),
        TempLog::new("a.csv", table.as_bytes()),
    ];
    for file in logs {
        let all = messages(&file.path);
        let (start_ns, end_ns) = (all[all.len() / 3].1, all[all.len() / 2].1);
        let (_folder, path, report) = clip(&file.path, start_ns, end_ns);
        let wanted = within(&all, start_ns, end_ns);
        assert!(wanted.len() > 10, "{}", file.path.display());
        let found = messages(&path);
        assert!(
            within(&found, start_ns, end_ns) == wanted,
            "{}",
            file.path.display()
        );
        assert_eq!(report.messages, wanted.len() as u64);
        assert_eq!(report.carried, (found.len() - wanted.len()) as u64);
        // topics keep type and definition
        let (log, clip) = (Log::open(&file.path).unwrap(), Log::open(&path).unwrap());
        assert!(clip.losses().is_empty());
        for topic in clip.topics() {
            let of_log = log
                .topics()
                .iter()
                .find(|of_log| of_log.name == topic.name)
                .unwrap();
            assert_eq!(
                (&topic.type_name, &topic.encoding, &topic.definition),
                (&of_log.type_name, &of_log.encoding, &of_log.definition)
            );
        }
    }
}

/// A log of 20 s: a fast topic, latched ones, a slow one and extras. The definition of its latched topics is `says`.
fn log_with_latched(says: &BTreeMap<String, String>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = WriteOptions::new()
        .chunk_size(Some(200))
        .create(&mut bytes)
        .unwrap();
    let schema = writer
        .add_schema("my/msg/Text", "ros2msg", b"string data")
        .unwrap();
    let none = BTreeMap::new();
    let mut channel = |topic: &str, says| writer.add_channel(schema, topic, "cdr", says).unwrap();
    let robot = |name: &str| BTreeMap::from([("callerid".to_owned(), name.to_owned())]);
    let fast = channel("/fast", &none);
    let map = channel("/map", says);
    let robots = [robot("a"), robot("b")];
    let [first_tf, second_tf] = [0, 1].map(|of| channel("/tf_static", &robots[of]));
    let slow = channel("/slow", &none);
    let mut at = |channel_id: u16, second: f64, data: &str| {
        let time = (second * 1e9) as u64;
        let header = records::MessageHeader {
            channel_id,
            sequence: 9,
            log_time: time,
            publish_time: time + 5,
        };
        writer
            .write_to_known_channel(&header, data.as_bytes())
            .unwrap();
    };
    at(first_tf, 0.0, "base to imu");
    at(second_tf, 0.1, "base to arm");
    at(second_tf, 0.2, "base to arm");
    at(map, 0.5, "old map");
    for step in 0..200 {
        let second = f64::from(step) * 0.1;
        at(fast, second, &format!("fast {step}"));
        match step {
            // known before the span
            30 => at(map, second, "new map"),
            // and one within it
            105 => at(first_tf, second, "base to camera"),
            _ => {}
        }
        if step % 70 == 0 {
            at(slow, second, &format!("slow {step}"));
        }
    }
    for (name, data) in [("calibration.yaml", "k: 1"), ("notes.txt", "wet")] {
        let attachment = Attachment {
            log_time: 3,
            create_time: 4,
            name: name.into(),
            media_type: "text/plain".into(),
            data: data.as_bytes().into(),
        };
        writer.attach(&attachment).unwrap();
    }
    let metadata = BTreeMap::from([("serial".to_owned(), "7".to_owned())]);
    let record = records::Metadata {
        name: "vehicle".into(),
        metadata,
    };
    writer.write_metadata(&record).unwrap();
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

#[test]
fn latched_and_slow_topics_attachments_and_metadata_are_kept() {
    let qos = "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n".to_owned();
    let says = BTreeMap::from([("offered_qos_profiles".to_owned(), qos)]);
    let file = TempLog::new("a.mcap", &log_with_latched(&says));
    let (_folder, path, report) = clip(&file.path, 10 * SECOND_NS, 12 * SECOND_NS);
    let found = messages(&path);
    let before: Vec<_> = found
        .iter()
        .filter(|message| message.1 < 10 * SECOND_NS)
        .collect();
    let texts: Vec<_> = before
        .iter()
        .map(|m| String::from_utf8_lossy(&m.4))
        .collect();
    // 9.9 s of the fast topic is not carried over
    assert_eq!(texts, ["new map", "base to imu", "base to arm", "slow 70"]);
    // as recorded: log times are not changed
    let times: Vec<_> = before.iter().map(|m| (m.1, m.2 - m.1, m.3)).collect();
    let tenths = [30, 0, 2, 70].map(|tenth| (tenth * SECOND_NS / 10, 5, 9));
    assert_eq!(times, tenths);
    assert_eq!((report.carried, report.messages), (4, 22));
    // what is latched stands before what is not
    assert_eq!(String::from_utf8_lossy(&found[0].4), "new map");
    assert_eq!(found[3].0, "/fast");

    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut names: Vec<_> = (summary.channels.values())
        .map(|channel| (channel.topic.clone(), channel.metadata.clone()))
        .collect();
    names.sort();
    let robot = |name: &str| BTreeMap::from([("callerid".to_owned(), name.to_owned())]);
    let expected = [
        ("/fast", BTreeMap::new()),
        ("/map", says.clone()),
        ("/slow", BTreeMap::new()),
        ("/tf_static", robot("a")),
        ("/tf_static", robot("b")),
    ];
    assert_eq!(
        names,
        expected.map(|(topic, says)| (topic.to_owned(), says))
    );
    let attached = (summary.attachment_indexes.iter())
        .map(|index| mcap::read::attachment(&bytes, index).unwrap());
    let attached: Vec<_> = attached
        .map(|a| (a.name, a.log_time, a.data.into_owned()))
        .collect();
    assert_eq!(
        attached[0],
        ("calibration.yaml".to_owned(), 3, b"k: 1".to_vec())
    );
    assert_eq!(attached.len(), 2);
    let records = metadata_records(&Log::open(&path).unwrap()).unwrap();
    let records: Vec<_> = records.iter().map(|record| record.name.as_str()).collect();
    assert_eq!(records, ["vehicle", "origin"]);
}

/// Without a word about its writer, a topic is not latched: only its slow messages are kept.
#[test]
fn topic_that_is_not_latched_is_slow_or_left() {
    let file = TempLog::new("a.mcap", &log_with_latched(&BTreeMap::new()));
    let (_folder, path, _) = clip(&file.path, 10 * SECOND_NS, 12 * SECOND_NS);
    let found = messages(&path);
    let maps: Vec<_> = found.iter().filter(|message| message.0 == "/map").collect();
    assert_eq!(maps.len(), 1);
    assert_eq!(maps[0].1, 3 * SECOND_NS);
    // it has no message within the span, and stands at the end
    assert!(found[0].0 == "/tf_static" && found.last().unwrap().1 < 10 * SECOND_NS);
}

/// Databases keep the quality of service in the table of topics.
#[test]
fn latched_topic_of_a_database_is_known_by_its_quality_of_service() {
    for (qos, carried) in [("", 0), ("- durability: transient_local\n", 1)] {
        let recorded = joint_messages(0, 200);
        let file = database(&[JOINTS], &rows(&recorded), false);
        let connection = rusqlite::Connection::open(&file.path).unwrap();
        let update = "UPDATE topics SET offered_qos_profiles = ?1";
        assert_eq!(connection.execute(update, [qos]).unwrap(), 1);
        drop(connection);
        let all = messages(&file.path);
        let (_folder, path, report) = clip(&file.path, all[100].1, all[120].1);
        assert_eq!((report.carried, report.messages), (carried, 21));
        if carried == 1 {
            assert_eq!(messages(&path)[0], all[99]);
        }
        let clip = Log::open(&path).unwrap();
        let offered = clip.topics()[0].writers[0]
            .says
            .get("offered_qos_profiles")
            .map(String::as_str);
        assert_eq!(offered.unwrap_or(""), qos);
    }
}

/// More clips than are written in one pass, in a damaged log without index.
#[test]
fn damaged_log_gives_the_intact_messages_of_many_spans() {
    let mut bytes = joint_log(&Style::chunked(Some(mcap::Compression::Zstd)), 400);
    let third = bytes.len() / 3;
    bytes[third..third + 500].fill(0);
    bytes.truncate(third * 2);
    let file = TempLog::new("a.mcap", &bytes);
    let all = messages(&file.path);
    let folder = tempfile::tempdir().unwrap();
    let spans: Vec<_> = (0..40)
        .map(|k| FIRST_NS + k * 10 * PERIOD_NS)
        .map(|start_ns| (start_ns, start_ns + 9 * PERIOD_NS))
        .collect();
    let path = |k: usize| folder.path().join(format!("{k}.mcap"));
    let requests = spans.iter().enumerate();
    let requests: Vec<_> = requests
        .map(|(k, &(start, end))| request(path(k), start, end))
        .collect();
    let (reports, losses) = write_clips(&Log::open(&file.path).unwrap(), &requests).unwrap();
    assert!(!losses.is_empty());
    let mut sum = 0;
    for (k, &(start_ns, end_ns)) in spans.iter().enumerate() {
        let wanted = within(&all, start_ns, end_ns);
        assert!(
            within(&messages(&path(k)), start_ns, end_ns) == wanted,
            "{k}"
        );
        assert_eq!(reports[k].messages, wanted.len() as u64);
        sum += wanted.len();
    }
    assert!(sum > 100 && sum <= all.len(), "{sum}");
}

#[test]
fn existing_file_is_never_overwritten_and_nothing_is_left_behind() {
    let file = TempLog::new("a.mcap", &joint_log(&Style::chunked(None), 50));
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("1.mcap"), folder.path().join("2.mcap"));
    std::fs::write(&second, "mine").unwrap();
    let span = (FIRST_NS, FIRST_NS + 10 * PERIOD_NS);
    let requests = [&first, &second].map(|path| request(path.clone(), span.0, span.1));
    let error = write_clips(&Log::open(&file.path).unwrap(), &requests).unwrap_err();
    assert!(
        error.to_string().contains("2.mcap: cannot be created"),
        "{error}"
    );
    assert_eq!(std::fs::read(&second).unwrap(), b"mine");
    assert!(!first.exists());
}
