//! A recorded state with the suspension moved elsewhere: the state as it would have been.
//!
//! The frame of the contact plane moves as recorded: the wheels' path over the ground is unchanged, and so is
//! the motion of all other joints. The pose and motion of the base above the wheels follow from the rods,
//! S(1)-(3), and with them the IMU's measurement.

use nalgebra::{Vector2, Vector3};

use super::carriers::Carriers;
use super::error::StabiliserError;
use super::instant::Instant;
use super::problem::MAX_ACTUATORS;
use super::prospect::{Own, Prospect, SuspendedMachine};
use super::stabiliser::check_stroke;
use crate::actuator_force::actuator_force;
use crate::coordinate::{Coordinate, Motion};
use crate::evaluate::evaluate;
use crate::kinematics::{self, ImuSeat};
use crate::machine::{LinkageInput, Machine, Suspension};
use crate::number::Real;
use crate::outcome::Outcome;
use crate::scope::Scope;
use crate::spatial::rotate;
use crate::state::{BaseState, State};
use crate::workspace::Workspace;

/// Replaces the motion of the suspension's rods in recorded states. A step does not allocate.
#[derive(Debug)]
pub struct Replay {
    suspended: SuspendedMachine,
    instant: Instant,
    scratch: Prospect<f64>,
    prospect: Prospect<f64>,
    coordinates: Vec<Coordinate<f64>>,
    state: State<f64>,
    workspace: Workspace<f64>,
    com_offset: Vector2<f64>,
}

impl SuspendedMachine {
    /// For a machine with a suspension that can be controlled.
    pub(super) fn of(machine: &Machine) -> Result<(Self, Suspension), StabiliserError> {
        let Some(suspension) = machine.suspension().cloned() else {
            return Err(StabiliserError::NoSuspension);
        };
        let actuators = suspension.linkages.len();
        if !(1..=MAX_ACTUATORS).contains(&actuators) {
            return Err(StabiliserError::Actuators { found: actuators });
        }
        if !machine.contact.free_joints.is_empty() {
            return Err(StabiliserError::FreeJoints {
                found: machine.contact.free_joints.len(),
            });
        }
        check_stroke(machine, &suspension)?;
        let mut unmeasured = machine.clone();
        // The joint torques in another posture are unknown.
        unmeasured.contact.actuated_joints.clear();
        let suspended = Self {
            carriers: Carriers::of(&unmeasured, &suspension.linkages),
            machine: unmeasured,
            linkages: suspension.linkages.clone(),
        };
        Ok((suspended, suspension))
    }
}

impl Replay {
    /// For a machine with a suspension.
    ///
    /// # Errors
    /// [`StabiliserError`]: the machine has no suspension that can be controlled.
    pub fn new(machine: &Machine) -> Result<Self, StabiliserError> {
        let (suspended, _) = SuspendedMachine::of(machine)?;
        let own = &suspended.machine;
        let scope = Scope {
            indicators: true,
            ..Scope::LOADS
        };
        Ok(Self {
            instant: Instant::new(&suspended),
            scratch: Prospect::new(&suspended),
            prospect: Prospect::new(&suspended),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); own.bodies.len()],
            state: State::zero(own),
            workspace: Workspace::with_scope(own, scope),
            com_offset: Vector2::repeat(f64::NAN),
            suspended,
        })
    }

    /// Number of rods.
    #[must_use]
    pub fn actuators(&self) -> usize {
        self.suspended.linkages.len()
    }

    /// Motion of the rods in a state (m, m/s, m/s^2), by actuator; zero beyond the machine's actuators.
    #[must_use]
    pub fn rods(&self, state: &State<f64>) -> [Motion<f64>; MAX_ACTUATORS] {
        let mut rods = [Motion::zero(); MAX_ACTUATORS];
        for (rod, &linkage) in rods.iter_mut().zip(&self.suspended.linkages) {
            let linkage = &self.suspended.machine.linkages[linkage];
            let solved = linkage.solve(&state.joints[linkage.measured_joint]).rod;
            *rod = Motion {
                position: solved.displacement,
                rate: solved.rate,
                acceleration: solved.acceleration,
            };
        }
        rods
    }

    /// The state with the given motion of the rods, by actuator, which is also evaluated. Non-finite inputs make
    /// the dependent values NaN. Actuator forces and the base's velocity are unknown in it.
    pub fn moved(&mut self, state: &State<f64>, rods: &[Motion<f64>]) -> &State<f64> {
        let recorded = self.rods(state);
        let actuators = self.actuators();
        let Self {
            suspended,
            instant,
            scratch,
            prospect,
            coordinates,
            state: moved,
            ..
        } = self;
        let machine = &suspended.machine;
        instant.fill(suspended, state, &recorded[..actuators], scratch);
        prospect.fill(suspended, instant, rods, Own::InMotion, true);
        let support = prospect.observe(suspended, instant, rods);
        moved.joints.clone_from(&state.joints);
        for (rod, &linkage) in rods.iter().zip(&suspended.linkages) {
            let linkage = &machine.linkages[linkage];
            moved.joints[linkage.measured_joint] = match linkage.input {
                LinkageInput::RodLength => *rod,
                LinkageInput::PivotAngle => {
                    let pivot = linkage.solve_by_rod(rod).pivot;
                    Motion {
                        position: Real::atan2(pivot.sin, pivot.cos),
                        rate: pivot.rate,
                        acceleration: pivot.acceleration,
                    }
                }
            };
        }
        kinematics::coordinates(machine, moved, coordinates);
        moved.imu = ImuSeat::of(machine, coordinates).felt(&prospect.base);
        moved.tool_wrench = state.tool_wrench;
        moved.payload_share.clone_from(&state.payload_share);
        moved.noise = state.noise;
        moved.base = BaseState::unknown();
        let up = rotate(&support.seat.rotation, &instant.up_on_ground);
        moved.base.up = up;
        self.com_offset = {
            let plane = &support.plane;
            let up = if up.x.is_finite() { up } else { plane.normal };
            let com = prospect.com;
            let height = plane.normal.dot(&com) - plane.height;
            let below: Vector3<f64> = com - up * (height / plane.normal.dot(&up));
            let middle = prospect.contacts.iter().sum::<Vector2<f64>>();
            plane.coordinates(&below) - middle / prospect.contacts.len() as f64
        };
        evaluate(machine, moved, &mut self.workspace);
        &self.state
    }

    /// Loads and indicators of the state from the last [`Self::moved`].
    #[must_use]
    pub fn outcome(&self) -> &Outcome<f64> {
        self.workspace.outcome()
    }

    /// Position of the centre of mass of the whole machine, projected along gravity onto the contact plane:
    /// forward and left of the centre of the contact points (m).
    #[must_use]
    pub fn com_offset(&self) -> Vector2<f64> {
        self.com_offset
    }

    /// Force that an actuator needs in that state, without friction (N), positive when it extends its rod.
    #[must_use]
    pub fn rod_force(&self, actuator: usize) -> f64 {
        let linkage = self.suspended.linkages[actuator];
        actuator_force(
            &self.suspended.machine,
            &self.state,
            &self.workspace,
            linkage,
        )
    }
}
