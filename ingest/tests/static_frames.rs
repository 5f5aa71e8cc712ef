use mcap::WriteOptions;
use tipwatch_ingest::{Log, static_frames};

use crate::support::{Cdr, Mcap, TempLog};

/// A log of transforms, one message each: topic, parent, child, x, w.
fn log(transforms: &[(&str, &str, &str, f64, f64)]) -> TempLog {
    let mut writer = Mcap::new(WriteOptions::new());
    for &(topic, parent, child, x, w) in transforms {
        // without a definition, the built-in one is used
        let channel = writer.topic(topic, "tf2_msgs/msg/TFMessage", "");
        let mut cdr = Cdr::new(false);
        cdr.u32(1).header(7, parent).text(child);
        cdr.all(&[x, 2.0, 3.0]).all(&[0.0, 0.0, 0.0, w]);
        writer.message(channel, 0, [1, 1], &cdr.bytes);
    }
    TempLog::new("tf.mcap", &writer.finish())
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
