//! Check of the measured load of a support against equilibrium.

use crate::machine::{ForceSource, Machine};
use crate::state::{Reason, Reasons, State};

/// Standard deviations from which a measured load contradicts equilibrium.
const CONTRADICTS_SIGMAS: f64 = 5.0;

/// The reasons for doubt in a row in which the measured load of a support contradicts equilibrium. One that is reported as set
/// while it measures no load may not stand on the ground; one that carries another load than computed leaves the row doubted.
///
/// `residual` is the measured less the computed load by actuated joint (N), and `load_sigma` the standard deviation of the
/// computed one by wheel (N), NaN where it is unknown; `None` where the model computes none.
#[must_use]
pub fn doubts_by_measured_loads(
    machine: &Machine,
    state: &State<f64>,
    residual: impl Fn(usize) -> Option<f64>,
    load_sigma: impl Fn(usize) -> Option<f64>,
) -> Reasons {
    let mut reasons = Reasons::NONE;
    for (index, joint) in machine.contact().actuated_joints.iter().enumerate() {
        let ForceSource::Support {
            wheel: Some(wheel), ..
        } = joint.source
        else {
            continue;
        };
        let (Some(residual), Some(load_sigma)) = (residual(index), load_sigma(wheel)) else {
            continue;
        };
        if residual.abs() <= CONTRADICTS_SIGMAS * joint.force_sigma {
            continue;
        }
        // measured loads contradict the computed ones in this time, and here they are missing
        if state.follows_supports > 0.0 && state.actuator_force[index].is_nan() {
            reasons.add(Reason::Contradiction);
        }
        let friction = joint.friction_share * state.actuator_force[index];
        let of_load = match load_sigma.is_finite() {
            true => load_sigma,
            false => 0.0,
        };
        let sigma = joint.force_sigma.hypot(friction).hypot(of_load);
        if residual.abs() > CONTRADICTS_SIGMAS * sigma {
            let carries = state.actuator_force[index] > CONTRADICTS_SIGMAS * joint.force_sigma;
            reasons.add(match carries {
                true => Reason::Contradiction,
                false => Reason::SupportsUnknown,
            });
        }
    }
    reasons
}
