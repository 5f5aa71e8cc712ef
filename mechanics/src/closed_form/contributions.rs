//! Contributions to the demand on the normal loads: the parts of (56)-(58).

use nalgebra::Vector3;

use super::{Demand, PlanarMotion, Platform};
use crate::geometry::spatial::Wrench;
use crate::number::Real;

/// The platform's motion as measured by an inertial measurement unit, in platform axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredMotion<T> {
    /// Acceleration minus gravity at C (m/s^2); z is not used, because the platform stays on its plane.
    pub specific_force: Vector3<T>,
    /// Psidot, about z (rad/s).
    pub yaw_rate: T,
    /// Psiddot, about z (rad/s^2).
    pub yaw_acceleration: T,
}

/// The right side of (55), by contribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DemandContributions<T> {
    /// Weight of the platform without wheels.
    pub chassis_weight: Demand<T>,
    /// Weight of the wheels.
    pub wheel_weights: Demand<T>,
    /// The arm's f_x, f_y, f_z, m_x, m_y.
    pub arm: [Demand<T>; 5],
    /// Acceleration of C: the derivatives of v_x and v_y, and the term due to turning. For a measured motion
    /// the first two hold the whole acceleration.
    pub acceleration: [Demand<T>; 3],
    /// Yaw rate and yaw acceleration, through I_xz and I_yz.
    pub yaw: [Demand<T>; 2],
}

impl<T: Real> DemandContributions<T> {
    /// Demand of a motion given by velocities, as in the paper.
    ///
    /// `up` is (r31, r32, r33) of (8), the unit vector pointing up in platform axes; `arm` is the wrench of the
    /// arm on the platform at the arm's root, platform axes (N, N m): f_z < 0 at rest.
    ///
    /// ```text
    ///     7: b2 = m z_C vdot_x    8: b1 = -m z_C vdot_y
    ///     9: b1 = -m z_C v_x Psidot,  b2 = -m z_C v_y Psidot
    /// ```
    #[must_use]
    pub fn of_motion(
        platform: &Platform<T>,
        up: &Vector3<T>,
        motion: &PlanarMotion<T>,
        arm: &Wrench<T>,
    ) -> Self {
        let zero = T::zero();
        let lever = platform.mass * platform.com_height;
        let turning = lever * motion.yaw_rate;
        let acceleration = [
            Demand::moments(zero, lever * motion.vdot_x),
            Demand::moments(-(lever * motion.vdot_y), zero),
            Demand::moments(-(turning * motion.v_x), -(turning * motion.v_y)),
        ];
        let yaw = yaw_demands(platform, motion.yaw_rate, motion.yaw_acceleration);
        Self::with(platform, up, acceleration, yaw, arm)
    }

    /// Demand of a motion given by the specific force of an accelerometer at C: no velocity needs to be known or
    /// differentiated. Arguments as in [`DemandContributions::of_motion`].
    ///
    /// ```text
    ///     s = (vdot_x - v_y Psidot + g r31, vdot_y + v_x Psidot + g r32, .)
    ///     b1 = -m z_C (s_y - g r32)    b2 = m z_C (s_x - g r31)
    /// ```
    #[must_use]
    pub fn of_measured(
        platform: &Platform<T>,
        up: &Vector3<T>,
        motion: &MeasuredMotion<T>,
        arm: &Wrench<T>,
    ) -> Self {
        let (zero, g) = (T::zero(), platform.gravity);
        let lever = platform.mass * platform.com_height;
        let measured = &motion.specific_force;
        let acceleration = [
            Demand::moments(zero, lever * (measured.x - g * up.x)),
            Demand::moments(-(lever * (measured.y - g * up.y)), zero),
            Demand::zero(),
        ];
        let yaw = yaw_demands(platform, motion.yaw_rate, motion.yaw_acceleration);
        Self::with(platform, up, acceleration, yaw, arm)
    }

    fn with(
        platform: &Platform<T>,
        up: &Vector3<T>,
        acceleration: [Demand<T>; 3],
        yaw: [Demand<T>; 2],
        arm: &Wrench<T>,
    ) -> Self {
        let g = platform.gravity;
        let height = platform.mass * platform.com_height;
        let chassis = Vector3::new(T::zero(), T::zero(), height);
        Self {
            chassis_weight: weight_demand(g, platform.mass, &chassis, up),
            wheel_weights: weight_demand(g, platform.wheel_mass, &platform.wheel_moment, up),
            arm: arm_demands(platform, arm),
            acceleration,
            yaw,
        }
    }

    /// b1, b2, b3 of (56)-(58).
    #[must_use]
    pub fn sum(&self) -> Demand<T> {
        Demand::sum(&[
            self.chassis_weight,
            self.wheel_weights,
            Demand::sum(&self.arm),
            Demand::sum(&self.acceleration),
            Demand::sum(&self.yaw),
        ])
    }
}

/// Demand of the weight of a mass with the first moment `moment` about the point below C.
///
/// b1 = g (m y r33 - m z r32)    b2 = g (m z r31 - m x r33)    b3 = g m r33
fn weight_demand<T: Real>(gravity: T, mass: T, moment: &Vector3<T>, up: &Vector3<T>) -> Demand<T> {
    Demand {
        b1: gravity * (moment.y * up.z - moment.z * up.y),
        b2: gravity * (moment.z * up.x - moment.x * up.z),
        b3: gravity * mass * up.z,
    }
}

/// ```text
///     2: b2 = -(z_CA + z_C) f_x    3: b1 = (z_CA + z_C) f_y
///     4: b1 = -y_CA f_z,  b2 = x_CA f_z,  b3 = -f_z
///     5: b1 = -m_x    6: b2 = -m_y
/// ```
/// m_z does not affect the normal loads.
fn arm_demands<T: Real>(platform: &Platform<T>, arm: &Wrench<T>) -> [Demand<T>; 5] {
    let (zero, base, force) = (T::zero(), &platform.arm_base, &arm.force);
    let height = base.z + platform.com_height;
    let pressed = Demand {
        b1: -(base.y * force.z),
        b2: base.x * force.z,
        b3: -force.z,
    };
    [
        Demand::moments(zero, -(height * force.x)),
        Demand::moments(height * force.y, zero),
        pressed,
        Demand::moments(-arm.moment.x, zero),
        Demand::moments(zero, -arm.moment.y),
    ]
}

/// ```text
///     10: b1 = -I_yz Psidot^2,  b2 = I_xz Psidot^2
///     11: b1 = I_xz Psiddot,    b2 = I_yz Psiddot
/// ```
fn yaw_demands<T: Real>(platform: &Platform<T>, rate: T, acceleration: T) -> [Demand<T>; 2] {
    let (xz, yz) = (platform.inertia_xz, platform.inertia_yz);
    let squared = rate * rate;
    [
        Demand::moments(-(yz * squared), xz * squared),
        Demand::moments(xz * acceleration, yz * acceleration),
    ]
}
