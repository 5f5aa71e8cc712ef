//! Validation of `[signals]`: every field is located, and fields of one quantity belong together.

use super::checker::Checker;
use crate::machine::{
    FieldSpec, JointCommand, JointFields, MachineError, MeasuredJoint, NumberSpec, SignalSpec,
};

impl Checker<'_> {
    pub(super) fn check_signals(&self) -> Result<(), MachineError> {
        let signals = &self.spec.signals;
        for (joint, fields) in &signals.joints {
            self.check_joint(joint, fields)?;
        }
        if let Some(imu) = signals.imu.as_ref().and_then(SignalSpec::fields) {
            let place = "signals.imu";
            self.check_group(&format!("{place}.specific_force"), &imu.specific_force)?;
            let turning = format!("{place}.angular_velocity");
            self.check_each_number(&turning, &imu.angular_velocity)?;
            self.check_attitude(place, &imu.orientation, &imu.roll_pitch_yaw)?;
        }
        if let Some(odometry) = signals.odometry.as_ref().and_then(SignalSpec::fields) {
            let place = "signals.odometry";
            self.check_group(&format!("{place}.velocity"), &odometry.velocity)?;
            if let Some(turning) = &odometry.angular_velocity {
                self.check_each_number(&format!("{place}.angular_velocity"), turning)?;
            }
            self.check_attitude(place, &odometry.orientation, &odometry.roll_pitch_yaw)?;
        }
        if let Some(wrench) = signals.tool_wrench.as_ref().and_then(SignalSpec::fields) {
            let all = [&wrench.force[..], &wrench.moment[..]].concat();
            self.check_group("signals.tool_wrench", &all)?;
        }
        for linkage in &self.spec.linkage {
            let place = |key: &str| format!("linkage.{}.{key}", linkage.name);
            if let Some(force) = &linkage.force {
                self.check_field(&place("force"), force, true)?;
            }
            if let Some(pressure) = &linkage.pressure {
                self.check_field(&place("pressure.piston"), &pressure.piston, false)?;
                self.check_field(&place("pressure.rod"), &pressure.rod, false)?;
            }
        }
        Ok(())
    }

    /// Returns the commanded rates of those joints that are measured.
    pub(super) fn joint_commands(&self, joints: &[MeasuredJoint]) -> Vec<JointCommand> {
        let joint_of = |name: &str| joints.iter().position(|joint| joint.name == name);
        let commands = self
            .spec
            .signals
            .joints
            .iter()
            .filter_map(|(name, fields)| {
                Some(JointCommand {
                    joint: joint_of(name)?,
                    field: fields.command.clone()?,
                })
            });
        commands.collect()
    }

    fn check_joint(&self, joint: &str, fields: &JointFields) -> Result<(), MachineError> {
        let place = format!("signals.joints.{joint}");
        self.joint(&place, joint)?;
        let velocity = &fields.velocity;
        if let Some(NumberSpec::Constant(value)) = fields.position {
            return self.check_constant(&place, value, fields);
        }
        let position = fields.position.as_ref().and_then(NumberSpec::field);
        for (key, field) in [
            ("position", position),
            ("velocity", velocity.as_ref()),
            ("effort", fields.effort.as_ref()),
            ("command", fields.command.as_ref()),
        ] {
            if let Some(field) = field {
                self.check_field(&format!("{place}.{key}"), field, true)?;
            }
        }
        match (position, velocity) {
            (None, None) if fields.effort.is_some() || fields.command.is_some() => Ok(()),
            (None, _) => Err(self.value_error(place, "a position", "none")),
            (Some(position), Some(velocity)) if position.topic != velocity.topic => {
                let expected = format!("position and velocity from one topic, {}", position.topic);
                let found = format!("velocity from {}", velocity.topic);
                Err(self.value_error(place, expected, found))
            }
            _ => Ok(()),
        }
    }

    /// A joint that nobody logs: its position is constant, so it has no velocity.
    fn check_constant(
        &self,
        place: &str,
        value: f64,
        fields: &JointFields,
    ) -> Result<(), MachineError> {
        if !value.is_finite() {
            let place = format!("{place}.position");
            return Err(self.value_error(place, "a finite number [rad or m]", value));
        }
        if fields.velocity.is_some() {
            let place = format!("{place}.velocity");
            return Err(self.value_error(place, "no velocity of a constant position", "one"));
        }
        if fields.command.is_some() {
            let place = format!("{place}.command");
            return Err(self.value_error(place, "no command of a constant position", "one"));
        }
        match &fields.effort {
            Some(effort) => self.check_field(&format!("{place}.effort"), effort, true),
            None => Ok(()),
        }
    }

    fn check_attitude(
        &self,
        place: &str,
        orientation: &Option<[NumberSpec; 4]>,
        roll_pitch_yaw: &Option<[NumberSpec; 3]>,
    ) -> Result<(), MachineError> {
        match (orientation, roll_pitch_yaw) {
            (Some(_), Some(_)) => {
                Err(self.value_error(place, "orientation or roll_pitch_yaw", "both"))
            }
            (Some(numbers), None) => self.check_at_once(&format!("{place}.orientation"), numbers),
            (None, Some(numbers)) => {
                self.check_at_once(&format!("{place}.roll_pitch_yaw"), numbers)
            }
            (None, None) => Ok(()),
        }
    }

    /// Checks numbers of which at least one is measured: its stamps are those of the samples.
    fn check_group(&self, place: &str, numbers: &[NumberSpec]) -> Result<(), MachineError> {
        self.check_each_number(place, numbers)?;
        match numbers.iter().any(|number| number.field().is_some()) {
            true => Ok(()),
            false => {
                Err(self.value_error(place, "at least one field of the log", "constants alone"))
            }
        }
    }

    /// Checks numbers that no one can interpolate one by one: constants, or fields of one topic.
    fn check_at_once(&self, place: &str, numbers: &[NumberSpec]) -> Result<(), MachineError> {
        self.check_each_number(place, numbers)?;
        let mut fields = (numbers.iter().enumerate())
            .filter_map(|(i, number)| number.field().map(|field| (i, &field.topic)));
        let Some((_, first)) = fields.next() else {
            return Ok(());
        };
        match fields.find(|(_, topic)| *topic != first) {
            Some((i, other)) => {
                let expected = format!("a field of topic {first}, like the others");
                Err(self.value_error(format!("{place}[{i}]"), expected, other))
            }
            None => Ok(()),
        }
    }

    /// Checks numbers: constants, or fields.
    fn check_each_number(&self, place: &str, numbers: &[NumberSpec]) -> Result<(), MachineError> {
        for (i, number) in numbers.iter().enumerate() {
            let place = format!("{place}[{i}]");
            match number {
                NumberSpec::Constant(value) if !value.is_finite() => {
                    return Err(self.value_error(place, "a finite number", value));
                }
                NumberSpec::Constant(_) => {}
                NumberSpec::Field(field) => self.check_field(&place, field, false)?,
            }
        }
        Ok(())
    }

    /// Checks that a field is located; `has_default` where a joint name suffices.
    pub(super) fn check_field(
        &self,
        place: &str,
        field: &FieldSpec,
        has_default: bool,
    ) -> Result<(), MachineError> {
        if field.field.is_none() && !(has_default && field.joint.is_some()) {
            return Err(self.value_error(place, "field = \"...\", the path of a number", "none"));
        }
        if !field.scale.is_finite() {
            let place = format!("{place}.scale");
            return Err(self.value_error(place, "a finite number", field.scale));
        }
        if !field.offset.is_finite() {
            let place = format!("{place}.offset");
            return Err(self.value_error(place, "a finite number", field.offset));
        }
        Ok(())
    }
}
