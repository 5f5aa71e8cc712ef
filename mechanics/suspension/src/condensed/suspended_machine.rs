//! A machine whose suspension can be controlled.

use super::carriers::Carriers;
use crate::error::SuspensionError;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Machine, Suspension};
use tipwatch_mechanics::state::State;

/// Maximum number of actuators.
pub const MAX_ACTUATORS: usize = 2;

/// Number of strokes at which T* is evaluated.
pub(crate) const STROKE_POSITIONS: usize = 33;

/// A machine with its suspension linkages.
#[derive(Debug, Clone)]
pub(crate) struct SuspendedMachine {
    pub(crate) machine: Machine,
    /// Indices of the linkages, by actuator.
    pub(crate) linkages: Vec<usize>,
    pub(crate) carriers: Carriers,
}

impl SuspendedMachine {
    /// For a machine with a suspension that can be controlled.
    pub(crate) fn of(machine: &Machine) -> Result<(Self, Suspension), SuspensionError> {
        let Some(suspension) = machine.suspension().cloned() else {
            return Err(SuspensionError::NoSuspension);
        };
        let actuators = suspension.linkages.len();
        if !(1..=MAX_ACTUATORS).contains(&actuators) {
            return Err(SuspensionError::Actuators { found: actuators });
        }
        if !machine.contact().free_joints.is_empty() {
            return Err(SuspensionError::FreeJoints {
                found: machine.contact().free_joints.len(),
            });
        }
        check_stroke(machine, &suspension)?;
        let mut unmeasured = machine.clone();
        // The joint torques in another posture are unknown.
        unmeasured.leave_out_actuator_forces();
        let suspended = Self {
            carriers: Carriers::of(&unmeasured, &suspension.linkages),
            machine: unmeasured,
            linkages: suspension.linkages.clone(),
        };
        Ok((suspended, suspension))
    }

    /// Motion of the rods in a state (m, m/s, m/s^2), by actuator; zero beyond the machine's actuators.
    pub(crate) fn rods(&self, state: &State<f64>) -> [Motion<f64>; MAX_ACTUATORS] {
        let mut rods = [Motion::zero(); MAX_ACTUATORS];
        for (motion, &linkage) in rods.iter_mut().zip(&self.linkages) {
            let linkage = &self.machine.linkages()[linkage];
            let rod = linkage.solve(&state.joints[linkage.measured_joint]).rod;
            *motion = Motion {
                position: rod.displacement,
                rate: rod.rate,
                acceleration: rod.acceleration,
            };
        }
        rods
    }
}

/// Checks that every triangle closes over the stroke.
fn check_stroke(machine: &Machine, suspension: &Suspension) -> Result<(), SuspensionError> {
    let [least, greatest] = suspension.stroke;
    for &linkage in &suspension.linkages {
        let linkage = &machine.linkages()[linkage];
        for k in 0..STROKE_POSITIONS {
            let position = least + (greatest - least) * k as f64 / (STROKE_POSITIONS - 1) as f64;
            let rod = Motion::at_rest(position);
            if !(linkage.solve_by_rod(&rod).closure > 0.0) {
                return Err(SuspensionError::Stroke {
                    linkage: linkage.name.clone(),
                    position,
                });
            }
        }
    }
    Ok(())
}
