//! Supports on the ground and joint positions of a machine while it is weighed.

use super::{MeasuredJoint, SupportId, Supports, WeighedPosture};

impl WeighedPosture {
    /// The supports on the ground.
    #[must_use]
    pub fn stands_on(&self, supports: &Supports) -> Vec<SupportId> {
        if self.supports.is_empty() {
            return match supports.at_rest() {
                some if some.len() >= 3 => some,
                _ => supports.ids().collect(),
            };
        }
        let named = self.supports.iter().flat_map(|name| supports.named(name));
        named.collect()
    }

    /// Joint positions during the weighing, as the encoders of these joints showed them (rad or m): as stated; joints that
    /// are not listed are at zero, or where they always are. `evaluated` is the posture under evaluation.
    #[must_use]
    pub fn positions(&self, joints: &[MeasuredJoint], evaluated: &[f64]) -> Vec<f64> {
        if self.in_evaluated_posture {
            return evaluated.to_vec();
        }
        let of_joint = |joint: &MeasuredJoint| {
            let stated = self.posture.get(&joint.name).copied();
            stated.or(joint.constant).unwrap_or(0.0)
        };
        joints.iter().map(of_joint).collect()
    }
}
