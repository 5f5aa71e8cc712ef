//! Publishers that share a topic, and contents that a log records twice.

use mcap::WriteOptions;
use tipwatch_ingest::{
    Log, NamedTopics, SampleStream, SensorKind, SensorRequest, SensorTopics, record_sensors,
    robot_descriptions,
};

use crate::sensor_blocks::blocks_and_columns;
use crate::support::{Cdr, FIRST_NS, Mcap, TempLog, joint_state};

const MS: i64 = 1_000_000;

/// The arm at 50 Hz, the wheels at 25 Hz, a gripper at 100 Hz, all on one topic. Positions are the times in
/// milliseconds, and more for each joint.
fn shared() -> TempLog {
    let mut messages = Vec::new();
    for tick in 0..400_i64 {
        let at_ms = 10 * tick;
        let mut add = |later_ms: i64, names: &[&str]| {
            let ms = at_ms + later_ms;
            let positions: Vec<f64> = (0..names.len())
                .map(|k| ms as f64 + 0.1 * k as f64)
                .collect();
            let stamp_ns = FIRST_NS + ms * MS;
            let data = joint_state(stamp_ns, names, &positions, &[]);
            messages.push((0, stamp_ns + 2 * MS, data));
        };
        add(0, &["gripper"]);
        if tick % 2 == 0 {
            add(3, &["boom", "stick"]);
        }
        if tick % 4 == 0 {
            add(5, &["left", "right", "boom_copy"]);
        }
    }
    log_of(
        &[("/joint_states", "sensor_msgs/msg/JointState")],
        &messages,
    )
}

fn log_of(topics: &[(&str, &str)], messages: &[(usize, i64, Vec<u8>)]) -> TempLog {
    let messages: Vec<(usize, i64, &[u8])> = (messages.iter())
        .map(|(topic, log_ns, data)| (*topic, *log_ns, data.as_slice()))
        .collect();
    crate::rosbag2::database(topics, &messages, false)
}

/// A request for each group of joints.
fn requests(log: &Log) -> Vec<SensorRequest> {
    let found = SensorTopics::find(log, &NamedTopics::default()).unwrap();
    let request = |topic: &tipwatch_ingest::JointTopic| {
        SensorRequest::typed(
            topic.binding.topic,
            SensorKind::JointStates,
            topic.joint_names.clone(),
        )
    };
    found.joint_states.iter().map(request).collect()
}

#[test]
fn joints_of_several_publishers_have_times_of_their_own() {
    let file = shared();
    let log = Log::open(&file.path).unwrap();
    let found = SensorTopics::find(&log, &NamedTopics::default()).unwrap();
    let groups: Vec<Vec<String>> = (found.joint_states.iter())
        .map(|topic| topic.joint_names.clone())
        .collect();
    // those with most messages first
    assert_eq!(
        groups,
        [
            vec!["gripper"],
            vec!["boom", "stick"],
            vec!["left", "right", "boom_copy"]
        ]
    );
    let counts: Vec<u64> = (found.joint_states.iter())
        .filter_map(|topic| topic.message_count)
        .collect();
    assert_eq!(counts.len(), 3);
    assert!(
        counts[0].abs_diff(400) <= 4 && counts[2].abs_diff(100) <= 4,
        "{counts:?}"
    );
    let (_, recordings) = blocks_and_columns(&log, &requests(&log));
    for (recording, (count, first_ms, step_ms)) in
        recordings
            .iter()
            .zip([(400, 0, 10), (200, 3, 20), (100, 5, 40)])
    {
        assert_eq!(recording.stamps_ns.len(), count);
        let found = &recording.reading;
        assert_eq!((found.without_value, found.undecodable), (0, 0));
        for (k, stamp) in (0_i64..).zip(&recording.stamps_ns) {
            let ms = first_ms + k * step_ms;
            assert_eq!(*stamp, FIRST_NS + ms * MS);
            assert_eq!(recording.sample(k as usize)[0], ms as f64);
        }
        assert!(found.findings.is_empty(), "{:?}", found.findings);
    }
}

