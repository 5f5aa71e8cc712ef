//! Self-describing messages: JSON and protobuf.

use mcap::WriteOptions;
use proptest::prelude::*;
use prost_reflect::{DescriptorPool, DynamicMessage, Value as ProtoValue, prost::Message as _};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};
use tipwatch_ingest::{
    DecodeError, FieldPath, Fields, Layout, Log, SensorDecoder, SensorKind, SensorSample, Topic,
};

use crate::support::{self, FIRST_NS, Mcap, PERIOD_NS, Style, TempLog, joint_log, joint_samples};

const COUNT: usize = 60;

/// A log of one topic of joint states.
fn log_of(encoding: &str, schema: (&str, &str, &[u8]), messages: &[Vec<u8>]) -> TempLog {
    let mut writer = Mcap::new(WriteOptions::new().compression(None));
    let channel = writer.topic_of("/joint_states", encoding, schema);
    for (index, message) in messages.iter().enumerate() {
        let stamp_ns = (FIRST_NS + index as i64 * PERIOD_NS) as u64;
        writer.message(channel, index as u32, [stamp_ns + 5, stamp_ns + 3], message);
    }
    TempLog::new("log.mcap", &writer.finish())
}

/// The samples of the same messages in CDR, with non-round numbers.
fn expected() -> Vec<SensorSample> {
    let file = TempLog::new("log.mcap", &joint_log(&Style::chunked(None), COUNT));
    joint_samples(&file.path).0
}

fn stamp(index: usize) -> (i64, i64) {
    let stamp_ns = FIRST_NS + index as i64 * PERIOD_NS;
    (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000)
}

#[test]
fn json_joint_states_equal_those_in_cdr() {
    let message = |index: usize| {
        let value = index as f64;
        let (sec, nanosec) = stamp(index);
        serde_json::json!({
            "extra": {"nested": [1, {"x": null}]},
            "header": {"stamp": {"sec": sec, "nsec": nanosec}, "frame_id": "/base"},
            "name": ["a", "bb"],
            "position": [value, -value],
            "velocity": [0.5, value * 0.25],
            "effort": [],
        })
    };
    let messages: Vec<Vec<u8>> = (0..COUNT)
        .map(|index| message(index).to_string().into_bytes())
        .collect();
    let schema = ("sensor_msgs/msg/JointState", "jsonschema", &b"{}"[..]);
    let file = log_of("json", schema, &messages);
    let (samples, losses) = joint_samples(&file.path);
    assert!(losses.is_empty());
    assert_eq!(samples, expected());
}

#[test]
fn json_numbers_are_read_exactly_in_every_notation() {
    let paths: Vec<FieldPath> = ["a", "b[]", "c[1]", "d[].x", "e.f"]
        .map(|path| path.parse().unwrap())
        .to_vec();
    let topic = json_topic();
    let layout = Layout::of_topic(&topic, &paths).unwrap();
    let mut fields = Fields::new();
    let json = br#"{"a": 0.1e-7, "b": [1, "NaN", null, "-Infinity", true, 3.141592653589793],
        "c": [4, 5], "d": [{"x": 1}, {"y": 3}, {"x": "12345"}], "e": [], "z": {"a": 7}}"#;
    layout.decode(json, &mut fields).unwrap();
    assert_eq!(fields.number(0), 0.1e-7);
    let b = fields.numbers(1);
    assert!(b[1].is_nan() && b[2].is_nan() && b[3] == f64::NEG_INFINITY);
    assert_eq!(
        (b.len(), b[0], b[4], b[5]),
        (6, 1.0, 1.0, std::f64::consts::PI)
    );
    assert_eq!(fields.number(2), 5.0);
    // an element without the number keeps its place
    let d = fields.numbers(3);
    assert!(d[1].is_nan());
    assert_eq!((d.len(), d[0], d[2]), (3, 1.0, 12345.0));
    assert!(fields.number(4).is_nan());
    layout.decode(b"{}", &mut fields).unwrap();
    assert!(fields.number(0).is_nan() && fields.numbers(1).is_empty());
    for wrong in ["", "[1]", "{\"a\": ", "{\"a\": 1} x", "nul"] {
        let error = layout.decode(wrong.as_bytes(), &mut fields).unwrap_err();
        assert!(
            matches!(error, DecodeError::Json { .. }),
            "{wrong}: {error}"
        );
    }
}

