//! Derivatives of sigma with respect to the motion of the base: the avoidance gradient (111) of the first
//! paper, with the dynamics of the whole machine, the arm moving with the base.
//!
//! With f = vdot + w x v + g up the specific force at the base origin, v and vdot as components in base axes:
//! ```text
//!     dN/dv_x = dN/df . (w x e_x)       dN/dw_z = dN/df . (e_z x v) + dN/dw_z|f       dN/dvdot_x = dN/df . e_x
//! ```
//! The first three are at constant accelerations; braking appears in the last three.

use super::balance::Balance;
use crate::dynamics::newton_euler_derivatives::by_base_motion;
use crate::explain::sensitivity::Sensitivity;
use crate::machine::BaseMotion;
use crate::number::{Real, Wheels};

/// Derivatives of sigma with respect to the motion of the base.
#[derive(Debug, Clone, Copy)]
pub struct VelocityGradient<T> {
    /// Derivative with respect to the forward velocity v_x, at constant accelerations (N^2 s/m).
    pub forward_velocity: T,
    /// Derivative with respect to the velocity to the left v_y (N^2 s/m).
    pub left_velocity: T,
    /// Derivative with respect to the yaw rate (N^2 s/rad); NaN where the velocity is unknown.
    pub yaw_rate: T,
    /// Derivative with respect to the derivative of v_x (N^2 s^2/m).
    pub forward_acceleration: T,
    /// Derivative with respect to the derivative of v_y (N^2 s^2/m).
    pub left_acceleration: T,
    /// Derivative with respect to the yaw acceleration (N^2 s^2/rad).
    pub yaw_acceleration: T,
}

impl<T: Real> VelocityGradient<T> {
    pub(crate) fn unknown() -> Self {
        let unknown = T::constant(f64::NAN);
        Self {
            forward_velocity: unknown,
            left_velocity: unknown,
            yaw_rate: unknown,
            forward_acceleration: unknown,
            left_acceleration: unknown,
            yaw_acceleration: unknown,
        }
    }
}

pub(super) fn of<T: Real>(
    balance: &Balance<'_, T>,
    sensitivity: &Sensitivity<T>,
    otf: &[T],
) -> VelocityGradient<T> {
    let (w, velocity) = (
        &balance.motions[0].angular_velocity,
        &balance.state.base.velocity,
    );
    let mut sums = [T::zero(); BaseMotion::ALL.len()];
    let optimal = &balance.machine.reference.optimal_load;
    let groups = otf
        .chunks(T::Wheels::COUNT)
        .zip(optimal.chunks(T::Wheels::COUNT));
    for (group, (otf, optimal)) in groups.enumerate() {
        let by = by_base_motion(sensitivity.by_base(group), w, velocity);
        for (place, (&otf, &optimal)) in otf.iter().zip(optimal).enumerate() {
            let off = otf - T::constant(optimal);
            for (sum, by) in sums.iter_mut().zip(by) {
                *sum += by.wheel(place) * off;
            }
        }
    }
    VelocityGradient {
        forward_velocity: sums[0],
        left_velocity: sums[1],
        yaw_rate: sums[2],
        forward_acceleration: sums[3],
        left_acceleration: sums[4],
        yaw_acceleration: sums[5],
    }
}
