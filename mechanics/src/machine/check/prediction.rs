//! Checks `[prediction]`.

use super::checker::Checker;
use crate::machine::prediction_spec::MOST_POINTS;
use crate::machine::{JointStopSpec, MachineError, MeasuredJoint};

/// Longest horizon (s): beyond it, no motion goes on as it is.
const LONGEST_S: f64 = 10.0;
/// Longest period (s): a fifth of the shortest horizon that is of use.
const LONGEST_PERIOD_S: f64 = 0.1;

impl Checker<'_> {
    /// Checks that all numbers are positive, that the work is bounded and that all joints exist.
    pub(super) fn check_prediction(&self, joints: &[MeasuredJoint]) -> Result<(), MachineError> {
        let spec = &self.spec.prediction;
        self.check_ranges("prediction", &spec.numbers())?;
        if spec.horizon > LONGEST_S {
            let expected = format!("at most {LONGEST_S} s");
            return Err(self.value_error("prediction.horizon", expected, spec.horizon));
        }
        if spec.period > LONGEST_PERIOD_S {
            let expected = format!("at most {LONGEST_PERIOD_S} s");
            return Err(self.value_error("prediction.period", expected, spec.period));
        }
        if !(1..=MOST_POINTS).contains(&spec.points) {
            let expected = format!("1 to {MOST_POINTS} instants");
            return Err(self.value_error("prediction.points", expected, spec.points));
        }
        self.check_joints(
            "prediction.joints",
            &spec.joints,
            joints,
            JointStopSpec::numbers,
        )
    }
}
