//! Doubtful values: guesses that no person has confirmed, and constants for joints that nobody logs. They carry a
//! wide standard deviation and a note.

use tipwatch_language::say;

use super::checker::Checker;
use crate::machine::{Machine, MachineError, Note, NoteKind};

/// Standard deviation of an unconfirmed radius, as a share of it.
const RADIUS_SHARE: f64 = 0.25;
/// Standard deviation of an unconfirmed joint position: unit, sign and zero are guesses (rad or m).
const JOINT_SIGMA: [f64; 2] = [0.3, 0.15];
/// Standard deviation of a constant joint position that was confirmed (rad or m).
const CONSTANT_SIGMA: [f64; 2] = [0.1, 0.05];
/// Standard deviations of an unconfirmed mounting of the IMU: position (m), orientation (rad).
const IMU_SIGMA: [f64; 2] = [0.3, 0.1];

impl Checker<'_> {
    /// Widens the standard deviations of doubtful values and notes them.
    pub(super) fn add_doubts(&self, machine: &mut Machine) -> Result<(), MachineError> {
        for joint in 0..machine.joints.len() {
            let Some(position) = machine.joints[joint].constant else {
                continue;
            };
            let (sigma, unit) = of_joint(machine, joint, CONSTANT_SIGMA);
            machine.joints[joint].position_sigma = Some(sigma);
            let name = &machine.joints[joint].name;
            let [kg, percent] = self.carried_mass(name);
            machine.notes.push(unconfirmed(say!(
                "joint {name}, which carries {kg} kg, {percent} % of the mass, is in no message; its position is the constant {position} \
                 {unit} of the machine file, with a standard deviation of {sigma} {unit}."
            )));
        }
        for key in &self.spec.unconfirmed {
            self.add_doubt(key, machine)?;
        }
        Ok(())
    }

    fn add_doubt(&self, key: &str, machine: &mut Machine) -> Result<(), MachineError> {
        let parts: Vec<&str> = key.split('.').collect();
        let about = match parts[..] {
            ["imu"] => {
                if self.log.lacks_imu {
                    return Ok(());
                }
                let [position, rotation] = IMU_SIGMA;
                let uncertainty = &mut machine.uncertainty;
                uncertainty.imu_position = uncertainty.imu_position.max(position);
                uncertainty.imu_rotation = uncertainty.imu_rotation.max(rotation);
                say!(
                    "position and orientation of the IMU ({}) are guessed, with standard deviations of {position} m and \
                     {rotation} rad",
                    machine.imu.source
                )
            }
            ["wheels", wheel, "radius"] => {
                let found = machine.wheels.iter_mut().find(|w| w.name == wheel);
                let Some(wheel) = found else {
                    return Err(self.unknown_doubt(key));
                };
                let sigma = RADIUS_SHARE * wheel.radius;
                wheel.radius_sigma = Some(sigma);
                say!(
                    "the radius of wheel {}, {} m, is guessed, with a standard deviation of {sigma:.3} m",
                    wheel.name,
                    wheel.radius
                )
            }
            ["signals", "joints", ref name @ ..] if !name.is_empty() => {
                let name = name.join(".");
                if !self.spec.signals.joints.contains_key(&name) {
                    return Err(self.unknown_doubt(key));
                }
                let Some(joint) = machine.joints.iter().position(|joint| joint.name == name) else {
                    return Ok(());
                };
                let (sigma, unit) = of_joint(machine, joint, JOINT_SIGMA);
                machine.joints[joint].position_sigma = Some(sigma);
                say!(
                    "the position of joint {name} is guessed, with a standard deviation of {sigma} {unit}"
                )
            }
            _ => return Err(self.unknown_doubt(key)),
        };
        machine.notes.push(unconfirmed(say!(
            "{about}. Check it, then remove \"{key}\" from `unconfirmed` in the machine file."
        )));
        Ok(())
    }

    fn unknown_doubt(&self, key: &str) -> MachineError {
        self.value_error(
            "unconfirmed",
            "\"imu\", \"wheels.NAME.radius\" or \"signals.joints.NAME\", with names of this file",
            format!("\"{key}\""),
        )
    }
}

/// A note on a value that nobody has confirmed.
fn unconfirmed(what: String) -> Note {
    Note::new(NoteKind::Unconfirmed, say!("Unconfirmed: {what}"))
}

/// The standard deviation for the kind of joint, and its unit.
fn of_joint(machine: &Machine, joint: usize, sigmas: [f64; 2]) -> (f64, &'static str) {
    match machine.joint_slides(joint) {
        true => (sigmas[1], "m"),
        false => (sigmas[0], "rad"),
    }
}
