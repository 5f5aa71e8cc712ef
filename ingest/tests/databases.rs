//! Databases of rosbag2 after crashes, and of every schema version.

use std::path::Path;

use rusqlite::Connection;
use tipwatch_ingest::{DefinitionSource, Log};

use crate::{
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{JOINT_STATE, TempLog, joint_samples},
};

/// The files in the folder of a log, with their content.
fn folder_of(path: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(path.parent().unwrap()).unwrap();
    let mut files: Vec<(String, Vec<u8>)> = entries
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read(&path).unwrap())
        })
        .collect();
    files.sort();
    files
}

/// A database as a crashed recorder leaves it: copied while open.
fn copied_while_open(journal_mode: &str, ending: &str) -> TempLog {
    let messages = joint_messages(0, 400);
    let original = database(&[JOINTS], &rows(&messages[..100]), true);
    let mut connection = Connection::open(&original.path).unwrap();
    let setup = format!("PRAGMA journal_mode={journal_mode}; PRAGMA cache_size=4;");
    connection.execute_batch(&setup).unwrap();
    let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (10, ?1, ?2)";
    for message in &messages[100..200] {
        connection.execute(insert, (message.0, &message.1)).unwrap();
    }
    let transaction = connection.transaction().unwrap();
    for message in &messages[200..] {
        transaction
            .execute(insert, (message.0, &message.1))
            .unwrap();
    }
    let bytes = std::fs::read(&original.path).unwrap();
    let journal = std::fs::read(format!("{}{ending}", original.path.display())).unwrap();
    drop(transaction);
    let copy = TempLog::new("crashed_0.db3", &bytes);
    std::fs::write(
        copy.folder().join(format!("crashed_0.db3{ending}")),
        journal,
    )
    .unwrap();
    copy
}

#[test]
fn journal_beside_a_database_is_applied_to_a_copy() {
    for (journal_mode, ending) in [("WAL", "-wal"), ("DELETE", "-journal")] {
        let file = copied_while_open(journal_mode, ending);
        let before = folder_of(&file.path);
        assert_eq!(before.len(), 2);
        let (samples, losses) = joint_samples(&file.path);
        assert_eq!(samples.len(), 200, "{journal_mode}: what was committed");
        assert!(losses.is_empty(), "{losses:?}");
        assert!(
            losses
                .notes
                .iter()
                .any(|note| note.contains("private copy"))
        );
        assert!(folder_of(&file.path) == before, "the evidence is as it was");
    }
}

#[test]
fn a_journal_beside_a_compressed_database_is_applied() {
    for packed_journal in [true, false] {
        let file = copied_while_open("WAL", "-wal");
        let pack = |name: &str| {
            let path = file.folder().join(name);
            let packed = zstd::encode_all(&*std::fs::read(&path).unwrap(), 1).unwrap();
            std::fs::write(file.folder().join(format!("{name}.zst")), packed).unwrap();
            std::fs::remove_file(&path).unwrap();
        };
        pack("crashed_0.db3");
        if packed_journal {
            pack("crashed_0.db3-wal");
        }
        let (samples, losses) = joint_samples(&file.folder().join("crashed_0.db3.zst"));
        assert_eq!(samples.len(), 200, "{losses:?}");
        assert!(losses.is_empty(), "{losses:?}");
    }
    // without one, messages may be missing
    let file = copied_while_open("WAL", "-wal");
    let packed = zstd::encode_all(&*std::fs::read(&file.path).unwrap(), 1).unwrap();
    let alone = TempLog::new("crashed_0.db3.zst", &packed);
    let (_, losses) = joint_samples(&alone.path);
    assert!(
        losses.notes.iter().any(|note| note.contains("-wal")),
        "{losses:?}"
    );
}

#[test]
fn missing_write_ahead_log_is_told() {
    let asks = |path: &Path| {
        let (_, losses) = joint_samples(path);
        losses.notes.iter().any(|note| note.contains("-wal"))
    };
    let file = copied_while_open("WAL", "-wal");
    let journal = file.folder().join("crashed_0.db3-wal");
    std::fs::remove_file(&journal).unwrap();
    assert!(asks(&file.path));
    // the recorder has merged all of it, and left the file empty
    std::fs::write(&journal, b"").unwrap();
    assert!(!asks(&file.path));
    let without = database(&[JOINTS], &rows(&joint_messages(0, 3)), true);
    assert!(!asks(&without.path));
}

#[test]
fn unusable_journal_is_reported() {
    let file = copied_while_open("DELETE", "-journal");
    let journal = file.folder().join("crashed_0.db3-journal");
    std::fs::write(&journal, b"no journal").unwrap();
    let before = folder_of(&file.path);
    // Without its journal the database is torn, but its intact pages are read.
    let (samples, _) = joint_samples(&file.path);
    assert!(samples.len() >= 200);
    assert!(folder_of(&file.path) == before);
}

