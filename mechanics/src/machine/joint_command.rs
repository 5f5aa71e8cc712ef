//! Rates that the controller commands to joints.

use super::signals::{FieldSpec, SignalsSpec};

/// The rate that a controller commands to a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCommand {
    /// The joint, by its index in [`Machine::joints`](super::Machine::joints).
    pub joint: usize,
    /// Field of a log that contains the rate (rad/s or m/s).
    pub field: FieldSpec,
}

impl SignalsSpec {
    /// Returns the field of the commanded rate of each joint, with the joint's name, in the order of names.
    pub fn command_fields_mut(&mut self) -> impl Iterator<Item = (&String, &mut FieldSpec)> {
        let joints = self.joints.iter_mut();
        joints.filter_map(|(joint, fields)| Some((joint, fields.command.as_mut()?)))
    }
}
