use mcap::WriteOptions;
use tipwatch_ingest::{
    FieldRequest, Log, NumberField, SampleSpec, SensorKind, SensorRequest, ValueSource,
    record_fields, record_sensors, topic_contents,
};

use crate::sensor_blocks::blocks_and_columns;
use crate::support::{Cdr, Mcap, TempLog, imu_of_two_parts};

/// Named axes in an array of messages, without a header.
const AXES: &str = "Axis[] axes\nCell[2] cells\n===\nMSG: pkg/Axis\nstring name\nfloat64 angle\n\
    ===\nMSG: pkg/Cell\nfloat64 load\n";

fn message(angles: &[(&str, f64)], cells: [f64; 2]) -> Vec<u8> {
    let mut cdr = Cdr::new(false);
    cdr.u32(angles.len() as u32);
    for (name, angle) in angles {
        cdr.text(name).f64(*angle);
    }
    cdr.all(&cells);
    cdr.bytes
}

fn log(encoding: &str, schema: (&str, &str), messages: &[Vec<u8>]) -> TempLog {
    let mut writer = Mcap::new(WriteOptions::new());
    let schema = ("pkg/msg/Axes", schema.0, schema.1.as_bytes());
    let channel = writer.topic_of("/axes", encoding, schema);
    for (i, message) in messages.iter().enumerate() {
        let time = 1_000_000_000 + i as u64 * 10_000_000;
        writer.message(channel, i as u32, [time, time], message);
    }
    TempLog::new("axes.mcap", &writer.finish())
}

fn binary() -> TempLog {
    let messages = [
        message(&[("slew", 1.0), ("boom", 2.0)], [10.0, 20.0]),
        message(&[("boom", 3.0)], [11.0, 21.0]),
        message(&[("slew", 4.0)], [12.0, 22.0]),
    ];
    log("cdr", ("ros2msg", AXES), &messages)
}

fn number(field: &str, joint: Option<&str>) -> NumberField {
    NumberField {
        field: field.into(),
        joint: joint.map(str::to_owned),
        scale: 10.0,
        offset: -1.0,
    }
}

fn values(file: &TempLog, field: &str, joint: Option<&str>) -> Result<(Vec<f64>, u64), String> {
    let request = FieldRequest {
        topic: "/axes".into(),
        number: number(field, joint),
    };
    let log = Log::open(&file.path).unwrap();
    let (mut recordings, _) = record_fields(&log, &[request], None).map_err(|e| e.to_string())?;
    let recording = recordings.remove(0);
    assert_eq!(recording.stamps_ns.len(), recording.values.len());
    Ok((recording.values, recording.reading.without_value))
}

#[test]
fn numbers_are_found_in_arrays_by_name_and_index() {
    let file = binary();
    assert_eq!(
        values(&file, "axes[].angle", Some("boom")),
        Ok((vec![19.0, 29.0], 1))
    );
    assert_eq!(
        values(&file, "axes[].angle", Some("slew")),
        Ok((vec![9.0, 39.0], 1))
    );
    assert_eq!(
        values(&file, "cells[1].load", None),
        Ok((vec![199.0, 209.0, 219.0], 0))
    );
    assert_eq!(values(&file, "axes[1].angle", None), Ok((vec![19.0], 2)));
}

