//! Reads the static transforms on `/tf_static`.

use std::ops::ControlFlow;

use crate::{
    decode::{Fields, layout_of},
    log::Log,
    message::{Error, Topic},
    schema::normal_type_name,
};

/// Largest deviation of a quaternion's norm from one.
const QUATERNION_NORM_TOLERANCE: f64 = 0.1;
const TYPES: [&str; 2] = ["tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"];
/// The names of both frames, then seven numbers.
const PATHS: [&str; 9] = [
    "transforms[].header.frame_id",
    "transforms[].child_frame_id",
    "transforms[].transform.translation.x",
    "transforms[].transform.translation.y",
    "transforms[].transform.translation.z",
    "transforms[].transform.rotation.x",
    "transforms[].transform.rotation.y",
    "transforms[].transform.rotation.z",
    "transforms[].transform.rotation.w",
];

/// Pose of a frame in its parent. Frames are without a leading slash.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticFrame {
    /// The frame in which the pose is given.
    pub parent: String,
    /// The frame whose pose is given.
    pub child: String,
    /// Position (m).
    pub translation_m: [f64; 3],
    /// Orientation: quaternion x y z w.
    pub rotation_xyzw: [f64; 4],
}

/// All transforms on topics of that type whose name ends with `tf_static`, in file order. Invalid
/// poses are omitted.
///
/// # Errors
/// The log cannot be read.
pub fn static_frames(log: &Log) -> Result<Vec<StaticFrame>, Error> {
    let mut frames = Vec::new();
    for topic in log.topics().iter().filter(|topic| is_static(topic)) {
        let Ok(layout) = layout_of(topic, &PATHS) else {
            continue;
        };
        let mut fields = Fields::new();
        log.read(&[topic.id], &mut |message| {
            if layout.decode(message.data, &mut fields).is_ok() {
                frames.extend(frames_in(&fields));
            }
            ControlFlow::Continue(())
        })?;
    }
    Ok(frames)
}

fn is_static(topic: &Topic) -> bool {
    let type_name = normal_type_name(&topic.type_name);
    topic.name.ends_with("tf_static") && TYPES.iter().any(|t| normal_type_name(t) == type_name)
}

fn frames_in(fields: &Fields) -> Vec<StaticFrame> {
    let name = |text: &[u8]| {
        String::from_utf8_lossy(text)
            .trim_start_matches('/')
            .to_owned()
    };
    let names = fields
        .texts(0)
        .map(name)
        .zip(fields.texts(1).map(name))
        .enumerate();
    let at = |path: usize, i: usize| fields.numbers(path).get(i).copied().unwrap_or(f64::NAN);
    let frame = |(i, (parent, child))| StaticFrame {
        parent,
        child,
        translation_m: [2, 3, 4].map(|path| at(path, i)),
        rotation_xyzw: [5, 6, 7, 8].map(|path| at(path, i)),
    };
    names.map(frame).filter(StaticFrame::is_pose).collect()
}

impl StaticFrame {
    fn is_pose(&self) -> bool {
        let norm = self.rotation_xyzw.iter().map(|q| q * q).sum::<f64>().sqrt();
        self.translation_m.iter().all(|t| t.is_finite())
            && (norm - 1.0).abs() < QUATERNION_NORM_TOLERANCE
    }
}
