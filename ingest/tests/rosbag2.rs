use std::path::Path;

use rusqlite::Connection;
use tipwatch_ingest::{
    DefinitionSource, FieldRequest, Format, Log, Losses, LostPart, ReadOptions, record_fields,
    topic_contents,
};

use crate::support::{
    Cdr, FIRST_NS, JOINT_STATE, Mcap, PERIOD_NS, Style, TempLog, joint_log, joint_samples,
    joint_state,
};

pub(crate) const JOINTS: (&str, &str) = ("/joint_states", "sensor_msgs/msg/JointState");

/// A database with these topics and messages (index of the topic, time, data).
pub(crate) fn database(
    topics: &[(&str, &str)],
    messages: &[(usize, i64, &[u8])],
    with_definitions: bool,
) -> TempLog {
    let file = TempLog::new("part %1?_0.db3", b"");
    write_database(&file.path, topics, messages, with_definitions);
    file
}

fn write_database(
    path: &Path,
    topics: &[(&str, &str)],
    messages: &[(usize, i64, &[u8])],
    with_definitions: bool,
) {
    let mut connection = Connection::open(path).unwrap();
    let transaction = connection.transaction().unwrap();
    transaction
        .execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,
             serialization_format TEXT, offered_qos_profiles TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
             data BLOB);",
        )
        .unwrap();
    for (index, (name, type_name)) in topics.iter().enumerate() {
        let row = (index as i64 + 10, name, type_name);
        transaction
            .execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", row)
            .unwrap();
    }
    for (topic, time_ns, data) in messages {
        let row = (*topic as i64 + 10, time_ns, data);
        let insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        transaction.execute(insert, row).unwrap();
    }
    if with_definitions {
        transaction
            .execute_batch(
                "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT,
                 encoding TEXT, encoded_message_definition TEXT, type_description_hash TEXT);",
            )
            .unwrap();
        let insert = "INSERT INTO message_definitions VALUES (1, ?1, 'ros2msg', ?2, '')";
        transaction
            .execute(insert, (JOINTS.1, JOINT_STATE))
            .unwrap();
    }
    transaction.commit().unwrap();
}

pub(crate) fn joint_messages(from: usize, to: usize) -> Vec<(i64, Vec<u8>)> {
    let message = |index: usize| {
        let stamp_ns = FIRST_NS + index as i64 * PERIOD_NS;
        let value = index as f64;
        (
            stamp_ns,
            joint_state(stamp_ns, &["a", "bb"], &[value, -value], &[]),
        )
    };
    (from..to).map(message).collect()
}

pub(crate) fn rows(messages: &[(i64, Vec<u8>)]) -> Vec<(usize, i64, &[u8])> {
    messages
        .iter()
        .map(|(time_ns, data)| (0, *time_ns, data.as_slice()))
        .collect()
}

#[test]
fn databases_are_read_with_and_without_definitions() {
    for with_definitions in [true, false] {
        let messages = joint_messages(0, 300);
        let file = database(
            &[JOINTS, ("/custom", "own/msg/Type")],
            &rows(&messages),
            with_definitions,
        );
        let log = Log::open(&file.path).unwrap();
        assert_eq!(log.format(), Format::Rosbag2Sqlite);
        let source = log.topics()[0].definition_source;
        assert_eq!(source == DefinitionSource::Embedded, with_definitions);
        assert_eq!(log.topics()[0].message_count, Some(300));
        assert_eq!(log.topics()[1].definition_source, DefinitionSource::Missing);
        let (samples, losses) = joint_samples(&file.path);
        assert!(losses.is_empty(), "{losses:?}");
        assert_eq!(samples.len(), 300);
        assert_eq!(samples[299].values[..2], [-299.0, 299.0]);
        let beside = std::fs::read_dir(file.folder()).unwrap().count();
        assert_eq!(beside, 1, "nothing may be created beside a log");
    }
}

#[test]
fn truncated_database_yields_its_beginning() {
    let messages = joint_messages(0, 3000);
    let file = database(&[JOINTS], &rows(&messages), false);
    let bytes = std::fs::read(&file.path).unwrap();
    let mut readable = 0;
    for end in (1000..bytes.len()).step_by(bytes.len() / 40) {
        let cut = TempLog::new("cut.db3", &bytes[..end]);
        let Ok(log) = Log::open(&cut.path) else {
            continue;
        };
        assert_eq!(log.losses().ranges[0].part, LostPart::Tail);
        let (samples, losses) = joint_samples(&cut.path);
        assert!(losses.ranges.len() > 1, "{losses:?}");
        for sample in &samples {
            let index = (sample.header_stamp_ns.unwrap() - FIRST_NS) / PERIOD_NS;
            assert_eq!(
                sample.values[..2],
                [-index as f64, index as f64],
                "cut at {end}"
            );
        }
        readable += samples.len();
    }
    assert!(readable > 1000, "{readable}");
}

