//! `[prediction]` of the machine file: how far ahead loads are predicted, and by which motions.

use std::collections::BTreeMap;

use serde::Deserialize;

/// Most instants of a prediction: more would not be refined by the signals, only cost time in every cycle of a monitor.
pub(crate) const MOST_POINTS: usize = 32;

/// `[prediction]`: the assumed motions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PredictionSpec {
    /// How far ahead (s).
    pub horizon: f64,
    /// Number of instants between now and the horizon at which the loads are computed.
    pub points: usize,
    /// How old a prediction by which no wheel may lift can become while the level is Safe (s).
    pub period: f64,
    /// Deceleration of the platform when it brakes now (m/s^2).
    pub brake_deceleration: f64,
    /// Deceleration of a revolute joint when the arm stops now (rad/s^2).
    pub joint_deceleration: f64,
    /// The same for a prismatic joint (m/s^2).
    pub joint_deceleration_linear: f64,
    /// Shortest time in which anything that moves can be stopped (s).
    pub stop_time: f64,
    /// Time constant with which the acceleration of a joint dies away if the motion goes on (s).
    pub joint_decay: f64,
    /// The same for the acceleration of the platform along the ground (s).
    pub platform_decay: f64,
    /// Single joints, by name.
    pub joints: BTreeMap<String, JointStopSpec>,
}

/// `[prediction.joints.NAME]`: a joint that differs from the others.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JointStopSpec {
    /// Deceleration when the arm stops now (rad/s^2 or m/s^2).
    pub deceleration: Option<f64>,
}

impl Default for PredictionSpec {
    fn default() -> Self {
        Self {
            horizon: 2.0,
            points: 6,
            period: 0.02,
            brake_deceleration: 3.0,
            joint_deceleration: 2.0,
            joint_deceleration_linear: 2.0,
            stop_time: 0.2,
            joint_decay: 0.3,
            platform_decay: 1.0,
            joints: BTreeMap::new(),
        }
    }
}

impl PredictionSpec {
    /// The numbers that must be positive, by key.
    pub(super) fn numbers_by_key(&self) -> Vec<(String, f64)> {
        let keys = [
            ("horizon", self.horizon),
            ("period", self.period),
            ("brake_deceleration", self.brake_deceleration),
            ("joint_deceleration", self.joint_deceleration),
            ("joint_deceleration_linear", self.joint_deceleration_linear),
            ("stop_time", self.stop_time),
            ("joint_decay", self.joint_decay),
            ("platform_decay", self.platform_decay),
        ];
        let mut numbers: Vec<_> = keys.map(|(key, number)| (key.to_string(), number)).into();
        for (name, joint) in &self.joints {
            let stated = joint.deceleration.into_iter();
            numbers.extend(stated.map(|number| (format!("joints.{name}.deceleration"), number)));
        }
        numbers
    }
}
