//! Amounts that the machine file does not state, and the evaluation of rows with them.

use nalgebra::{Vector2, Vector3};
use tipwatch_mechanics::estimation::plausibility::LeanOnTyres;
use tipwatch_mechanics::machine::{LoadOnTool, Machine, Unknown};
use tipwatch_mechanics::{Axis, Parameter, Scope, State, Workspace, Wrench, evaluate};

/// Something that may differ from the machine file or from the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unstated {
    /// A mass on the tool (kg).
    LoadMass,
    /// Position of that mass, in the axes of the body that carries it (m).
    LoadPlace(Axis),
    /// A level force on the tool, outwards across the edge (N).
    OutwardForce,
    /// A parameter of the machine or the constant error of a signal.
    Parameter(Parameter),
    /// The relative change of a link's inertia tensor.
    Inertia(usize),
    /// The part of the way that a joint has gone on since its encoder stopped, up to the onset and from then on.
    Stopped {
        joint: usize,
        since_ns: i64,
        onset_ns: i64,
    },
    /// A signal with the opposite sign; the amount is 1.
    Reversed(Parameter),
}

/// An amount of each.
pub(super) type Amounts = [(Unstated, f64)];

/// A row of the log.
#[derive(Debug, Clone)]
pub(super) struct RowState {
    pub(super) time_ns: i64,
    /// Time since the onset (s).
    pub(super) time_s: f64,
    pub(super) state: State<f64>,
    /// Position of a load on the tool, in the base frame (m).
    pub(super) load_place: Vector3<f64>,
    /// Level unit vector outwards across the edge, in base axes.
    pub(super) outward: Vector3<f64>,
    /// Rotation about the edge since the onset (rad).
    pub(super) rotation_rad: f64,
    /// Lean about x and y since the first row of the lean (rad), as measured.
    pub(super) lean_rad: Vector2<f64>,
}

/// Evaluation of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Computed {
    /// Overturning moment about the edge (N m).
    pub(super) moment_nm: f64,
    /// Lean about x and y (rad); NaN where the tyres' compliance is unknown.
    pub(super) lean_rad: Vector2<f64>,
    /// Force of the ground along its normal (N).
    pub(super) normal_n: f64,
    /// The smallest load of a tyre, as a share of the mean load; NaN as the lean.
    pub(super) least_load: f64,
}

/// The machine, and the edge, load and lean that are evaluated of it.
pub(super) struct Scene<'a> {
    pub(super) machine: &'a Machine,
    pub(super) edge: usize,
    pub(super) load: Option<LoadOnTool>,
    pub(super) lean: Option<LeanOnTyres>,
}

impl Scene<'_> {
    /// Evaluates rows with some amounts.
    pub(super) fn computed(&self, rows: &[RowState], amounts: &Amounts) -> Vec<Computed> {
        let machine = self.machine_with(amounts);
        let mut workspace = Workspace::with_scope(&machine, Scope::LOADS);
        let shares = machine.payloads().len();
        let of = |row: &RowState| {
            let mut state = row.state.clone();
            state.payload_share.resize(shares, 1.0);
            if self.machine.tool().is_none() {
                state.tool_wrench = Wrench::zero();
            }
            for &(unstated, amount) in amounts {
                change(&mut state, row, unstated, amount);
            }
            let outcome = evaluate(&machine, &state, &mut workspace);
            let ground = &outcome.ground_wrench;
            let lean = self.lean.as_ref();
            Computed {
                moment_nm: outcome.itom_full[self.edge],
                normal_n: outcome.normal_force,
                lean_rad: lean.map_or(Vector2::repeat(f64::NAN), |lean| lean.lean(ground)),
                least_load: lean.map_or(f64::NAN, |lean| lean.least_load(ground)),
            }
        };
        rows.iter().map(of).collect()
    }

    fn machine_with(&self, amounts: &Amounts) -> Machine {
        let mut parameters = Vec::new();
        let (mut mass, mut offset, mut is_pulled) = (0.0, Vector3::zeros(), false);
        for &(unstated, amount) in amounts {
            match unstated {
                Unstated::LoadMass => mass += amount,
                Unstated::LoadPlace(axis) => offset[axis as usize] += amount,
                Unstated::OutwardForce => is_pulled = true,
                Unstated::Parameter(parameter) => parameters.push((parameter, amount)),
                Unstated::Inertia(link) => {
                    parameters.extend(Unknown::Inertia(link).changes(self.machine, amount));
                }
                Unstated::Stopped { .. } | Unstated::Reversed(_) => {}
            }
        }
        let mut machine = self.machine.changed(&parameters);
        if let Some(load) = self.load.filter(|_| mass != 0.0) {
            machine = machine.with_load(load.body, load.place + offset, mass);
        }
        match is_pulled {
            true => machine.with_wrench_on_base(),
            false => machine,
        }
    }
}

/// Changes a state by an amount of an unstated quantity.
fn change(state: &mut State<f64>, row: &RowState, unstated: Unstated, amount: f64) {
    match unstated {
        Unstated::Parameter(parameter) => state.change(parameter, amount),
        Unstated::OutwardForce => {
            let force = row.outward * amount;
            state.tool_wrench.force += force;
            state.tool_wrench.moment += row.load_place.cross(&force);
        }
        Unstated::Stopped {
            joint,
            since_ns,
            onset_ns,
        } => {
            let way = (row.time_ns - since_ns) as f64 / (onset_ns - since_ns).max(1) as f64;
            state.joints[joint].position += amount * way.clamp(0.0, 1.0);
        }
        Unstated::Reversed(signal) => reverse(state, signal),
        Unstated::LoadMass | Unstated::LoadPlace(_) | Unstated::Inertia(_) => {}
    }
}

pub(super) fn reverse(state: &mut State<f64>, signal: Parameter) {
    let imu = &mut state.imu;
    match signal {
        Parameter::JointPosition(joint) => {
            let joint = &mut state.joints[joint];
            joint.position = -joint.position;
            joint.rate = -joint.rate;
            joint.acceleration = -joint.acceleration;
        }
        Parameter::SpecificForce(axis) => imu.specific_force[axis as usize] *= -1.0,
        Parameter::AngularVelocity(axis) => {
            imu.angular_velocity[axis as usize] *= -1.0;
            imu.angular_acceleration[axis as usize] *= -1.0;
        }
        _ => {}
    }
}
