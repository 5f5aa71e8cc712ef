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

/// `[quasi_static]`: greatest rates and accelerations. Each bounds the absolute value, of a vector that of each
/// component.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QuasiStaticSpec {
    /// When rows are static.
    pub mode: QuasiStaticMode,
    /// Greatest age of a sample that stands for a missing one (s).
    pub hold: f64,
    /// Greatest acceleration of the platform (m/s^2).
    pub platform_acceleration: f64,
    /// Greatest angular velocity of the platform (rad/s).
    pub platform_rate: f64,
    /// Greatest angular acceleration of the platform (rad/s^2).
    pub platform_angular_acceleration: f64,
    /// Greatest velocity of a revolute joint for which the URDF states none (rad/s).
    pub joint_rate: f64,
    /// The same for a prismatic joint (m/s).
    pub joint_rate_linear: f64,
    /// Greatest acceleration of a revolute joint (rad/s^2).
    pub joint_acceleration: f64,
    /// The same for a prismatic joint (m/s^2).
    pub joint_acceleration_linear: f64,
    /// Greatest change of a force on the tool between samples (N). Without it, a measured tool wrench is unknown
    /// between samples.
    pub tool_force: Option<f64>,
    /// The same for a moment on the tool (N m).
    pub tool_moment: Option<f64>,
    /// Single joints, by name.
    pub joints: BTreeMap<String, JointMotionSpec>,
}

/// `[quasi_static.joints.NAME]`: a joint that differs from the others.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointMotionSpec {
    /// Greatest velocity (rad/s or m/s).
    pub rate: Option<f64>,
    /// Greatest acceleration (rad/s^2 or m/s^2).
    pub acceleration: Option<f64>,
}

impl Default for QuasiStaticSpec {
    fn default() -> Self {
        Self {
            mode: QuasiStaticMode::Auto,
            hold: 10.0,
            platform_acceleration: 1.0,
            platform_rate: 0.2,
            platform_angular_acceleration: 0.5,
            joint_rate: 0.5,
            joint_rate_linear: 0.5,
            joint_acceleration: 0.5,
            joint_acceleration_linear: 0.5,
            tool_force: None,
            tool_moment: None,
            joints: BTreeMap::new(),
        }
    }
}

impl QuasiStaticSpec {
    /// The numbers that must be positive, by key.
    pub(crate) fn numbers_by_key(&self) -> Vec<(String, f64)> {
        let mut numbers = vec![
            ("hold".to_string(), self.hold),
            ("platform_acceleration".into(), self.platform_acceleration),
            ("platform_rate".into(), self.platform_rate),
            (
                "platform_angular_acceleration".into(),
                self.platform_angular_acceleration,
            ),
            ("joint_rate".into(), self.joint_rate),
            ("joint_rate_linear".into(), self.joint_rate_linear),
            ("joint_acceleration".into(), self.joint_acceleration),
            (
                "joint_acceleration_linear".into(),
                self.joint_acceleration_linear,
            ),
        ];
        let tool = [
            ("tool_force", self.tool_force),
            ("tool_moment", self.tool_moment),
        ];
        numbers.extend(
            tool.into_iter()
                .filter_map(|(key, n)| Some((key.into(), n?))),
        );
        for (name, joint) in &self.joints {
            let both = [("rate", joint.rate), ("acceleration", joint.acceleration)];
            let stated = both.into_iter().filter_map(|(key, n)| Some((key, n?)));
            numbers.extend(stated.map(|(key, n)| (format!("joints.{name}.{key}"), n)));
        }
        numbers
    }
}