#[test]
fn json_numbers_are_found_in_lists_of_lists() {
    let paths = [
        "m[1][2]",
        "m[0][0]",
        "m[2][0]",
        "deep[0][1][0]",
        "mixed[0]",
        "mixed[1][1].x",
        "rows[][1]",
        "m[1][0]",
    ];
    let paths: Vec<FieldPath> = paths.map(|path| path.parse().unwrap()).to_vec();
    let layout = Layout::of_topic(&json_topic(), &paths).unwrap();
    let mut fields = Fields::new();
    let json = br#"{"m": [[1, 2, 3], [4, "5", 6.5]], "deep": [[[0], [-7, 8]]],
        "mixed": [9, [0, {"x": 10}]], "rows": [[1, 2], [3], [4, 5, 6]], "": [1]}"#;
    layout.decode(json, &mut fields).unwrap();
    let of = |fields: &Fields, at: usize| fields.number(at);
    assert_eq!(of(&fields, 0), 6.5);
    assert_eq!(of(&fields, 1), 1.0);
    assert!(of(&fields, 2).is_nan());
    assert_eq!(of(&fields, 3), -7.0);
    assert_eq!((of(&fields, 4), of(&fields, 5)), (9.0, 10.0));
    let rows = fields.numbers(6);
    assert!(rows[1].is_nan());
    assert_eq!((rows.len(), rows[0], rows[2]), (3, 2.0, 5.0));
    assert_eq!(of(&fields, 7), 4.0);
    // a list that a message lacks is no number, and costs no other one
    let json = br#"{"m": [null, [1, 2, 3]], "deep": [5], "mixed": [9, 1]}"#;
    layout.decode(json, &mut fields).unwrap();
    assert_eq!((of(&fields, 0), of(&fields, 4)), (3.0, 9.0));
    assert!([1, 3, 5].iter().all(|&at| of(&fields, at).is_nan()));
}

fn json_topic() -> Topic {
    let file = log_of("json", ("own/Type", "jsonschema", b"{}"), &[b"{}".to_vec()]);
    Log::open(&file.path).unwrap().topics()[0].clone()
}

fn field(name: &str, number: i32, kind: Type, label: Label, part: &str) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(label as i32),
        r#type: Some(kind as i32),
        type_name: (!part.is_empty()).then(|| part.to_owned()),
        ..Default::default()
    }
}

fn message(name: &str, fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto {
        name: Some(name.to_owned()),
        field: fields,
        ..Default::default()
    }
}

/// `sensor_msgs.JointState`, whose stamp is nested in its header, and a type with every kind of
/// number.
fn descriptors() -> FileDescriptorSet {
    const ONE: Label = Label::Optional;
    const MANY: Label = Label::Repeated;
    let stamp = message(
        "Stamp",
        vec![
            field("seconds", 1, Type::Int64, ONE, ""),
            field("nanos", 2, Type::Int32, ONE, ""),
        ],
    );
    let mut header = message(
        "Header",
        vec![
            field("stamp", 3, Type::Message, ONE, ".sensor_msgs.Header.Stamp"),
            field("frame_id", 1, Type::String, ONE, ""),
        ],
    );
    header.nested_type.push(stamp);
    let joint_state = message(
        "JointState",
        vec![
            field("header", 1, Type::Message, ONE, ".sensor_msgs.Header"),
            field("name", 2, Type::String, MANY, ""),
            field("position", 3, Type::Double, MANY, ""),
            field("velocity", 4, Type::Double, MANY, ""),
            field("effort", 5, Type::Double, MANY, ""),
            field("unwanted", 1000, Type::Bytes, ONE, ""),
        ],
    );
    let kinds = NUMBERS
        .iter()
        .enumerate()
        .flat_map(|(index, kind)| {
            let number = index as i32 + 1;
            [
                field(&format!("one{index}"), number, *kind, ONE, ""),
                field(&format!("many{index}"), number + 50, *kind, MANY, ""),
            ]
        })
        .chain([
            field("parts", 200, Type::Message, MANY, ".sensor_msgs.Numbers"),
            field("name", 201, Type::String, ONE, ""),
        ])
        .collect();
    let file = FileDescriptorProto {
        name: Some("joint_state.proto".to_owned()),
        package: Some("sensor_msgs".to_owned()),
        syntax: Some("proto3".to_owned()),
        message_type: vec![joint_state, header, message("Numbers", kinds)],
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }
}

