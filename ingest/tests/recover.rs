use std::{borrow::Cow, collections::BTreeMap};

use tipwatch_ingest::{Format, Log, RecoverError, WriteError, recover};

use crate::{
    bags::bag,
    rosbag2::{JOINTS, database, joint_messages, rows},
    support::{Mcap, Style, TempLog, joint_log, joint_samples, messages},
};

#[test]
fn recovered_messages_are_the_same_for_every_format() {
    let recorded = joint_messages(0, 200);
    let logs = [
        TempLog::new(
            "a.mcap",
            &joint_log(&Style::chunked(Some(mcap::Compression::Lz4)), 200),
        ),
        TempLog::new("a.bag", &bag("bz2", true, 200)),
        database(&[JOINTS, ("/own", "own/msg/Type")], &rows(&recorded), false),
    ];
    for file in logs {
        let log = Log::open(&file.path).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out.mcap");
        let report = recover(&log, &out).unwrap();
        assert_eq!(report.messages["/joint_states"], 200);
        assert!(report.losses.is_empty());
        assert_eq!(report.bytes_written, std::fs::metadata(&out).unwrap().len());
        assert!(messages(&file.path) == messages(&out));
        assert_eq!(joint_samples(&out).0.len(), 200);
        let clean = Log::open(&out).unwrap();
        assert_eq!(clean.format(), Format::Mcap);
        assert_eq!(clean.losses().integrity.note(), None);
        assert!(clean.losses().is_empty() && clean.losses().notes.is_empty());
        for (topic, original) in clean.topics().iter().zip(log.topics()) {
            assert_eq!(topic.type_name, original.type_name);
            assert_eq!(topic.message_count, original.message_count);
        }
        // The `mcap` crate reads it too.
        let bytes = std::fs::read(&out).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        assert_eq!(summary.stats.unwrap().message_count, report.message_count());
    }
}

#[test]
fn intact_part_of_a_damaged_log_is_recovered() {
    let mut bytes = joint_log(&Style::chunked(Some(mcap::Compression::Zstd)), 400);
    let third = bytes.len() / 3;
    bytes[third..third + 500].fill(0);
    bytes.truncate(third * 2);
    let file = TempLog::new("a.mcap", &bytes);
    let before = joint_samples(&file.path).0;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.mcap");
    let report = recover(&Log::open(&file.path).unwrap(), &out).unwrap();
    assert!(report.losses.ranges.len() >= 2, "{:?}", report.losses);
    let (after, losses) = joint_samples(&out);
    assert_eq!(before, after);
    assert!(losses.is_empty() && losses.notes.is_empty(), "{losses:?}");
    assert_eq!(
        std::fs::read(&file.path).unwrap(),
        bytes,
        "the log is never modified"
    );
}

#[test]
fn attachments_and_metadata_are_kept() {
    let mut writer = Mcap::new(mcap::WriteOptions::new());
    let attachment = mcap::Attachment {
        log_time: 1,
        create_time: 2,
        name: "robot.urdf".to_owned(),
        media_type: "text/xml".to_owned(),
        data: Cow::Borrowed(b"<robot/>"),
    };
    writer.0.attach(&attachment).unwrap();
    let metadata = mcap::records::Metadata {
        name: "machine".to_owned(),
        metadata: BTreeMap::from([("serial".to_owned(), "7".to_owned())]),
    };
    writer.0.write_metadata(&metadata).unwrap();
    let file = TempLog::new("a.mcap", &writer.finish());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.mcap");
    let report = recover(&Log::open(&file.path).unwrap(), &out).unwrap();
    assert_eq!(report.extras, 2);
    let bytes = std::fs::read(&out).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.attachment_indexes.len(), 1);
    assert_eq!(summary.metadata_indexes[0].name, "machine");
}

#[test]
fn existing_file_is_not_overwritten() {
    let file = TempLog::new("a.mcap", &joint_log(&Style::chunked(None), 5));
    let log = Log::open(&file.path).unwrap();
    let before = std::fs::read(&file.path).unwrap();
    let error = recover(&log, &file.path).unwrap_err();
    assert!(matches!(
        error,
        RecoverError::Write(WriteError::Create { .. })
    ));
    assert_eq!(std::fs::read(&file.path).unwrap(), before);
}

#[test]
fn channels_and_schemas_come_out_as_they_were() {
    let mut writer = Mcap::new(mcap::WriteOptions::new());
    let says = BTreeMap::from([("offered_qos_profiles".to_owned(), "- depth: 5".to_owned())]);
    // a definition that the recorder did not find, of a built-in type and of another
    let schemas = [
        ("sensor_msgs/msg/Imu", "ros2msg", ""),
        ("own/msg/Type", "ros2msg", ""),
        ("own/msg/Other", "ros2idl", "module own {};"),
        (
            "std_msgs/msg/String",
            "ros2msg",
            "string data  # a remark\n",
        ),
    ];
    for (index, (name, language, text)) in schemas.into_iter().enumerate() {
        let schema = writer.0.add_schema(name, language, text.as_bytes());
        let schema = schema.unwrap();
        for depth in ["- depth: 5", "- depth: 6"] {
            let mut says = says.clone();
            says.insert("offered_qos_profiles".to_owned(), depth.to_owned());
            let topic = format!("/{index}");
            let channel = writer.0.add_channel(schema, &topic, "cdr", &says).unwrap();
            writer.message(channel, 0, [1, 1], &[0, 1, 0, 0]);
        }
    }
    let file = TempLog::new("a.mcap", &writer.finish());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.mcap");
    recover(&Log::open(&file.path).unwrap(), &out).unwrap();
    let described = |path: &std::path::Path| {
        let bytes = std::fs::read(path).unwrap();
        let messages = mcap::MessageStream::new(&bytes).unwrap();
        let found = messages.map(|message| {
            let channel = message.unwrap().channel;
            let schema = channel.schema.clone().unwrap();
            (
                channel.topic.clone(),
                channel.metadata.clone(),
                schema.name.clone(),
                schema.encoding.clone(),
                schema.data.to_vec(),
            )
        });
        found.collect::<Vec<_>>()
    };
    assert_eq!(described(&out), described(&file.path));
    assert_eq!(described(&out).len(), 8);
}
