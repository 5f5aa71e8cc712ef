//! `[prediction]` of the machine file: horizon of the prediction, and the assumed motions.

use std::collections::BTreeMap;

/// Most instants of a prediction: more would not be refined by the signals, only cost time in every cycle of a monitor.
pub(crate) const MOST_POINTS: usize = 32;

table! {
    /// `[prediction]`: the assumed motions.
    pub struct PredictionSpec {
        /// Horizon: time ahead up to which loads are predicted (s).
        horizon: f64 = 2.0, positive;
        /// Number of instants between now and the horizon at which the loads are computed.
        points: usize = 6;
        /// Largest age of a prediction by which no wheel may lift, while the level is Safe (s).
        period: f64 = 0.02, positive;
        /// Deceleration of the platform when it brakes now (m/s^2).
        brake_deceleration: f64 = 3.0, positive;
        /// Deceleration of a revolute joint when the arm stops now (rad/s^2).
        joint_deceleration: f64 = 2.0, positive;
        /// The same for a prismatic joint (m/s^2).
        joint_deceleration_linear: f64 = 2.0, positive;
        /// Shortest time in which anything that moves can be stopped (s).
        stop_time: f64 = 0.2, positive;
        /// Time constant with which the acceleration of a joint dies away if the motion goes on (s).
        joint_decay: f64 = 0.3, positive;
        /// The same for the acceleration of the platform along the ground (s).
        platform_decay: f64 = 1.0, positive;
        /// Single joints, by name.
        joints: BTreeMap<String, JointStopSpec> = BTreeMap::new();
    }
}

table! {
    /// `[prediction.joints.NAME]`: a joint that differs from the others.
    #[derive(Copy)]
    pub struct JointStopSpec {
        /// Deceleration when the arm stops now (rad/s^2 or m/s^2).
        deceleration: Option<f64> = None, positive;
    }
}
