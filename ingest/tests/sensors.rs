use tipwatch_ingest::{
    DefinitionSource, RawMessage, SensorDecoder, SensorKind, SensorSample, Topic,
};

use crate::support::{Cdr, Style, TempLog, joint_log, joint_state};

/// A topic of a built-in type, in a log without definitions.
fn topic(kind: SensorKind) -> Topic {
    let folder = crate::rosbag2::database(&[("/t", kind.type_name())], &[], false);
    tipwatch_ingest::Log::open(&folder.path).unwrap().topics()[0].clone()
}

fn decode(decoder: &mut SensorDecoder, data: &[u8]) -> SensorSample {
    let mut sample = SensorSample::default();
    let topic = topic(decoder.kind()).id;
    let message = RawMessage {
        topic,
        log_time_ns: 2,
        publish_time_ns: 1,
        sequence: 0,
        writer: 0,
        data,
    };
    decoder.decode(&message, &mut sample).unwrap();
    sample
}

fn same(left: &[f64], right: &[f64]) -> bool {
    left.len() == right.len()
        && left
            .iter()
            .zip(right)
            .all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

#[test]
fn joints_are_matched_by_name_in_any_order() {
    const NAN: f64 = f64::NAN;
    let joints = ["boom", "slew"].map(str::to_owned);
    let topic = topic(SensorKind::JointStates);
    let mut decoder = SensorDecoder::new(&topic, SensorKind::JointStates, &joints).unwrap();
    let mut values = |names: &[&str], positions: &[f64], rates: &[f64]| {
        decode(&mut decoder, &joint_state(5, names, positions, rates)).values
    };
    let first = values(&["slew", "boom"], &[1.0, 2.0], &[0.1, 0.2]);
    assert!(same(&first, &[2.0, 1.0, 0.2, 0.1]), "{first:?}");
    let again = values(&["slew", "boom"], &[3.0, 4.0], &[]);
    assert!(same(&again, &[4.0, 3.0, NAN, NAN]), "{again:?}");
    let other_order = values(&["boom", "grip", "slew"], &[5.0, 0.0, 6.0], &[0.5, 0.0]);
    assert!(same(&other_order, &[5.0, 6.0, 0.5, NAN]), "{other_order:?}");
    let one_missing = values(&["slew"], &[7.0], &[0.7]);
    assert!(same(&one_missing, &[NAN, 7.0, NAN, 0.7]), "{one_missing:?}");
    let none = values(&[], &[], &[]);
    assert!(same(&none, &[NAN; 4]), "{none:?}");
    assert_eq!(decoder.frame_id(), Some("base"));
}

#[test]
fn damaged_name_list_does_not_affect_the_next_message() {
    let joints = ["a".to_owned()];
    let topic = topic(SensorKind::JointStates);
    let mut decoder = SensorDecoder::new(&topic, SensorKind::JointStates, &joints).unwrap();
    let good = joint_state(5, &["z", "a"], &[1.0, 2.0], &[]);
    assert_eq!(decode(&mut decoder, &good).values[0], 2.0);
    let mut cut = joint_state(5, &["a", "z"], &[1.0, 2.0], &[]);
    cut.truncate(35);
    let message = RawMessage {
        topic: topic.id,
        log_time_ns: 0,
        publish_time_ns: 0,
        sequence: 0,
        writer: 0,
        data: &cut,
    };
    assert!(
        decoder
            .decode(&message, &mut SensorSample::default())
            .is_err()
    );
    assert_eq!(decode(&mut decoder, &good).values[0], 2.0);
}

#[test]
fn imu_odometry_and_wrench_values_come_in_order() {
    let quaternion = [0.0, 0.0, 0.6, 0.8];
    let topic_imu = topic(SensorKind::Imu);
    let bytes = |[of_attitude, of_turning, of_force]: [f64; 3], quaternion: &[f64]| {
        let mut cdr = Cdr::new(true);
        cdr.header(1_500_000_000, "imu").all(quaternion);
        cdr.f64(of_attitude).all(&[0.0; 8]).all(&[4.0, 5.0, 6.0]);
        cdr.f64(of_turning).all(&[0.0; 8]).all(&[1.0, 2.0, 3.0]);
        cdr.f64(of_force).all(&[0.0; 8]);
        cdr.bytes
    };
    let imu = |covariance: f64, quaternion: &[f64]| {
        let mut decoder = SensorDecoder::new(&topic_imu, SensorKind::Imu, &[]).unwrap();
        decode(&mut decoder, &bytes([covariance, 0.0, 0.0], quaternion))
    };
    let sample = imu(0.0, &quaternion);
    assert_eq!(sample.header_stamp_ns, Some(1_500_000_000));
    assert_eq!(
        sample.values,
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.6, 0.8]
    );
    let without = [
        1.0,
        2.0,
        3.0,
        4.0,
        5.0,
        6.0,
        f64::NAN,
        f64::NAN,
        f64::NAN,
        f64::NAN,
    ];
    assert!(same(&imu(-1.0, &quaternion).values, &without));
    assert!(same(&imu(0.0, &[0.0; 4]).values, &without));
    // each quantity has a mark of its own, in the first message and in those that are read like it
    let mut decoder = SensorDecoder::new(&topic_imu, SensorKind::Imu, &[]).unwrap();
    let nan = f64::NAN;
    let [force, turning] = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    for (marks, force, turning) in [
        ([0.0, -1.0, 0.0], force, [nan; 3]),
        ([0.0, 0.0, -1.0], [nan; 3], turning),
        ([0.0, -1.0, -1.0], [nan; 3], [nan; 3]),
        ([0.0, 0.0, 0.0], force, turning),
    ] {
        let found = decode(&mut decoder, &bytes(marks, &quaternion)).values;
        let expected = [&force[..], &turning, &quaternion].concat();
        assert!(same(&found, &expected), "{marks:?}: {found:?}");
    }

    let mut cdr = Cdr::new(false);
    cdr.header(0, "odom")
        .text("base_link")
        .all(&[7.0; 3])
        .all(&quaternion)
        .all(&[0.0; 36]);
    cdr.all(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).all(&[0.0; 36]);
    let mut decoder =
        SensorDecoder::new(&topic(SensorKind::Odometry), SensorKind::Odometry, &[]).unwrap();
    let sample = decode(&mut decoder, &cdr.bytes);
    assert_eq!(sample.header_stamp_ns, None);
    assert_eq!(
        sample.values,
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.6, 0.8]
    );

    let mut cdr = Cdr::new(false);
    cdr.header(3, "/tool").all(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let mut decoder =
        SensorDecoder::new(&topic(SensorKind::ToolWrench), SensorKind::ToolWrench, &[]).unwrap();
    assert_eq!(
        decode(&mut decoder, &cdr.bytes).values,
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    );
    assert_eq!(decoder.frame_id(), Some("tool"));
}