/// The end of a file that is cut is not taken for that of messages, and zeros behind it are none of them.
#[test]
fn messages_that_end_with_zeros_are_read_from_a_truncated_database() {
    let data: Vec<Vec<u8>> = (0..400)
        .map(|index| [&[index as u8 | 1; 200][..], &[0; 300]].concat())
        .collect();
    let messages: Vec<(usize, i64, &[u8])> = (data.iter().enumerate())
        .map(|(index, data)| (0, index as i64, data.as_slice()))
        .collect();
    let file = database(&[JOINTS], &messages, false);
    let bytes = std::fs::read(&file.path).unwrap();
    let page = bytes.len() / 4096 * 3 / 4 * 4096;
    for (end, zeros) in [
        (0, 0),
        (700, 0),
        (3000, 0),
        (3000, 100_000),
        (4000, 100_000),
    ] {
        let cut = [&bytes[..page + end], &vec![0; zeros]].concat();
        let file = TempLog::new("cut.db3", &cut);
        let log = Log::open(&file.path).unwrap();
        let mut found = 0;
        let losses = log.read(&[log.topics()[0].id], &mut |message| {
            assert_eq!(
                message.data, data[message.log_time_ns as usize],
                "cut at {end}"
            );
            found += 1;
            std::ops::ControlFlow::Continue(())
        });
        assert!(found > 250, "cut at {end}: {found}");
        assert!(!losses.unwrap().is_empty());
    }
}

/// The last page of a message of zeros is a page of zeros: six of them at the end were taken for a loss of power.
#[test]
fn pages_of_zeros_that_belong_to_messages_are_no_cut() {
    let data: Vec<Vec<u8>> = (1..7_u8)
        .map(|value| [&[value; 100][..], &[0; 4500]].concat())
        .collect();
    let messages: Vec<(usize, i64, &[u8])> = (data.iter().enumerate())
        .map(|(index, data)| (0, index as i64, data.as_slice()))
        .collect();
    let file = database(&[JOINTS], &messages, false);
    assert!(std::fs::read(&file.path).unwrap().ends_with(&[0; 6 * 4096]));
    let log = Log::open(&file.path).unwrap();
    let mut found = 0;
    let losses = log.read(&[log.topics()[0].id], &mut |message| {
        assert_eq!(message.data, data[message.log_time_ns as usize]);
        found += 1;
        std::ops::ControlFlow::Continue(())
    });
    let losses = losses.unwrap();
    assert_eq!((found, losses.ranges.len()), (6, 0), "{losses:?}");
}

#[test]
fn changed_bytes_of_a_database_never_panic() {
    let messages = joint_messages(0, 200);
    let file = database(&[JOINTS], &rows(&messages), true);
    let bytes = std::fs::read(&file.path).unwrap();
    for at in (16..bytes.len()).step_by(131) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x5a;
        let damaged = TempLog::new("x.db3", &changed);
        let Ok(log) = Log::open(&damaged.path) else {
            continue;
        };
        let ids: Vec<_> = log.topics().iter().map(|topic| topic.id).collect();
        log.read(&ids, &mut |_| std::ops::ControlFlow::Continue(()))
            .unwrap();
    }
}

#[test]
fn split_files_of_a_folder_are_one_log() {
    let folder = tempfile::tempdir().unwrap();
    for part in 0..12_usize {
        let messages = joint_messages(part * 10, part * 10 + 10);
        let path = folder.path().join(format!("drive_{part}.db3"));
        write_database(&path, &[JOINTS], &rows(&messages), false);
    }
    let (samples, _) = joint_samples(folder.path());
    let values: Vec<f64> = samples.iter().map(|sample| sample.values[1]).collect();
    assert_eq!(values, (0..120).map(f64::from).collect::<Vec<_>>());

    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - drive_1.db3\n    - drive_0.db3\n    - gone.db3\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let log = Log::open(folder.path()).unwrap();
    assert_eq!(log.topics().len(), 1);
    // those behind are parts, too: a recorder that is killed does not list them
    assert_eq!(log.topics()[0].message_count, Some(120));
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!((samples.len(), samples[0].values[1]), (120, 10.0));
    assert_eq!(losses.ranges[0].part, LostPart::File);
    assert_eq!(losses.notes.len(), 10, "{:?}", losses.notes);

    let compressed =
        "rosbag2_bagfile_information:\n  compression_format: lz4\n  compression_mode: MESSAGE\n";
    std::fs::write(folder.path().join("metadata.yaml"), compressed).unwrap();
    assert!(
        Log::open(folder.path())
            .unwrap_err()
            .to_string()
            .contains("unsupported format")
    );
}

