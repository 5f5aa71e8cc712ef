//! Static transforms from the log, as in `/tf_static`.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Constant pose of a frame in its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticTransform {
    /// Parent frame, without a leading slash.
    pub parent: String,
    /// Child frame, without a leading slash.
    pub child: String,
    /// The pose.
    pub parent_from_child: Isometry3<f64>,
}

impl StaticTransform {
    /// Creates a transform from a position (m) and a quaternion x y z w, not necessarily normalised.
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

/// All ancestors of `frame` with the pose of `frame` in each, nearest first. If a frame has several
/// transforms, the last one applies; a cycle ends the chain.
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
