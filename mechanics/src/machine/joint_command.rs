//! What the controller asks of joints.

use super::signals::{FieldSpec, SignalsSpec};

/// The rate that a controller asks of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCommand {
    /// The joint, by its index in [`Machine::joints`](super::Machine::joints).
    pub joint: usize,
    /// Where a log contains the rate (rad/s or m/s).
    pub field: FieldSpec,
}

impl SignalsSpec {
    /// Where a log contains the rate that is asked of each joint, by its name, in the order of names.
    pub fn command_fields_mut(&mut self) -> impl Iterator<Item = (&String, &mut FieldSpec)> {
        let joints = self.joints.iter_mut();
        joints.filter_map(|(joint, fields)| Some((joint, fields.command.as_mut()?)))
    }
}