/// A folder of three files of ten messages of which one is missing, and its metadata with the times of each.
fn without_part(missing: usize) -> Losses {
    let folder = tempfile::tempdir().unwrap();
    let mut names = String::new();
    let mut contents = String::new();
    for part in 0..3_usize {
        let messages = joint_messages(part * 10, part * 10 + 10);
        let name = format!("drive_{part}.db3");
        if part != missing {
            write_database(
                &folder.path().join(&name),
                &[JOINTS],
                &rows(&messages),
                false,
            );
        }
        names += &format!("    - {name}\n");
        let first_ns = messages[0].0;
        let duration_ns = messages[9].0 - first_ns;
        contents += &format!(
            "    - path: {name}\n      starting_time:\n        nanoseconds_since_epoch: {first_ns}\n      duration:\n        \
            nanoseconds: {duration_ns}\n      message_count: 10\n"
        );
    }
    let metadata = format!(
        "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n{names}  files:\n{contents}"
    );
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 20);
    losses
}

#[test]
fn a_missing_part_is_lost_with_its_times() {
    for missing in 0..3_usize {
        let losses = without_part(missing);
        let [lost] = losses.ranges.as_slice() else {
            panic!("{losses:?}");
        };
        let time_ns = |index: i64| FIRST_NS + index * PERIOD_NS;
        let first = 10 * missing as i64;
        assert_eq!(lost.first_time_ns, Some(time_ns(first)));
        let is_at_end = missing == 2;
        let last_ns = (!is_at_end).then_some(time_ns(first + 9));
        assert_eq!(lost.last_time_ns, last_ns);
        assert_eq!(lost.message_count, Some(10));
        assert_eq!(losses.end_is_lost(), is_at_end);
    }
}

#[test]
fn damaged_metadata_is_a_loss_and_the_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    for part in 0..2_usize {
        let messages = joint_messages(part * 10, part * 10 + 10);
        let path = folder.path().join(format!("drive_{part}.db3"));
        write_database(&path, &[JOINTS], &rows(&messages), false);
    }
    let damaged = "rosbag2_bagfile_information:\n  relative_file_paths: [drive_1.db3\n";
    std::fs::write(folder.path().join("metadata.yaml"), damaged).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 20);
    let text = losses.ranges[0].to_string();
    assert!(text.contains("metadata.yaml: bytes 0 to"), "{text}");
    assert!(text.contains("not valid metadata"), "{text}");
    assert!(!losses.end_is_lost(), "{text}");
}

#[test]
fn split_mcap_files_share_their_topics() {
    let folder = tempfile::tempdir().unwrap();
    for part in 0..2 {
        let bytes = joint_log(&Style::chunked(None), 100);
        std::fs::write(folder.path().join(format!("log_{part}.mcap")), bytes).unwrap();
    }
    let log = Log::open(folder.path()).unwrap();
    assert_eq!((log.topics().len(), log.files().len()), (2, 2));
    assert_eq!(log.topics()[0].message_count, Some(200));
    assert_eq!(joint_samples(folder.path()).0.len(), 200);
}

#[test]
fn parts_that_were_compressed_afterwards_or_are_missing_are_found_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let part = |number: usize| {
        let bytes = joint_log(&Style::chunked(None), 100);
        let packed = zstd::encode_all(&*bytes, 1).unwrap();
        std::fs::write(folder.path().join(format!("log_{number}.mcap.zst")), packed).unwrap();
    };
    // a recorder that keeps the last parts only has deleted the others
    part(3);
    part(4);
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(
        (samples.len(), losses.is_empty()),
        (200, true),
        "{losses:?}"
    );
    part(8);
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!((samples.len(), losses.ranges.len()), (300, 1), "{losses:?}");
    assert_eq!(losses.ranges[0].part, LostPart::File);
    assert!(
        losses.ranges[0].reason.contains(": 3 after log_4"),
        "{losses:?}"
    );
    assert!(!losses.end_is_lost(), "{losses:?}");
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - log_4.mcap\n    - log_8.mcap\n    - log_3.mcap\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(
        (samples.len(), losses.is_empty()),
        (300, true),
        "{losses:?}"
    );
}

