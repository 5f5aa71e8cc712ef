//! Predictions of the readings by the model.

use std::sync::Arc;

use nalgebra::DVector;
use tipwatch_mechanics::machine::{Machine, Parameter, SupportId, SupportKind, Unknown};
use tipwatch_mechanics::{
    Scope, State, Workspace, actuator_force, evaluate_one, resting_on_slope, resting_state,
};

use crate::identification::data::{Instant, Measured, Situation};

/// Step of the difference by slope (rad).
const SLOPE_STEP: f64 = 1e-4;

/// A machine with changed parameters on some sets of supports, and the changes of its signals.
#[derive(Debug)]
pub(crate) struct Changed {
    /// On the supports that it was given on.
    machine: Machine,
    /// On the sets of the data that are others.
    on_others: Vec<Machine>,
    signals: Vec<(Parameter, f64)>,
}

impl Changed {
    /// `machine` on these sets with each unknown changed by an amount in its unit.
    pub(crate) fn new(
        machine: &Machine,
        sets: &[Arc<[SupportId]>],
        unknowns: &[Unknown],
        changes: &[f64],
    ) -> Self {
        let changes: Vec<(Parameter, f64)> = (unknowns.iter().zip(changes))
            .flat_map(|(unknown, &change)| unknown.changes(machine, change))
            .filter(|(_, change)| *change != 0.0)
            .collect();
        let machine = machine.changed(&changes);
        let others = sets.iter().filter(|set| ***set != *machine.stands_on());
        Self {
            on_others: (others.filter_map(|set| machine.standing_on(set).ok())).collect(),
            machine,
            signals: (changes.into_iter())
                .filter(|(parameter, _)| parameter.is_signal())
                .collect(),
        }
    }

    /// The machine as it stood at an instant; `None` if it cannot stand so.
    pub(crate) fn at(&self, instant: &Instant) -> Option<&Machine> {
        self.machines()
            .find(|machine| *machine.stands_on() == *instant.supports)
    }

    /// The machine on each set.
    pub(crate) fn machines(&self) -> impl Iterator<Item = &Machine> {
        std::iter::once(&self.machine).chain(&self.on_others)
    }

    /// Whether no mass is negative and every wheel has a positive radius.
    pub(crate) fn is_possible(&self) -> bool {
        let links = self.machine.links().iter().map(|link| link.inertia.mass);
        let payloads = self.machine.payloads().iter().map(|p| p.inertia.mass);
        let supports = self.machine.supports().all.iter();
        let mut wheels = supports.filter(|support| support.kind == SupportKind::Wheel);
        links.chain(payloads).all(|mass| mass >= 0.0) && wheels.all(|wheel| wheel.radius > 0.0)
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
        let Some(standing) = self.at(instant) else {
            return vec![f64::NAN; instant.readings.len()];
        };
        match &instant.situation {
            Situation::Logged(state) => {
                let state = self.corrected(state);
                self.of_state(standing, &state, instant)
            }
            Situation::AtRest {
                positions, slope, ..
            } => {
                let mut shown = resting_state(standing, positions);
                for &(parameter, change) in &self.signals {
                    if matches!(parameter, Parameter::JointPosition(_)) {
                        shown.change(parameter, change);
                    }
                }
                let positions: Vec<f64> = shown.joints.iter().map(|j| j.position).collect();
                let slope = [slope[0] + slope_change[0], slope[1] + slope_change[1]];
                let (machine, state) = resting_on_slope(standing, &positions, slope);
                self.of_state(&machine, &state, instant)
            }
        }
    }

    /// Computes the changes of all readings of an instant by one standard deviation of each slope; none where the slope is known
    /// exactly.
    pub(crate) fn by_slope(&self, instant: &Instant) -> Vec<DVector<f64>> {
        let sigma = match instant.situation {
            Situation::AtRest { slope_sigma, .. } => slope_sigma,
            Situation::Logged(_) => 0.0,
        };
        if !(sigma > 0.0) {
            return Vec::new();
        }
        let along = |axis: usize| {
            let [below, above] = [-1.0, 1.0].map(|side| {
                let mut change = [0.0; 2];
                change[axis] = side * SLOPE_STEP;
                DVector::from_vec(self.predict(instant, change))
            });
            (above - below) * (sigma / (2.0 * SLOPE_STEP))
        };
        (0..2).map(along).collect()
    }

    fn of_state(&self, machine: &Machine, state: &State<f64>, instant: &Instant) -> Vec<f64> {
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        evaluate_one(machine, state, &mut workspace);
        let needs_axes = |what: &Measured| matches!(what, Measured::SpecificForce { .. });
        let axes = (instant
            .readings
            .iter()
            .any(|reading| needs_axes(&reading.what)))
        .then(|| self.accelerometer(instant, state))
        .flatten();
        let predict = |what: &Measured| match what {
            Measured::Load { supports } => {
                let mut places = places(machine, supports).peekable();
                // a sensor of supports that are off the ground says nothing
                match places.peek() {
                    Some(_) => places.map(|place| workspace.outcome().load[place]).sum(),
                    None => f64::NAN,
                }
            }
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
    fn accelerometer(&self, instant: &Instant, state: &State<f64>) -> Option<[f64; 3]> {
        let standing = self.at(instant)?;
        let mut workspace = Workspace::with_scope(standing, Scope::LOADS);
        let mut shown = resting_state(standing, &[]);
        shown.joints.clone_from(&state.joints);
        // At rest the ground pushes with mass times the specific force of the base. What the IMU would have to measure
        // for a force along each of its axes gives these axes in the base.
        Some(std::array::from_fn(|axis| {
            shown.imu.specific_force.fill(0.0);
            shown.imu.specific_force[axis] = 1.0;
            let pushed = evaluate_one(standing, &shown, &mut workspace)
                .ground_wrench
                .force;
            pushed.normalize().dot(&state.imu.specific_force)
        }))
    }
}

/// Returns the places of some supports in the lists by wheel of `machine`; supports that it does not stand on have none.
pub(crate) fn places(machine: &Machine, supports: &[SupportId]) -> impl Iterator<Item = usize> {
    supports.iter().filter_map(|&id| machine.place_of(id))
}

/// Predictions of all readings of an instant by a machine, whose identified corrections are in the data already; NaN
/// where they cannot be computed.
#[must_use]
pub fn predict(machine: &Machine, instant: &Instant) -> Vec<f64> {
    predicted(machine, &[], &[], instant)
}

/// Predicts all readings of an instant with each unknown changed by an amount in the unknown's unit.
#[must_use]
pub fn predicted(
    machine: &Machine,
    unknowns: &[Unknown],
    changes: &[f64],
    instant: &Instant,
) -> Vec<f64> {
    let sets = [Arc::clone(&instant.supports)];
    Changed::new(machine, &sets, unknowns, changes).predict(instant, [0.0; 2])
}