#[test]
fn missing_numbers_are_reported_with_those_present() {
    let file = binary();
    let says = |field: &str, joint: Option<&str>| values(&file, field, joint).unwrap_err();
    for (said, parts) in [
        (
            says("axes[].angle", Some("tilt")),
            ["/axes", "axes[].angle", "\"tilt\"", "slew"],
        ),
        (
            says("axes[].speed", Some("boom")),
            ["/axes", "axes[].speed", "pkg/Axis", "name, angle"],
        ),
        (
            says("cells[7].load", None),
            ["/axes", "cells[7].load", "none", "3 messages"],
        ),
        (
            says("cells[].load", None),
            ["/axes", "one number", "cells[].load", "joint"],
        ),
        (
            says("cells[x].load", None),
            ["/axes", "one number", "cells[x].load", ""],
        ),
    ] {
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
}

#[test]
fn self_describing_messages_are_read() {
    let messages = [
        br#"{"header": {"stamp": {"sec": 3, "nanosec": 5}}, "name": ["a", "b"], "angle": [1, 2.5]}"#.to_vec(),
        br#"{"header": {"stamp": {"sec": 4, "nanosec": 5}}, "name": ["b"], "angle": [3]}"#.to_vec(),
    ];
    let file = log("json", ("jsonschema", "{}"), &messages);
    assert_eq!(values(&file, "angle", Some("b")), Ok((vec![24.0, 29.0], 0)));
    let said = values(&file, "angel", Some("b")).unwrap_err();
    assert!(
        said.contains("angel") && said.contains("2 messages"),
        "{said}"
    );
}

#[test]
fn numbers_in_lists_of_lists_are_listed_and_read() {
    let message =
        |i: u32| format!(r#"{{"m": [[], [{i}, 2], [3]], "t": [[null, [{i}]]]}}"#).into_bytes();
    let messages: Vec<Vec<u8>> = (0..3).map(message).collect();
    let file = log("json", ("jsonschema", "{}"), &messages);
    let expected = (vec![-1.0, 9.0, 19.0], 0);
    assert_eq!(values(&file, "m[1][0]", None).unwrap(), expected);
    assert_eq!(values(&file, "t[0][1][0]", None).unwrap(), expected);
    let log = Log::open(&file.path).unwrap();
    let (contents, _) = topic_contents(&log).unwrap();
    let fields: Vec<&str> = contents[0]
        .fields
        .iter()
        .map(|field| field.field.as_str())
        .collect();
    assert_eq!(fields, ["m[1][0]", "m[1][1]", "m[2][0]", "t[0][1][0]"]);
    assert!(values(&binary(), "cells[0][1]", None).is_err());
}

/// Two sensors on one topic, one of which has only some of its values there.
#[test]
fn one_topic_may_serve_several_sensors() {
    let file = binary();
    let log = Log::open(&file.path).unwrap();
    let topic = log.topics()[0].id;
    let field = |path: &str| ValueSource::Field(number(path, None));
    let mut imu = vec![ValueSource::Absent; 6];
    imu[0] = field("cells[0].load");
    imu[1] = ValueSource::Constant(0.5);
    // a quarter turn about z maps x to y
    imu.extend([0.0, 0.0, std::f64::consts::FRAC_PI_2].map(ValueSource::Constant));
    let boom = ValueSource::Field(number("axes[].angle", Some("boom")));
    let request = |kind, values, has_roll_pitch_yaw, joints: &[&str]| SensorRequest {
        topic,
        kind,
        joint_names: joints.iter().map(|&j| j.to_owned()).collect(),
        numbers: Some(SampleSpec {
            values,
            has_roll_pitch_yaw,
        }),
        other_parts: Vec::new(),
        frame_id: None,
    };
    let requests = [
        request(SensorKind::Imu, imu, true, &[]),
        request(
            SensorKind::JointStates,
            vec![boom, ValueSource::Absent],
            false,
            &["boom"],
        ),
    ];
    let (_, losses) = record_sensors(&log, &requests, &mut |_| {}).unwrap();
    assert!(losses.is_empty());
    let (_, recordings) = blocks_and_columns(&log, &requests);
    let [imu, joints] = &recordings[..] else {
        panic!()
    };
    assert_eq!(imu.stamps_ns.len(), 3);
    let sample = imu.sample(2);
    assert_eq!(sample[..2], [119.0, 0.5]);
    assert!(sample[2..6].iter().all(|v| v.is_nan()));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (found, expected) in sample[6..].iter().zip([0.0, 0.0, half, half]) {
        assert!((found - expected).abs() < 1e-15, "{sample:?}");
    }
    assert_eq!(joints.stamps_ns.len(), 2);
    assert_eq!(joints.reading.without_value, 1);
    assert_eq!(joints.sample(1)[0], 29.0);
    assert_eq!(joints.stamps_ns, [imu.stamps_ns[0], imu.stamps_ns[1]]);
}

/// Accelerations at 10, 20, ... ms; angular velocities, which grow with time, 4 ms later and with a
/// gap.
#[test]
fn parts_of_a_sample_may_come_on_separate_topics() {
    const MS: i64 = 1_000_000;
    let mut writer = Mcap::new(WriteOptions::new());
    let mut times: Vec<(&str, i64)> = (1..=100).map(|i| ("/acceleration", 10 * i)).collect();
    let of_rates = (1..=95).filter(|i| !(30..=60).contains(i));
    times.extend(of_rates.map(|i| ("/rates", 10 * i + 4)));
    times.sort_by_key(|(_, ms)| *ms);
    for (topic, ms) in times {
        let channel = writer.topic_of(topic, "json", ("pkg/Part", "jsonschema", b"{}"));
        let time = 1_000_000_000 + (ms * MS) as u64;
        let message = format!("{{\"x\": {ms}, \"y\": 0, \"z\": 1}}");
        writer.message(channel, 0, [time, time], message.as_bytes());
    }
    let file = TempLog::new("parts.mcap", &writer.finish());
    let log = Log::open(&file.path).unwrap();
    let request = imu_of_two_parts(&log);
    let (_, recordings) = blocks_and_columns(&log, &[request]);
    let [joined] = &recordings[..] else { panic!() };
    // the first and the last five lack a neighbour, and the gap is too long to interpolate
    let stamps: Vec<i64> = joined
        .stamps_ns
        .iter()
        .map(|ns| (ns - 1_000_000_000) / MS)
        .collect();
    let expected = (1..=100).filter(|i| (2..=29).contains(i) || (62..=95).contains(i));
    assert_eq!(stamps, expected.map(|i| 10 * i).collect::<Vec<i64>>());
    for (i, &ms) in stamps.iter().enumerate() {
        let sample = joined.sample(i);
        assert_eq!(sample[..3], [ms as f64, 0.0, 1.0]);
        assert!(
            (sample[3] - ms as f64).abs() < 1e-9 && sample[5] == 1.0,
            "{sample:?}"
        );
        assert!(sample[6..].iter().all(|v| v.is_nan()));
        // available once the next angular velocity has arrived
        assert_eq!(joined.log_times_ns[i], joined.stamps_ns[i] + 4 * MS);
    }
}
