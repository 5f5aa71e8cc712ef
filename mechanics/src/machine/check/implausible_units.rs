//! Refuses places, angles, stiffnesses and loads that no machine has: they are in another unit.

use super::checker::Checker;
use super::implausible_wheels::widest_distance;
use crate::machine::{Machine, MachineError, Wheel};

/// Largest distance of a part from the origin of its link, as a multiple of the largest distance between wheels: a load on a rope hangs far
/// below the tip of its boom.
const FARTHEST: f64 = 10.0;
/// Largest angle of a rotation (rad).
const LARGEST_TURN: f64 = 2.0 * std::f64::consts::PI;

impl Checker<'_> {
    /// Checks that a place on a link is one on this machine, and so in metres.
    pub(super) fn check_place(
        &self,
        key: &str,
        xyz: [f64; 3],
        wheels: &[Wheel],
    ) -> Result<(), MachineError> {
        let widest = widest_distance(wheels);
        let length = |xyz: [f64; 3]| xyz.iter().map(|x| x * x).sum::<f64>().sqrt();
        let distance = length(xyz);
        if distance <= FARTHEST * widest {
            return Ok(());
        }
        // a part is usually between the wheels
        let remedy = match distance / 1000.0 <= widest {
            true => {
                let [x, y, z] = xyz.map(|x| x / 1000.0);
                format!("It looks like millimetres: write [{x}, {y}, {z}] (m).")
            }
            false => "Lengths are in metres.".into(),
        };
        Err(self.implausible(
            key,
            format!(
                "a place within {:.1} m of the link's origin, {FARTHEST} times the largest distance between the wheels",
                FARTHEST * widest
            ),
            format!("[{}, {}, {}], {distance:.1} m away", xyz[0], xyz[1], xyz[2]),
            remedy,
        ))
    }

    /// Checks that angles are within a full turn, and so in radians.
    pub(super) fn check_turn(&self, key: &str, rpy: [f64; 3]) -> Result<(), MachineError> {
        if rpy.iter().all(|angle| angle.abs() <= LARGEST_TURN) {
            return Ok(());
        }
        let [roll, pitch, yaw] = rpy;
        let [in_roll, in_pitch, in_yaw] = rpy.map(|a| (a.to_radians() * 1e6).round() / 1e6);
        Err(self.implausible(
            key,
            "angles [rad] of a full turn, 2 pi, at most",
            format!("[{roll}, {pitch}, {yaw}]"),
            format!("They look like degrees: write [{in_roll}, {in_pitch}, {in_yaw}] (rad)."),
        ))
    }

    /// Checks payloads, tyres and limits against the size and the weight of the machine.
    pub(super) fn check_against_machine(&self, machine: &Machine) -> Result<(), MachineError> {
        for (index, payload) in self.spec.payload.iter().enumerate() {
            let key = format!("payload {}: com", index + 1);
            self.check_place(&key, payload.com, &machine.wheels)?;
        }
        let weight = machine.mass() * machine.gravity();
        if let Some(least) = self.spec.limits.min_load.filter(|least| *least >= weight) {
            return Err(self.implausible(
                "limits.min_load",
                format!("a load of one wheel [N], below the weight of the machine, {weight:.0} N"),
                format!("{least} N"),
                "With it every wheel is light at all times. Check its unit and the masses of the URDF (kg).",
            ));
        }
        let mean_load = weight / machine.wheels.len() as f64;
        for wheel in &machine.wheels {
            let Some(stiffness) = wheel.stiffness else {
                continue;
            };
            // a foot has no radius
            if wheel.radius <= 0.0 || mean_load <= stiffness * wheel.radius {
                continue;
            }
            let in_newtons = stiffness * 1e3;
            let remedy = match mean_load <= in_newtons * wheel.radius {
                true => format!("It looks like N/mm or kN/m: write {in_newtons:e} (N/m)."),
                false => "Check the unit of the stiffness and the masses of the URDF (kg).".into(),
            };
            return Err(self.implausible(
                format!("contact.tyre_stiffness of {}", wheel.name),
                format!(
                    "a stiffness [N/m] with which the mean load of a wheel, {mean_load:.0} N, deflects the tyre by less than its radius, {} m",
                    wheel.radius
                ),
                format!("{stiffness} N/m, a deflection of {:.1} m", mean_load / stiffness),
                remedy,
            ));
        }
        Ok(())
    }
}
