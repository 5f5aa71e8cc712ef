//! Derivatives of sigma with respect to the motion of the base: the avoidance gradient (111) of the first
//! paper, with the dynamics of the whole machine, the arm moving with the base.
//!
//! With f = vdot + w x v + g up the specific force at the base origin, v and vdot as components in base axes:
//! ```text
//!     dN/dv_x = dN/df . (w x e_x)       dN/dw_z = dN/df . (e_z x v) + dN/dw_z|f       dN/dvdot_x = dN/df . e_x
//! ```
//! The first three are at constant accelerations; braking appears in the last three.

use nalgebra::Vector3;

use super::Balance;
use crate::newton_euler_derivatives::BaseGradient;
use crate::number::Real;
use crate::sensitivity::Sensitivity;
use crate::spatial::cross;

/// Derivatives of sigma with respect to the motion of the base.
#[derive(Debug, Clone, Copy)]
pub struct VelocityGradient<T> {
    /// With respect to the forward velocity v_x, at constant accelerations (N^2 s/m).
    pub forward_velocity: T,
    /// With respect to the velocity to the left v_y (N^2 s/m).
    pub left_velocity: T,
    /// With respect to the yaw rate (N^2 s/rad); NaN where the velocity is unknown.
    pub yaw_rate: T,
    /// With respect to the derivative of v_x (N^2 s^2/m).
    pub forward_acceleration: T,
    /// With respect to the derivative of v_y (N^2 s^2/m).
    pub left_acceleration: T,
    /// With respect to the yaw acceleration (N^2 s^2/rad).
    pub yaw_acceleration: T,
}

/// Components of the base's motion that [`VelocityGradient`] differentiates by.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    strum::EnumCount,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(serialize_all = "snake_case")]
pub enum Travel {
    /// v_x
    #[strum(serialize = "v_x")]
    ForwardVelocity,
    /// v_y
    #[strum(serialize = "v_y")]
    LeftVelocity,
    /// Yaw rate.
    YawRate,
    /// Time derivative of v_x.
    #[strum(serialize = "v_x_dot")]
    ForwardAcceleration,
    /// Time derivative of v_y.
    #[strum(serialize = "v_y_dot")]
    LeftAcceleration,
    /// Yaw acceleration.
    #[strum(serialize = "yaw_rate_dot")]
    YawAcceleration,
}

impl Travel {
    /// All components, in column order.
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .expect("all variants");

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForwardVelocity | Self::LeftVelocity => "m/s",
            Self::YawRate => "rad/s",
            Self::ForwardAcceleration | Self::LeftAcceleration => "m/s^2",
            Self::YawAcceleration => "rad/s^2",
        }
    }
}

impl<T: Real> VelocityGradient<T> {
    pub(crate) fn get(&self, travel: Travel) -> T {
        match travel {
            Travel::ForwardVelocity => self.forward_velocity,
            Travel::LeftVelocity => self.left_velocity,
            Travel::YawRate => self.yaw_rate,
            Travel::ForwardAcceleration => self.forward_acceleration,
            Travel::LeftAcceleration => self.left_acceleration,
            Travel::YawAcceleration => self.yaw_acceleration,
        }
    }

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

/// Converts derivatives of a load with respect to the base's motion into those of [`VelocityGradient`].
pub(crate) fn by_travel<T: Real>(
    by: &BaseGradient<T>,
    w: &Vector3<T>,
    velocity: &Vector3<T>,
) -> [T; Travel::ALL.len()] {
    let force = &by.specific_force;
    [
        force.dot(&cross(w, &Vector3::x())),
        force.dot(&cross(w, &Vector3::y())),
        force.dot(&cross(&Vector3::z(), velocity)) + by.angular_velocity.z,
        force.x,
        force.y,
        by.angular_acceleration.z,
    ]
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
    let mut sums = [T::zero(); Travel::ALL.len()];
    let optimal = &balance.machine.reference.optimal_load;
    for (wheel, (&otf, optimal)) in otf.iter().zip(optimal).enumerate() {
        let off = otf - T::constant(*optimal);
        let by = by_travel(sensitivity.by_base(wheel), w, velocity);
        for (sum, by) in sums.iter_mut().zip(by) {
            *sum += by * off;
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
