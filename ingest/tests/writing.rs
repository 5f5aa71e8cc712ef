use std::ops::ControlFlow;

use proptest::prelude::*;
use serde::Serialize;
use tempfile::tempdir;
use tipwatch_ingest::{
    FieldPath, Fields, Layout, Log, Ros2Writer, SensorDecoder, SensorKind, SensorSample, WriteError,
};

#[derive(Serialize)]
struct Stamp(i32, u32);

#[derive(Serialize)]
struct Header(Stamp, String);

#[derive(Serialize)]
struct JointState(Header, Vec<String>, Vec<f64>, Vec<f64>, Vec<f64>);

fn joint_state(index: i32) -> JointState {
    let names = ["lift", "tilt"].map(String::from).to_vec();
    let value = f64::from(index);
    let header = Header(Stamp(index, 5), "base".into());
    JointState(header, names, vec![value, -value], vec![0.5, value], vec![])
}

#[test]
fn builtin_message_survives_a_round_trip() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("new.mcap");
    let mut writer = Ros2Writer::create(&path).unwrap();
    let topic = writer.topic("/joints", "sensor_msgs/msg/JointState", None);
    let topic = topic.unwrap();
    for index in 0..300 {
        let time_ns = i64::from(index) * 1_000_000;
        writer.write(topic, time_ns, &joint_state(index)).unwrap();
    }
    writer.attach("a.txt", "text/plain", 7, b"hello").unwrap();
    writer.finish().unwrap();

    let log = Log::open(&path).unwrap();
    assert!(log.losses().is_empty() && log.losses().integrity.note().is_none());
    let topic = &log.topics()[0];
    let joints = ["tilt".to_string()];
    let mut decoder = SensorDecoder::new(topic, SensorKind::JointStates, &joints).unwrap();
    let mut sample = SensorSample::default();
    let mut count = 0;
    log.read(&[topic.id], &mut |message| {
        decoder.decode(message, &mut sample).unwrap();
        assert_eq!(sample.header_stamp_ns, Some(count * 1_000_000_000 + 5));
        assert_eq!(sample.log_time_ns, count * 1_000_000);
        count += 1;
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(count, 300);
}

#[test]
fn existing_file_and_unknown_type_are_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("new.mcap");
    std::fs::write(&path, "evidence").unwrap();
    let refused = Ros2Writer::create(&path).unwrap_err();
    assert!(matches!(refused, WriteError::Create { .. }), "{refused}");
    assert_eq!(std::fs::read(&path).unwrap(), b"evidence");
    let mut writer = Ros2Writer::create(&folder.path().join("b.mcap")).unwrap();
    let refused = writer.topic("/x", "own_msgs/msg/X", None).unwrap_err();
    assert!(refused.to_string().contains("own_msgs/msg/X"), "{refused}");
}

proptest! {
    /// The reader was developed against the standard and files of other programs, not against this
    /// writer.
    #[test]
    fn any_numbers_and_texts_come_back(
        text in ".{0,9}", numbers in prop::collection::vec(any::<f64>(), 0..5), byte: u8, last: f64,
    ) {
        let folder = tempdir().unwrap();
        let path = folder.path().join("new.mcap");
        let mut writer = Ros2Writer::create(&path).unwrap();
        let definition = "string text\nuint8 byte\nfloat64[] numbers\nfloat64 last\n";
        let topic = writer.topic("/x", "own_msgs/msg/X", Some(definition)).unwrap();
        writer.write(topic, 1, &(&text, byte, &numbers, last)).unwrap();
        writer.finish().unwrap();
        let log = Log::open(&path).unwrap();
        let paths: Vec<FieldPath> = ["byte", "last", "numbers[]", "text"]
            .iter()
            .map(|path| path.parse().unwrap())
            .collect();
        let layout = Layout::compile(definition, "own_msgs/msg/X", &paths).unwrap();
        let mut fields = Fields::new();
        let mut seen = 0;
        log.read(&[log.topics()[0].id], &mut |message| {
            layout.decode(message.data, &mut fields).unwrap();
            seen += 1;
            ControlFlow::Continue(())
        })
        .unwrap();
        prop_assert_eq!(seen, 1);
        prop_assert_eq!(fields.number(0), f64::from(byte));
        prop_assert_eq!(fields.number(1).to_bits(), last.to_bits());
        let same = fields.numbers(2).iter().zip(&numbers).all(|(a, b)| a.to_bits() == b.to_bits());
        prop_assert!(same && fields.numbers(2).len() == numbers.len());
        prop_assert_eq!(fields.text(3), text.as_bytes());
    }
}
