//! `[quasi_static]` of the machine file: how fast the machine may move between the rows of a sparse log.

use std::collections::BTreeMap;

use serde::Deserialize;

/// When rows without neighbours count as static.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, strum::IntoStaticStr, strum::EnumString,
)]
#[strum(serialize_all = "snake_case")]
#[serde(rename_all = "lowercase")]
pub enum QuasiStaticMode {
    /// In a log whose samples are too far apart for most of its time.
    #[default]
    Auto,
    /// In every log.
    Always,
    /// In no log: rows in gaps are invalid.
    Never,
}

table! {
    /// `[quasi_static]`: greatest rates and accelerations. Each bounds the absolute value, of a vector that of each
    /// component.
    pub struct QuasiStaticSpec {
        /// When rows are static.
        mode: QuasiStaticMode = QuasiStaticMode::Auto;
        /// Greatest age of a sample that stands for a missing one (s).
        hold: f64 = 10.0, positive;
        /// Greatest acceleration of the platform (m/s^2).
        platform_acceleration: f64 = 1.0, positive;
        /// Greatest angular velocity of the platform (rad/s).
        platform_rate: f64 = 0.2, positive;
        /// Greatest angular acceleration of the platform (rad/s^2).
        platform_angular_acceleration: f64 = 0.5, positive;
        /// Greatest velocity of a revolute joint for which the URDF states none (rad/s).
        joint_rate: f64 = 0.5, positive;
        /// The same for a prismatic joint (m/s).
        joint_rate_linear: f64 = 0.5, positive;
        /// Greatest acceleration of a revolute joint (rad/s^2).
        joint_acceleration: f64 = 0.5, positive;
        /// The same for a prismatic joint (m/s^2).
        joint_acceleration_linear: f64 = 0.5, positive;
        /// Greatest change of a force on the tool between samples (N). Without it, a measured tool wrench is unknown
        /// between samples.
        tool_force: Option<f64> = None, positive;
        /// The same for a moment on the tool (N m).
        tool_moment: Option<f64> = None, positive;
        /// Single joints, by name.
        joints: BTreeMap<String, JointMotionSpec> = BTreeMap::new();
    }
}

table! {
    /// `[quasi_static.joints.NAME]`: a joint that differs from the others.
    #[derive(Copy)]
    pub struct JointMotionSpec {
        /// Greatest velocity (rad/s or m/s).
        rate: Option<f64> = None, positive;
        /// Greatest acceleration (rad/s^2 or m/s^2).
        acceleration: Option<f64> = None, positive;
    }
}
