//! Static loads: wheel loads at rest on level ground.

use nalgebra::{Isometry3, Vector3};

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::{Machine, Mount, MountSource, Parameter, UncertaintySpec, Unknown};
use crate::state::{Reasons, State, resting_state};

/// Wheel loads of `machine` at rest on level ground with these joint positions (rad or m) in the order of
/// [`Machine::joints`], payloads without a time limit attached.
///
/// Level means that gravity acts along the normal of the contact plane, whatever the tilt of the base frame.
#[must_use]
pub fn static_outcome(machine: &Machine, joint_positions: &[f64]) -> Outcome<f64> {
    at_rest(machine, joint_positions, Scope::LOADS)
        .workspace
        .outcome
}

/// A machine with an error-free IMU at its base frame, and its state at rest in this posture on ground that rises by
/// these angles forward and to the left (rad).
#[must_use]
pub fn resting_on_slope(
    machine: &Machine,
    joint_positions: &[f64],
    slope: [f64; 2],
) -> (Machine, State<f64>) {
    let AtRest {
        machine,
        mut state,
        workspace,
    } = at_rest(machine, joint_positions, Scope::LOADS);
    let normal = workspace.outcome.contact_normal;
    // The contact plane's own axes: forward is what remains of x in it.
    let forward = (Vector3::x() - normal * normal.x).normalize();
    let left = normal.cross(&forward);
    let [rise, lean] = slope.map(f64::tan);
    // Up in a plane that rises by tan of these angles along its axes.
    let up = (normal + forward * rise + left * lean).normalize();
    state.imu.specific_force = up * machine.gravity();
    (machine, state)
}

/// Evaluation of a machine at rest on level ground.
#[derive(Debug)]
pub(crate) struct AtRest {
    /// The machine, with the specific force given at its base frame.
    pub(crate) machine: Machine,
    pub(crate) state: State<f64>,
    pub(crate) workspace: Workspace<f64>,
}

/// Evaluates the machine at rest on level ground.
pub(crate) fn at_rest(machine: &Machine, joint_positions: &[f64], scope: Scope) -> AtRest {
    let resting = machine.with_imu_at_base();
    let mut state = resting_state(&resting, joint_positions);
    let mut workspace = Workspace::with_scope(&resting, scope);
    evaluate_at_rest(&resting, &mut state, &mut workspace);
    AtRest {
        machine: resting,
        state,
        workspace,
    }
}

/// Evaluates a state at rest on level ground, whatever specific force it had before. The tyres give way: level is along the
/// normal of the plane that they leave.
pub(crate) fn evaluate_at_rest<'w>(
    machine: &Machine,
    state: &mut State<f64>,
    workspace: &'w mut Workspace<f64>,
) -> &'w Outcome<f64> {
    state.imu.specific_force = Vector3::z() * machine.gravity();
    let up = evaluate(machine, state, workspace).contact_normal;
    state.imu.specific_force = up * machine.gravity();
    evaluate(machine, state, workspace)
}

/// Joint positions of a row in which the machine can stand: the signals determine them (the estimator may still be
/// warming up), and its linkages close. The closed form is frozen in the first such posture, and control starts
/// from it.
#[must_use]
pub fn standing_posture(
    machine: &Machine,
    state: &State<f64>,
    reasons: Reasons,
) -> Option<Vec<f64>> {
    if !reasons.leave_inputs_known() {
        return None;
    }
    let positions: Vec<f64> = state.joints.iter().map(|joint| joint.position).collect();
    let loads = static_outcome(machine, &positions).load;
    loads
        .iter()
        .all(|load| load.is_finite())
        .then_some(positions)
}

/// A reference load that cannot serve as one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "static load of wheel {wheel} in the reference posture ({posture}): expected a positive load, found {found}; \
     state a posture in which the machine stands on all wheels in limits.reference_posture of the machine file"
)]
pub struct ReferenceLoadError {
    /// Name of the wheel.
    pub wheel: String,
    /// The joint positions, and their source.
    pub posture: String,
    /// The load (N), or why there is none.
    pub found: String,
}

/// Whether an unknown is a parameter of the IMU or of the tool's sensor.
fn is_of_sensors(unknown: Unknown) -> bool {
    matches!(
        unknown,
        Unknown::Parameter(
            Parameter::ImuPosition(_)
                | Parameter::ImuRotation(_)
                | Parameter::SpecificForce(_)
                | Parameter::AngularVelocity(_)
                | Parameter::ToolForce(_)
                | Parameter::ToolMoment(_)
        )
    )
}

impl Machine {
    /// Computes the reference loads: those at rest on level ground in the machine's reference posture, payloads
    /// without a time limit attached. Optimal loads stated in the machine file are kept.
    ///
    /// # Errors
    /// A wheel carries no load in this posture, or it cannot be computed.
    pub fn set_reference_loads(&mut self) -> Result<(), ReferenceLoadError> {
        let loads = static_outcome(self, &self.reference.posture.positions).load;
        for (wheel, &load) in self.wheels.iter().zip(&loads) {
            // NaN is not positive either
            if !(load > 0.0) {
                return Err(ReferenceLoadError {
                    wheel: wheel.name.clone(),
                    posture: self.reference_posture_text(),
                    found: match load.is_nan() {
                        true => "none, because a linkage cannot close".into(),
                        false => format!("{load:.0} N"),
                    },
                });
            }
        }
        for (optimal, &load) in self.reference.optimal_load.iter_mut().zip(&loads) {
            let stated = self.limits.optimal_load.is_some() && optimal.is_finite();
            *optimal = if stated { *optimal } else { load };
        }
        self.reference.static_load = loads;
        Ok(())
    }

    /// The positions of the joints other than wheels, and the source of the reference posture.
    fn reference_posture_text(&self) -> String {
        let posture = &self.reference.posture;
        let joints = self.joints.iter().zip(&posture.positions);
        let stated = joints.filter(|(joint, _)| joint.spins_wheel.is_none());
        let positions: Vec<String> = stated
            .map(|(joint, position)| format!("{} = {position:.4}", joint.name))
            .collect();
        format!("{}: {}", posture.source(), positions.join(", "))
    }

    /// Returns the machine with an error-free inertial measurement unit at the base frame: the specific force of a machine at
    /// rest on level ground is given.
    #[must_use]
    pub fn with_imu_at_base(&self) -> Self {
        let uncertainty = UncertaintySpec {
            imu_position: 0.0,
            imu_rotation: 0.0,
            accelerometer_bias: 0.0,
            gyro_bias: 0.0,
            tool_force: 0.0,
            tool_moment: 0.0,
            ..self.uncertainty
        };
        let measured = self.measured_at_base();
        Self {
            uncertainty,
            identified: (self.identified.as_ref()).map(|known| known.without(is_of_sensors)),
            ..measured
        }
    }

    /// Returns the machine with a sensor at the base frame that has the errors of its own sensor: for states whose motion was
    /// moved to the base and whose signals were corrected.
    #[must_use]
    pub fn measured_at_base(&self) -> Self {
        let imu = Mount {
            body: 0,
            body_from_mount: Isometry3::identity(),
            source: MountSource::Base,
        };
        Self {
            imu,
            corrections: None,
            ..self.clone()
        }
    }
}