#[test]
fn undecodable_topics_are_refused_when_bound() {
    let file = TempLog::new("log.mcap", &joint_log(&Style::chunked(None), 3));
    let log = tipwatch_ingest::Log::open(&file.path).unwrap();
    let joints = log
        .topic(crate::support::topic_named(&log, "/joint_states"))
        .unwrap();
    let refused = |topic: &Topic, kind| {
        SensorDecoder::new(topic, kind, &[])
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        refused(joints, SensorKind::Imu),
        "topic /joint_states: expected messages of type sensor_msgs/msg/Imu, found \
         sensor_msgs/msg/JointState"
    );
    let flat = Topic {
        encoding: "flatbuffer".to_owned(),
        ..joints.clone()
    };
    assert!(refused(&flat, SensorKind::JointStates).ends_with("unsupported encoding flatbuffer"));
    let other = Topic {
        schema_encoding: "jsonschema".to_owned(),
        ..joints.clone()
    };
    assert!(refused(&other, SensorKind::JointStates).ends_with("unsupported encoding jsonschema"));
    let bare = Topic {
        definition: None,
        definition_source: DefinitionSource::Missing,
        writers: Vec::new(),
        ..joints.clone()
    };
    assert!(refused(&bare, SensorKind::JointStates).contains("has no definition"));
}
