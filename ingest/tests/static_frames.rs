use std::{collections::BTreeMap, io::Cursor};

use mcap::{WriteOptions, records::MessageHeader};
use tipwatch_ingest::{Log, static_frames};

use crate::support::{Cdr, TempLog};

/// A log of transforms, one message each: topic, parent, child, x, w.
fn log(transforms: &[(&str, &str, &str, f64, f64)]) -> TempLog {
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    // without a definition, the built-in one is used
    let schema = writer
        .add_schema("tf2_msgs/msg/TFMessage", "ros2msg", b"")
        .unwrap();
    for &(topic, parent, child, x, w) in transforms {
        let channel = writer
            .add_channel(schema, topic, "cdr", &BTreeMap::new())
            .unwrap();
        let mut cdr = Cdr::new(false);
        cdr.u32(1).header(7, parent).text(child);
        cdr.all(&[x, 2.0, 3.0]).all(&[0.0, 0.0, 0.0, w]);
        let header = MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: 1,
            publish_time: 1,
        };
        writer.write_to_known_channel(&header, &cdr.bytes).unwrap();
    }
    writer.finish().unwrap();
    TempLog::new("tf.mcap", &writer.into_inner().into_inner())
}

#[test]
fn leading_slashes_of_frames_are_removed() {
    let file = log(&[
        ("/tf_static", "/base_link", "/imu", 1.0, 1.0),
        ("/robot/tf_static", "imu", "chip", 0.5, 1.0),
    ]);
    let frames = static_frames(&Log::open(&file.path).unwrap()).unwrap();
    let names: Vec<_> = (frames.iter())
        .map(|f| (f.parent.as_str(), f.child.as_str()))
        .collect();
    assert_eq!(names, [("base_link", "imu"), ("imu", "chip")]);
    assert_eq!(frames[0].translation_m, [1.0, 2.0, 3.0]);
    assert_eq!(frames[1].rotation_xyzw, [0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn moving_frames_and_invalid_poses_are_omitted() {
    let file = log(&[
        ("/tf", "base_link", "imu", 1.0, 1.0),
        ("/tf_static", "base_link", "imu", f64::NAN, 1.0),
        ("/tf_static", "base_link", "imu", 1.0, 0.0),
    ]);
    assert_eq!(static_frames(&Log::open(&file.path).unwrap()).unwrap(), []);
}