/// A part beside its own packed copy was read twice.
#[test]
fn a_part_and_its_packed_copy_are_one_part() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = joint_log(&Style::chunked(None), 100);
    for number in 0..2 {
        let name = format!("log_{number}.mcap");
        std::fs::write(folder.path().join(&name), &bytes).unwrap();
        let packed = zstd::encode_all(&*bytes, 1).unwrap();
        std::fs::write(folder.path().join(name + ".zst"), packed).unwrap();
    }
    for listed in ["", "log_0.mcap.zst", "log_0.mcap"] {
        let metadata =
            format!("rosbag2_bagfile_information:\n  relative_file_paths:\n    - {listed}\n");
        if !listed.is_empty() {
            std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
        }
        assert_eq!(
            Log::open(folder.path()).unwrap().files().len(),
            2,
            "{listed}"
        );
        assert_eq!(joint_samples(folder.path()).0.len(), 200, "{listed}");
    }
}

/// A part whose beginning is damaged was told as missing, and the gap before a much larger number not at all.
#[test]
fn a_part_that_is_no_log_is_lost_with_its_size() {
    let folder = tempfile::tempdir().unwrap();
    for number in [0, 2, 40] {
        let bytes = joint_log(&Style::chunked(None), 100);
        std::fs::write(folder.path().join(format!("log_{number}.mcap")), bytes).unwrap();
    }
    let damaged = folder.path().join("log_1.mcap");
    std::fs::write(&damaged, [0; 5000]).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 300);
    let [first, second] = losses.ranges.as_slice() else {
        panic!("{losses:?}")
    };
    assert_eq!((&first.file, first.end_byte), (&damaged, 5000));
    assert!(second.file.ends_with("log_40.mcap"), "{second:?}");
    assert!(second.reason.contains(": 37 after log_2"), "{second:?}");
    // the parts have the same times, so that those of each go back
    assert!(second.first_time_ns < second.last_time_ns, "{second:?}");
}

#[test]
fn folder_without_a_single_log_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |folder: &Path| Log::open(folder).unwrap_err().to_string();
    assert!(refused(folder.path()).contains("a folder without any such file"));
    for name in ["one.mcap", "other.mcap"] {
        std::fs::write(
            folder.path().join(name),
            joint_log(&Style::chunked(None), 1),
        )
        .unwrap();
    }
    assert!(refused(folder.path()).contains("several logs (one.mcap, other.mcap)"));
}

#[test]
fn a_description_beside_a_log_is_no_second_log() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = joint_log(&Style::chunked(None), 1);
    std::fs::write(folder.path().join("drive_0.mcap"), bytes).unwrap();
    for description in [
        "{\"machine\":\"x\",\"operator\":\"y\"}",
        "{\"machine\":\"x\",\"created_at\":\"2026-11-14T22:13:20Z\"}\n",
        "{\"machine\":\"x\",\"operator\":\"y\"}\n{\"machine\":\"z\",\"operator\":\"y\"}\n",
    ] {
        std::fs::write(folder.path().join("info.json"), description).unwrap();
        let log = Log::open(folder.path()).unwrap();
        assert_eq!(log.files().len(), 1, "{description}");
    }
}

#[test]
fn compressed_files_are_decompressed_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let mut names = Vec::new();
    for part in 0..3_usize {
        let messages = joint_messages(part * 10, part * 10 + 10);
        let path = folder.path().join(format!("drive_{part}.db3"));
        write_database(&path, &[JOINTS], &rows(&messages), false);
        let packed = zstd::encode_all(&*std::fs::read(&path).unwrap(), 3).unwrap();
        std::fs::write(path.with_extension("db3.zstd"), packed).unwrap();
        std::fs::remove_file(&path).unwrap();
        names.push(format!("    - drive_{part}.db3.zstd\n"));
    }
    assert_eq!(joint_samples(folder.path()).0.len(), 30);
    let metadata = format!(
        "rosbag2_bagfile_information:\n  relative_file_paths:\n{}  compression_format: zstd\n  compression_mode: FILE\n",
        names.concat()
    );
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 30);
    assert!(losses.is_empty(), "{losses:?}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);

    let first = folder.path().join("drive_0.db3.zstd");
    let bytes = std::fs::read(&first).unwrap();
    std::fs::write(&first, &bytes[..bytes.len() / 2]).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 20, "the other files are read");
    assert_eq!(losses.ranges[0].part, LostPart::File);
}