#[test]
fn a_stream_gives_the_samples_of_a_log_of_a_shared_topic() {
    let file = shared();
    let log = Log::open(&file.path).unwrap();
    let requests = requests(&log);
    let (recordings, _) = record_sensors(&log, &requests, &mut |_| {}).unwrap();
    let mut stream = SampleStream::new(&log, &requests).unwrap();
    let mut stamps: Vec<Vec<i64>> = vec![Vec::new(); requests.len()];
    log.read(&[requests[0].topic], &mut |message| {
        let refusals = stream.take(message, &mut |request, stamp_ns, _| {
            stamps[request].push(stamp_ns);
        });
        assert_eq!(refusals, tipwatch_ingest::StreamRefusals::default());
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    for (found, recording) in stamps.iter().zip(&recordings) {
        assert_eq!(*found, recording.stamps_ns);
    }
}

#[test]
fn joints_named_twice_and_without_a_position_are_told() {
    let message = |k: i64| {
        let positions = [1.0, f64::NAN, 2.0, 3.0, 3.0];
        let names = ["boom", "stick", "boom", "left", "left"];
        let stamp_ns = FIRST_NS + k * 10 * MS;
        (0, stamp_ns, joint_state(stamp_ns, &names, &positions, &[]))
    };
    let messages: Vec<_> = (0..10).map(message).collect();
    let file = log_of(
        &[("/joint_states", "sensor_msgs/msg/JointState")],
        &messages,
    );
    let log = Log::open(&file.path).unwrap();
    let found = SensorTopics::find(&log, &NamedTopics::default()).unwrap();
    let [topic] = found.joint_states.as_slice() else {
        panic!("{found:?}");
    };
    assert_eq!(topic.joint_names, ["boom", "stick", "left"]);
    assert_eq!(topic.without_position, ["stick"]);
    // the same position twice is no contradiction
    assert_eq!(topic.twice.len(), 1);
    assert_eq!(topic.twice[0].joint, "boom");
    assert_eq!(topic.twice[0].positions, [("1".into(), 0), ("2".into(), 2)]);
}

#[test]
fn different_robot_descriptions_are_found_with_the_last_one_last() {
    let string = |text: &str| {
        let length = (text.len() + 1) as u32;
        [
            &[0, 1, 0, 0][..],
            &length.to_le_bytes(),
            text.as_bytes(),
            &[0],
        ]
        .concat()
    };
    let messages = [
        (0, 1_000, string("placeholder")),
        (0, 2_000, string("machine")),
        (1, 3_000, string("of another robot")),
        (0, 4_000, string("machine")),
    ];
    let topics = [
        ("/robot_description", "std_msgs/msg/String"),
        ("/other/robot_description", "std_msgs/msg/String"),
    ];
    let file = log_of(&topics, &messages);
    let log = Log::open(&file.path).unwrap();
    let found = robot_descriptions(&log).unwrap();
    let texts: Vec<(&str, i64)> = (found.iter())
        .map(|it| (it.text.as_str(), it.log_time_ns))
        .collect();
    assert_eq!(texts, [("placeholder", 1_000), ("machine", 4_000)]);
    assert!(log.topics().iter().all(tipwatch_ingest::Topic::is_latched));
}

const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";

/// The force of each message is 1 N by the one sensor and 2 N by the other; the sensors come in no steady turn.
fn wrenches(frames: [&str; 2]) -> Vec<(usize, i64, Vec<u8>)> {
    let message = |k: i64| {
        let of = usize::from(k % 7 < 3);
        let stamp_ns = FIRST_NS + k * MS;
        let mut cdr = Cdr::new(false);
        cdr.header(stamp_ns, frames[of])
            .all(&[1.0 + of as f64, 0.0, 0.0, 0.0, 0.0, 0.0]);
        (0, stamp_ns, cdr.bytes)
    };
    (1..50_000).map(message).collect()
}

/// A log in small chunks, which several threads decode.
fn chunked_log(type_name: &str, messages: &[(usize, i64, Vec<u8>)]) -> TempLog {
    let options = WriteOptions::new().compression(None).chunk_size(Some(3000));
    let mut writer = Mcap::new(options);
    let channel = writer.topic("/t", type_name, "");
    for (_, time_ns, data) in messages {
        writer.message(channel, 0, [*time_ns as u64; 2], data);
    }
    TempLog::new("t.mcap", &writer.finish())
}

#[test]
fn sensors_that_share_a_topic_are_never_mixed() {
    for frames in [["left", "right"], ["left", ""], ["left", "left_too"]] {
        let file = chunked_log(WRENCH, &wrenches(frames));
        let log = Log::open(&file.path).unwrap();
        let found = |frame: Option<&str>| {
            let named = NamedTopics {
                has_tool: true,
                frames: (frame.iter())
                    .map(|frame| ("/t".into(), (*frame).into()))
                    .collect(),
                ..NamedTopics::default()
            };
            SensorTopics::find(&log, &named)
        };
        for unsettled in [None, Some("middle")] {
            let problem = found(unsettled).unwrap_err().to_string();
            for frame in frames {
                assert!(problem.contains(&format!("{frame:?}")), "{problem}");
            }
            assert!(problem.contains("frames = { \"/t\" = "), "{problem}");
        }
        for (frame_id, of) in [(Some(frames[0]), 0), (Some(frames[1]), 1), (None, 1)] {
            let topic = found(Some(frames[of])).unwrap().tool_wrench.unwrap();
            assert_eq!(topic.frame_id.as_deref(), Some(frames[of]));
            let request = SensorRequest {
                topic: topic.topic,
                kind: SensorKind::ToolWrench,
                joint_names: Vec::new(),
                numbers: None,
                other_parts: Vec::new(),
                frame_id: frame_id.map(str::to_owned),
            };
            let (recordings, losses) = record_sensors(&log, &[request], &mut |_| {}).unwrap();
            let samples = (0..recordings[0].stamps_ns.len()).map(|at| recordings[0].sample(at)[0]);
            let count = (1..50_000).filter(|k| usize::from(k % 7 < 3) == of).count();
            assert_eq!(samples.len(), count);
            assert!(samples.into_iter().all(|force| force == 1.0 + of as f64));
            assert!(losses.undecodable_messages.is_empty(), "{losses:?}");
            let told = format!("{} messages of /t are of other sensors", 49_999 - count);
            assert!(
                losses.notes.iter().any(|note| note.contains(&told)),
                "{losses:?}"
            );
        }
    }
}
