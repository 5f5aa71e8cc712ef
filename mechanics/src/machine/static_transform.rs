//! Frames that a log places: static transforms, as `/tf_static` carries them.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Pose of a frame in its parent, constant over a log.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticTransform {
    /// The frame in which the pose is given, without a leading slash.
    pub parent: String,
    /// The frame that is placed, without a leading slash.
    pub child: String,
    /// The pose.
    pub parent_from_child: Isometry3<f64>,
}

impl StaticTransform {
    /// From a position (m) and a quaternion x y z w of any length but zero.
    #[must_use]
    pub fn new(parent: &str, child: &str, xyz: [f64; 3], xyzw: [f64; 4]) -> Self {
        let [x, y, z] = xyz;
        let [i, j, k, w] = xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Self {
            parent: parent.trim_start_matches('/').into(),
            child: child.trim_start_matches('/').into(),
            parent_from_child: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
        }
    }
}

/// Every frame above `frame` with the pose of `frame` in it, nearest first. Where a frame is placed
/// more than once, the last one counts; a loop ends the chain.
pub(super) fn ancestors<'t>(
    transforms: &'t [StaticTransform],
    frame: &'t str,
) -> Vec<(&'t str, Isometry3<f64>)> {
    let mut found: Vec<(&str, Isometry3<f64>)> = Vec::new();
    let (mut current, mut pose) = (frame, Isometry3::identity());
    while found.len() < transforms.len() {
        let Some(step) = transforms.iter().rev().find(|t| t.child == current) else {
            break;
        };
        pose = step.parent_from_child * pose;
        current = &step.parent;
        found.push((current, pose));
    }
    found
}