#[test]
fn torn_pages_lose_only_their_messages() {
    const PAGE: usize = 4096;
    let messages = joint_messages(0, 3000);
    let file = database(&[JOINTS], &rows(&messages), true);
    let bytes = std::fs::read(&file.path).unwrap();
    let pages = bytes.len() / PAGE;
    for torn in (3..pages).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[torn * PAGE..torn * PAGE + PAGE / 2].fill(0);
        let copy = TempLog::new("torn.db3", &damaged);
        let (samples, losses) = joint_samples(&copy.path);
        assert!(samples.len() > 2950, "page {torn}: {}", samples.len());
        for pair in samples.windows(2) {
            assert!(pair[0].log_time_ns < pair[1].log_time_ns);
        }
        let lost = 3000 - samples.len();
        assert!(!losses.is_empty(), "page {torn}");
        if lost > 0 {
            let counts = losses.ranges.iter().filter_map(|range| range.message_count);
            assert_eq!(counts.sum::<u64>(), lost as u64, "page {torn}: {losses:?}");
            let covered = losses
                .ranges
                .iter()
                .any(|range| (range.start_byte..range.end_byte).contains(&((torn * PAGE) as u64)));
            assert!(covered, "page {torn}: {losses:?}");
        }
    }
}

#[test]
fn topics_are_found_without_a_readable_schema() {
    let messages = joint_messages(0, 300);
    let file = database(&[JOINTS], &rows(&messages), false);
    let mut bytes = std::fs::read(&file.path).unwrap();
    // The table of tables begins after the header of the file.
    bytes[100..140].fill(0);
    let damaged = TempLog::new("x.db3", &bytes);
    let (samples, losses) = joint_samples(&damaged.path);
    assert_eq!(samples.len(), 300, "{losses:?}");
    assert!(!losses.is_empty());
}

#[test]
fn large_messages_continue_on_overflow_pages() {
    let mut messages = joint_messages(0, 60);
    let image = vec![7_u8; 50_000];
    for index in (0..60).step_by(3) {
        messages[index].1 = image.clone();
    }
    let file = database(&[JOINTS], &rows(&messages), true);
    let bytes = std::fs::read(&file.path).unwrap();
    let intact = read_data(&file.path);
    assert_eq!(intact.len(), 60);
    for torn in [2, 3] {
        let mut damaged = bytes.clone();
        damaged[torn * 4096..torn * 4096 + 8].fill(0);
        let copy = TempLog::new("x.db3", &damaged);
        if Log::open(&copy.path).is_err() {
            continue;
        }
        let found = read_data(&copy.path);
        assert!(found.len() > 30, "page {torn}: {}", found.len());
        assert!(found.iter().all(|data| intact.contains(data)));
    }
}

fn read_data(path: &Path) -> Vec<Vec<u8>> {
    let log = Log::open(path).unwrap();
    let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
    let mut found = Vec::new();
    log.read(&ids, &mut |message| {
        found.push(message.data.to_vec());
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    found
}

/// The tables as each version of the schema has them.
const VERSIONS: [(u32, &str); 4] = [
    (
        1,
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
         serialization_format TEXT NOT NULL);",
    ),
    (
        2,
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
         serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL DEFAULT '');",
    ),
    (
        3,
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
         INSERT INTO schema VALUES (3, 'humble');
         CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,
         metadata TEXT NOT NULL);
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
         serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL DEFAULT '');",
    ),
    (
        4,
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
         INSERT INTO schema VALUES (4, 'jazzy');
         CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,
         metadata TEXT NOT NULL);
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
         serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL DEFAULT '',
         type_description_hash TEXT NOT NULL DEFAULT '');
         CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL,
         encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL,
         type_description_hash TEXT NOT NULL);",
    ),
];

#[test]
fn every_schema_version_is_read() {
    for (version, tables) in VERSIONS {
        let file = TempLog::new("v.db3", b"");
        let connection = Connection::open(&file.path).unwrap();
        connection.execute_batch(tables).unwrap();
        connection
            .execute_batch(
                "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
                 timestamp INTEGER NOT NULL, data BLOB NOT NULL);
                 CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
            )
            .unwrap();
        let insert = "INSERT INTO topics(id, name, type, serialization_format) \
                      VALUES (1, ?1, ?2, 'cdr')";
        connection.execute(insert, JOINTS).unwrap();
        if version == 4 {
            let insert = "INSERT INTO message_definitions VALUES (1, ?1, 'ros2msg', ?2, '')";
            connection.execute(insert, (JOINTS.1, JOINT_STATE)).unwrap();
        }
        for (time_ns, data) in joint_messages(0, 50) {
            let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?1, ?2)";
            connection.execute(insert, (time_ns, data)).unwrap();
        }
        drop(connection);
        let (samples, losses) = joint_samples(&file.path);
        assert_eq!(samples.len(), 50, "version {version}");
        assert!(losses.is_empty() && losses.notes.is_empty(), "{losses:?}");
        let source = Log::open(&file.path).unwrap().topics()[0].definition_source;
        assert_eq!(source == DefinitionSource::Embedded, version == 4);
    }
}
