//! A recorded state with the suspension moved elsewhere: the state as it would have been.
//!
//! The frame of the contact plane moves as recorded: the wheels' path over the ground is unchanged, and so is
//! the motion of all other joints. The pose and motion of the base above the wheels follow from the rods,
//! S(1)-(3), and with them the IMU's measurement.

use nalgebra::{Vector2, Vector3};

use crate::condensed::Instant;
use crate::condensed::MAX_ACTUATORS;
use crate::condensed::SuspendedMachine;
use crate::control::RodForce;
use crate::error::SuspensionError;
use crate::prediction::{PredictedState, RodMotion};
use tipwatch_mechanics::dynamics::kinematics::{self, SensorFrame};
use tipwatch_mechanics::geometry::coordinate::{Coordinate, Motion};
use tipwatch_mechanics::geometry::spatial::rotate;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{BaseState, State};
use tipwatch_mechanics::{Outcome, Scope, Workspace, actuator_force, evaluate};

/// Motion of all rods; zero beyond the machine's actuators.
pub(super) type Rods = [Motion<f64>; MAX_ACTUATORS];

/// Returns the rods at rest at their strokes.
pub(super) fn at_rest(rods: &Rods) -> Rods {
    rods.map(|rod| Motion::at_rest(rod.position))
}

/// Replaces the motion of the suspension's rods in recorded states. A step does not allocate.
#[derive(Debug)]
pub struct Replay {
    suspended: SuspendedMachine,
    instant: Instant,
    scratch: PredictedState<f64>,
    predicted_state: PredictedState<f64>,
    coordinates: Vec<Coordinate<f64>>,
    state: State<f64>,
    workspace: Workspace<f64>,
    com_offset: Vector2<f64>,
    /// Index of the measured force of each actuator in [`State::actuator_force`], if there is one.
    measured_force: [Option<usize>; MAX_ACTUATORS],
}

impl Replay {
    /// Creates the replay of a machine with a suspension.
    ///
    /// # Errors
    /// [`SuspensionError`]: the machine has no suspension that can be controlled.
    pub fn new(machine: &Machine) -> Result<Self, SuspensionError> {
        let (suspended, _) = SuspendedMachine::of(machine)?;
        let own = &suspended.machine;
        let scope = Scope {
            indicators: true,
            ..Scope::LOADS
        };
        Ok(Self {
            instant: Instant::new(&suspended),
            scratch: PredictedState::new(&suspended),
            predicted_state: PredictedState::new(&suspended),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); own.bodies().len()],
            state: State::zero(own),
            workspace: Workspace::with_scope(own, scope),
            com_offset: Vector2::repeat(f64::NAN),
            measured_force: std::array::from_fn(|k| {
                let linkage = suspended.linkages.get(k)?;
                let joints = &machine.contact().actuated_joints;
                joints
                    .iter()
                    .position(|joint| joint.linkage() == Some(*linkage))
            }),
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
        self.suspended.rods(state)
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
            predicted_state,
            coordinates,
            state: moved,
            ..
        } = self;
        let machine = &suspended.machine;
        instant.fill(suspended, state, &recorded[..actuators], scratch);
        predicted_state.fill(suspended, instant, rods, RodMotion::InMotion, true);
        let support = predicted_state.observe(suspended, instant, rods);
        moved.joints.clone_from(&state.joints);
        for (rod, &linkage) in rods.iter().zip(&suspended.linkages) {
            let linkage = &machine.linkages()[linkage];
            moved.joints[linkage.measured_joint] = linkage.measured_by_rod(rod);
        }
        kinematics::coordinates(machine, moved, coordinates);
        moved.imu = SensorFrame::of(machine, coordinates).measured(&predicted_state.base);
        moved.tool_wrench = state.tool_wrench;
        moved.payload_share.clone_from(&state.payload_share);
        moved.noise = state.noise;
        moved.base = BaseState::unknown();
        let up = rotate(&support.sensor_frame.rotation, &instant.up_on_ground);
        moved.base.up = up;
        self.com_offset = {
            let plane = &support.plane;
            let up = if up.x.is_finite() { up } else { plane.normal };
            let com = predicted_state.com;
            let height = plane.normal.dot(&com) - plane.height;
            let below: Vector3<f64> = com - up * (height / plane.normal.dot(&up));
            let middle = predicted_state.contacts.iter().sum::<Vector2<f64>>();
            plane.coordinates(&below) - middle / predicted_state.contacts.len() as f64
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

    /// Returns the forces on each rod in a state, for the valve law: the measured one, from pressures or from a force signal, and
    /// the load without acceleration of the rods. Unknown where no force is measured.
    pub fn rod_forces(&mut self, state: &State<f64>) -> [RodForce; MAX_ACTUATORS] {
        let measured = self.measured_force.map(|joint| {
            let force = joint.and_then(|joint| state.actuator_force.get(joint));
            force.copied().unwrap_or(f64::NAN)
        });
        let rods = self.rods(state);
        self.carried(state, &rods, &measured)
    }

    /// Returns the forces on rods with this motion, whose acceleration is disregarded, and these measured forces (N).
    pub fn carried(
        &mut self,
        state: &State<f64>,
        rods: &[Motion<f64>; MAX_ACTUATORS],
        measured: &[f64; MAX_ACTUATORS],
    ) -> [RodForce; MAX_ACTUATORS] {
        let mut forces = [RodForce::UNKNOWN; MAX_ACTUATORS];
        if measured.iter().any(|force| force.is_finite()) {
            let actuators = self.actuators();
            let rods = rods.map(|rod| Motion {
                acceleration: 0.0,
                ..rod
            });
            self.moved(state, &rods[..actuators]);
            for (k, force) in forces[..actuators].iter_mut().enumerate() {
                *force = RodForce {
                    piston: measured[k],
                    load: self.rod_force(k),
                };
            }
        }
        forces
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