#[test]
fn truncated_compressed_file_yields_its_beginning() {
    let bytes = joint_log(&Style::chunked(None), 3000);
    let packed = zstd::encode_all(&*bytes, 1).unwrap();
    let file = TempLog::new("log.mcap.zstd", &packed[..packed.len() * 2 / 3]);
    let (samples, losses) = joint_samples(&file.path);
    assert!(samples.len() > 1000, "{}", samples.len());
    assert!(losses.ranges[0].reason.contains("decompressed bytes"));
    assert!(losses.ranges.len() > 1, "{losses:?}");
}

#[test]
fn split_files_in_subfolders_are_one_log() {
    let folder = tempfile::tempdir().unwrap();
    for part in 0..11 {
        let below = folder.path().join(format!("part_{part}"));
        std::fs::create_dir(&below).unwrap();
        let bytes = joint_log(&Style::chunked(None), 10);
        std::fs::write(below.join(format!("log_{part}.mcap")), bytes).unwrap();
    }
    let log = Log::open(folder.path()).unwrap();
    assert_eq!(log.files().len(), 11);
    assert!(log.files()[10].ends_with("part_10/log_10.mcap"));
    assert_eq!(joint_samples(folder.path()).0.len(), 110);
}

#[test]
fn recorder_message_counts_reveal_missing_messages() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive_0.db3");
    write_database(&path, &[JOINTS], &rows(&joint_messages(0, 2000)), true);
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - drive_0.db3\n\
        \x20 topics_with_message_count:\n    - topic_metadata:\n        name: /joint_states\n\
        \x20     message_count: 2000\n  version: 5\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!(samples.len(), 2000);
    assert!(losses.is_empty(), "{losses:?}");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2 / 4096 * 4096;
    bytes[middle..middle + 4096].fill(0);
    std::fs::write(&path, bytes).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    let lost = 2000 - samples.len() as u64;
    assert!(lost > 0);
    assert_eq!(losses.missing_messages["/joint_states"], lost);
}

#[test]
fn metadata_of_older_recorders_names_files_with_their_folder() {
    // metadata up to version 3; the second folder was renamed after recording
    for folder_name in ["drive", "renamed"] {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join(folder_name);
        std::fs::create_dir(&folder).unwrap();
        for part in 0..2_usize {
            let messages = joint_messages(part * 10, part * 10 + 10);
            let path = folder.join(format!("drive_{part}.db3"));
            write_database(&path, &[JOINTS], &rows(&messages), false);
        }
        let metadata = "rosbag2_bagfile_information:\n  version: 2\n  relative_file_paths:\n    - drive/drive_0.db3\n    \
            - drive/drive_1.db3\n";
        std::fs::write(folder.join("metadata.yaml"), metadata).unwrap();
        let (samples, losses) = joint_samples(&folder);
        assert_eq!(samples.len(), 20);
        assert!(losses.is_empty() && losses.notes.is_empty(), "{losses:?}");

        // a file that is truly gone is still a loss
        std::fs::remove_file(folder.join("drive_1.db3")).unwrap();
        let (samples, losses) = joint_samples(&folder);
        assert_eq!((samples.len(), losses.ranges.len()), (10, 1), "{losses:?}");
        assert_eq!(losses.ranges[0].part, LostPart::File);
    }
}

#[test]
fn a_file_named_twice_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let messages = joint_messages(0, 10);
    let path = folder.path().join("drive_0.db3");
    write_database(&path, &[JOINTS], &rows(&messages), false);
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - a/drive_0.db3\n    - b/drive_0.db3\n";
    std::fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.path());
    assert_eq!((samples.len(), losses.ranges.len()), (10, 1), "{losses:?}");
}