const NUMBERS: [Type; 13] = [
    Type::Double,
    Type::Float,
    Type::Int64,
    Type::Uint64,
    Type::Int32,
    Type::Fixed64,
    Type::Fixed32,
    Type::Bool,
    Type::Uint32,
    Type::Sfixed32,
    Type::Sfixed64,
    Type::Sint32,
    Type::Sint64,
];

#[test]
fn protobuf_joint_states_equal_those_in_cdr() {
    let set = descriptors().encode_to_vec();
    let pool = DescriptorPool::decode(&*set).unwrap();
    let new = |name: &str| DynamicMessage::new(pool.get_message_by_name(name).unwrap());
    let list =
        |values: Vec<f64>| ProtoValue::List(values.into_iter().map(ProtoValue::F64).collect());
    let message = |index: usize| {
        let value = index as f64;
        let (seconds, nanos) = stamp(index);
        let mut stamp = new("sensor_msgs.Header.Stamp");
        stamp.set_field_by_name("seconds", ProtoValue::I64(seconds));
        stamp.set_field_by_name("nanos", ProtoValue::I32(nanos as i32));
        let mut header = new("sensor_msgs.Header");
        header.set_field_by_name("stamp", ProtoValue::Message(stamp));
        header.set_field_by_name("frame_id", ProtoValue::String("/base".to_owned()));
        let mut joints = new("sensor_msgs.JointState");
        joints.set_field_by_name("header", ProtoValue::Message(header));
        let names = ["a", "bb"].map(|name| ProtoValue::String(name.to_owned()));
        joints.set_field_by_name("name", ProtoValue::List(names.to_vec()));
        joints.set_field_by_name("position", list(vec![value, -value]));
        joints.set_field_by_name("velocity", list(vec![0.5, value * 0.25]));
        joints.set_field_by_name("unwanted", ProtoValue::Bytes(vec![7; index].into()));
        joints.encode_to_vec()
    };
    let messages: Vec<Vec<u8>> = (0..COUNT).map(message).collect();
    let schema = ("sensor_msgs.JointState", "protobuf", set.as_slice());
    let file = log_of("protobuf", schema, &messages);
    let (samples, losses) = joint_samples(&file.path);
    assert!(losses.is_empty());
    assert_eq!(samples, expected());

    let topic = Log::open(&file.path).unwrap().topics()[0].clone();
    let error = |path: &str| {
        Layout::of_topic(&topic, &[path.parse().unwrap()])
            .unwrap_err()
            .to_string()
    };
    assert!(error("header.stamp.hours").contains("which has: seconds, nanos"));
    assert!(error("position").contains("found an array of number"));
    let bare = Topic {
        descriptors: None,
        ..topic.clone()
    };
    let paths = ["name[]".parse().unwrap()];
    assert!(Layout::of_topic(&bare, &paths).is_err());
}

#[test]
fn elements_keep_their_place_where_protobuf_writes_no_zero() {
    let set = descriptors().encode_to_vec();
    let pool = DescriptorPool::decode(&*set).unwrap();
    let numbers = || DynamicMessage::new(pool.get_message_by_name("sensor_msgs.Numbers").unwrap());
    let part = |name: &str, value: f64| {
        let mut part = numbers();
        part.set_field_by_name("name", ProtoValue::String(name.to_owned()));
        part.set_field_by_name("one0", ProtoValue::F64(value));
        ProtoValue::Message(part)
    };
    let parts = vec![part("jib", 0.0), part("", 2.0), part("hook", 300.0)];
    let mut message = numbers();
    message.set_field_by_name("parts", ProtoValue::List(parts));
    let bytes = message.encode_to_vec();
    let schema = ("sensor_msgs.Numbers", "protobuf", set.as_slice());
    let file = log_of("protobuf", schema, std::slice::from_ref(&bytes));
    let topic = Log::open(&file.path).unwrap().topics()[0].clone();
    let paths = ["parts[].name", "parts[].one0"].map(|path| path.parse().unwrap());
    let layout = Layout::of_topic(&topic, &paths).unwrap();
    let mut fields = Fields::new();
    layout.decode(&bytes, &mut fields).unwrap();
    let names: Vec<&[u8]> = fields.texts(0).collect();
    assert_eq!(names, [b"jib".as_slice(), b"", b"hook"]);
    assert_eq!(fields.numbers(1), [0.0, 2.0, 300.0]);
}

