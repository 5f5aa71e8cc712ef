//! The signals of a state, in the order of the derivatives.

use crate::estimation::quasi_static::{MotionRange, Span};
use crate::machine::Machine;
use crate::state::State;

/// Value and range of every signal, in the order of the derivatives.
pub(super) fn signals<'a>(
    machine: &'a Machine,
    state: &'a State<f64>,
    range: &'a MotionRange,
) -> impl Iterator<Item = (f64, Span)> + 'a {
    let joints = state
        .joints
        .iter()
        .zip(&range.joints)
        .flat_map(|(joint, range)| {
            [joint.position, joint.rate, joint.acceleration]
                .into_iter()
                .zip(*range)
        });
    let imu = &state.imu;
    let vectors = [
        (imu.specific_force, range.specific_force),
        (imu.angular_velocity, range.angular_velocity),
        (imu.angular_acceleration, range.angular_acceleration),
    ];
    let imu =
        (vectors.into_iter()).flat_map(|(value, range)| value.data.0[0].into_iter().zip(range));
    let wrench = &state.tool_wrench;
    let tool = [wrench.force.data.0[0], wrench.moment.data.0[0]];
    let tool = tool.into_iter().flatten().zip(range.tool);
    joints
        .chain(imu)
        .chain(tool.filter(|_| machine.tool().is_some()))
}
