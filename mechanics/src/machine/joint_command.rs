//! What the controller asks of joints.

use super::checked::Machine;
use super::signals::{FieldSpec, SignalsSpec};

/// The rate that a controller asks of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCommand {
    /// The joint, by its index in [`Machine::joints`].
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

impl Machine {
    /// What the controller asks of joints, in the order of their names in the machine file. A joint that no message measures has
    /// none.
    #[must_use]
    pub fn joint_commands(&self) -> &[JointCommand] {
        &self.joint_commands
    }

    pub(super) fn find_joint_commands(&self, signals: &SignalsSpec) -> Vec<JointCommand> {
        let joint_of = |name: &str| self.joints.iter().position(|joint| joint.name == name);
        let commands = signals.joints.iter().filter_map(|(name, fields)| {
            Some(JointCommand {
                joint: joint_of(name)?,
                field: fields.command.clone()?,
            })
        });
        commands.collect()
    }
}