fn proto_number(kind: Type, seed: i64) -> (ProtoValue, f64) {
    match kind {
        Type::Double => (ProtoValue::F64(seed as f64 * 0.1), seed as f64 * 0.1),
        Type::Float => {
            let value = seed as f32 * 0.1;
            (ProtoValue::F32(value), f64::from(value))
        }
        Type::Int64 | Type::Sfixed64 | Type::Sint64 => (ProtoValue::I64(seed), seed as f64),
        Type::Uint64 | Type::Fixed64 => (ProtoValue::U64(seed as u64), seed as u64 as f64),
        Type::Uint32 | Type::Fixed32 => (ProtoValue::U32(seed as u32), f64::from(seed as u32)),
        Type::Bool => (ProtoValue::Bool(seed & 1 == 1), (seed & 1) as f64),
        _ => (ProtoValue::I32(seed as i32), f64::from(seed as i32)),
    }
}

proptest! {
    #![proptest_config(support::proptest_config(200))]

    #[test]
    fn every_kind_of_protobuf_number_survives(
        seeds in proptest::collection::vec(any::<i64>(), 13),
        parts in 0_usize..4,
    ) {
        let set = descriptors().encode_to_vec();
        let pool = DescriptorPool::decode(&*set).unwrap();
        let descriptor = pool.get_message_by_name("sensor_msgs.Numbers").unwrap();
        let mut message = DynamicMessage::new(descriptor.clone());
        for (index, (kind, seed)) in NUMBERS.iter().zip(&seeds).enumerate() {
            message.set_field_by_name(&format!("one{index}"), proto_number(*kind, *seed).0);
            let many = (0..3).map(|more| proto_number(*kind, seed.wrapping_add(more)).0);
            message.set_field_by_name(&format!("many{index}"), ProtoValue::List(many.collect()));
        }
        let inner = ProtoValue::Message(message.clone());
        message.set_field_by_name("parts", ProtoValue::List(vec![inner; parts]));
        let file = log_of(
            "protobuf",
            ("sensor_msgs.Numbers", "protobuf", &set),
            &[message.encode_to_vec()],
        );
        let topic = Log::open(&file.path).unwrap().topics()[0].clone();
        let mut paths: Vec<FieldPath> = Vec::new();
        for index in 0..13 {
            paths.push(format!("one{index}").parse().unwrap());
            paths.push(format!("many{index}[]").parse().unwrap());
        }
        paths.push("parts[].one4".parse().unwrap());
        let layout = Layout::of_topic(&topic, &paths).unwrap();
        let mut fields = Fields::new();
        layout.decode(&message.encode_to_vec(), &mut fields).unwrap();
        for (index, (kind, seed)) in NUMBERS.iter().zip(&seeds).enumerate() {
            prop_assert_eq!(fields.number(2 * index), proto_number(*kind, *seed).1);
            let many = (0..3).map(|more| proto_number(*kind, seed.wrapping_add(more)).1);
            prop_assert_eq!(fields.numbers(2 * index + 1), many.collect::<Vec<_>>());
        }
        prop_assert_eq!(fields.numbers(26).len(), parts);
    }

    #[test]
    fn numbers_survive_json(values in proptest::collection::vec(any::<f64>(), 0..20)) {
        let finite: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        let json = serde_json::json!({"v": finite}).to_string();
        let layout = Layout::of_topic(&json_topic(), &["v[]".parse().unwrap()]).unwrap();
        let mut fields = Fields::new();
        layout.decode(json.as_bytes(), &mut fields).unwrap();
        prop_assert_eq!(fields.numbers(0), finite);
    }

    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..300),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut set = descriptors().encode_to_vec();
        for (place, byte) in bytes.iter().take(3).enumerate() {
            let at = cut.index(set.len()) + place;
            if let Some(target) = set.get_mut(at) {
                *target = *byte;
            }
        }
        let schema = ("sensor_msgs.JointState", "protobuf", set.as_slice());
        let file = log_of("protobuf", schema, &[bytes]);
        let log = Log::open(&file.path).unwrap();
        let topic = &log.topics()[0];
        let _ = tipwatch_ingest::joint_names_in(&log, topic.id);
        let Ok(mut decoder) = SensorDecoder::new(topic, SensorKind::JointStates, &[]) else {
            return Ok(());
        };
        let mut sample = SensorSample::default();
        log.read(&[topic.id], &mut |message| {
            let _ = decoder.decode(message, &mut sample);
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();
    }
}
