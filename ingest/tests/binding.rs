use tipwatch_ingest::{Log, SensorKind, Topic, bind, bind_joint_states};

const IMU: &str = "sensor_msgs/msg/Imu";

fn topics(named: &[(&str, &str)], messages: &[(usize, i64, &[u8])]) -> Vec<Topic> {
    let file = crate::rosbag2::database(named, messages, false);
    Log::open(&file.path).unwrap().topics().to_vec()
}

#[test]
fn only_topic_with_messages_is_bound() {
    let topics = topics(
        &[
            ("/imu/a", IMU),
            ("/imu/b", IMU),
            ("/s", "std_msgs/msg/String"),
        ],
        &[(1, 1, b"")],
    );
    let binding = bind(&topics, SensorKind::Imu, None).unwrap().unwrap();
    assert_eq!(binding.topic.index(), 1);
    assert_eq!(binding.why, "the only sensor_msgs/msg/Imu topic");
    assert_eq!(bind(&topics, SensorKind::Odometry, None), Ok(None));
    let binding = bind(&topics, SensorKind::Imu, Some("/imu/a"));
    let binding = binding.unwrap().unwrap();
    assert_eq!(
        (binding.topic.index(), binding.why.as_str()),
        (0, "named by the machine file")
    );
}

#[test]
fn missing_wrong_and_ambiguous_topics_are_explained() {
    let topics = topics(
        &[
            ("/imu/a", IMU),
            ("/imu/b", "sensor_msgs/Imu"),
            ("/s", "std_msgs/msg/String"),
        ],
        &[(0, 1, b""), (1, 1, b""), (1, 2, b"")],
    );
    let error = bind(&topics, SensorKind::Imu, None)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("several candidates for one signal"),
        "{error}"
    );
    assert!(
        error.contains("/imu/b (sensor_msgs/Imu, 2 messages)"),
        "{error}"
    );
    assert!(
        error.ends_with("under [signals]: imu = \"/imu/a\""),
        "{error}"
    );
    let error = bind(&topics, SensorKind::Imu, Some("/imu"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("/s (std_msgs/msg/String)"), "{error}");
    let error = bind(&topics, SensorKind::Imu, Some("/s"))
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "topic /s: expected messages of type sensor_msgs/msg/Imu, found std_msgs/msg/String"
    );
}

#[test]
fn joints_may_come_on_several_topics() {
    const JOINTS: &str = "sensor_msgs/msg/JointState";
    let topics = topics(
        &[("/arm", JOINTS), ("/wheels", JOINTS)],
        &[(0, 1, b""), (1, 1, b"")],
    );
    let all = bind_joint_states(&topics, &[]).unwrap();
    assert_eq!(all.len(), 2);
    assert_eq!(all[0].why, "one of 2 sensor_msgs/msg/JointState topics");
    let one = bind_joint_states(&topics, &["/wheels".to_owned()]).unwrap();
    assert_eq!((one.len(), one[0].topic.index()), (1, 1));
    assert!(bind_joint_states(&topics, &["/legs".to_owned()]).is_err());
}
