//! What the model predicts of the readings.

use tipwatch_mechanics::machine::{Machine, Parameter, Unknown};
use tipwatch_mechanics::{
    Scope, State, Workspace, actuator_force, evaluate_one, resting_on_slope, resting_state,
};

use crate::data::{Instant, Measured, Situation};

/// A machine with changed parameters, and the changes of its signals.
#[derive(Debug)]
pub(crate) struct Changed {
    pub(crate) machine: Machine,
    signals: Vec<(Parameter, f64)>,
}

impl Changed {
    /// `machine` with each unknown changed by an amount in its unit.
    pub(crate) fn new(machine: &Machine, unknowns: &[Unknown], changes: &[f64]) -> Self {
        let changes: Vec<(Parameter, f64)> = (unknowns.iter().zip(changes))
            .flat_map(|(unknown, &change)| unknown.changes(machine, change))
            .filter(|(_, change)| *change != 0.0)
            .collect();
        Self {
            machine: machine.changed(&changes),
            signals: (changes.into_iter())
                .filter(|(parameter, _)| parameter.is_signal())
                .collect(),
        }
    }

    /// Whether every mass is positive.
    pub(crate) fn is_possible(&self) -> bool {
        let links = self.machine.links().iter().map(|link| link.inertia.mass);
        let payloads = self.machine.payloads().iter().map(|p| p.inertia.mass);
        let wheels = self.machine.wheels().iter().map(|wheel| wheel.radius);
        links.chain(payloads).all(|mass| mass >= 0.0) && wheels.clone().all(|r| r > 0.0)
    }

    /// The state of a row with the errors of its signals corrected.
    pub(crate) fn corrected(&self, state: &State<f64>) -> State<f64> {
        let mut state = state.clone();
        for &(parameter, change) in &self.signals {
            state.change(parameter, change);
        }
        state
    }

    /// The error that must be added to the reading of an accelerometer along an axis.
    fn of_accelerometer(&self, axis: usize) -> f64 {
        let own = self.signals.iter().filter(|(parameter, _)| {
            matches!(parameter, Parameter::SpecificForce(other) if *other as usize == axis)
        });
        own.map(|(_, change)| change).sum()
    }

    /// Predictions of all readings of an instant; NaN where they cannot be computed.
    pub(crate) fn predict(&self, instant: &Instant, slope_change: [f64; 2]) -> Vec<f64> {
        match &instant.situation {
            Situation::Logged(state) => {
                let state = self.corrected(state);
                self.of_state(&self.machine, &state, instant)
            }
            Situation::AtRest {
                positions, slope, ..
            } => {
                let mut shown = resting_state(&self.machine, positions);
                for &(parameter, change) in &self.signals {
                    if matches!(parameter, Parameter::JointPosition(_)) {
                        shown.change(parameter, change);
                    }
                }
                let positions: Vec<f64> = shown.joints.iter().map(|j| j.position).collect();
                let slope = [slope[0] + slope_change[0], slope[1] + slope_change[1]];
                let (machine, state) = resting_on_slope(&self.machine, &positions, slope);
                self.of_state(&machine, &state, instant)
            }
        }
    }

    fn of_state(&self, machine: &Machine, state: &State<f64>, instant: &Instant) -> Vec<f64> {
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        evaluate_one(machine, state, &mut workspace);
        let needs_axes = |what: &Measured| matches!(what, Measured::SpecificForce { .. });
        let axes = (instant
            .readings
            .iter()
            .any(|reading| needs_axes(&reading.what)))
        .then(|| self.accelerometer(state));
        let predict = |what: &Measured| match what {
            Measured::Load { wheels } => wheels
                .iter()
                .map(|&wheel| workspace.outcome().load[wheel])
                .sum(),
            Measured::ActuatorForce { linkage } => {
                actuator_force(machine, state, &workspace, *linkage)
            }
            Measured::SpecificForce { axis } => {
                axes.map_or(f64::NAN, |axes| axes[*axis] - self.of_accelerometer(*axis))
            }
        };
        let readings = instant.readings.iter();
        readings.map(|reading| predict(&reading.what)).collect()
    }

    /// The specific force of a machine at rest along the axes of its IMU. `state` holds that of the base.
    fn accelerometer(&self, state: &State<f64>) -> [f64; 3] {
        let mut workspace = Workspace::with_scope(&self.machine, Scope::LOADS);
        let mut shown = resting_state(&self.machine, &[]);
        shown.joints.clone_from(&state.joints);
        // At rest the ground pushes with mass times the specific force of the base. What the IMU would have to measure
        // for a force along each of its axes gives these axes in the base.
        std::array::from_fn(|axis| {
            shown.imu.specific_force.fill(0.0);
            shown.imu.specific_force[axis] = 1.0;
            let pushed = evaluate_one(&self.machine, &shown, &mut workspace)
                .ground_wrench
                .force;
            pushed.normalize().dot(&state.imu.specific_force)
        })
    }
}

/// Predictions of all readings of an instant by a machine, whose identified corrections are in the data already; NaN
/// where they cannot be computed.
#[must_use]
pub fn predict(machine: &Machine, instant: &Instant) -> Vec<f64> {
    Changed::new(machine, &[], &[]).predict(instant, [0.0; 2])
}

/// The same with each unknown changed by an amount in its unit.
#[must_use]
pub fn predicted(
    machine: &Machine,
    unknowns: &[Unknown],
    changes: &[f64],
    instant: &Instant,
) -> Vec<f64> {
    Changed::new(machine, unknowns, changes).predict(instant, [0.0; 2])
}