#[test]
fn messages_that_were_compressed_one_by_one_are_read() {
    let messages = joint_messages(0, 20);
    let packed: Vec<(i64, Vec<u8>)> = messages
        .iter()
        .map(|(time_ns, data)| (*time_ns, zstd::bulk::compress(data, 3).unwrap()))
        .collect();
    let file = database(&[JOINTS], &rows(&packed), true);
    let (samples, losses) = joint_samples(&file.path);
    assert_eq!(samples.len(), 20);
    assert!(losses.is_empty(), "{losses:?}");
    let mut torn = packed;
    torn[7].1.truncate(30);
    let folder = database(&[JOINTS], &rows(&torn), true);
    let metadata = "rosbag2_bagfile_information:\n  compression_format: zstd\n  compression_mode: MESSAGE\n\
        \x20 relative_file_paths:\n    - 'part %1?_0.db3'\n";
    std::fs::write(folder.folder().join("metadata.yaml"), metadata).unwrap();
    let (samples, losses) = joint_samples(folder.folder());
    assert_eq!(samples.len(), 19);
    assert_eq!(losses.undecodable_messages["/joint_states"], 1);
}

#[test]
fn definitions_that_a_log_lacks_are_read_from_packages() {
    let data = [
        &[0, 1, 0, 0][..],
        &2.5_f64.to_le_bytes(),
        &4.0_f64.to_le_bytes(),
    ]
    .concat();
    let file = database(
        &[("/load", "own_msgs/msg/Load")],
        &[(0, FIRST_NS, &data)],
        false,
    );
    let packages = tempfile::tempdir().unwrap();
    let write = |path: &str, text: &str| {
        let path = packages.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("src/group/own_msgs/msg/Load.msg", "Pair pair\n");
    write(
        "src/group/own_msgs/msg/Pair.msg",
        "float64 left # N\nfloat64 right\n",
    );
    let number = |definitions: &[std::path::PathBuf]| {
        let options = ReadOptions {
            definitions: definitions.to_vec(),
            ..ReadOptions::default()
        };
        let log = Log::open_with(&file.path, &options).map_err(|error| error.to_string())?;
        let wanted = [FieldRequest::raw("/load", "pair.right")];
        let columns = record_fields(&log, &wanted, None).map_err(|error| error.to_string())?;
        Ok::<_, String>(columns.0[0].values.clone())
    };
    assert!(number(&[]).unwrap_err().contains("--definitions DIR"));
    assert_eq!(number(&[packages.path().to_owned()]).unwrap(), [4.0]);
    let package = packages.path().join("src/group/own_msgs");
    assert_eq!(number(&[package]).unwrap(), [4.0]);
    write("install/own_msgs/msg/Pair.msg", "float64 right\n");
    assert!(
        number(&[packages.path().to_owned()])
            .unwrap_err()
            .contains("differs from")
    );
    let empty = tempfile::tempdir().unwrap();
    assert!(
        number(&[empty.path().to_owned()])
            .unwrap_err()
            .contains("found none")
    );
}

#[test]
fn numbers_in_lists_of_lists_are_read_by_either_definition() {
    let mut cdr = Cdr::new(false);
    cdr.u32(2)
        .numbers(&[1.0, 2.0])
        .f64(3.0)
        .numbers(&[4.0])
        .f64(5.0)
        .f64(6.0);
    let text =
        "Point[] points\nfloat64 after\n===\nMSG: own/Point\nfloat64[] positions\nfloat64 time\n";
    let idl = "===\nIDL: own/msg/Path\nmodule own { module msg { struct Path {\n\
        sequence<own::msg::Point> points; double after; }; }; };\n===\nIDL: own/msg/Point\n\
        module own { module msg { struct Point { sequence<double> positions; double time; }; }; };\n";
    for (language, definition) in [("ros2msg", text), ("ros2idl", idl)] {
        let mut writer = Mcap::new(mcap::WriteOptions::new());
        let schema = ("own/msg/Path", language, definition.as_bytes());
        let channel = writer.topic_of("/path", "cdr", schema);
        writer.message(channel, 0, [1, 1], &cdr.bytes);
        let file = TempLog::new("log.mcap", &writer.finish());
        let log = Log::open(&file.path).unwrap();
        let (contents, _) = topic_contents(&log).unwrap();
        let found: Vec<(&str, Option<f64>)> = contents[0]
            .fields
            .iter()
            .map(|field| (field.field.as_str(), field.last))
            .collect();
        let expected = [
            ("points[0].positions[0]", 1.0),
            ("points[0].positions[1]", 2.0),
            ("points[0].time", 3.0),
            ("points[1].positions[0]", 4.0),
            ("points[1].time", 5.0),
            ("after", 6.0),
        ];
        assert_eq!(
            found,
            expected.map(|(name, value)| (name, Some(value))),
            "{language}"
        );
    }
}
