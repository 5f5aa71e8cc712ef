//! Signals on which the loads of a machine depend, and which must therefore be proven before a verdict may call it safe.
//!
//! A joint counts if its whole range, in some posture of the others, changes the load of a wheel by a share of its static load
//! that matters. The derivative in one posture would not do: it is zero where a load is largest, and it rests on the very
//! joints that are not yet proven.

use nalgebra::Vector3;

use super::self_equilibrated::self_equilibrated_loads;
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ForceSource, Ground, Machine, Proof, Proofs, SupportId};
use crate::state::{Sensors, State, resting_state};

/// Change of a wheel's load that matters, as a share of its static load. The lowest threshold of a verdict leaves a quarter.
const MATTERS: f64 = 0.05;
/// Postures of the other joints that are tried, and positions of the joint in each.
const POSTURES: u32 = 12;
const POSITIONS: u32 = 5;
/// Range of a joint without limits: half a turn to both sides (rad), or so far (m).
const UNLIMITED_TURN: f64 = std::f64::consts::PI;
const UNLIMITED_SLIDE: f64 = 0.5;

/// Proofs that the loads of a machine need.
#[derive(Debug, Clone)]
pub struct NeededProofs {
    /// On any set of supports.
    proofs: Proofs,
    /// Supports whose loads are measured: on these alone, the loads need nothing of the ground.
    measured_supports: Vec<SupportId>,
}

impl NeededProofs {
    /// All proofs: where it is not known which the loads need.
    pub const ALL: Self = Self {
        proofs: Proofs::ALL,
        measured_supports: Vec::new(),
    };

    /// Returns the proofs that the loads need on these supports; `None` for supports that do not vary, or are unknown.
    #[must_use]
    pub fn on(&self, supports: Option<&[SupportId]>) -> Proofs {
        let mut needed = self.proofs;
        if supports.is_some_and(|on| on.iter().all(|id| self.measured_supports.contains(id))) {
            needed.remove(Proof::Ground);
        }
        needed
    }
}

impl Machine {
    /// Returns the signals on which the loads depend, with these sensors, among those that a commissioning or a motion can prove.
    #[must_use]
    pub fn needed_proofs(&self, sensors: &Sensors) -> NeededProofs {
        let mut needed = Proofs::NONE;
        if sensors.imu {
            needed.add(Proof::SpecificForce);
            needed.add(Proof::AngularVelocity);
        } else {
            needed.add(Proof::Odometry);
        }
        if sensors.tool_wrench {
            needed.add(Proof::ToolWrench);
        }
        if !sensors.actuators.is_empty() {
            needed.add(Proof::ActuatorForces);
        }
        // a mass may be wrong by all that the machine can lift, and other supports are another machine
        if !sensors.payload_signals.is_empty() {
            needed.add(Proof::Payload);
        }
        if sensors.switches > 0 {
            needed.add(Proof::Supports);
        }
        // of supports that come and go each set is another machine
        let mut trial = (!self.supports().vary()).then(|| Trial::of(self));
        let is_plane = self.contact().ground == Ground::Plane;
        // what presses how much into plane ground is known of all supports together, or of none
        let is_stiff = self.contact().tyres_deflect || !self.supports().vary();
        let measured = self.measured_supports(sensors);
        let is_measured = match self.supports().vary() {
            true => self.supports().ids().all(|id| measured.contains(&id)),
            false => self.stands_on().iter().all(|id| measured.contains(id)),
        };
        let is_known = (is_plane && is_stiff) || is_measured;
        if !is_known && trial.as_mut().is_none_or(Trial::leaves_split_open) {
            needed.add(Proof::Ground);
        }
        for (joint, it) in self.joints().iter().enumerate() {
            let is_sensed = it.logged && it.constant.is_none() && it.spins_wheel.is_none();
            let is_idle = |trial: &mut Trial| trial.largest_effect(joint) < MATTERS;
            if is_sensed && !trial.as_mut().is_some_and(is_idle) {
                needed.add(Proof::Joint(joint));
            }
        }
        NeededProofs {
            proofs: needed,
            measured_supports: measured,
        }
    }

    /// Returns the supports whose loads these sensors measure. On these alone, nothing of the split of the load is open.
    fn measured_supports(&self, sensors: &Sensors) -> Vec<SupportId> {
        let joints = &self.contact().actuated_joints;
        let signals = sensors.actuators.iter();
        signals
            .filter_map(|signal| match joints[signal.joint].source {
                ForceSource::Support { support, .. } => Some(support),
                ForceSource::Linkage(_) => None,
            })
            .collect()
    }
}

/// The machine at rest on level ground, in one posture after the other.
struct Trial {
    machine: Machine,
    workspace: Workspace<f64>,
    state: State<f64>,
}

impl Trial {
    fn of(machine: &Machine) -> Self {
        let machine = machine.with_imu_at_base();
        let positions = &machine.reference().posture.positions;
        let mut state = resting_state(&machine, positions);
        state.imu.specific_force = Vector3::z() * machine.gravity();
        Self {
            workspace: Workspace::new(&machine),
            state,
            machine,
        }
    }

    /// Whether equilibrium leaves the split of the load open.
    fn leaves_split_open(&mut self) -> bool {
        evaluate(&self.machine, &self.state, &mut self.workspace);
        let is_solved = self.workspace.outcome.otf.iter().all(|otf| otf.is_finite());
        !is_solved || !self_equilibrated_loads(&self.workspace).is_empty()
    }

    /// Largest change of a wheel's load over the range of a joint, as a share of its static load; NaN if it is unknown.
    fn largest_effect(&mut self, joint: usize) -> f64 {
        let mut largest = f64::NAN;
        for posture in 0..POSTURES {
            self.take_posture(posture);
            let wheels = self.machine.wheels().len();
            let mut spans = vec![[f64::INFINITY, f64::NEG_INFINITY]; wheels];
            for position in 0..POSITIONS {
                let share = f64::from(position) / f64::from(POSITIONS - 1);
                self.state.joints[joint].position = self.within_range(joint, share);
                let outcome = evaluate(&self.machine, &self.state, &mut self.workspace);
                for (span, otf) in spans.iter_mut().zip(&outcome.otf) {
                    // a posture in which a linkage cannot close has no loads
                    *span = [span[0].min(*otf), span[1].max(*otf)];
                }
            }
            let static_load = &self.machine.reference().static_load;
            for ([least, most], load) in spans.iter().zip(static_load) {
                if most >= least {
                    largest = largest.max((most - least) / load);
                }
            }
        }
        largest
    }

    /// Every joint somewhere in its range, evenly spread over the postures.
    fn take_posture(&mut self, posture: u32) {
        for joint in 0..self.state.joints.len() {
            let it = &self.machine.joints()[joint];
            if it.constant.is_some() || it.spins_wheel.is_some() {
                continue;
            }
            // a lattice of the golden ratio, another in each dimension
            let share = f64::from(posture) * 0.618_033_988_75 * (1.0 + joint as f64 * 0.377);
            self.state.joints[joint].position = self.within_range(joint, share.fract());
        }
    }

    fn within_range(&self, joint: usize, share: f64) -> f64 {
        let unlimited = match self.machine.joint_slides(joint) {
            true => UNLIMITED_SLIDE,
            false => UNLIMITED_TURN,
        };
        let limits = self.machine.joints()[joint].limits;
        let [least, most] = limits.unwrap_or([-unlimited, unlimited]);
        least + share * (most - least)
    }
}
