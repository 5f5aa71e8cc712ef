//! Logs of real and simulated robots.

use std::path::PathBuf;

use tipwatch_ingest::{
    DefinitionSource, Format, Log, SensorKind, StampSource, TopicStatistics, bind, joint_names_in,
    robot_descriptions,
};

use crate::support::{samples, topic_named};

fn open(name: &str) -> Log {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/logs");
    Log::open(&PathBuf::from(folder).join(name)).unwrap()
}

fn count(log: &Log, kind: SensorKind) -> usize {
    let topic = bind(log.topics(), kind, None).unwrap().unwrap().topic;
    let (samples, losses) = samples(log, topic, kind, &[]);
    assert!(losses.is_empty(), "{losses:?}");
    assert_eq!(
        log.topic(topic).unwrap().message_count,
        Some(samples.len() as u64)
    );
    samples.len()
}

fn timing(log: &Log, kind: SensorKind) -> tipwatch_ingest::TopicTiming {
    let topic = bind(log.topics(), kind, None).unwrap().unwrap().topic;
    let mut statistics = TopicStatistics::default();
    for sample in samples(log, topic, kind, &[]).0 {
        statistics.push(
            sample.header_stamp_ns,
            sample.publish_time_ns,
            sample.log_time_ns,
        );
    }
    statistics.timing()
}

#[test]
#[ignore = "needs ../shared"]
fn simulated_arm_is_read_whole() {
    let log = open("sim/flat_arm.mcap");
    assert_eq!(count(&log, SensorKind::JointStates), 4000);
    assert_eq!(count(&log, SensorKind::Imu), 9999);
    let described = robot_descriptions(&log).unwrap();
    assert!(described[0].text.contains("<robot"));
    assert!(log.losses().is_empty());
}

#[test]
#[ignore = "needs ../shared"]
fn mcap_database_and_bag_of_one_drive_agree() {
    let logs = ["mcap", "db3", "bag"].map(|format| match format {
        "db3" => open("sim/drive_brake_db3"),
        other => open(&format!("sim/drive_brake.{other}")),
    });
    let [mcap, db3, bag] = logs;
    for kind in [
        SensorKind::JointStates,
        SensorKind::Imu,
        SensorKind::Odometry,
    ] {
        let all = [&mcap, &db3, &bag].map(|log| {
            let topic = bind(log.topics(), kind, None).unwrap().unwrap().topic;
            let joints = match kind {
                SensorKind::JointStates => joint_names_in(log, topic).unwrap(),
                _ => Vec::new(),
            };
            let joints: Vec<&str> = joints.iter().map(String::as_str).collect();
            samples(log, topic, kind, &joints).0
        });
        for other in &all[1..] {
            assert_eq!(all[0].len(), other.len());
            for (left, right) in all[0].iter().zip(other) {
                assert_eq!(left.header_stamp_ns, right.header_stamp_ns);
                assert_eq!(left.log_time_ns, right.log_time_ns);
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&left.values), bits(&right.values));
            }
        }
    }
}

#[test]
#[ignore = "needs ../shared"]
fn abitobot_has_two_epochs_and_no_checksums() {
    let log = open("real/abitobot");
    assert_eq!(count(&log, SensorKind::JointStates), 1866);
    assert_eq!(count(&log, SensorKind::Imu), 4712);
    assert!(log.losses().integrity.note().is_some());
    let timing = timing(&log, SensorKind::Imu);
    assert_eq!(timing.clock.source, StampSource::Header);
    assert_eq!(timing.stamps_not_dates, 4712);
}

#[test]
#[ignore = "needs ../shared"]
fn turtlebot3_is_read_by_built_in_definitions() {
    let log = open("real/turtlebot3");
    assert_eq!(count(&log, SensorKind::Imu), 5636);
    assert_eq!(count(&log, SensorKind::JointStates), 826);
    assert_eq!(count(&log, SensorKind::Odometry), 826);
    let joints = topic_named(&log, "/joint_states");
    assert_eq!(
        log.topic(joints).unwrap().definition_source,
        DefinitionSource::BuiltIn
    );
    let names = joint_names_in(&log, joints).unwrap();
    assert_eq!(names, ["wheel_left_joint", "wheel_right_joint"]);
    let described = robot_descriptions(&log).unwrap();
    assert!(described[0].text.contains("<robot"));
}

#[test]
#[ignore = "needs ../shared"]
fn jackal_bag_is_read_whole() {
    let log = open("real/jackal/test2.bag");
    assert_eq!(log.format(), Format::Ros1Bag);
    assert_eq!(count(&log, SensorKind::Imu), 3061);
    assert_eq!(count(&log, SensorKind::Odometry), 3060);
    assert!(log.losses().is_empty());
    assert_eq!(log.losses().integrity.note(), None, "bz2 has checksums");
    let timing = timing(&log, SensorKind::Imu);
    assert_eq!(timing.clock.source, StampSource::Header);
}
